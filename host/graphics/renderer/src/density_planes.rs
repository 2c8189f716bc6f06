//! Density planes: density pictures drawn between the axes in the world.

use busbar_density::{DensityResources, MAX_DENSITY_AXES};
use busbar_gpu::{
    BindGroup, BindGroupLayout, Buffer, BufferUsage, DrawCount, Format, GpuError,
    MAX_FRAMES_IN_FLIGHT, Pipeline, Recorder, RenderPass,
};
use busbar_shaders::{DENSITY_PLANE, PlaneInstance};
use glam::Vec3;

use crate::RenderError;
use crate::quads::{QuadMesh, QuadShader, quad_pipeline, target_color};

/// Planes that a picture may have: one for each axis but one.
const MAX_PLANES: usize = MAX_DENSITY_AXES;
const PLANE: QuadShader = QuadShader {
    name: "density plane",
    words: DENSITY_PLANE,
    vertex: c"plane_vertex",
    fragment: c"plane_fragment",
    bytes: size_of::<PlaneInstance>(),
};

/// Upright plane between the feet of two axes that shows their density picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DensityPlane {
    /// Foot of the first axis, metres.
    pub from: Vec3,
    /// Foot of the second.
    pub to: Vec3,
    /// Height of axes, metres.
    pub height: f32,
    /// Colour of lines, sRGB.
    pub color: [u8; 3],
    /// Colour of brushed lines, sRGB; `None` where that is not known, or no brush is set.
    pub brushed: Option<[u8; 3]>,
}

/// GPU resources of density planes.
pub(crate) struct DensityPlaneResources {
    pipeline: Pipeline,
    undecoded: bool,
    /// The instances of each frame in flight.
    slots: Vec<Buffer>,
}

impl DensityPlaneResources {
    /// Makes the pipeline and buffers, like
    /// [`PolylineResources::new`](crate::polylines::PolylineResources::new).
    pub(crate) fn new(
        recorder: &Recorder<'_>,
        (frame, density): (&BindGroupLayout, &DensityResources),
        (color, undecoded): (Format, bool),
        samples: u32,
    ) -> Result<Self, RenderError> {
        let gpu = recorder.gpu();
        let groups = [frame, density.picture_layout()];
        let pipeline = quad_pipeline(gpu, &groups, (color, samples), &PLANE)?;
        let bytes = (MAX_PLANES * size_of::<PlaneInstance>()) as u64;
        let slot = |_| Buffer::new(gpu, "planes", BufferUsage::HostVertex, bytes);
        let slots = (0..MAX_FRAMES_IN_FLIGHT).map(slot).collect::<Result<_, _>>()?;
        Ok(Self { pipeline, undecoded, slots })
    }

    /// Writes them; the last frame in this slot must be finished.
    pub(crate) fn write(
        &self,
        slot: usize,
        density: &DensityResources,
        planes: &[DensityPlane],
    ) -> Result<(), RenderError> {
        let Some((_, summary)) = density.picture() else { return Ok(()) };
        let count = planes.len().min(MAX_PLANES);
        let instance = |(pair, plane): (usize, &DensityPlane)| {
            let [[r, g, b], [meant_r, meant_g, meant_b]] =
                [plane.color, plane.brushed.unwrap_or_default()]
                    .map(|color| target_color(color, self.undecoded));
            let has_brushed = if plane.brushed.is_some() { 1.0 } else { 0.0 };
            PlaneInstance {
                from_height: plane.from.extend(plane.height).to_array(),
                to_pair: plane.to.extend(pair as f32).to_array(),
                color_peak: [r, g, b, summary.peak as f32],
                brushed_peak: [meant_r, meant_g, meant_b, summary.brushed_peak as f32],
                pairs: [summary.pairs as f32, has_brushed, 0.0, 0.0],
            }
        };
        let instances: Vec<_> = planes[..count].iter().enumerate().map(instance).collect();
        Ok(self.slots[slot].write(bytemuck::cast_slice(&instances))?)
    }

    /// Draws the planes over farther surfaces. Nothing is drawn unless the count has as many pairs.
    pub(crate) fn draw(
        &self,
        pass: &mut RenderPass<'_>,
        frame_group: &BindGroup,
        (slot, quads): (usize, &QuadMesh),
        (density, planes): (&DensityResources, &[DensityPlane]),
    ) -> Result<DrawCount, GpuError> {
        let fits = |pairs: u32| pairs as usize == planes.len() && planes.len() <= MAX_PLANES;
        let Some((picture, _)) = density.picture().filter(|(_, summary)| fits(summary.pairs))
        else {
            return Ok(DrawCount::default());
        };
        let groups = [frame_group, picture];
        let instances = (&self.slots[slot], planes.len() as u32);
        pass.draw(&quads.draw(&self.pipeline, &groups, instances))?;
        Ok(DrawCount::ONE)
    }
}
