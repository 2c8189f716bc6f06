//! Full-screen passes: one triangle covers an image for post-processing.

use ash::vk;

use crate::image::ImageUse;
use crate::{BindGroup, GpuError, Image, ImageArea, Pipeline, Recorder};

impl Recorder<'_> {
    /// Makes images ready to be sampled by the commands recorded next.
    pub fn prepare_sampling(&mut self, images: &[&Image]) {
        for image in images {
            self.transition(image, ImageUse::Sampled);
        }
    }

    /// Runs a pipeline's fragment shader on every pixel of an image of one sample. Its vertex
    /// shader makes a triangle that covers clip space of the vertices 0, 1 and 2. Without `keeps`
    /// the image's contents are discarded before.
    ///
    /// # Errors
    /// When pipeline and groups are not made for that.
    pub fn fullscreen_pass(
        &mut self,
        image: &Image,
        keeps: bool,
        pipeline: &Pipeline,
        groups: &[&BindGroup],
    ) -> Result<(), GpuError> {
        self.fullscreen_pass_in((image, ImageArea::whole(image)), keeps, pipeline, groups)
    }

    /// Runs the fragment shader on a part of the image; the rest stays as it is.
    ///
    /// # Errors
    /// As above, or when the image has no such part.
    pub fn fullscreen_pass_in(
        &mut self,
        (image, area): (&Image, ImageArea),
        keeps: bool,
        pipeline: &Pipeline,
        groups: &[&BindGroup],
    ) -> Result<(), GpuError> {
        let made_for = (pipeline.color, pipeline.samples, pipeline.screen);
        let fits = made_for == (Some(image.format()), 1, true) && pipeline.accepts_groups(groups);
        if !fits || image.samples() != 1 || !area.is_within(image.size()) {
            return Err(GpuError::Misuse("a screen pass that does not fit its image"));
        }
        self.transition(image, ImageUse::ColorTarget);
        let load = match keeps {
            true => vk::AttachmentLoadOp::LOAD,
            false => vk::AttachmentLoadOp::DONT_CARE,
        };
        let colors = [vk::RenderingAttachmentInfo::default()
            .image_view(image.view())
            .image_layout(ImageUse::ColorTarget.layout())
            .load_op(load)
            .store_op(vk::AttachmentStoreOp::STORE)];
        let [width, height] = image.size();
        let info = vk::RenderingInfo::default()
            .render_area(area.to_rect())
            .layer_count(1)
            .color_attachments(&colors);
        let viewport = vk::Viewport {
            width: width as f32,
            height: height as f32,
            max_depth: 1.0,
            ..vk::Viewport::default()
        };
        let sets: Vec<_> = groups.iter().map(|group| group.raw()).collect();
        self.begin_label(image.name());
        let (commands, device) = (self.commands(), &self.device().raw);
        let point = vk::PipelineBindPoint::GRAPHICS;
        // SAFETY: the commands are being recorded, outside any pass; the image is in this
        // layout; all that is bound belongs to this device and lives until the
        // submission is done; the pipeline reads no vertices.
        unsafe {
            device.cmd_begin_rendering(commands, &info);
            device.cmd_set_viewport(commands, 0, &[viewport]);
            device.cmd_set_scissor(commands, 0, &[area.to_rect()]);
            device.cmd_set_cull_mode(commands, vk::CullModeFlags::NONE);
            device.cmd_set_front_face(commands, vk::FrontFace::COUNTER_CLOCKWISE);
            device.cmd_bind_pipeline(commands, point, pipeline.raw);
            device.cmd_bind_descriptor_sets(commands, point, pipeline.layout, 0, &sets, &[]);
            device.cmd_draw(commands, 3, 1, 0, 0);
            device.cmd_end_rendering(commands);
        }
        self.end_label();
        Ok(())
    }
}
