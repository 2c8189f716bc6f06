//! Queue of an open device: frames in flight, work outside frames, presentation and timing.

use std::num::NonZeroU32;
use std::path::PathBuf;
use std::sync::Arc;

use crate::adapter::Adapter;
use crate::command_slot::{CommandSlot, MAX_FRAMES_IN_FLIGHT, StageMillis};
use crate::device::Device;
use crate::instance::Instance;
use crate::presenter::Presenter;
use crate::recorder::Submission;
use crate::surface::Surface;
use crate::{Format, Gpu, GpuError, Recorder, ValidationLog, WindowHandles};

/// The slot of work outside frames, after those of the frames.
const TRANSFER_SLOT: usize = MAX_FRAMES_IN_FLIGHT;

/// Options of opening a device.
#[derive(Clone, Debug, Default)]
pub struct GpuOptions {
    /// Turns the validation layer on, synchronization validation included.
    pub validation: bool,
    /// The device to use: its number among those there are, or a part of its
    /// name. `BUSBAR_DEVICE` in the environment goes before. `None` takes the
    /// best.
    pub device: Option<String>,
    /// A folder for compiled pipelines; `None` keeps none.
    pub pipeline_cache: Option<PathBuf>,
    /// Log that receives the messages of the validation layer.
    pub log: ValidationLog,
}

/// Frames of a window, numbered from 1 in the order in which they were submitted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct WindowFrames {
    /// Number of the last frame submitted.
    pub submitted: u64,
    /// Number of the last frame that the window took.
    pub shown: u64,
}

impl WindowFrames {
    pub(crate) fn number_next(&mut self) -> u64 {
        self.submitted += 1;
        self.submitted
    }
}

/// Queue of an open device, with a window or without.
pub struct GpuQueue {
    pub(crate) presenter: Option<Presenter>,
    pub(crate) slots: Vec<CommandSlot>,
    /// Triangles of one part of a pass; `None` draws each pass in one.
    pub(crate) max_triangles_per_pass: Option<NonZeroU32>,
    /// True where frames are shown later than they are submitted.
    pub(crate) defers_presentation: bool,
    /// True after a deferred frame could not be shown: the next one reports what is wrong.
    pub(crate) shows_at_once: bool,
    pub(crate) window_frames: WindowFrames,
    next_frame: usize,
    frame_millis: Option<f64>,
    stage_millis: StageMillis,
    gpu: Gpu,
}

impl GpuQueue {
    /// Opens the best device for drawing without a window.
    ///
    /// # Errors
    /// When there is no loader, driver or fitting device, or, if validation is
    /// asked for, no layer.
    pub fn headless(options: &GpuOptions) -> Result<Self, GpuError> {
        let instance = Instance::open(options.validation, options.log.clone(), None)?;
        let adapter = Adapter::choose(&instance, None, options.device.as_deref())?;
        let device = Device::open(instance, adapter, false, options.pipeline_cache.as_deref())?;
        Self::on(device, None)
    }

    /// Opens the best device that can draw into the window.
    ///
    /// # Errors
    /// Returns the errors of [`GpuQueue::headless`], or when the window gives no surface.
    pub fn for_window(
        options: &GpuOptions,
        window: Arc<dyn WindowHandles>,
    ) -> Result<Self, GpuError> {
        let instance = Instance::open(options.validation, options.log.clone(), Some(&*window))?;
        let surface = Surface::new(Arc::clone(&instance), window)?;
        let adapter = Adapter::choose(&instance, Some(&surface), options.device.as_deref())?;
        let device = Device::open(instance, adapter, true, options.pipeline_cache.as_deref())?;
        let presenter = Presenter::new(Arc::clone(&device), surface)?;
        Self::on(device, Some(presenter))
    }

    fn on(device: Arc<Device>, presenter: Option<Presenter>) -> Result<Self, GpuError> {
        let slots = (0..=TRANSFER_SLOT)
            .map(|_| CommandSlot::new(Arc::clone(&device)))
            .collect::<Result<_, _>>()?;
        let picture_format = presenter.as_ref().map_or(Format::Rgba8Srgb, Presenter::format);
        Ok(Self {
            presenter,
            slots,
            max_triangles_per_pass: None,
            defers_presentation: false,
            shows_at_once: false,
            window_frames: WindowFrames::default(),
            next_frame: 0,
            frame_millis: None,
            stage_millis: StageMillis::default(),
            gpu: Gpu::new(device, picture_format),
        })
    }

