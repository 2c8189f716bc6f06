//! Overlay pass: user-interface triangles blended over a finished picture.

use ash::vk;

use crate::image::ImageUse;
use crate::{BindGroup, Buffer, BufferUsage, Format, GpuError, Image, Pipeline, Recorder};

/// Triangles to paint, within a rectangle.
pub struct OverlayDraw<'a> {
    /// A pipeline of [`Blend::PremultipliedAlpha`](crate::Blend::PremultipliedAlpha).
    pub pipeline: &'a Pipeline,
    /// The groups that its layout asks for.
    pub groups: [&'a BindGroup; 2],
    /// Vertices of the triangles.
    pub vertices: &'a Buffer,
    /// Indices, 32 bits each.
    pub indices: &'a Buffer,
    /// Range of indices drawn.
    pub index_range: std::ops::Range<u32>,
    /// Added to each index.
    pub first_vertex: i32,
    /// Scissor rectangle: left, top, width and height, pixels; the picture's edges bound it
    /// besides.
    pub clip: [u32; 4],
}

/// A pass that paints over a picture; it ends when dropped.
pub struct OverlayPass<'r> {
    recorder: &'r Recorder<'r>,
    format: Format,
    size: [u32; 2],
}

impl Recorder<'_> {
    /// Begins painting over a picture of one sample, whose bytes are blended as
    /// they are, without decoding.
    ///
    /// # Errors
    /// When the image is no such picture.
    pub fn begin_overlay(&mut self, picture: &Image) -> Result<OverlayPass<'_>, GpuError> {
        let view = picture
            .undecoded_view()
            .ok_or(GpuError::Misuse("panels over an image that is no picture"))?;
        self.transition(picture, ImageUse::ColorTarget);
        let attachments = [vk::RenderingAttachmentInfo::default()
            .image_view(view)
            .image_layout(ImageUse::ColorTarget.layout())
            .load_op(vk::AttachmentLoadOp::LOAD)
            .store_op(vk::AttachmentStoreOp::STORE)];
        let size @ [width, height] = picture.size();
        let info = vk::RenderingInfo::default()
            .render_area(vk::Extent2D { width, height }.into())
            .layer_count(1)
            .color_attachments(&attachments);
        let viewport = vk::Viewport {
            width: width as f32,
            height: height as f32,
            max_depth: 1.0,
            ..vk::Viewport::default()
        };
        self.begin_label("panels");
        let (commands, device) = (self.commands(), &self.device().raw);
        // SAFETY: the commands are being recorded, outside any pass; the view
        // is in this layout and lives as long as the picture.
        unsafe {
            device.cmd_begin_rendering(commands, &info);
            device.cmd_set_viewport(commands, 0, &[viewport]);
            device.cmd_set_cull_mode(commands, vk::CullModeFlags::NONE);
            device.cmd_set_front_face(commands, vk::FrontFace::COUNTER_CLOCKWISE);
        }
        Ok(OverlayPass { recorder: self, format: picture.format(), size })
    }
}

impl OverlayPass<'_> {
    /// Draws triangles over the picture.
    ///
    /// # Errors
    /// When pipeline, groups or buffers do not fit.
    pub fn draw(&mut self, paint: &OverlayDraw<'_>) -> Result<(), GpuError> {
        let OverlayDraw { pipeline, groups, vertices, indices, index_range, first_vertex, clip } =
            paint;
        if (pipeline.color, pipeline.samples) != (Some(self.format), 1)
            || !pipeline.accepts_groups(groups)
        {
            return Err(GpuError::Misuse("paint made for another picture"));
        }
        if vertices.usage() != BufferUsage::HostVertex
            || indices.usage() != BufferUsage::HostIndex
            || u64::from(index_range.end) * size_of::<u32>() as u64 > indices.size()
        {
            return Err(GpuError::Misuse("paint beyond its vertices or indices"));
        }
        let (device, commands) = (&self.recorder.device().raw, self.recorder.commands());
        let sets = groups.map(BindGroup::raw);
        let point = vk::PipelineBindPoint::GRAPHICS;
        // SAFETY: the commands are being recorded, inside this pass; all that is
        // bound belongs to this device and lives until the submission is done;
        // what the shaders read beyond a buffer is zero, by robust buffer access.
        unsafe {
            device.cmd_bind_pipeline(commands, point, pipeline.raw);
            device.cmd_bind_descriptor_sets(commands, point, pipeline.layout, 0, &sets, &[]);
            device.cmd_bind_vertex_buffers(commands, 0, &[vertices.raw()], &[0]);
            device.cmd_bind_index_buffer(commands, indices.raw(), 0, vk::IndexType::UINT32);
            device.cmd_set_scissor(commands, 0, &[scissor(*clip, self.size)]);
            let count = index_range.len() as u32;
            device.cmd_draw_indexed(commands, count, 1, index_range.start, *first_vertex, 0);
        }
        Ok(())
    }
}

/// Clips a rectangle to the picture.
fn scissor([left, top, width, height]: [u32; 4], size: [u32; 2]) -> vk::Rect2D {
    let (left, top) = (left.min(size[0]), top.min(size[1]));
    vk::Rect2D {
        offset: vk::Offset2D { x: left as i32, y: top as i32 },
        extent: vk::Extent2D {
            width: width.min(size[0] - left),
            height: height.min(size[1] - top),
        },
    }
}

impl Drop for OverlayPass<'_> {
    fn drop(&mut self) {
        // SAFETY: the pass was begun in these commands and not ended yet.
        unsafe { self.recorder.device().raw.cmd_end_rendering(self.recorder.commands()) };
        self.recorder.end_label();
    }
}
