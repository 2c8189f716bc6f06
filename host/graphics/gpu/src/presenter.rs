//! Presentation in a window, with swapchain recreation as the window changes.

use std::sync::Arc;

use ash::vk;

use crate::device::Device;
use crate::error::vulkan_error;
use crate::format::Format;
use crate::image::ImageUse;
use crate::surface::Surface;
use crate::swapchain::{PresentTarget, Swapchain, SwapchainShape};
use crate::{GpuError, Image};

/// Attempts at a swapchain while the window changes under it; after that, the
/// frame is not shown.
const MAX_ATTEMPTS: usize = 3;

/// A window's surface and its swapchain.
pub(crate) struct Presenter {
    // Before the surface: it must go first.
    swapchain: Option<Swapchain>,
    surface: Surface,
    device: Arc<Device>,
    surface_format: vk::SurfaceFormatKHR,
    format: Format,
    size: [u32; 2],
    /// The swapchain is to be made anew before the next frame.
    outdated: bool,
    /// Surface loss: the surface is to be made anew too.
    surface_lost: bool,
    /// Submitted frame that is not shown yet, with its number.
    deferred: Option<(PresentTarget, u64)>,
}

impl Presenter {
    pub(crate) fn new(device: Arc<Device>, surface: Surface) -> Result<Self, GpuError> {
        let formats = surface
            .formats(device.adapter.raw)
            .map_err(vulkan_error("asking for the window's formats"))?;
        let (surface_format, format) = choose_format(&formats).ok_or_else(|| {
            GpuError::Window("it offers no 8-bit sRGB format; use a display of 24 bits".to_owned())
        })?;
        Ok(Self {
            swapchain: None,
            surface,
            device,
            surface_format,
            format,
            size: [0, 0],
            outdated: true,
            surface_lost: false,
            deferred: None,
        })
    }

    pub(crate) fn format(&self) -> Format {
        self.format
    }

    pub(crate) fn resize(&mut self, size: [u32; 2]) {
        if self.size != size {
            self.size = size;
            self.outdated = true;
        }
    }

    /// Reports whether the swapchain fits the window, as far as is known.
    pub(crate) fn fits_window(&self) -> bool {
        !self.outdated && !self.surface_lost
    }

    /// Forgets the swapchain with all its semaphores.
    pub(crate) fn reset_swapchain(&mut self) {
        self.deferred = None;
        self.swapchain = None;
        self.outdated = true;
    }

    /// Makes the swapchain fit the window; `None` while the window is empty.
    pub(crate) fn prepare(&mut self) -> Result<Option<[u32; 2]>, GpuError> {
        if self.size.contains(&0) {
            return Ok(None);
        }
        for _ in 0..MAX_ATTEMPTS {
            if let Some(swapchain) = self.swapchain.as_ref().filter(|_| !self.outdated) {
                return Ok(Some([swapchain.extent.width, swapchain.extent.height]));
            }
            if self.surface_lost {
                self.recreate_surface()?;
            }
            match self.rebuild() {
                Ok(true) => {}
                Ok(false) => return Ok(None),
                Err(vk::Result::ERROR_SURFACE_LOST_KHR) => self.surface_lost = true,
                Err(vk::Result::ERROR_OUT_OF_DATE_KHR) => self.reset_swapchain(),
                Err(code) => return Err(vulkan_error("preparing the window")(code)),
            }
        }
        Ok(None)
    }

    /// Makes the surface anew, and the swapchain with it.
    fn recreate_surface(&mut self) -> Result<(), GpuError> {
        tracing::warn!("the window's surface was lost: it is made anew");
        self.reset_swapchain();
        self.surface.recreate()?;
        let adapter = &self.device.adapter;
        let offered =
            self.surface.formats(adapter.raw).map_err(vulkan_error("asking for formats again"))?;
        if !self.surface.supports(adapter.raw, adapter.queue_family)?
            || !offered.contains(&self.surface_format)
        {
            // Another device or another kind of picture: all is chosen anew.
            return Err(GpuError::DeviceLost("the window moved to where it cannot draw"));
        }
        self.surface_lost = false;
        Ok(())
    }

    /// Records the window system's answer to a use of an image. Returns whether it is a mere change
    /// of the surface.
    fn note_surface_change(&mut self, code: vk::Result) -> bool {
        let lost = code == vk::Result::ERROR_SURFACE_LOST_KHR;
        let noted = lost || code == vk::Result::ERROR_OUT_OF_DATE_KHR;
        self.surface_lost |= lost;
        self.outdated |= noted;
        noted
    }

    /// Builds the swapchain; false if the window has no area.
    fn rebuild(&mut self) -> Result<bool, vk::Result> {
        let capabilities = self.surface.capabilities(self.device.adapter.raw)?;
        let extent = extent(&capabilities, self.size);
        if extent.width == 0 || extent.height == 0 {
            return Ok(false);
        }
        if !capabilities.supported_usage_flags.contains(vk::ImageUsageFlags::TRANSFER_DST) {
            return Err(vk::Result::ERROR_FORMAT_NOT_SUPPORTED);
        }
        let present_mode = self.surface.present_mode(self.device.adapter.raw)?;
        let format = self.surface_format;
        let shape = SwapchainShape { format, extent, capabilities, present_mode };
        let device = Arc::clone(&self.device);
        let next = Swapchain::new(device, &self.surface, &shape, self.swapchain.as_ref());
        // Retired by the attempt, also by one that failed.
        (self.swapchain, self.deferred) = (None, None);
        self.swapchain = Some(next?);
        self.outdated = false;
        Ok(true)
    }

