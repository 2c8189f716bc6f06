//! Open device: its abilities, shared by all resources made from it.

use std::sync::Arc;

use crate::device::Device;
use crate::format::sample_flag;
use crate::{Format, GpuError, ValidationLog};

/// An open device; clones share it.
#[derive(Clone)]
pub struct Gpu {
    device: Arc<Device>,
    picture_format: Format,
}

impl Gpu {
    pub(crate) fn new(device: Arc<Device>, picture_format: Format) -> Self {
        Self { device, picture_format }
    }

    pub(crate) fn device(&self) -> &Arc<Device> {
        &self.device
    }

    /// Returns the name of the device.
    pub fn device_name(&self) -> &str {
        &self.device.adapter.name
    }

    /// Reports whether the device is a software rasterizer.
    pub fn is_software(&self) -> bool {
        self.device.adapter.is_software
    }

    /// Reports whether edges can be drawn instead of faces.
    pub fn can_draw_lines(&self) -> bool {
        self.device.adapter.can_draw_lines
    }

    /// Reports whether targets can have this many samples a pixel.
    pub fn supports_samples(&self, samples: u32) -> bool {
        let limits = &self.device.adapter.limits;
        samples.is_power_of_two()
            && (limits.framebuffer_color_sample_counts & limits.framebuffer_depth_sample_counts)
                .contains(sample_flag(samples))
    }

    /// Returns the log of the validation layer; readable after the device is gone.
    pub fn validation_log(&self) -> ValidationLog {
        self.device.instance.log.clone()
    }

    /// Returns the format that pictures for the window must have.
    pub fn picture_format(&self) -> Format {
        self.picture_format
    }

    /// Writes compiled pipelines to disk, where a folder was named. Call it once
    /// all are compiled. That they cannot be written is no failure.
    ///
    /// # Errors
    /// When memory runs out.
    pub fn save_pipelines(&self) -> Result<(), GpuError> {
        self.device.save_pipeline_cache()
    }
}
