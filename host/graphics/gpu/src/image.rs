//! Device images, their views and memory.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use ash::vk;
use gpu_allocator::MemoryLocation;
use gpu_allocator::vulkan::Allocation;

use crate::deferred_destruction::DiscardedObject;
use crate::device::Device;
use crate::error::vulkan_error;
use crate::format::sample_flag;
use crate::{Format, Gpu, GpuError};

/// Kind of an image, which decides its usage flags.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ImageKind {
    /// Sampled by shaders, with all its smaller levels.
    Texture,
    /// Sampled by shaders, in its own size alone.
    FlatTexture,
    /// Drawn into, with this many samples a pixel, and perhaps copied, either way.
    Target {
        /// Samples a pixel, 1 or 4.
        samples: u32,
    },
    /// Drawn into, one sample a pixel, and then sampled by shaders; depth is perhaps read back.
    SampledTarget,
}

/// An image to make.
#[derive(Clone, Copy, Debug)]
pub struct ImageDescription {
    /// Name shown in messages.
    pub name: &'static str,
    /// Kind of the image.
    pub kind: ImageKind,
    /// Format of its pixels.
    pub format: Format,
    /// Width and height in pixels, at least 1.
    pub size: [u32; 2],
}

/// An image; clones share it. It lives until the GPU is done with it.
#[derive(Clone)]
pub struct Image(Arc<Inner>);

struct Inner {
    device: Arc<Device>,
    raw: vk::Image,
    view: vk::ImageView,
    undecoded_view: Option<vk::ImageView>,
    allocation: Option<Allocation>,
    description: ImageDescription,
    levels: u32,
    usage: Mutex<ImageUse>,
}

/// Last use of an image by the GPU; decides the next barrier.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum ImageUse {
    Undefined,
    ColorTarget,
    DepthTarget,
    /// Gets the depth of a pass with several samples a pixel.
    DepthResolve,
    CopySource,
    CopyTarget,
    Sampled,
}

impl ImageUse {
    pub(crate) fn layout(self) -> vk::ImageLayout {
        match self {
            Self::Undefined => vk::ImageLayout::UNDEFINED,
            Self::ColorTarget => vk::ImageLayout::COLOR_ATTACHMENT_OPTIMAL,
            Self::DepthTarget | Self::DepthResolve => vk::ImageLayout::DEPTH_ATTACHMENT_OPTIMAL,
            Self::CopySource => vk::ImageLayout::TRANSFER_SRC_OPTIMAL,
            Self::CopyTarget => vk::ImageLayout::TRANSFER_DST_OPTIMAL,
            Self::Sampled => vk::ImageLayout::SHADER_READ_ONLY_OPTIMAL,
        }
    }

    pub(crate) fn stages(self) -> vk::PipelineStageFlags2 {
        match self {
            // What ran before on an image whose content is given up is unknown.
            Self::Undefined => vk::PipelineStageFlags2::ALL_COMMANDS,
            // Depth, too, is resolved at the colours' stage (Vulkan specification, "Render Pass
            // Multisample Resolve Operations").
            Self::ColorTarget | Self::DepthResolve => {
                vk::PipelineStageFlags2::COLOR_ATTACHMENT_OUTPUT
            }
            Self::DepthTarget => {
                vk::PipelineStageFlags2::EARLY_FRAGMENT_TESTS
                    | vk::PipelineStageFlags2::LATE_FRAGMENT_TESTS
            }
            Self::CopySource | Self::CopyTarget => vk::PipelineStageFlags2::ALL_TRANSFER,
            Self::Sampled => vk::PipelineStageFlags2::FRAGMENT_SHADER,
        }
    }