    /// Returns the device, for making resources.
    pub fn gpu(&self) -> &Gpu {
        &self.gpu
    }

    /// Limits the triangles between two ends of a render pass: a pass that holds more ends and
    /// resumes with its attachments preserved. `None` draws each pass in one.
    pub fn set_max_triangles_per_pass(&mut self, limit: Option<NonZeroU32>) {
        self.max_triangles_per_pass = limit;
    }

    /// Defers the presentation of frames where the processor draws: there the caller of a present
    /// waits until the frame is drawn, and cannot prepare the next one meanwhile. A frame is shown
    /// by [`GpuQueue::present_deferred`], and at the latest with the next submission.
    pub fn defer_presentation(&mut self, is_deferred: bool) {
        self.defers_presentation = is_deferred && self.gpu.is_software();
    }

    /// Shows the frame that was deferred, if any; waits until it is drawn. After an error the next
    /// frame is not deferred.
    ///
    /// # Errors
    /// When the device is lost or memory runs out.
    pub fn present_deferred(&mut self) -> Result<(), GpuError> {
        let Some(presenter) = &mut self.presenter else { return Ok(()) };
        match presenter.present_deferred() {
            Ok(shown) => {
                self.window_frames.shown = shown.unwrap_or(self.window_frames.shown);
                Ok(())
            }
            Err(error) => {
                // Its semaphores may be left signalled: make all of it anew.
                presenter.reset_swapchain();
                self.shows_at_once = true;
                Err(error)
            }
        }
    }

    /// Returns the numbers of the window's frames.
    pub fn window_frames(&self) -> WindowFrames {
        self.window_frames
    }

    /// Goes on numbering the window's frames as before, on another device.
    pub fn continue_window_frames(&mut self, frames: WindowFrames) {
        self.window_frames = frames;
    }

    /// Returns the GPU time of the last frame that finished, milliseconds, if the device measures
    /// it.
    pub fn frame_millis(&self) -> Option<f64> {
        self.frame_millis
    }

    /// Returns the GPU times of the stages of that frame, in order.
    pub fn stage_millis(&self) -> StageMillis {
        self.stage_millis
    }

    /// Sets the size that the window now has, in pixels.
    pub fn resize_window(&mut self, size: [u32; 2]) {
        if let Some(presenter) = &mut self.presenter {
            presenter.resize(size);
        }
    }

    /// Reports whether the next frame can be shown as the window is now, as far as is known; true
    /// without a window.
    pub fn fits_window(&self) -> bool {
        self.presenter.as_ref().is_none_or(Presenter::fits_window)
    }

    /// Gives the window up, so that another device can draw into it.
    pub fn release_window(&mut self) {
        self.presenter = None;
    }

    /// Frees all unused objects. Recorded work that was abandoned may have used them.
    ///
    /// # Errors
    /// When the device is lost or hangs.
    pub fn free_memory(&mut self) -> Result<(), GpuError> {
        self.gpu.device().wait_for_all("freeing memory")?;
        self.gpu.device().destroy_discarded();
        Ok(())
    }

    /// Frees unused objects if everything submitted is finished; does not wait. For times in which
    /// no frame is drawn, which would free them.
    ///
    /// # Errors
    /// When the device is lost.
    pub fn free_idle_memory(&mut self) -> Result<(), GpuError> {
        if self.is_idle()? {
            self.gpu.device().destroy_discarded();
        }
        Ok(())
    }

    /// Makes the swapchain fit the window; gives its size, or `None` while
    /// there is nothing to draw into (no window, or a minimised one).
    ///
    /// # Errors
    /// When the window or the device is lost, or memory runs out.
    pub fn prepare_window(&mut self) -> Result<Option<[u32; 2]>, GpuError> {
        if !self.fits_window() {
            // A new swapchain does not know the last frame.
            self.present_deferred()?;
        }
        match &mut self.presenter {
            Some(presenter) => presenter.prepare(),
            None => Ok(None),
        }
    }

