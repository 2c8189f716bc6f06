//! What the CPU writes for the GPU every frame.

use busbar_gpu::{BindGroup, BindGroupLayout, Binding, Buffer, BufferUsage, Gpu};
use busbar_shaders::{FrameUniform, Instance};

use crate::{CameraView, RenderError};

/// Instances in one frame. Their buffer stays within the 128 MiB that every
/// Vulkan device lets a shader see.
pub const MAX_INSTANCES: usize = 1_000_000;

/// Instances that the first buffer holds.
const FIRST_CAPACITY: usize = 256;

/// The buffers of one frame in flight, and the group that binds them.
pub(crate) struct FrameStream {
    uniform: Buffer,
    instances: Buffer,
    pub(crate) group: BindGroup,
    capacity: usize,
}

impl FrameStream {
    pub(crate) fn new(gpu: &Gpu, layout: &BindGroupLayout) -> Result<Self, RenderError> {
        Self::with_capacity(gpu, layout, FIRST_CAPACITY)
    }

    fn with_capacity(
        gpu: &Gpu,
        layout: &BindGroupLayout,
        capacity: usize,
    ) -> Result<Self, RenderError> {
        let uniform_bytes = size_of::<FrameUniform>() as u64;
        let instance_bytes = (capacity * size_of::<Instance>()) as u64;
        let uniform = Buffer::new(gpu, "frame", BufferUsage::HostUniform, uniform_bytes)?;
        let instances = Buffer::new(gpu, "instances", BufferUsage::HostStorage, instance_bytes)?;
        let bindings = [Binding::Buffer(&uniform), Binding::Buffer(&instances)];
        let group = BindGroup::new(layout, &bindings)?;
        Ok(Self { uniform, instances, group, capacity })
    }

    /// Writes a frame; the last one in this stream must be finished.
    pub(crate) fn write(
        &mut self,
        gpu: &Gpu,
        layout: &BindGroupLayout,
        camera: &CameraView,
        instances: &[Instance],
    ) -> Result<(), RenderError> {
        if instances.len() > MAX_INSTANCES {
            return Err(RenderError::TooMany {
                what: "instances in one frame",
                asked: instances.len() as u64,
                limit: MAX_INSTANCES as u64,
            });
        }
        if instances.len() > self.capacity {
            let capacity = instances.len().next_power_of_two().min(MAX_INSTANCES);
            *self = Self::with_capacity(gpu, layout, capacity)?;
        }
        let uniform = FrameUniform {
            clip_from_world: camera.clip_from_world().to_cols_array_2d(),
            eye: camera.eye.extend(1.0).to_array(),
        };
        self.uniform.write(bytemuck::bytes_of(&uniform))?;
        self.instances.write(bytemuck::cast_slice(instances))?;
        Ok(())
    }
}