    /// Acquires the image to show next; `None` if the window changed or gives none.
    pub(crate) fn acquire(&mut self, slot: usize) -> Result<Option<PresentTarget>, GpuError> {
        let Some(swapchain) = &self.swapchain else {
            return Ok(None);
        };
        match swapchain.acquire(slot) {
            Ok(target) => {
                self.outdated |= target.as_ref().is_some_and(|target| target.suboptimal);
                Ok(target)
            }
            Err(code) if self.note_surface_change(code) => Ok(None),
            Err(code) => Err(vulkan_error("taking the window's next image")(code)),
        }
    }

    /// Records the copy of the picture, whose bytes the window takes unchanged.
    ///
    /// # Safety
    /// The commands belong to the presenter's device and are being recorded, outside any pass; the
    /// picture is a copy source there, and they keep it alive.
    pub(crate) unsafe fn record_copy(
        &self,
        commands: vk::CommandBuffer,
        picture: &Image,
        target: &PresentTarget,
    ) {
        let Some(swapchain) = &self.swapchain else {
            return;
        };
        let [width, height] = picture.size();
        // The window's image has one level of one layer, too.
        let layers = picture.layers(0);
        let region = [vk::ImageCopy::default()
            .src_subresource(layers)
            .dst_subresource(layers)
            .extent(vk::Extent3D {
                width: width.min(swapchain.extent.width),
                height: height.min(swapchain.extent.height),
                depth: 1,
            })];
        let copied = ImageUse::CopyTarget;
        let change = |from, to| {
            vk::ImageMemoryBarrier2::default()
                .src_stage_mask(copied.stages())
                .dst_stage_mask(copied.stages())
                .old_layout(from)
                .new_layout(to)
                .src_queue_family_index(vk::QUEUE_FAMILY_IGNORED)
                .dst_queue_family_index(vk::QUEUE_FAMILY_IGNORED)
                .image(target.image)
                .subresource_range(vk::ImageSubresourceRange {
                    aspect_mask: vk::ImageAspectFlags::COLOR,
                    base_mip_level: 0,
                    level_count: 1,
                    base_array_layer: 0,
                    layer_count: 1,
                })
        };
        // Its source stage is the one that waits for the image's semaphore.
        let fill = change(vk::ImageLayout::UNDEFINED, copied.layout())
            .dst_access_mask(vk::AccessFlags2::TRANSFER_WRITE);
        let show = change(copied.layout(), vk::ImageLayout::PRESENT_SRC_KHR)
            .src_access_mask(vk::AccessFlags2::TRANSFER_WRITE)
            .dst_stage_mask(vk::PipelineStageFlags2::NONE);
        // SAFETY: the commands are being recorded, by the caller's promise; both images are in
        // these layouts at the copy, hold the region, and have formats of the same size.
        unsafe {
            self.device.record_barriers(commands, &[fill], &[]);
            self.device.raw.cmd_copy_image(
                commands,
                picture.raw(),
                ImageUse::CopySource.layout(),
                target.image,
                copied.layout(),
                &region,
            );
            self.device.record_barriers(commands, &[show], &[]);
        }
    }

    /// Keeps a submitted frame, with its number, to be shown by [`Presenter::present_deferred`].
    pub(crate) fn defer(&mut self, target: PresentTarget, number: u64) {
        self.deferred = Some((target, number));
    }

    /// Shows the frame that was deferred, if any; returns its number if the window took it.
    pub(crate) fn present_deferred(&mut self) -> Result<Option<u64>, GpuError> {
        let Some((target, number)) = self.deferred.take() else { return Ok(None) };
        Ok(self.present(&target)?.then_some(number))
    }

    /// Shows a frame; reports whether the window took it.
    pub(crate) fn present(&mut self, target: &PresentTarget) -> Result<bool, GpuError> {
        let Some(swapchain) = &self.swapchain else {
            return Ok(false);
        };
        match swapchain.present(target) {
            Ok(suboptimal) => {
                self.outdated |= suboptimal;
                Ok(true)
            }
            Err(code) if self.note_surface_change(code) => Ok(false),
            Err(code) => Err(vulkan_error("showing a frame")(code)),
        }
    }
}

fn choose_format(formats: &[vk::SurfaceFormatKHR]) -> Option<(vk::SurfaceFormatKHR, Format)> {
    formats
        .iter()
        .filter(|format| format.color_space == vk::ColorSpaceKHR::SRGB_NONLINEAR)
        .find_map(|&format| Some((format, Format::from_swapchain(format.format)?)))
}

/// Returns the window's own size where it has one, else the size set.
fn extent(capabilities: &vk::SurfaceCapabilitiesKHR, [width, height]: [u32; 2]) -> vk::Extent2D {
    if capabilities.current_extent.width != u32::MAX {
        return capabilities.current_extent;
    }
    let (least, most) = (capabilities.min_image_extent, capabilities.max_image_extent);
    vk::Extent2D {
        width: width.max(least.width).min(most.width),
        height: height.max(least.height).min(most.height),
    }
}