    pub(crate) fn access(self) -> vk::AccessFlags2 {
        match self {
            Self::Undefined => vk::AccessFlags2::MEMORY_WRITE,
            Self::ColorTarget | Self::DepthResolve => {
                vk::AccessFlags2::COLOR_ATTACHMENT_WRITE | vk::AccessFlags2::COLOR_ATTACHMENT_READ
            }
            Self::DepthTarget => {
                vk::AccessFlags2::DEPTH_STENCIL_ATTACHMENT_WRITE
                    | vk::AccessFlags2::DEPTH_STENCIL_ATTACHMENT_READ
            }
            Self::CopySource => vk::AccessFlags2::TRANSFER_READ,
            Self::CopyTarget => vk::AccessFlags2::TRANSFER_WRITE,
            Self::Sampled => vk::AccessFlags2::SHADER_SAMPLED_READ,
        }
    }
}

impl ImageKind {
    fn usage(self, format: Format) -> vk::ImageUsageFlags {
        match self {
            Self::Texture => {
                vk::ImageUsageFlags::SAMPLED
                    | vk::ImageUsageFlags::TRANSFER_DST
                    | vk::ImageUsageFlags::TRANSFER_SRC
            }
            Self::FlatTexture => vk::ImageUsageFlags::SAMPLED | vk::ImageUsageFlags::TRANSFER_DST,
            Self::Target { .. } if format == Format::Depth32 => {
                vk::ImageUsageFlags::DEPTH_STENCIL_ATTACHMENT
            }
            Self::Target { samples: 1 } => {
                vk::ImageUsageFlags::COLOR_ATTACHMENT
                    | vk::ImageUsageFlags::TRANSFER_SRC
                    | vk::ImageUsageFlags::TRANSFER_DST
            }
            Self::SampledTarget if format == Format::Depth32 => {
                vk::ImageUsageFlags::SAMPLED
                    | vk::ImageUsageFlags::DEPTH_STENCIL_ATTACHMENT
                    | vk::ImageUsageFlags::TRANSFER_SRC
            }
            Self::SampledTarget => {
                vk::ImageUsageFlags::SAMPLED | vk::ImageUsageFlags::COLOR_ATTACHMENT
            }
            Self::Target { .. } => vk::ImageUsageFlags::COLOR_ATTACHMENT,
        }
    }

    fn samples(self) -> u32 {
        match self {
            Self::Texture | Self::FlatTexture | Self::SampledTarget => 1,
            Self::Target { samples } => samples,
        }
    }
}

/// Levels down to one pixel.
fn level_count([width, height]: [u32; 2]) -> u32 {
    u32::BITS - width.max(height).leading_zeros()
}

impl Image {
    /// Makes an image with undefined content.
    ///
    /// # Errors
    /// When it is empty, too large for the device, or memory runs out.
    pub fn new(gpu: &Gpu, description: ImageDescription) -> Result<Self, GpuError> {
        Self::on(gpu.device(), description)
    }

    pub(crate) fn on(
        device: &Arc<Device>,
        description: ImageDescription,
    ) -> Result<Self, GpuError> {
        let ImageDescription { name, kind, format, size: [width, height] } = description;
        let limit = device.adapter.limits.max_image_dimension2_d;
        let largest = width.max(height);
        if largest > limit {
            return Err(GpuError::TooLarge {
                what: name,
                asked: u64::from(largest),
                limit: u64::from(limit),
            });
        }
        if width == 0 || height == 0 {
            return Err(GpuError::Misuse("an image without pixels"));
        }
        let levels = match kind {
            ImageKind::Texture => level_count(description.size),
            _ => 1,
        };
        // A picture gets a second view, for drawing without decoding.
        let undecoded = format.undecoded().filter(|_| kind != ImageKind::Texture);
        let flags = match undecoded {
            Some(_) => vk::ImageCreateFlags::MUTABLE_FORMAT,
            None => vk::ImageCreateFlags::empty(),
        };
        let info = vk::ImageCreateInfo::default()
            .flags(flags)
            .image_type(vk::ImageType::TYPE_2D)
            .format(format.vk())
            .extent(vk::Extent3D { width, height, depth: 1 })
            .mip_levels(levels)
            .array_layers(1)
            .samples(sample_flag(kind.samples()))
            .tiling(vk::ImageTiling::OPTIMAL)
            .usage(kind.usage(format))
            .sharing_mode(vk::SharingMode::EXCLUSIVE)
            .initial_layout(vk::ImageLayout::UNDEFINED);
        // SAFETY: size, samples and format are within the device's abilities.
        let raw = unsafe { device.raw.create_image(&info, None) }.map_err(vulkan_error(name))?;
        device.name(raw, name);
        // Owns what is made from here on, so that a failure frees it.
        let mut inner = Inner {
            device: Arc::clone(device),
            raw,
            view: vk::ImageView::null(),
            undecoded_view: None,
            allocation: None,
            description,
            levels,
            usage: Mutex::new(ImageUse::Undefined),
        };
        inner.bind()?;
        inner.view = inner.make_view(format.vk())?;
        inner.undecoded_view = undecoded.map(|format| inner.make_view(format.vk())).transpose()?;
        Ok(Self(Arc::new(inner)))
    }

