//! Recorder of one submission's commands, with image layout tracking.

use std::sync::Arc;

use ash::vk;

use crate::command_slot::CommandSlot;
use crate::device::Device;
use crate::draw_command::IndirectCommand;
use crate::image::ImageUse;
use crate::presenter::Presenter;
use crate::{Gpu, GpuError, GpuQueue, Image, ImageArea, ImageKind};

/// Commands being recorded. Dropping it unsubmitted abandons them.
pub struct Recorder<'g> {
    pub(crate) queue: &'g mut GpuQueue,
    slot: usize,
    /// Images whose tracked use would be wrong if this is abandoned.
    touched: Vec<Image>,
    /// Bytes waiting in staging buffers.
    pub(crate) staged_bytes: u64,
}

/// Work handed to the device: its number on the timeline.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Submission(pub(crate) u64);

impl<'g> Recorder<'g> {
    pub(crate) fn new(queue: &'g mut GpuQueue, slot: usize) -> Self {
        Self { queue, slot, touched: Vec::new(), staged_bytes: 0 }
    }

    /// Returns the device, for making resources meanwhile.
    pub fn gpu(&self) -> &Gpu {
        self.queue.gpu()
    }

    /// Returns the queue that the commands are for, with the times of frames that finished.
    pub fn queue(&self) -> &GpuQueue {
        self.queue
    }

    /// Returns the number of this frame in flight. Resources of its slot are free to be written.
    pub fn slot(&self) -> usize {
        self.slot
    }

    /// Ends a timed stage: the commands since the last one. Does nothing beyond
    /// [`MAX_STAGES`](crate::MAX_STAGES).
    pub fn end_stage(&mut self, name: &'static str) {
        self.queue.slots[self.slot].end_stage(name);
    }

    pub(crate) fn device(&self) -> &Arc<Device> {
        self.gpu().device()
    }

    fn command_slot(&self) -> &CommandSlot {
        &self.queue.slots[self.slot]
    }

    pub(crate) fn commands(&self) -> vk::CommandBuffer {
        self.command_slot().commands
    }

    /// Puts draw calls where the device reads them, as [`IndirectCommands::write`] does.
    pub(crate) fn write_indirect_commands(
        &self,
        calls: &[IndirectCommand],
    ) -> Result<Option<(vk::Buffer, u64, usize)>, GpuError> {
        self.command_slot().indirect.borrow_mut().write(self.device(), calls)
    }

    /// Makes an image ready for its next use, after its last.
    pub(crate) fn transition(&mut self, image: &Image, next: ImageUse) {
        let last = std::mem::replace(&mut *image.usage(), next);
        self.barrier(image.raw(), image.format().aspect(), 0..image.levels(), last, next);
        self.touched.push(image.clone());
    }

    pub(crate) fn barrier(
        &self,
        image: vk::Image,
        aspect: vk::ImageAspectFlags,
        levels: std::ops::Range<u32>,
        last: ImageUse,
        next: ImageUse,
    ) {
        let barrier = vk::ImageMemoryBarrier2::default()
            .src_stage_mask(last.stages())
            .src_access_mask(last.access())
            .dst_stage_mask(next.stages())
            .dst_access_mask(next.access())
            .old_layout(last.layout())
            .new_layout(next.layout())
            .src_queue_family_index(vk::QUEUE_FAMILY_IGNORED)
            .dst_queue_family_index(vk::QUEUE_FAMILY_IGNORED)
            .image(image)
            .subresource_range(vk::ImageSubresourceRange {
                aspect_mask: aspect,
                base_mip_level: levels.start,
                level_count: levels.len() as u32,
                base_array_layer: 0,
                layer_count: 1,
            });
        self.barriers(&[barrier], &[]);
    }

