//! Polylines: anti-aliased lines of a width in points, and flat faces, in the world.
//!
//! Each line is a quad that the vertex shader lays along it on the screen; its coverage
//! fades over a pixel, so that it is smooth with one sample too. They are hidden by what
//! lies before them and hide nothing themselves: what comes first lies behind.

use busbar_gpu::{
    BindGroup, BindGroupLayout, Buffer, BufferUsage, DrawCount, Format, Gpu, GpuError,
    MAX_FRAMES_IN_FLIGHT, Pipeline, Recorder, RenderPass,
};
use busbar_shaders::{FaceInstance, POLYLINES, StrokeInstance};
use glam::Vec3;

use crate::RenderError;
use crate::density_planes::DensityPlane;
use crate::quads::{QuadMesh, QuadShader, quad_pipeline, target_color};

/// Lines, and as many faces, in one frame: 24 and 32 MB.
pub const MAX_POLYLINE_PARTS: usize = 500_000;

/// Parts that the first buffers hold.
const FIRST_CAPACITY: usize = 256;

/// Lines and faces of a frame.
#[derive(Clone, Copy, Debug)]
pub struct Polylines<'a> {
    /// Revision of lines and faces: unchanged ones are not written again.
    pub revision: u64,
    /// Faces, drawn before all lines, the farthest first.
    pub faces: &'a [WorldFace],
    /// Density planes, drawn between faces and lines, one for each pair of axes; may be empty.
    pub planes: &'a [DensityPlane],
    /// Lines, the farthest first.
    pub strokes: &'a [WorldStroke],
}

/// Line segment in the world.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WorldStroke {
    /// Start of the line, metres.
    pub from: Vec3,
    /// End of the line, metres.
    pub to: Vec3,
    /// Width of the line, points.
    pub width: f32,
    /// Colour of the line, sRGB.
    pub color: [u8; 3],
    /// Coverage of the line, 0 to 1.
    pub cover: f32,
    /// 0 unbroken, 1 dashes, 2 dashes and dots, 3 dots.
    pub pattern: u32,
}

/// A surface with four corners, one after the other around it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WorldFace {
    /// Corners of the face, metres.
    pub corners: [Vec3; 4],
    /// Colour of the face, sRGB.
    pub color: [u8; 3],
    /// Coverage of the face, 0 to 1.
    pub cover: f32,
}

/// GPU resources of lines and faces, made on first use.
pub(crate) struct PolylineResources {
    strokes: Pipeline,
    faces: Pipeline,
    /// Encoding: whether the target takes sRGB-encoded colours.
    undecoded: bool,
    pub(crate) quads: QuadMesh,
    slots: Vec<PolylineBuffers>,
}

/// The buffers of one frame in flight.
struct PolylineBuffers {
    strokes: Buffer,
    faces: Buffer,
    written: Option<u64>,
}

impl PolylineResources {
    /// Makes pipelines and buffers; `color` is the scene's colour format.
    pub(crate) fn new(
        recorder: &mut Recorder<'_>,
        frame: &BindGroupLayout,
        (color, undecoded): (Format, bool),
        samples: u32,
    ) -> Result<Self, RenderError> {
        let quads = QuadMesh::new(recorder)?;
        let gpu = recorder.gpu();
        let slots = (0..MAX_FRAMES_IN_FLIGHT)
            .map(|_| PolylineBuffers::new(gpu))
            .collect::<Result<_, _>>()?;
        let target = (color, samples);
        let strokes = quad_pipeline(gpu, &[frame], target, &STROKES)?;
        let faces = quad_pipeline(gpu, &[frame], target, &FACES)?;
        Ok(Self { strokes, faces, undecoded, quads, slots })
    }