    /// Returns width and height in pixels.
    pub fn size(&self) -> [u32; 2] {
        self.0.description.size
    }

    pub(crate) fn name(&self) -> &'static str {
        self.0.description.name
    }

    /// Returns the pixel format.
    pub fn format(&self) -> Format {
        self.0.description.format
    }

    /// Returns the colour or depth of one level.
    pub(crate) fn layers(&self, mip_level: u32) -> vk::ImageSubresourceLayers {
        vk::ImageSubresourceLayers {
            aspect_mask: self.format().aspect(),
            mip_level,
            base_array_layer: 0,
            layer_count: 1,
        }
    }

    pub(crate) fn raw(&self) -> vk::Image {
        self.0.raw
    }

    pub(crate) fn view(&self) -> vk::ImageView {
        self.0.view
    }

    pub(crate) fn undecoded_view(&self) -> Option<vk::ImageView> {
        self.0.undecoded_view
    }

    pub(crate) fn levels(&self) -> u32 {
        self.0.levels
    }

    pub(crate) fn kind(&self) -> ImageKind {
        self.0.description.kind
    }

    pub(crate) fn samples(&self) -> u32 {
        self.kind().samples()
    }

    pub(crate) fn usage(&self) -> MutexGuard<'_, ImageUse> {
        self.0.usage.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Inner {
    fn bind(&mut self) -> Result<(), GpuError> {
        let name = self.description.name;
        // SAFETY: the image was just made from this device.
        let requirements = unsafe { self.device.raw.get_image_memory_requirements(self.raw) };
        let allocation =
            self.device.allocate(name, requirements, MemoryLocation::GpuOnly, false)?;
        let (memory, offset) = {
            // SAFETY: read only to bind, below.
            (unsafe { allocation.memory() }, allocation.offset())
        };
        self.allocation = Some(allocation);
        // SAFETY: the memory meets the image's requirements and is its alone.
        unsafe { self.device.raw.bind_image_memory(self.raw, memory, offset) }
            .map_err(vulkan_error(name))
    }

    fn make_view(&self, format: vk::Format) -> Result<vk::ImageView, GpuError> {
        let info = vk::ImageViewCreateInfo::default()
            .image(self.raw)
            .view_type(vk::ImageViewType::TYPE_2D)
            .format(format)
            .subresource_range(vk::ImageSubresourceRange {
                aspect_mask: self.description.format.aspect(),
                base_mip_level: 0,
                level_count: self.levels,
                base_array_layer: 0,
                layer_count: 1,
            });
        // SAFETY: the image lives and is bound; its format is this one or it is
        // mutable.
        let view = unsafe { self.device.raw.create_image_view(&info, None) }
            .map_err(vulkan_error(self.description.name))?;
        self.device.name(view, self.description.name);
        Ok(view)
    }
}

impl Drop for Inner {
    fn drop(&mut self) {
        let mut views: Vec<_> = self.undecoded_view.into_iter().collect();
        views.push(self.view);
        let allocation = self.allocation.take();
        self.device.discard(DiscardedObject::Image { image: self.raw, views, allocation });
    }
}
