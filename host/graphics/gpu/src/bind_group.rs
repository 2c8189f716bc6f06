//! Bind groups (descriptor sets): buffers, textures and samplers that shaders read.

use std::sync::{Arc, PoisonError};

use ash::vk;

use crate::deferred_destruction::DiscardedObject;
use crate::descriptor_pools::{BindingKind, MAX_BINDINGS_PER_KIND};
use crate::device::Device;
use crate::error::vulkan_error;
use crate::{Buffer, BufferSlice, BufferUsage, Gpu, GpuError, Image, ImageKind, Sampler};

/// The stages there are.
const STAGES: vk::ShaderStageFlags = vk::ShaderStageFlags::from_raw(
    vk::ShaderStageFlags::VERTEX.as_raw()
        | vk::ShaderStageFlags::FRAGMENT.as_raw()
        | vk::ShaderStageFlags::COMPUTE.as_raw(),
);

/// One resource to bind.
#[derive(Clone, Copy)]
pub enum Binding<'a> {
    /// A whole uniform or storage buffer.
    Buffer(&'a Buffer),
    /// A part of a buffer, as a storage buffer.
    BufferSlice(&'a BufferSlice),
    /// A texture that has been uploaded, or a target that is sampled after its pass.
    Texture(&'a Image),
    /// Sampler without an image.
    Sampler(&'a Sampler),
}

/// Binding kinds of a group, numbered from 0; clones share the layout.
#[derive(Clone)]
pub struct BindGroupLayout(Arc<LayoutInner>);

struct LayoutInner {
    device: Arc<Device>,
    raw: vk::DescriptorSetLayout,
    kinds: Vec<BindingKind>,
}

impl BindGroupLayout {
    /// Makes a layout; every binding is visible to all shader stages.
    ///
    /// # Errors
    /// When there are too many bindings of a kind, or memory runs out.
    pub fn new(gpu: &Gpu, kinds: &[BindingKind]) -> Result<Self, GpuError> {
        let count = |kind| kinds.iter().filter(|&&k| k == kind).count();
        if BindingKind::ALL.into_iter().any(|kind| count(kind) > MAX_BINDINGS_PER_KIND as usize) {
            return Err(GpuError::Misuse("a bind group with too many bindings"));
        }
        let bindings: Vec<_> = (0..)
            .zip(kinds)
            .map(|(index, kind)| {
                vk::DescriptorSetLayoutBinding::default()
                    .binding(index)
                    .descriptor_type(kind.vk())
                    .descriptor_count(1)
                    .stage_flags(STAGES)
            })
            .collect();
        let info = vk::DescriptorSetLayoutCreateInfo::default().bindings(&bindings);
        let device = Arc::clone(gpu.device());
        // SAFETY: the device lives.
        let raw = unsafe { device.raw.create_descriptor_set_layout(&info, None) }
            .map_err(vulkan_error("creating a bind group layout"))?;
        device.name(raw, "bind group layout");
        Ok(Self(Arc::new(LayoutInner { device, raw, kinds: kinds.to_vec() })))
    }

    pub(crate) fn raw(&self) -> vk::DescriptorSetLayout {
        self.0.raw
    }
}

impl Drop for LayoutInner {
    fn drop(&mut self) {
        self.device.discard(DiscardedObject::DescriptorSetLayout(self.raw));
    }
}

/// Resources bound together. Keeps them alive.
pub struct BindGroup {
    layout: BindGroupLayout,
    pool: vk::DescriptorPool,
    raw: vk::DescriptorSet,
    _kept: Vec<HeldResource>,
}

/// Held, never read: the set refers to them.
enum HeldResource {
    Buffer(#[expect(dead_code, reason = "held")] Buffer),
    BufferSlice(#[expect(dead_code, reason = "held")] BufferSlice),
    Image(#[expect(dead_code, reason = "held")] Image),
    Sampler(#[expect(dead_code, reason = "held")] Sampler),
}

impl BindGroup {
    /// Binds resources in the layout's order.
    ///
    /// # Errors
    /// When they are not what the layout asks for, or memory runs out.
    pub fn new(layout: &BindGroupLayout, bindings: &[Binding<'_>]) -> Result<Self, GpuError> {
        let device = &layout.0.device;
        let fits = layout.0.kinds.len() == bindings.len()
            && layout.0.kinds.iter().zip(bindings).all(|(kind, binding)| binding.fits(*kind));
        if !fits {
            return Err(GpuError::Misuse("a bind group that does not fit its layout"));
        }
        let (pool, raw) = device
            .pools
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .allocate(&device.raw, layout.raw())?;
        device.name(raw, "bind group");
        let kept = bindings.iter().map(Binding::hold).collect();
        let group = Self { layout: layout.clone(), pool, raw, _kept: kept };
        for (index, binding) in (0..).zip(bindings) {
            group.bind(index, layout.0.kinds[index as usize], binding);
        }
        Ok(group)
    }

    fn bind(&self, index: u32, kind: BindingKind, binding: &Binding<'_>) {
        let mut buffer = vk::DescriptorBufferInfo::default().range(vk::WHOLE_SIZE);
        let mut image = vk::DescriptorImageInfo::default()
            .image_layout(vk::ImageLayout::SHADER_READ_ONLY_OPTIMAL);
        match binding {
            Binding::Buffer(bound) => buffer.buffer = bound.raw(),
            Binding::BufferSlice(bound) => {
                buffer = vk::DescriptorBufferInfo::default()
                    .buffer(bound.buffer().raw())
                    .offset(bound.offset())
                    .range(bound.size());
            }
            Binding::Texture(bound) => image.image_view = bound.view(),
            Binding::Sampler(bound) => image.sampler = bound.raw(),
        }
        let mut write = vk::WriteDescriptorSet::default()
            .dst_set(self.raw)
            .dst_binding(index)
            .descriptor_type(kind.vk());
        let (buffers, images) = ([buffer], [image]);
        write = match binding {
            Binding::Buffer(_) | Binding::BufferSlice(_) => write.buffer_info(&buffers),
            Binding::Texture(_) | Binding::Sampler(_) => write.image_info(&images),
        };
        // SAFETY: the set is new, so nothing uses it; the kinds were checked.
        unsafe { self.layout.0.device.raw.update_descriptor_sets(&[write], &[]) };
    }

    pub(crate) fn raw(&self) -> vk::DescriptorSet {
        self.raw
    }

    pub(crate) fn layout(&self) -> vk::DescriptorSetLayout {
        self.layout.raw()
    }
}

impl Drop for BindGroup {
    fn drop(&mut self) {
        self.layout.0.device.discard(DiscardedObject::DescriptorSet(self.pool, self.raw));
    }
}

impl Binding<'_> {
    fn fits(&self, kind: BindingKind) -> bool {
        match (self, kind) {
            (Self::Buffer(buffer), BindingKind::Uniform) => {
                matches!(buffer.usage(), BufferUsage::Uniform | BufferUsage::HostUniform)
            }
            (Self::Buffer(buffer), BindingKind::Storage) => buffer.can_be_storage(buffer.size()),
            (Self::BufferSlice(slice), BindingKind::Storage) => {
                slice.size() > 0 && slice.buffer().can_be_storage(slice.size())
            }
            (Self::Buffer(buffer), BindingKind::StorageWrite) => {
                matches!(buffer.usage(), BufferUsage::ComputeVertex | BufferUsage::ComputeReadback)
            }
            (Self::Texture(image), BindingKind::Texture) => {
                !matches!(image.kind(), ImageKind::Target { .. })
            }
            (Self::Sampler(_), BindingKind::Sampler) => true,
            _ => false,
        }
    }

    fn hold(&self) -> HeldResource {
        match self {
            Self::Buffer(buffer) => HeldResource::Buffer((*buffer).clone()),
            Self::BufferSlice(slice) => HeldResource::BufferSlice((*slice).clone()),
            Self::Texture(image) => HeldResource::Image((*image).clone()),
            Self::Sampler(sampler) => HeldResource::Sampler((*sampler).clone()),
        }
    }
}
