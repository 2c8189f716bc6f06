//! Draws a density's picture between the axes in the world.

use busbar_gpu::{
    BindGroup, BindGroupLayout, Buffer, BufferUsage, DrawCount, Format, GpuError,
    MAX_FRAMES_IN_FLIGHT, Pass, Pipeline, Recorder,
};
use busbar_shaders::{DENSITY_PLANE, PlaneInstance};
use glam::Vec3;

use super::Density;
use crate::RenderError;
use crate::polylines::{Kind, Quads, quad_pipeline, shown};

/// Planes that a picture may have: one for each axis but one.
const MAX_PLANES: usize = super::MAX_DENSITY_AXES;
const PLANE: Kind = Kind {
    name: "density plane",
    words: DENSITY_PLANE,
    vertex: c"plane_vertex",
    fragment: c"plane_fragment",
    bytes: size_of::<PlaneInstance>(),
};

/// Where the picture of a pair of axes stands: upright between their feet.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlaneInWorld {
    /// Foot of the first axis, metres.
    pub from: Vec3,
    /// Foot of the second.
    pub to: Vec3,
    /// Height of axes, metres.
    pub height: f32,
    /// Of lines, sRGB.
    pub color: [u8; 3],
    /// Of those that are meant; `None` where that is not known, or nothing is.
    pub meant: Option<[u8; 3]>,
}

/// What draws them.
pub(crate) struct PlaneKit {
    pipeline: Pipeline,
    undecoded: bool,
    /// The instances of each frame in flight.
    slots: Vec<Buffer>,
}

impl PlaneKit {
    /// As [`PolylineKit::new`](crate::polylines::PolylineKit::new).
    pub(crate) fn new(
        recorder: &Recorder<'_>,
        (frame, density): (&BindGroupLayout, &Density),
        (color, undecoded): (Format, bool),
        samples: u32,
    ) -> Result<Self, RenderError> {
        let gpu = recorder.gpu();
        let groups = [frame, &density.kit.of_picture];
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
        density: &Density,
        planes: &[PlaneInWorld],
    ) -> Result<(), RenderError> {
        let Some(woven) = &density.shown else { return Ok(()) };
        let summary = woven.summary;
        let count = planes.len().min(MAX_PLANES);
        let instance = |(pair, plane): (usize, &PlaneInWorld)| {
            let [[r, g, b], [meant_r, meant_g, meant_b]] =
                [plane.color, plane.meant.unwrap_or_default()]
                    .map(|color| shown(color, self.undecoded));
            let has_meant = if plane.meant.is_some() { 1.0 } else { 0.0 };
            PlaneInstance {
                from_height: plane.from.extend(plane.height).to_array(),
                to_pair: plane.to.extend(pair as f32).to_array(),
                color_most: [r, g, b, summary.most as f32],
                meant_most: [meant_r, meant_g, meant_b, summary.meant_most as f32],
                pairs: [summary.pairs as f32, has_meant, 0.0, 0.0],
            }
        };
        let instances: Vec<_> = planes[..count].iter().enumerate().map(instance).collect();
        Ok(self.slots[slot].write(bytemuck::cast_slice(&instances))?)
    }

    /// Draws them over what is farther. There are none unless what was counted has as many pairs.
    pub(crate) fn draw(
        &self,
        pass: &mut Pass<'_>,
        frame_group: &BindGroup,
        (slot, quads): (usize, &Quads),
        (density, planes): (&Density, &[PlaneInWorld]),
    ) -> Result<DrawCount, GpuError> {
        let fits = |pairs: u32| pairs as usize == planes.len() && planes.len() <= MAX_PLANES;
        let Some(woven) = density.shown.as_ref().filter(|woven| fits(woven.summary.pairs)) else {
            return Ok(DrawCount::default());
        };
        let groups = [frame_group, &woven.group];
        let instances = (&self.slots[slot], planes.len() as u32);
        pass.draw(&quads.draw(&self.pipeline, &groups, instances))?;
        Ok(DrawCount::ONE)
    }
}