    pub(crate) fn barriers(
        &self,
        images: &[vk::ImageMemoryBarrier2<'_>],
        memory: &[vk::MemoryBarrier2<'_>],
    ) {
        // SAFETY: the commands are being recorded, outside any pass, and keep the images alive.
        unsafe { self.device().record_barriers(self.commands(), images, memory) };
    }

    /// Begins a stretch that debuggers show under this name.
    pub(crate) fn begin_label(&self, name: &str) {
        self.device().begin_label(self.commands(), name);
    }

    pub(crate) fn end_label(&self) {
        self.device().end_label(self.commands());
    }

    /// Submits the recorded commands.
    ///
    /// # Errors
    /// When the device is lost or memory runs out.
    pub fn submit(mut self) -> Result<(), GpuError> {
        self.finish(None, None)
    }

    /// Submits the recorded commands; [`GpuQueue::has_finished`] tells when they are done.
    ///
    /// # Errors
    /// Returns the errors of [`Recorder::submit`].
    pub fn submit_tracked(mut self) -> Result<Submission, GpuError> {
        self.finish(None, None)?;
        Ok(Submission(self.command_slot().value))
    }

    /// Submits the recorded commands and waits for them.
    ///
    /// # Errors
    /// Returns the errors of [`Recorder::submit`], or when the device hangs.
    pub fn submit_and_wait(mut self) -> Result<(), GpuError> {
        self.finish(None, None)?;
        self.device().wait(self.command_slot().value, "a transfer")
    }

    /// Submits the recorded commands, waits for them and continues recording. All resources of the
    /// recorder's slot are free to be written again.
    ///
    /// # Errors
    /// Returns the errors of [`Recorder::submit_and_wait`].
    pub fn flush(&mut self) -> Result<(), GpuError> {
        self.finish(None, None)?;
        self.device().wait(self.command_slot().value, "the first part of a submission")?;
        self.device().destroy_finished()?;
        self.staged_bytes = 0;
        self.queue.slots[self.slot].resume()
    }

    /// Submits the recorded commands and shows the picture in the window, at once or deferred
    /// ([`GpuQueue::defer_presentation`]). Returns false if the
    /// window changed meanwhile or took no picture: then it does not show this one.
    ///
    /// # Errors
    /// When there is no window, the device is lost or memory runs out.
    pub fn present(mut self, picture: &Image) -> Result<bool, GpuError> {
        self.queue.present_deferred()?;
        let mut presenter =
            self.queue.presenter.take().ok_or(GpuError::Misuse("presenting without a window"))?;
        let presented = self.present_to(&mut presenter, picture);
        if presented.is_err() {
            // Its semaphores may be left signalled: make all of it anew.
            presenter.reset_swapchain();
        }
        self.queue.presenter = Some(presenter);
        presented
    }

    fn present_to(&mut self, presenter: &mut Presenter, picture: &Image) -> Result<bool, GpuError> {
        self.transition(picture, ImageUse::CopySource);
        let Some(target) = presenter.acquire(self.slot)? else {
            self.finish(None, None)?;
            return Ok(false);
        };
        // SAFETY: the commands are being recorded, outside any pass; the picture is a copy source
        // by the transition above and is kept alive.
        unsafe { presenter.record_copy(self.commands(), picture, &target) };
        self.finish(Some(target.acquired), Some(target.presentable))?;
        let number = self.queue.window_frames.number_next();
        if self.queue.defers_presentation && !self.queue.shows_at_once {
            presenter.defer(target, number);
        } else if presenter.present(&target)? {
            self.queue.window_frames.shown = number;
            self.queue.shows_at_once = false;
        }
        Ok(presenter.fits_window())
    }

    fn finish(
        &mut self,
        wait: Option<vk::Semaphore>,
        signal: Option<vk::Semaphore>,
    ) -> Result<(), GpuError> {
        self.command_slot().end()?;
        self.queue.present_deferred()?;
        // SAFETY: the commands were just ended; the semaphores come from the
        // presenter, in the states a presented frame asks for; `&mut` of the
        // queue makes this the only submission.
        let value = unsafe { self.device().submit(self.commands(), wait, signal) }?;
        self.queue.slots[self.slot].value = value;
        self.touched.clear();
        Ok(())
    }

    /// Copies a part of an image of one sample into the same place of another of the same kind,
    /// format and size.
    ///
    /// # Errors
    /// When the images differ in kind, or the part is not within them.
    pub fn copy_image(
        &mut self,
        source: &Image,
        target: &Image,
        area: ImageArea,
    ) -> Result<(), GpuError> {
        let shape = |image: &Image| (image.kind(), image.format(), image.size());
        let is_picture = source.kind() == ImageKind::Target { samples: 1 };
        if !is_picture || shape(source) != shape(target) || !area.is_within(source.size()) {
            return Err(GpuError::Misuse("a copy between images that differ"));
        }
        self.transition(source, ImageUse::CopySource);
        self.transition(target, ImageUse::CopyTarget);
        let vk::Rect2D { offset, extent } = area.to_rect();
        let offset = vk::Offset3D { x: offset.x, y: offset.y, z: 0 };
        let region = [vk::ImageCopy::default()
            .src_subresource(source.layers(0))
            .src_offset(offset)
            .dst_subresource(target.layers(0))
            .dst_offset(offset)
            .extent(vk::Extent3D { width: extent.width, height: extent.height, depth: 1 })];
        // SAFETY: the commands are being recorded, outside any pass; both images are in these
        // layouts by the transitions above, which keep them alive, and hold the region.
        unsafe {
            self.device().raw.cmd_copy_image(
                self.commands(),
                source.raw(),
                ImageUse::CopySource.layout(),
                target.raw(),
                ImageUse::CopyTarget.layout(),
                &region,
            );
        }
        Ok(())
    }

    /// Copies the whole of an image of one sample to the whole of another one of the same kind and
    /// format, scaled with linear interpolation.
    ///
    /// # Errors
    /// When the images differ in kind or format.
    pub fn scale_image(&mut self, source: &Image, target: &Image) -> Result<(), GpuError> {
        let shape = |image: &Image| (image.kind(), image.format());
        let is_picture = source.kind() == ImageKind::Target { samples: 1 };
        if !is_picture || shape(source) != shape(target) {
            return Err(GpuError::Misuse("scaling between images that differ"));
        }
        self.transition(source, ImageUse::CopySource);
        self.transition(target, ImageUse::CopyTarget);
        self.blit([(source, 0), (target, 0)]);
        Ok(())
    }

    /// Copies a level of an image to one of an image of the same format, scaled with linear
    /// interpolation. Both are in the layouts of copies, outside any pass.
    pub(crate) fn blit(&self, [source, target]: [(&Image, u32); 2]) {
        let corners = |(image, level): (&Image, u32)| {
            let [x, y] = image.size().map(|pixels| (pixels >> level).max(1) as i32);
            [vk::Offset3D::default(), vk::Offset3D { x, y, z: 1 }]
        };
        let region = [vk::ImageBlit::default()
            .src_subresource(source.0.layers(source.1))
            .src_offsets(corners(source))
            .dst_subresource(target.0.layers(target.1))
            .dst_offsets(corners(target))];
        // SAFETY: the commands are being recorded, outside any pass; the levels exist and are in
        // these layouts, by the caller's promise; linear blits of these formats are always
        // supported (Vulkan specification, "Required Format Support").
        unsafe {
            self.device().raw.cmd_blit_image(
                self.commands(),
                source.0.raw(),
                ImageUse::CopySource.layout(),
                target.0.raw(),
                ImageUse::CopyTarget.layout(),
                &region,
                vk::Filter::LINEAR,
            );
        }
    }

    pub(crate) fn copy_to_image(&self, source: vk::Buffer, image: &Image) {
        let region = [copy_region(image, ImageArea::whole(image))];
        // SAFETY: the commands are being recorded; the image is a copy target
        // by the caller's barrier, and the buffer holds all its pixels.
        unsafe {
            self.device().raw.cmd_copy_buffer_to_image(
                self.commands(),
                source,
                image.raw(),
                ImageUse::CopyTarget.layout(),
                &region,
            );
        }
    }

    pub(crate) fn copy_from_image(&self, image: &Image, area: ImageArea, target: vk::Buffer) {
        let region = [copy_region(image, area)];
        // SAFETY: as above, the other way round.
        unsafe {
            self.device().raw.cmd_copy_image_to_buffer(
                self.commands(),
                image.raw(),
                ImageUse::CopySource.layout(),
                target,
                &region,
            );
        }
    }
}

impl Drop for Recorder<'_> {
    fn drop(&mut self) {
        // Abandoned: the barriers never ran, so what the images hold is
        // unknown; "undefined" is always true.
        for image in &self.touched {
            *image.usage() = ImageUse::Undefined;
        }
    }
}

/// Returns the copy region of a part of the first level.
fn copy_region(image: &Image, area: ImageArea) -> vk::BufferImageCopy {
    let vk::Rect2D { offset, extent } = area.to_rect();
    vk::BufferImageCopy::default()
        .image_subresource(image.layers(0))
        .image_offset(vk::Offset3D { x: offset.x, y: offset.y, z: 0 })
        .image_extent(vk::Extent3D { width: extent.width, height: extent.height, depth: 1 })
}