    /// Writes changed lines and faces; the last frame in this slot must be finished.
    pub(crate) fn write(
        &mut self,
        gpu: &Gpu,
        slot: usize,
        lines: &Polylines<'_>,
    ) -> Result<(), RenderError> {
        for count in [lines.strokes.len(), lines.faces.len()] {
            if count > MAX_POLYLINE_PARTS {
                let (asked, limit) = (count as u64, MAX_POLYLINE_PARTS as u64);
                return Err(RenderError::TooMany { what: "lines in one frame", asked, limit });
            }
        }
        let undecoded = self.undecoded;
        let slot = &mut self.slots[slot];
        if slot.written == Some(lines.revision) {
            return Ok(());
        }
        slot.written = None;
        let strokes: Vec<_> = lines.strokes.iter().map(|s| stroke_instance(s, undecoded)).collect();
        let faces: Vec<_> = lines.faces.iter().map(|f| face_instance(f, undecoded)).collect();
        fill(gpu, "strokes", &mut slot.strokes, bytemuck::cast_slice(&strokes))?;
        fill(gpu, "faces", &mut slot.faces, bytemuck::cast_slice(&faces))?;
        slot.written = Some(lines.revision);
        Ok(())
    }

    /// Draws faces over farther surfaces.
    pub(crate) fn draw_faces(
        &self,
        pass: &mut RenderPass<'_>,
        frame_group: &BindGroup,
        slot: usize,
        lines: &Polylines<'_>,
    ) -> Result<DrawCount, GpuError> {
        let instances = (&self.slots[slot].faces, lines.faces.len() as u32);
        self.draw(pass, frame_group, &self.faces, instances)
    }

    /// Draws strokes over farther surfaces.
    pub(crate) fn draw_strokes(
        &self,
        pass: &mut RenderPass<'_>,
        frame_group: &BindGroup,
        slot: usize,
        lines: &Polylines<'_>,
    ) -> Result<DrawCount, GpuError> {
        let instances = (&self.slots[slot].strokes, lines.strokes.len() as u32);
        self.draw(pass, frame_group, &self.strokes, instances)
    }

    fn draw(
        &self,
        pass: &mut RenderPass<'_>,
        frame_group: &BindGroup,
        pipeline: &Pipeline,
        instances: (&Buffer, u32),
    ) -> Result<DrawCount, GpuError> {
        if instances.1 == 0 {
            return Ok(DrawCount::default());
        }
        pass.draw(&self.quads.draw(pipeline, &[frame_group], instances))?;
        Ok(DrawCount::ONE)
    }
}

impl PolylineBuffers {
    fn new(gpu: &Gpu) -> Result<Self, GpuError> {
        let bytes = |part: usize| (FIRST_CAPACITY * part) as u64;
        let buffer = |name, bytes| Buffer::new(gpu, name, BufferUsage::HostVertex, bytes);
        Ok(Self {
            strokes: buffer("strokes", bytes(size_of::<StrokeInstance>()))?,
            faces: buffer("faces", bytes(size_of::<FaceInstance>()))?,
            written: None,
        })
    }
}

fn fill(
    gpu: &Gpu,
    name: &'static str,
    buffer: &mut Buffer,
    bytes: &[u8],
) -> Result<(), RenderError> {
    if bytes.len() as u64 > buffer.size() {
        let size = bytes.len().next_power_of_two() as u64;
        *buffer = Buffer::new(gpu, name, BufferUsage::HostVertex, size)?;
    }
    Ok(buffer.write(bytes)?)
}

fn stroke_instance(stroke: &WorldStroke, undecoded: bool) -> StrokeInstance {
    let [red, green, blue] = target_color(stroke.color, undecoded);
    StrokeInstance {
        from_width: stroke.from.extend(stroke.width).to_array(),
        to_pattern: stroke.to.extend(stroke.pattern as f32).to_array(),
        color: [red, green, blue, stroke.cover],
    }
}

fn face_instance(face: &WorldFace, undecoded: bool) -> FaceInstance {
    let [red, green, blue] = target_color(face.color, undecoded);
    let [a, b, c, d] = face.corners;
    FaceInstance {
        a_red: a.extend(red).to_array(),
        b_green: b.extend(green).to_array(),
        c_blue: c.extend(blue).to_array(),
        d_cover: d.extend(face.cover).to_array(),
    }
}

const STROKES: QuadShader = QuadShader {
    name: "strokes",
    words: POLYLINES,
    vertex: c"stroke_vertex",
    fragment: c"stroke_fragment",
    bytes: size_of::<StrokeInstance>(),
};
const FACES: QuadShader = QuadShader {
    name: "faces",
    words: POLYLINES,
    vertex: c"face_vertex",
    fragment: c"face_fragment",
    bytes: size_of::<FaceInstance>(),
};
