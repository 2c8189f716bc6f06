//! GPU errors, their messages, and the action that may help.

use ash::vk;
use thiserror::Error;

/// A failure of Vulkan or of the machine under it.
#[derive(Debug, Error)]
pub enum GpuError {
    /// Missing Vulkan loader, with the system's message.
    #[error(
        "no Vulkan loader on this machine ({0}): install the packages libvulkan1 and \
         mesa-vulkan-drivers, or the graphics vendor's driver"
    )]
    NoLoader(String),
    /// A loader without a driver.
    #[error(
        "Vulkan has no driver on this machine ({0}): install the package mesa-vulkan-drivers or \
         the graphics vendor's driver, and see that VK_DRIVER_FILES and VK_ICD_FILENAMES, if set, \
         name existing files"
    )]
    NoDriver(String),
    /// The validation layer was asked for and is missing.
    #[error(
        "the Vulkan validation layer {0} is not installed: install the package \
         vulkan-validationlayers, or turn validation off"
    )]
    NoValidationLayer(&'static str),
    /// Drivers, but none that can draw this.
    #[error(
        "no Vulkan device can draw this; {0}: update the graphics driver, or install \
         mesa-vulkan-drivers for drawing in software"
    )]
    NoDevice(String),
    /// Missing device that a setting asks for.
    #[error(
        "{place} asks for the Vulkan device \"{wanted}\", but there are: {available}; give a part \
         of one of these names, or its number, or nothing for the best"
    )]
    NoSuchDevice {
        /// Place of the setting.
        place: &'static str,
        /// Name or number asked for.
        wanted: String,
        /// Numbers and names of the devices.
        available: String,
    },
    /// The window system gave no usable handle or surface.
    #[error("the window cannot be drawn into: {0}")]
    Window(String),
    /// Exhausted device or host memory.
    #[error(
        "the GPU is out of memory ({0}): show fewer or smaller models and textures, raise theta, \
         or make the window smaller"
    )]
    OutOfMemory(&'static str),
    /// The device is gone.
    #[error(
        "the GPU stopped working ({0}): the driver was reset or the device removed; open the \
         view again, and update the driver if it happens often"
    )]
    DeviceLost(&'static str),
    /// Work did not finish in time.
    #[error("the GPU did not finish within {millis} ms ({what}): it hangs or is overloaded")]
    Timeout {
        /// Work that was waited for.
        what: &'static str,
        /// Time waited, in milliseconds.
        millis: u64,
    },
    /// More than a limit allows.
    #[error("{what} is {asked}, but at most {limit} is possible")]
    TooLarge {
        /// Quantity that is too large.
        what: &'static str,
        /// Amount that was asked for.
        asked: u64,
        /// Greatest amount that is possible.
        limit: u64,
    },
    /// Misuse of this crate's interface.
    #[error("the renderer used the GPU wrongly: {0}; please report this")]
    Misuse(&'static str),
    /// Any other Vulkan error.
    #[error("Vulkan failed at {what}: {code}")]
    Vulkan {
        /// Operation that was tried.
        what: &'static str,
        /// Result code of Vulkan.
        code: String,
    },
}

/// Action that may help against a failure of the GPU.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RecoveryAction {
    /// Giving memory back, then trying once more.
    FreeMemory,
    /// A new device, with everything on it uploaded again.
    RecreateDevice,
    /// No action: the request was impossible.
    None,
}

impl GpuError {
    /// Returns the action that may help against this error.
    pub fn recovery_action(&self) -> RecoveryAction {
        match self {
            Self::OutOfMemory(_) => RecoveryAction::FreeMemory,
            Self::DeviceLost(_) | Self::Vulkan { .. } => RecoveryAction::RecreateDevice,
            _ => RecoveryAction::None,
        }
    }
}

/// Makes the error of a failed Vulkan call: `call.map_err(vulkan_error("..."))?`.
pub(crate) fn vulkan_error(what: &'static str) -> impl Fn(vk::Result) -> GpuError {
    move |code| match code {
        vk::Result::ERROR_OUT_OF_HOST_MEMORY
        | vk::Result::ERROR_OUT_OF_DEVICE_MEMORY
        | vk::Result::ERROR_OUT_OF_POOL_MEMORY
        | vk::Result::ERROR_FRAGMENTED_POOL
        | vk::Result::ERROR_FRAGMENTATION
        | vk::Result::ERROR_MEMORY_MAP_FAILED => GpuError::OutOfMemory(what),
        vk::Result::ERROR_DEVICE_LOST => GpuError::DeviceLost(what),
        code => GpuError::Vulkan { what, code: code.to_string() },
    }
}

/// Makes the error of a failed allocation by gpu-allocator.
pub(crate) fn allocation_error(
    what: &'static str,
) -> impl Fn(gpu_allocator::AllocationError) -> GpuError {
    move |error| match error {
        // All that Vulkan answers to vkAllocateMemory and vkMapMemory.
        gpu_allocator::AllocationError::OutOfMemory
        | gpu_allocator::AllocationError::FailedToMap(_)
        | gpu_allocator::AllocationError::Internal(_) => GpuError::OutOfMemory(what),
        error => GpuError::Vulkan { what, code: error.to_string() },
    }
}
