//! Deferred destruction of Vulkan objects until the GPU is done with them.

use std::ops::Range;
use std::sync::Weak;

use ash::vk;
use gpu_allocator::vulkan::{Allocation, Allocator};

use crate::free_ranges::FreeRanges;

/// Vulkan object that waits for destruction.
pub(crate) enum DiscardedObject {
    Buffer(vk::Buffer, Option<Allocation>),
    Image {
        image: vk::Image,
        views: Vec<vk::ImageView>,
        allocation: Option<Allocation>,
    },
    Sampler(vk::Sampler),
    DescriptorSet(vk::DescriptorPool, vk::DescriptorSet),
    DescriptorSetLayout(vk::DescriptorSetLayout),
    Pipeline(vk::Pipeline, vk::PipelineLayout),
    /// Bytes of a block, which may be gone.
    Range(Weak<FreeRanges>, Range<u64>),
}

impl DiscardedObject {
    /// Destroys the Vulkan object.
    ///
    /// # Safety
    /// It belongs to `device`, no submitted or recorded work uses it, and the
    /// caller alone touches its descriptor pool meanwhile.
    pub(crate) unsafe fn destroy(self, device: &ash::Device, allocator: &mut Allocator) {
        // SAFETY: the caller's promise is what each of these calls asks for.
        let allocation = unsafe {
            match self {
                Self::Buffer(buffer, allocation) => {
                    device.destroy_buffer(buffer, None);
                    allocation
                }
                Self::Image { image, views, allocation } => {
                    for view in views {
                        device.destroy_image_view(view, None);
                    }
                    device.destroy_image(image, None);
                    allocation
                }
                Self::Sampler(sampler) => {
                    device.destroy_sampler(sampler, None);
                    None
                }
                Self::DescriptorSet(pool, set) => {
                    // Cannot fail (Vulkan specification, vkFreeDescriptorSets).
                    let _ = device.free_descriptor_sets(pool, &[set]);
                    None
                }
                Self::DescriptorSetLayout(layout) => {
                    device.destroy_descriptor_set_layout(layout, None);
                    None
                }
                Self::Pipeline(pipeline, layout) => {
                    device.destroy_pipeline(pipeline, None);
                    device.destroy_pipeline_layout(layout, None);
                    None
                }
                Self::Range(free, range) => {
                    if let Some(free) = free.upgrade() {
                        free.release(range);
                    }
                    None
                }
            }
        };
        if let Some(allocation) = allocation
            && let Err(error) = allocator.free(allocation)
        {
            tracing::error!(%error, "freeing GPU memory");
        }
    }
}
