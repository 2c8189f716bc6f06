//! Panel painter: egui's user interface drawn over the picture.
//!
//! egui tells of a change of its textures once, so the pixels are kept here: a
//! frame that fails, or a device that is lost, loses none of them.

use std::collections::BTreeMap;
use std::mem::offset_of;
use std::sync::Arc;

use busbar_gpu::{
    AddressMode, AttributeKind, BindGroup, BindGroupLayout, Binding, BindingKind, Blend, Buffer,
    BufferUsage, Format, Gpu, GpuError, Image, ImageArea, MAX_FRAMES_IN_FLIGHT, OverlayDraw,
    Pipeline, PipelineDescription, Recorder, Sampler, ShaderStage, VertexAttribute, VertexBuffer,
};
use busbar_shaders::PANELS;
use egui::epaint::{ImageData, ImageDelta, Primitive, Vertex};
use egui::{ClippedPrimitive, ColorImage, Rect, TextureId, TexturesDelta};

mod damage;
mod error;

use damage::PaintedPanels;
pub use error::PanelError;

/// Vertices and indices of the panels in one frame, each.
pub const MAX_PANEL_VERTICES: usize = 1 << 22;

/// Output of egui for one frame. Every textures delta must reach the painter once, in order. Clear
/// it after the frame was drawn: egui panics when an uncleared delta is dropped.
#[derive(Clone, Copy)]
pub struct EguiFrame<'a> {
    /// Textures that egui changed.
    pub textures_delta: &'a TexturesDelta,
    /// Tessellated shapes of the panels.
    pub primitives: &'a [ClippedPrimitive],
    /// Physical pixels a point.
    pub pixels_per_point: f32,
}

/// Vertices and indices that the first buffers hold.
const FIRST_CAPACITY: usize = 1 << 12;

/// Painter of egui's panels: pipeline, buffers and textures.
pub struct PanelPainter {
    pipeline: Pipeline,
    texture_layout: BindGroupLayout,
    sampler: Sampler,
    /// One a frame in flight.
    streams: Vec<PanelBuffers>,
    textures: Textures,
    /// Panels as they were painted last.
    painted: PaintedPanels,
}

/// Textures of egui: their pixels, and their copies on the device.
#[derive(Default)]
struct Textures {
    all: BTreeMap<TextureId, Texture>,
    /// Not needed after the last frame.
    dying: Vec<TextureId>,
    /// True if any changed since panels were painted last.
    have_changed: bool,
}

struct Texture {
    pixels: Arc<ColorImage>,
    /// `None` where the device has none, or an older one.
    group: Option<BindGroup>,
    /// Uploaded by the frame that is being recorded.
    is_new: bool,
}

/// The buffers of one frame in flight.
struct PanelBuffers {
    uniform: Buffer,
    group: BindGroup,
    vertices: Buffer,
    indices: Buffer,
}

impl PanelPainter {
    /// Paints over pictures of this format.
    pub fn new(gpu: &Gpu, format: Format) -> Result<Self, GpuError> {
        let frame_layout = BindGroupLayout::new(gpu, &[BindingKind::Uniform])?;
        let texture_layout =
            BindGroupLayout::new(gpu, &[BindingKind::Texture, BindingKind::Sampler])?;
        let pipeline = pipeline(gpu, format, [&frame_layout, &texture_layout])?;
        let sampler = Sampler::new(gpu, [AddressMode::Clamp; 2])?;
        let streams = (0..MAX_FRAMES_IN_FLIGHT)
            .map(|_| PanelBuffers::new(gpu, &frame_layout))
            .collect::<Result<_, _>>()?;
        let (textures, painted) = (Textures::default(), PaintedPanels::default());
        Ok(Self { pipeline, texture_layout, sampler, streams, textures, painted })
    }

    /// Takes the pixels over from panels whose device was lost.
    pub fn inherit(&mut self, lost: &Self) {
        let kept = |(&id, texture): (&TextureId, &Texture)| {
            let pixels = Arc::clone(&texture.pixels);
            (id, Texture { pixels, group: None, is_new: false })
        };
        self.textures.all = lost.textures.all.iter().map(kept).collect();
        self.textures.dying.clone_from(&lost.textures.dying);
    }

    /// Applies egui's new, changed and freed textures; applying a change twice does no harm.
    pub fn update(&mut self, delta: &TexturesDelta) -> Result<(), PanelError> {
        self.textures.update(delta)
    }