    /// Begins the next frame, once its slot's last frame is finished.
    ///
    /// # Errors
    /// When the device is lost or hangs.
    pub fn begin_frame(&mut self) -> Result<Recorder<'_>, GpuError> {
        let slot = self.next_frame;
        self.next_frame = (slot + 1) % MAX_FRAMES_IN_FLIGHT;
        self.begin(slot)
    }

    /// Begins work outside frames: uploads, read-backs, picking.
    ///
    /// # Errors
    /// Returns the errors of [`GpuQueue::begin_frame`].
    pub fn begin_transfer(&mut self) -> Result<Recorder<'_>, GpuError> {
        self.begin(TRANSFER_SLOT)
    }

    fn begin(&mut self, slot: usize) -> Result<Recorder<'_>, GpuError> {
        self.gpu.device().wait(self.slots[slot].value, "an earlier frame")?;
        self.gpu.device().destroy_finished()?;
        if slot != TRANSFER_SLOT
            && let Some((millis, stages)) = self.slots[slot].elapsed_millis()?
        {
            (self.frame_millis, self.stage_millis) = (Some(millis), stages);
        }
        self.slots[slot].begin()?;
        Ok(Recorder::new(self, slot))
    }

    /// Reports whether submitted work is done; does not wait.
    ///
    /// # Errors
    /// When the device is lost.
    pub fn has_finished(&self, submission: Submission) -> Result<bool, GpuError> {
        Ok(self.gpu.device().finished()? >= submission.0)
    }

    /// Reports whether everything submitted is finished; does not wait.
    ///
    /// # Errors
    /// When the device is lost.
    pub fn is_idle(&self) -> Result<bool, GpuError> {
        let device = self.gpu.device();
        Ok(device.finished()? >= device.submitted())
    }

    /// Waits until everything submitted is finished.
    ///
    /// # Errors
    /// When the device is lost or hangs.
    pub fn wait(&self) -> Result<(), GpuError> {
        self.gpu.device().wait_for_all("all frames")
    }
}

#[cfg(test)]
mod tests {
    use ash::vk;

    use super::*;

    fn open_validated() -> GpuQueue {
        GpuQueue::headless(&GpuOptions { validation: true, ..GpuOptions::default() }).unwrap()
    }

    /// Proof that silence elsewhere means something.
    #[test]
    fn what_the_validation_layer_says_is_collected() {
        let queue = open_validated();
        let log = queue.gpu.validation_log();
        assert_eq!(log.messages(), Vec::<String>::new());
        let raw = &queue.gpu.device().raw;
        let wrong = vk::SamplerCreateInfo::default().min_lod(2.0).max_lod(1.0);
        // SAFETY: the limits contradict each other, on purpose; the layer says
        // so and drivers make a useless sampler, which nothing uses.
        unsafe {
            let sampler = raw.create_sampler(&wrong, None).unwrap();
            raw.destroy_sampler(sampler, None);
        }
        drop(queue);
        let messages = log.messages();
        assert!(messages.iter().any(|message| message.contains("maxLod")), "{messages:?}");
    }

    #[test]
    fn abandoned_work_leaves_nothing_behind() {
        let mut queue = open_validated();
        let log = queue.gpu.validation_log();
        for abandon in [true, false, true, false] {
            let mut recorder = queue.begin_transfer().unwrap();
            let image =
                recorder.upload_texture("texture", Format::Rgba8Srgb, [4, 2], &[9; 32]).unwrap();
            assert_eq!(image.size(), [4, 2]);
            if !abandon {
                recorder.submit_and_wait().unwrap();
            }
        }
        let mut recorder = queue.begin_frame().unwrap();
        let error = recorder.upload_texture("texture", Format::Rgba8Srgb, [4, 2], &[9; 31]);
        assert!(matches!(error, Err(GpuError::Misuse(_))));
        drop(error);
        drop(recorder);
        drop(queue);
        assert_eq!(log.messages(), Vec::<String>::new());
    }

    #[test]
    fn uploads_larger_than_the_staging_limit_arrive() {
        let mut queue = open_validated();
        let log = queue.gpu.validation_log();
        let bytes = vec![7; 40 << 20];
        let mut recorder = queue.begin_transfer().unwrap();
        for _ in 0..3 {
            let buffer =
                recorder.upload_buffer("vertices", crate::BufferUsage::Vertex, &bytes).unwrap();
            assert_eq!(buffer.size(), 40 << 20);
            assert!(recorder.staged_bytes <= 40 << 20, "flushed in between");
        }
        recorder.submit_and_wait().unwrap();
        drop(queue);
        assert_eq!(log.messages(), Vec::<String>::new());
    }
}
