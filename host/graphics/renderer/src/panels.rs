//! Panel painter: egui's user interface drawn over the picture.
//!
//! egui tells of a change of its textures once, so the pixels are kept here: a
//! frame that fails, or a device that is lost, loses none of them.

use std::collections::BTreeMap;
use std::mem::offset_of;
use std::sync::Arc;

use busbar_gpu::{
    AddressMode, AttributeKind, BindGroup, BindGroupLayout, Binding, BindingKind, Blend, Buffer,
    BufferUsage, Format, Gpu, GpuError, Image, MAX_FRAMES_IN_FLIGHT, OverlayDraw, Pipeline,
    PipelineDescription, Recorder, Sampler, ShaderStage, VertexAttribute, VertexBuffer,
};
use busbar_shaders::PANELS;
use egui::epaint::{ImageData, ImageDelta, Primitive, Vertex};
use egui::{ClippedPrimitive, ColorImage, Rect, TextureId, TexturesDelta};

use crate::RenderError;

/// Vertices and indices of the panels in one frame, each.
pub const MAX_PANEL_VERTICES: usize = 1 << 22;

/// Vertices and indices that the first buffers hold.
const FIRST_CAPACITY: usize = 1 << 12;

/// Painter of egui's panels: pipeline, buffers and textures.
pub(crate) struct Panels {
    pipeline: Pipeline,
    texture_layout: BindGroupLayout,
    sampler: Sampler,
    /// One a frame in flight.
    streams: Vec<PanelBuffers>,
    textures: Textures,
}

/// Textures of egui: their pixels, and their copies on the device.
#[derive(Default)]
struct Textures {
    all: BTreeMap<TextureId, Texture>,
    /// Not needed after the last frame.
    dying: Vec<TextureId>,
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

impl Panels {
    /// Paints over pictures of this format.
    pub(crate) fn new(gpu: &Gpu, format: Format) -> Result<Self, GpuError> {
        let frame_layout = BindGroupLayout::new(gpu, &[BindingKind::Uniform])?;
        let texture_layout =
            BindGroupLayout::new(gpu, &[BindingKind::Texture, BindingKind::Sampler])?;
        let pipeline = pipeline(gpu, format, [&frame_layout, &texture_layout])?;
        let sampler = Sampler::new(gpu, [AddressMode::Clamp; 2])?;
        let streams = (0..MAX_FRAMES_IN_FLIGHT)
            .map(|_| PanelBuffers::new(gpu, &frame_layout))
            .collect::<Result<_, _>>()?;
        Ok(Self { pipeline, texture_layout, sampler, streams, textures: Textures::default() })
    }

    /// Takes the pixels over from panels whose device was lost.
    pub(crate) fn inherit(&mut self, lost: &Self) {
        let kept = |(&id, texture): (&TextureId, &Texture)| {
            let pixels = Arc::clone(&texture.pixels);
            (id, Texture { pixels, group: None, is_new: false })
        };
        self.textures.all = lost.textures.all.iter().map(kept).collect();
        self.textures.dying.clone_from(&lost.textures.dying);
    }

    /// Applies egui's new, changed and freed textures; applying a change twice does no harm.
    pub(crate) fn update(&mut self, delta: &TexturesDelta) -> Result<(), RenderError> {
        self.textures.update(delta)
    }

    /// Abandons the frame that was being recorded: its uploads never ran.
    pub(crate) fn abandon_frame(&mut self) {
        for texture in self.textures.all.values_mut().filter(|texture| texture.is_new) {
            (texture.group, texture.is_new) = (None, false);
        }
    }

    /// Records the painting of one frame.
    pub(crate) fn record(
        &mut self,
        recorder: &mut Recorder<'_>,
        picture: &Image,
        primitives: &[ClippedPrimitive],
        pixels_per_point: f32,
    ) -> Result<(), RenderError> {
        if !(pixels_per_point.is_finite() && pixels_per_point > 0.0) {
            return Err(RenderError::BadPanels(format!("{pixels_per_point} pixels a point")));
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
                RenderError::BadPanels(format!("{:?} was never given", mesh.texture_id))
            })?;
            pass.draw(&OverlayDraw {
                pipeline: &self.pipeline,
                groups: [&stream.group, texture],
                vertices: &stream.vertices,
                indices: &stream.indices,
                index_range: first_index..end,
                first_vertex,
                clip: pixels_of(clip, pixels_per_point),
            })?;
            first_index = end;
            first_vertex += mesh.vertices.len() as i32;
        }
        Ok(())
    }

    /// Ends a submitted frame: its uploads are on the device.
    pub(crate) fn end_frame(&mut self) {
        self.textures.all.values_mut().for_each(|texture| texture.is_new = false);
    }
}

impl Textures {
    fn update(&mut self, delta: &TexturesDelta) -> Result<(), RenderError> {
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
    fn merge(&mut self, id: TextureId, delta: &ImageDelta) -> Result<(), RenderError> {
        let ImageData::Color(patch) = &delta.image;
        let Some([left, top]) = delta.pos else {
            let pixels = Arc::clone(patch);
            self.all.insert(id, Texture { pixels, group: None, is_new: false });
            return Ok(());
        };
        let missing = || RenderError::BadPanels(format!("{id:?} changes before it exists"));
        let texture = self.all.get_mut(&id).ok_or_else(missing)?;
        let image = Arc::make_mut(&mut texture.pixels);
        let ([width, height], [whole_width, whole_height]) = (patch.size, image.size);
        if left + width > whole_width || top + height > whole_height {
            return Err(RenderError::BadPanels(format!("{id:?} changes beyond its edge")));
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
    ) -> Result<(), RenderError> {
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
    ) -> Result<(), RenderError> {
        let asked = vertices.len().max(indices.len());
        if asked > MAX_PANEL_VERTICES {
            let (asked, limit) = (asked as u64, MAX_PANEL_VERTICES as u64);
            return Err(RenderError::TooMany { what: "vertices of panels", asked, limit });
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

#[cfg(test)]
mod tests {
    use egui::{Color32, TextureOptions, pos2};

    use super::*;

    fn image(size: [usize; 2], shade: u8) -> ColorImage {
        ColorImage::filled(size, Color32::from_gray(shade))
    }

    /// Deltas must be cleared before they go.
    fn apply(textures: &mut Textures, mut delta: TexturesDelta) -> Result<(), RenderError> {
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
}