    /// Returns the part of a picture of `size` pixels in which a frame's panels differ from those
    /// painted last; none where they do not differ.
    pub fn difference(&self, overlay: Option<&EguiFrame<'_>>, size: [u32; 2]) -> Option<ImageArea> {
        let is_changed = |overlay: &&EguiFrame<'_>| !overlay.textures_delta.set.is_empty();
        if self.textures.have_changed || overlay.filter(is_changed).is_some() {
            return Some(ImageArea { origin: [0; 2], size });
        }
        match overlay {
            None => self.painted.difference(&[], 1.0, size),
            Some(EguiFrame { primitives, pixels_per_point, .. }) => {
                self.painted.difference(primitives, *pixels_per_point, size)
            }
        }
    }

    /// Notes that a picture without panels was drawn.
    pub fn note_none(&mut self) {
        self.painted.note(&[], 1.0);
    }

    /// Abandons the frame that was being recorded: its uploads never ran.
    pub fn abandon_frame(&mut self) {
        for texture in self.textures.all.values_mut().filter(|texture| texture.is_new) {
            (texture.group, texture.is_new) = (None, false);
        }
    }

    /// Records the painting of one frame within a part of its picture.
    pub fn record(
        &mut self,
        recorder: &mut Recorder<'_>,
        (picture, area): (&Image, ImageArea),
        primitives: &[ClippedPrimitive],
        pixels_per_point: f32,
    ) -> Result<(), PanelError> {
        self.textures.have_changed = false;
        self.painted.note(primitives, pixels_per_point);
        if !(pixels_per_point.is_finite() && pixels_per_point > 0.0) {
            return Err(PanelError::BadPanels(format!("{pixels_per_point} pixels a point")));
        }
        let meshes = || {
            primitives.iter().filter_map(|primitive| match &primitive.primitive {
                Primitive::Mesh(mesh) if !mesh.indices.is_empty() => {
                    Some((primitive.clip_rect, mesh))
                }
                _ => None,
            })
        };
        let vertices: Vec<Vertex> =
            meshes().flat_map(|(_, mesh)| mesh.vertices.iter().copied()).collect();
        let indices: Vec<u32> =
            meshes().flat_map(|(_, mesh)| mesh.indices.iter().copied()).collect();
        if indices.is_empty() {
            return Ok(());
        }
        self.textures.upload(recorder, &self.texture_layout, &self.sampler)?;
        let slot = recorder.slot();
        let stream = self.streams.get_mut(slot).ok_or(GpuError::Misuse("panels outside frames"))?;
        let clip_per_point = picture.size().map(|pixels| 2.0 * pixels_per_point / pixels as f32);
        stream.write(recorder.gpu(), clip_per_point, &vertices, &indices)?;
        let mut pass = recorder.begin_overlay(picture)?;
        let (mut first_vertex, mut first_index) = (0, 0);
        for (clip, mesh) in meshes() {
            let end = first_index + mesh.indices.len() as u32;
            let texture = self.textures.all.get(&mesh.texture_id);
            let texture = texture.and_then(|texture| texture.group.as_ref()).ok_or_else(|| {
                PanelError::BadPanels(format!("{:?} was never given", mesh.texture_id))
            })?;
            pass.draw(&OverlayDraw {
                pipeline: &self.pipeline,
                groups: [&stream.group, texture],
                vertices: &stream.vertices,
                indices: &stream.indices,
                index_range: first_index..end,
                first_vertex,
                clip: intersection(pixels_of(clip, pixels_per_point), area),
            })?;
            first_index = end;
            first_vertex += mesh.vertices.len() as i32;
        }
        Ok(())
    }

    /// Ends a submitted frame: its uploads are on the device.
    pub fn end_frame(&mut self) {
        self.textures.all.values_mut().for_each(|texture| texture.is_new = false);
    }
}

impl Textures {
    fn update(&mut self, delta: &TexturesDelta) -> Result<(), PanelError> {
        self.have_changed |= !delta.set.is_empty();
        // A frame that is drawn again frees the same once more, and needs them.
        for id in std::mem::take(&mut self.dying) {
            if !delta.free.contains(&id) {
                self.all.remove(&id);
            }
        }
        for (&id, deltas) in &delta.set {
            deltas.iter().try_for_each(|delta| self.merge(id, delta))?;
        }
        self.dying.extend(&delta.free);
        Ok(())
    }

