//! Vulkan surface of a window.

use std::sync::Arc;

use ash::{khr, vk};
use raw_window_handle::{HasDisplayHandle, HasWindowHandle};

use crate::GpuError;
use crate::error::vulkan_error;
use crate::instance::Instance;

/// A window that can be drawn into.
pub trait WindowHandles: HasWindowHandle + HasDisplayHandle + Send + Sync {}

impl<T: HasWindowHandle + HasDisplayHandle + Send + Sync> WindowHandles for T {}

/// A surface and the window it must not outlive.
pub(crate) struct Surface {
    functions: khr::surface::Instance,
    pub(crate) raw: vk::SurfaceKHR,
    window: Arc<dyn WindowHandles>,
    instance: Arc<Instance>,
}

impl Surface {
    pub(crate) fn new(
        instance: Arc<Instance>,
        window: Arc<dyn WindowHandles>,
    ) -> Result<Self, GpuError> {
        let functions = khr::surface::Instance::new(&instance.entry, &instance.raw);
        let mut surface = Self { functions, raw: vk::SurfaceKHR::null(), window, instance };
        surface.create()?;
        Ok(surface)
    }

    /// Makes the surface anew, after it was lost. No swapchain may be on it.
    /// After a failure it counts as lost, so that the next frame tries again.
    pub(crate) fn recreate(&mut self) -> Result<(), GpuError> {
        self.destroy();
        self.create()
    }

    fn create(&mut self) -> Result<(), GpuError> {
        let refuse = |error: raw_window_handle::HandleError| GpuError::Window(error.to_string());
        let display = self.window.display_handle().map_err(refuse)?.as_raw();
        let window = self.window.window_handle().map_err(refuse)?.as_raw();
        // SAFETY: the instance has the extensions of this display; both handles
        // are valid for as long as `self.window`, which the surface keeps.
        self.raw = unsafe {
            ash_window::create_surface(
                &self.instance.entry,
                &self.instance.raw,
                display,
                window,
                None,
            )
        }
        .map_err(vulkan_error("creating the window's surface"))?;
        Ok(())
    }

    fn destroy(&mut self) {
        // SAFETY: made from this instance, or null; its swapchain is gone.
        unsafe { self.functions.destroy_surface(self.raw, None) };
        self.raw = vk::SurfaceKHR::null();
    }

    pub(crate) fn supports(
        &self,
        device: vk::PhysicalDevice,
        queue_family: u32,
    ) -> Result<bool, GpuError> {
        // SAFETY: device and surface belong to the same live instance.
        unsafe {
            self.functions.get_physical_device_surface_support(device, queue_family, self.raw)
        }
        .map_err(vulkan_error("asking what the window supports"))
    }

    pub(crate) fn capabilities(
        &self,
        device: vk::PhysicalDevice,
    ) -> Result<vk::SurfaceCapabilitiesKHR, vk::Result> {
        if self.raw == vk::SurfaceKHR::null() {
            return Err(vk::Result::ERROR_SURFACE_LOST_KHR);
        }
        // SAFETY: as in `supports`.
        unsafe { self.functions.get_physical_device_surface_capabilities(device, self.raw) }
    }

    /// Chooses the present mode. Callers pace the frames, so a mode that never blocks is best. With
    /// FIFO, a hidden window can block the thread that also handles events.
    pub(crate) fn present_mode(
        &self,
        device: vk::PhysicalDevice,
    ) -> Result<vk::PresentModeKHR, vk::Result> {
        // SAFETY: as in `supports`.
        let modes =
            unsafe { self.functions.get_physical_device_surface_present_modes(device, self.raw) }?;
        let mailbox = modes.contains(&vk::PresentModeKHR::MAILBOX);
        Ok(if mailbox { vk::PresentModeKHR::MAILBOX } else { vk::PresentModeKHR::FIFO })
    }

    pub(crate) fn formats(
        &self,
        device: vk::PhysicalDevice,
    ) -> Result<Vec<vk::SurfaceFormatKHR>, vk::Result> {
        // SAFETY: as in `supports`.
        unsafe { self.functions.get_physical_device_surface_formats(device, self.raw) }
    }
}

impl Drop for Surface {
    fn drop(&mut self) {
        self.destroy();
    }
}
