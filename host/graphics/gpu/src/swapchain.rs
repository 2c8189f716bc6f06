//! Swapchain with the semaphores of its images.

use std::sync::Arc;

use ash::{khr, vk};

use crate::GpuError;
use crate::command_slot::MAX_FRAMES_IN_FLIGHT;
use crate::device::Device;
use crate::surface::Surface;

/// Time that the window system may take to give an image back, milliseconds. A hidden window may
/// give none; the frame is then not shown.
const MAX_ACQUIRE_MILLIS: u64 = 1_000;

/// Parameters that a swapchain is made with.
pub(crate) struct SwapchainShape {
    pub(crate) format: vk::SurfaceFormatKHR,
    pub(crate) extent: vk::Extent2D,
    pub(crate) capabilities: vk::SurfaceCapabilitiesKHR,
    pub(crate) present_mode: vk::PresentModeKHR,
}

pub(crate) struct Swapchain {
    device: Arc<Device>,
    functions: khr::swapchain::Device,
    raw: vk::SwapchainKHR,
    images: Vec<vk::Image>,
    pub(crate) extent: vk::Extent2D,
    /// Per frame in flight: its image may be written.
    acquired: Vec<vk::Semaphore>,
    /// Per image: it may be shown. One an image, because only acquiring the
    /// image again proves that showing it is over.
    presentable: Vec<vk::Semaphore>,
}

/// An image to fill and show.
pub(crate) struct PresentTarget {
    pub(crate) index: u32,
    pub(crate) image: vk::Image,
    pub(crate) acquired: vk::Semaphore,
    pub(crate) presentable: vk::Semaphore,
    /// The swapchain no longer fits the window quite.
    pub(crate) suboptimal: bool,
}

impl Swapchain {
    pub(crate) fn new(
        device: Arc<Device>,
        surface: &Surface,
        shape: &SwapchainShape,
        old: Option<&Self>,
    ) -> Result<Self, vk::Result> {
        let functions = khr::swapchain::Device::new(&device.instance.raw, &device.raw);
        let capabilities = &shape.capabilities;
        let info = vk::SwapchainCreateInfoKHR::default()
            .surface(surface.raw)
            .min_image_count(image_count(capabilities))
            .image_format(shape.format.format)
            .image_color_space(shape.format.color_space)
            .image_extent(shape.extent)
            .image_array_layers(1)
            .image_usage(vk::ImageUsageFlags::TRANSFER_DST)
            .image_sharing_mode(vk::SharingMode::EXCLUSIVE)
            .pre_transform(capabilities.current_transform)
            .composite_alpha(composite_alpha(capabilities))
            .present_mode(shape.present_mode)
            .clipped(true)
            .old_swapchain(old.map_or(vk::SwapchainKHR::null(), |old| old.raw));
        // SAFETY: the surface lives and the shape is within its capabilities;
        // the old swapchain, if any, is on the same surface.
        let raw = unsafe { functions.create_swapchain(&info, None) }?;
        // Owns what is made from here on.
        let mut swapchain = Self {
            device,
            functions,
            raw,
            images: Vec::new(),
            extent: shape.extent,
            acquired: Vec::new(),
            presentable: Vec::new(),
        };
        // SAFETY: just made.
        swapchain.images = unsafe { swapchain.functions.get_swapchain_images(raw) }?;
        swapchain.device.name(swapchain.raw, "window");
        for &image in &swapchain.images {
            swapchain.device.name(image, "window");
        }
        for _ in 0..MAX_FRAMES_IN_FLIGHT {
            let semaphore = semaphore(&swapchain.device)?;
            swapchain.acquired.push(semaphore);
        }
        for _ in 0..swapchain.images.len() {
            let semaphore = semaphore(&swapchain.device)?;
            swapchain.presentable.push(semaphore);
        }
        Ok(swapchain)
    }

    /// Acquires the next image for a frame slot, whose last frame is finished; `None` if the window
    /// system gives none in time.
    pub(crate) fn acquire(&self, slot: usize) -> Result<Option<PresentTarget>, vk::Result> {
        let acquired = self.acquired[slot];
        let timeout_nanos = MAX_ACQUIRE_MILLIS * 1_000_000;
        // SAFETY: the slot's last frame, which waited for this semaphore, is
        // finished, so it is not signalled and nothing waits for it.
        let next = unsafe {
            self.functions.acquire_next_image(self.raw, timeout_nanos, acquired, vk::Fence::null())
        };
        match next {
            Ok((index, suboptimal)) => Ok(Some(PresentTarget {
                index,
                image: self.images[index as usize],
                acquired,
                presentable: self.presentable[index as usize],
                suboptimal,
            })),
            Err(vk::Result::TIMEOUT | vk::Result::NOT_READY) => Ok(None),
            Err(code) => Err(code),
        }
    }

    /// Shows an image; true if the swapchain no longer fits the window quite.
    pub(crate) fn present(&self, target: &PresentTarget) -> Result<bool, vk::Result> {
        let (swapchains, indices) = ([self.raw], [target.index]);
        let waits = [target.presentable];
        let info = vk::PresentInfoKHR::default()
            .wait_semaphores(&waits)
            .swapchains(&swapchains)
            .image_indices(&indices);
        // SAFETY: the image was acquired and its semaphore will be signalled by
        // the submission just made.
        unsafe { self.functions.queue_present(self.device.queue, &info) }
    }

    /// Waits until nothing is drawn into it and nothing waits to be shown.
    fn wait_idle(&self) -> Result<(), GpuError> {
        self.device.wait_for_all("the window's last frame")?;
        // Presents wait on the queue, out of the timeline's sight. All
        // submissions are done, so this does not block.
        self.device.wait_for_queue("waiting for the window")
    }
}

impl Drop for Swapchain {
    fn drop(&mut self) {
        // On a hung device it stays; the device reports it.
        if let Err(error) = self.wait_idle()
            && !matches!(error, GpuError::DeviceLost(_))
        {
            return;
        }
        // SAFETY: nothing uses them any more.
        unsafe {
            for &semaphore in self.acquired.iter().chain(&self.presentable) {
                self.device.raw.destroy_semaphore(semaphore, None);
            }
            self.functions.destroy_swapchain(self.raw, None);
        }
    }
}

fn semaphore(device: &Device) -> Result<vk::Semaphore, vk::Result> {
    // SAFETY: the device lives.
    let semaphore =
        unsafe { device.raw.create_semaphore(&vk::SemaphoreCreateInfo::default(), None) }?;
    device.name(semaphore, "window's image");
    Ok(semaphore)
}

/// Returns one image more than the minimum, so that acquiring seldom waits; a maximum of zero is no
/// limit.
fn image_count(capabilities: &vk::SurfaceCapabilitiesKHR) -> u32 {
    let most = match capabilities.max_image_count {
        0 => u32::MAX,
        most => most,
    };
    (capabilities.min_image_count + 1).min(most)
}

fn composite_alpha(capabilities: &vk::SurfaceCapabilitiesKHR) -> vk::CompositeAlphaFlagsKHR {
    let supported = capabilities.supported_composite_alpha;
    [
        vk::CompositeAlphaFlagsKHR::OPAQUE,
        vk::CompositeAlphaFlagsKHR::INHERIT,
        vk::CompositeAlphaFlagsKHR::PRE_MULTIPLIED,
    ]
    .into_iter()
    .find(|&alpha| supported.contains(alpha))
    .unwrap_or(vk::CompositeAlphaFlagsKHR::POST_MULTIPLIED)
}