    /// Applies a change to a texture's pixels.
    fn merge(&mut self, id: TextureId, delta: &ImageDelta) -> Result<(), PanelError> {
        let ImageData::Color(patch) = &delta.image;
        let Some([left, top]) = delta.pos else {
            let pixels = Arc::clone(patch);
            self.all.insert(id, Texture { pixels, group: None, is_new: false });
            return Ok(());
        };
        let missing = || PanelError::BadPanels(format!("{id:?} changes before it exists"));
        let texture = self.all.get_mut(&id).ok_or_else(missing)?;
        let image = Arc::make_mut(&mut texture.pixels);
        let ([width, height], [whole_width, whole_height]) = (patch.size, image.size);
        if left + width > whole_width || top + height > whole_height {
            return Err(PanelError::BadPanels(format!("{id:?} changes beyond its edge")));
        }
        let rows = image.pixels.chunks_exact_mut(whole_width.max(1)).skip(top);
        for (row, pixels) in rows.zip(patch.pixels.chunks_exact(width.max(1))) {
            row[left..left + width].copy_from_slice(pixels);
        }
        texture.group = None;
        Ok(())
    }

    /// Uploads textures that the device lacks.
    fn upload(
        &mut self,
        recorder: &mut Recorder<'_>,
        layout: &BindGroupLayout,
        sampler: &Sampler,
    ) -> Result<(), PanelError> {
        for texture in self.all.values_mut().filter(|texture| texture.group.is_none()) {
            let image = &texture.pixels;
            if image.pixels.is_empty() {
                continue;
            }
            let size = image.size.map(|pixels| u32::try_from(pixels).unwrap_or(u32::MAX));
            let bytes = bytemuck::cast_slice(&image.pixels);
            let image = recorder.upload_flat_texture("panels", Format::Rgba8Linear, size, bytes)?;
            let bindings = [Binding::Texture(&image), Binding::Sampler(sampler)];
            texture.group = Some(BindGroup::new(layout, &bindings)?);
            texture.is_new = true;
        }
        Ok(())
    }
}

impl PanelBuffers {
    fn new(gpu: &Gpu, layout: &BindGroupLayout) -> Result<Self, GpuError> {
        let bytes = size_of::<[f32; 4]>() as u64;
        let uniform = Buffer::new(gpu, "panels", BufferUsage::HostUniform, bytes)?;
        let group = BindGroup::new(layout, &[Binding::Buffer(&uniform)])?;
        let vertices = vertex_buffer(gpu, FIRST_CAPACITY)?;
        let indices = index_buffer(gpu, FIRST_CAPACITY)?;
        Ok(Self { uniform, group, vertices, indices })
    }

    /// Writes a frame; the last one in this stream must be finished.
    fn write(
        &mut self,
        gpu: &Gpu,
        [x, y]: [f32; 2],
        vertices: &[Vertex],
        indices: &[u32],
    ) -> Result<(), PanelError> {
        let asked = vertices.len().max(indices.len());
        if asked > MAX_PANEL_VERTICES {
            let (asked, limit) = (asked as u64, MAX_PANEL_VERTICES as u64);
            return Err(PanelError::TooManyVertices { asked, limit });
        }
        if size_of_val(vertices) as u64 > self.vertices.size() {
            self.vertices = vertex_buffer(gpu, vertices.len().next_power_of_two())?;
        }
        if size_of_val(indices) as u64 > self.indices.size() {
            self.indices = index_buffer(gpu, indices.len().next_power_of_two())?;
        }
        self.uniform.write(bytemuck::bytes_of(&[x, y, 0.0, 0.0]))?;
        self.vertices.write(bytemuck::cast_slice(vertices))?;
        Ok(self.indices.write(bytemuck::cast_slice(indices))?)
    }
}

fn vertex_buffer(gpu: &Gpu, count: usize) -> Result<Buffer, GpuError> {
    let bytes = (count * size_of::<Vertex>()) as u64;
    Buffer::new(gpu, "panels' vertices", BufferUsage::HostVertex, bytes)
}

fn index_buffer(gpu: &Gpu, count: usize) -> Result<Buffer, GpuError> {
    let bytes = (count * size_of::<u32>()) as u64;
    Buffer::new(gpu, "panels' indices", BufferUsage::HostIndex, bytes)
}

fn pipeline(gpu: &Gpu, color: Format, groups: [&BindGroupLayout; 2]) -> Result<Pipeline, GpuError> {
    let attribute =
        |location, kind, offset: usize| VertexAttribute { location, kind, offset: offset as u32 };
    let attributes = [
        attribute(0, AttributeKind::Float2, offset_of!(Vertex, pos)),
        attribute(1, AttributeKind::Float2, offset_of!(Vertex, uv)),
        attribute(2, AttributeKind::Unorm4, offset_of!(Vertex, color)),
    ];
    let stride = size_of::<Vertex>() as u32;
    Pipeline::new(
        gpu,
        &PipelineDescription {
            name: "panels",
            vertex: ShaderStage { words: PANELS, entry: c"vertex_main" },
            fragment: Some(ShaderStage { words: PANELS, entry: c"fragment_main" }),
            vertex_buffers: &[VertexBuffer {
                stride,
                per_instance: false,
                attributes: &attributes,
            }],
            groups: &groups,
            color: Some(color),
            samples: 1,
            blend: Blend::PremultipliedAlpha,
            lines: false,
            screen: false,
        },
    )
}

