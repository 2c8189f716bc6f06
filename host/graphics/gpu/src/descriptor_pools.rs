//! Descriptor pools: descriptor sets of every kind of binding.

use ash::vk;

use crate::GpuError;
use crate::error::vulkan_error;

/// Sets that one pool holds; a full pool gets a companion.
const SETS_PER_POOL: u32 = 256;

/// Pools there may be: a quarter of a million sets.
const MAX_POOLS: usize = 1024;

/// Greatest number of descriptors of each kind in one set.
pub(crate) const MAX_BINDINGS_PER_KIND: u32 = 4;

/// Kind of one binding.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BindingKind {
    /// Uniform buffer, read only.
    Uniform,
    /// A storage buffer, read only.
    Storage,
    /// A storage buffer that a compute shader writes.
    StorageWrite,
    /// Sampled image, without sampler.
    Texture,
    /// Sampler without an image.
    Sampler,
}

impl BindingKind {
    pub(crate) const ALL: [Self; 5] =
        [Self::Uniform, Self::Storage, Self::StorageWrite, Self::Texture, Self::Sampler];

    pub(crate) fn vk(self) -> vk::DescriptorType {
        match self {
            Self::Uniform => vk::DescriptorType::UNIFORM_BUFFER,
            Self::Storage | Self::StorageWrite => vk::DescriptorType::STORAGE_BUFFER,
            Self::Texture => vk::DescriptorType::SAMPLED_IMAGE,
            Self::Sampler => vk::DescriptorType::SAMPLER,
        }
    }
}

/// Pools that descriptor sets come from.
#[derive(Default)]
pub(crate) struct DescriptorPools(Vec<vk::DescriptorPool>);

impl DescriptorPools {
    pub(crate) fn allocate(
        &mut self,
        device: &ash::Device,
        layout: vk::DescriptorSetLayout,
    ) -> Result<(vk::DescriptorPool, vk::DescriptorSet), GpuError> {
        for &pool in self.0.iter().rev() {
            match allocate_from(device, pool, layout) {
                Ok(set) => return Ok((pool, set)),
                Err(vk::Result::ERROR_OUT_OF_POOL_MEMORY | vk::Result::ERROR_FRAGMENTED_POOL) => {}
                Err(code) => return Err(vulkan_error("allocation_error a bind group")(code)),
            }
        }
        if self.0.len() == MAX_POOLS {
            return Err(GpuError::OutOfMemory("too many bind groups"));
        }
        let sizes = BindingKind::ALL.map(|kind| vk::DescriptorPoolSize {
            ty: kind.vk(),
            descriptor_count: SETS_PER_POOL * MAX_BINDINGS_PER_KIND,
        });
        let info = vk::DescriptorPoolCreateInfo::default()
            .flags(vk::DescriptorPoolCreateFlags::FREE_DESCRIPTOR_SET)
            .max_sets(SETS_PER_POOL)
            .pool_sizes(&sizes);
        // SAFETY: the device lives.
        let pool = unsafe { device.create_descriptor_pool(&info, None) }
            .map_err(vulkan_error("creating a descriptor pool"))?;
        self.0.push(pool);
        let set = allocate_from(device, pool, layout)
            .map_err(vulkan_error("allocation_error a bind group"))?;
        Ok((pool, set))
    }

    /// Destroys all descriptor pools.
    ///
    /// # Safety
    /// They came from `device` and no set of theirs is in use.
    pub(crate) unsafe fn destroy(&mut self, device: &ash::Device) {
        for pool in self.0.drain(..) {
            // SAFETY: the caller's promise.
            unsafe { device.destroy_descriptor_pool(pool, None) };
        }
    }
}

fn allocate_from(
    device: &ash::Device,
    pool: vk::DescriptorPool,
    layout: vk::DescriptorSetLayout,
) -> Result<vk::DescriptorSet, vk::Result> {
    let layouts = [layout];
    let info = vk::DescriptorSetAllocateInfo::default().descriptor_pool(pool).set_layouts(&layouts);
    // SAFETY: pool and layout belong to the device; the caller holds the pools'
    // lock. One layout gives one set.
    unsafe { device.allocate_descriptor_sets(&info) }.map(|sets| sets[0])
}
