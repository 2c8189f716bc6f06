//! Pixel formats of images.

use ash::vk;

/// Pixel format of an image.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Format {
    /// Four bytes, sRGB colour and linear alpha.
    Rgba8Srgb,
    /// Four bytes, sRGB colour and linear alpha, red and blue swapped, as most windows need it.
    Bgra8Srgb,
    /// Four bytes, all linear.
    Rgba8Linear,
    /// Four bytes, all linear, red and blue swapped.
    Bgra8Linear,
    /// One unsigned 32-bit integer.
    R32Uint,
    /// Two 16-bit floats per pixel.
    Rg16Float,
    /// Depth as a 32-bit float.
    Depth32,
}

impl Format {
    pub(crate) fn vk(self) -> vk::Format {
        match self {
            Self::Rgba8Srgb => vk::Format::R8G8B8A8_SRGB,
            Self::Bgra8Srgb => vk::Format::B8G8R8A8_SRGB,
            Self::Rgba8Linear => vk::Format::R8G8B8A8_UNORM,
            Self::Bgra8Linear => vk::Format::B8G8R8A8_UNORM,
            Self::R32Uint => vk::Format::R32_UINT,
            Self::Rg16Float => vk::Format::R16G16_SFLOAT,
            Self::Depth32 => vk::Format::D32_SFLOAT,
        }
    }

    /// Returns the format of the same bytes without sRGB decoding; `None` for linear formats.
    pub fn undecoded(self) -> Option<Self> {
        match self {
            Self::Rgba8Srgb => Some(Self::Rgba8Linear),
            Self::Bgra8Srgb => Some(Self::Bgra8Linear),
            _ => None,
        }
    }

    /// Returns the picture format whose bytes a swapchain format takes unchanged.
    pub(crate) fn from_swapchain(format: vk::Format) -> Option<Self> {
        match format {
            vk::Format::R8G8B8A8_UNORM | vk::Format::R8G8B8A8_SRGB => Some(Self::Rgba8Srgb),
            vk::Format::B8G8R8A8_UNORM | vk::Format::B8G8R8A8_SRGB => Some(Self::Bgra8Srgb),
            _ => None,
        }
    }

    pub(crate) fn aspect(self) -> vk::ImageAspectFlags {
        match self {
            Self::Depth32 => vk::ImageAspectFlags::DEPTH,
            _ => vk::ImageAspectFlags::COLOR,
        }
    }
}

/// Returns the Vulkan flag of a sample count.
pub(crate) fn sample_flag(samples: u32) -> vk::SampleCountFlags {
    vk::SampleCountFlags::from_raw(samples)
}

/// Bytes of one pixel: all formats have four.
pub(crate) const PIXEL_BYTES: u64 = 4;