/// Converts a clip rectangle to left, top, width and height in whole pixels.
fn pixels_of(clip: Rect, pixels_per_point: f32) -> [u32; 4] {
    let pixel = |points: f32| (points * pixels_per_point).round().max(0.0) as u32;
    let [left, top] = [pixel(clip.min.x), pixel(clip.min.y)];
    let [right, bottom] = [pixel(clip.max.x), pixel(clip.max.y)];
    [left, top, right.saturating_sub(left), bottom.saturating_sub(top)]
}

/// Returns the part of a clip rectangle (left, top, width, height) within an area, pixels.
fn intersection([left, top, width, height]: [u32; 4], area: ImageArea) -> [u32; 4] {
    let along = |start: u32, length: u32, axis: usize| {
        let (from, to) = (area.origin[axis], area.origin[axis] + area.size[axis]);
        let begin = start.clamp(from, to);
        (begin, start.saturating_add(length).clamp(begin, to) - begin)
    };
    let ((left, width), (top, height)) = (along(left, width, 0), along(top, height, 1));
    [left, top, width, height]
}

#[cfg(test)]
mod tests {
    use egui::{Color32, TextureOptions, pos2};

    use super::*;

    fn image(size: [usize; 2], shade: u8) -> ColorImage {
        ColorImage::filled(size, Color32::from_gray(shade))
    }

    /// Deltas must be cleared before they go.
    fn apply(textures: &mut Textures, mut delta: TexturesDelta) -> Result<(), PanelError> {
        let applied = textures.update(&delta);
        delta.clear();
        applied
    }

    fn set(id: u64, image: ColorImage, pos: Option<[usize; 2]>) -> TexturesDelta {
        let mut delta = TexturesDelta::default();
        let options = TextureOptions::LINEAR;
        let patch = match pos {
            None => ImageDelta::full(image, options),
            Some(pos) => ImageDelta::partial(pos, image, options),
        };
        delta.push(TextureId::Managed(id), patch);
        delta
    }

    #[test]
    fn patches_change_their_pixels_alone_and_twice_is_once() {
        let mut textures = Textures::default();
        apply(&mut textures, set(0, image([4, 3], 10), None)).unwrap();
        for _ in 0..2 {
            apply(&mut textures, set(0, image([2, 1], 90), Some([1, 2]))).unwrap();
            let shades: Vec<_> =
                textures.all[&TextureId::Managed(0)].pixels.pixels.iter().map(|p| p.r()).collect();
            assert_eq!(shades, [10, 10, 10, 10, 10, 10, 10, 10, 10, 90, 90, 10]);
        }
        let beyond = apply(&mut textures, set(0, image([2, 1], 90), Some([3, 0])));
        assert!(beyond.unwrap_err().to_string().contains("beyond its edge"));
        assert!(apply(&mut textures, set(1, image([1, 1], 0), Some([0, 0]))).is_err());
    }

    #[test]
    fn what_is_freed_lives_until_the_next_frame() {
        let mut textures = Textures::default();
        apply(&mut textures, set(7, image([1, 1], 0), None)).unwrap();
        // The second time is the same frame, drawn again.
        for _ in 0..2 {
            let mut freed = TexturesDelta::default();
            freed.free(TextureId::Managed(7));
            apply(&mut textures, freed).unwrap();
            assert_eq!(textures.all.len(), 1);
        }
        apply(&mut textures, TexturesDelta::default()).unwrap();
        assert!(textures.all.is_empty());
    }

    #[test]
    fn clips_are_whole_pixels() {
        let clip = Rect::from_min_max(pos2(-3.0, 1.2), pos2(10.4, 0.0));
        assert_eq!(pixels_of(clip, 2.0), [0, 2, 21, 0]);
    }

    #[test]
    fn clips_are_cut_to_the_damage() {
        let area = ImageArea { origin: [10, 20], size: [30, 40] };
        assert_eq!(intersection([0, 0, 100, 100], area), [10, 20, 30, 40]);
        assert_eq!(intersection([12, 22, 5, 100], area), [12, 22, 5, 38]);
        assert_eq!(intersection([50, 0, 5, u32::MAX], area), [40, 20, 0, 40]);
    }
}
