//! Device buffers and their memory.

use std::sync::{Arc, Mutex, PoisonError};

use ash::vk;
use gpu_allocator::MemoryLocation;
use gpu_allocator::vulkan::Allocation;

use crate::deferred_destruction::DiscardedObject;
use crate::device::Device;
use crate::error::vulkan_error;
use crate::{Gpu, GpuError};

/// Usage of a buffer, which decides its memory type.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BufferUsage {
    /// Vertices on the device, filled by a [`Recorder`](crate::Recorder); a storage
    /// buffer too, where it is no larger than one may be.
    Vertex,
    /// Vertices on the device that a compute shader writes.
    ComputeVertex,
    /// Words on the device, filled by a [`Recorder`](crate::Recorder), that a compute shader writes
    /// and the CPU reads back.
    ComputeReadback,
    /// 32-bit indices on the device, filled by a [`Recorder`](crate::Recorder).
    Index,
    /// Uniform on the device, filled by a [`Recorder`](crate::Recorder).
    Uniform,
    /// Storage buffer on the device, filled by a [`Recorder`](crate::Recorder).
    Storage,
    /// A uniform that the CPU writes every frame.
    HostUniform,
    /// A storage buffer that the CPU writes every frame.
    HostStorage,
    /// Vertex data that the CPU writes every frame.
    HostVertex,
    /// 32-bit indices that the CPU writes every frame.
    HostIndex,
    /// Draw calls that the CPU writes every frame.
    HostIndirect,
    /// Source of a copy to the device.
    Staging,
    /// Target of a copy to the CPU.
    Readback,
}

impl BufferUsage {
    fn flags(self) -> vk::BufferUsageFlags {
        match self {
            Self::Vertex => {
                vk::BufferUsageFlags::VERTEX_BUFFER
                    | vk::BufferUsageFlags::STORAGE_BUFFER
                    | vk::BufferUsageFlags::TRANSFER_DST
            }
            Self::ComputeVertex => {
                vk::BufferUsageFlags::VERTEX_BUFFER | vk::BufferUsageFlags::STORAGE_BUFFER
            }
            Self::ComputeReadback => {
                vk::BufferUsageFlags::STORAGE_BUFFER
                    | vk::BufferUsageFlags::TRANSFER_DST
                    | vk::BufferUsageFlags::TRANSFER_SRC
            }
            Self::Index => vk::BufferUsageFlags::INDEX_BUFFER | vk::BufferUsageFlags::TRANSFER_DST,
            Self::Uniform => {
                vk::BufferUsageFlags::UNIFORM_BUFFER | vk::BufferUsageFlags::TRANSFER_DST
            }
            Self::Storage => {
                vk::BufferUsageFlags::STORAGE_BUFFER | vk::BufferUsageFlags::TRANSFER_DST
            }
            Self::HostUniform => vk::BufferUsageFlags::UNIFORM_BUFFER,
            Self::HostStorage => vk::BufferUsageFlags::STORAGE_BUFFER,
            Self::HostVertex => vk::BufferUsageFlags::VERTEX_BUFFER,
            Self::HostIndex => vk::BufferUsageFlags::INDEX_BUFFER,
            Self::HostIndirect => vk::BufferUsageFlags::INDIRECT_BUFFER,
            Self::Staging => vk::BufferUsageFlags::TRANSFER_SRC,
            Self::Readback => vk::BufferUsageFlags::TRANSFER_DST,
        }
    }

    fn location(self) -> MemoryLocation {
        match self {
            Self::Vertex
            | Self::ComputeVertex
            | Self::ComputeReadback
            | Self::Index
            | Self::Uniform
            | Self::Storage => MemoryLocation::GpuOnly,
            Self::HostUniform
            | Self::HostStorage
            | Self::HostVertex
            | Self::HostIndex
            | Self::HostIndirect
            | Self::Staging => MemoryLocation::CpuToGpu,
            Self::Readback => MemoryLocation::GpuToCpu,
        }
    }

    /// Returns how many bytes a shader may see at once.
    fn limit(self, limits: &vk::PhysicalDeviceLimits) -> u64 {
        match self {
            Self::Uniform | Self::HostUniform => u64::from(limits.max_uniform_buffer_range),
            Self::Storage | Self::HostStorage | Self::ComputeVertex | Self::ComputeReadback => {
                u64::from(limits.max_storage_buffer_range)
            }
            _ => u64::MAX,
        }
    }
}

/// A buffer; clones share it. It lives until the GPU is done with it.
#[derive(Clone)]
pub struct Buffer(Arc<Inner>);

struct Inner {
    device: Arc<Device>,
    raw: vk::Buffer,
    allocation: Mutex<Option<Allocation>>,
    size: u64,
    usage: BufferUsage,
}

impl Buffer {
    /// Makes a buffer of `size` bytes, at least 1.
    ///
    /// # Errors
    /// When memory runs out or a shader could not see so many bytes.
    pub fn new(
        gpu: &Gpu,
        name: &'static str,
        usage: BufferUsage,
        size: u64,
    ) -> Result<Self, GpuError> {
        Self::on(gpu.device(), name, usage, size)
    }

    pub(crate) fn on(
        device: &Arc<Device>,
        name: &'static str,
        usage: BufferUsage,
        size: u64,
    ) -> Result<Self, GpuError> {
        let limit = usage.limit(&device.adapter.limits);
        if size > limit {
            return Err(GpuError::TooLarge { what: name, asked: size, limit });
        }
        let size = size.max(1);
        let info = vk::BufferCreateInfo::default()
            .size(size)
            .usage(usage.flags())
            .sharing_mode(vk::SharingMode::EXCLUSIVE);
        // SAFETY: the device lives; the size is not zero.
        let raw = unsafe { device.raw.create_buffer(&info, None) }.map_err(vulkan_error(name))?;
        device.name(raw, name);
        let buffer = Self(Arc::new(Inner {
            device: Arc::clone(device),
            raw,
            allocation: Mutex::default(),
            size,
            usage,
        }));
        buffer.bind(name)?;
        Ok(buffer)
    }

    fn bind(&self, name: &'static str) -> Result<(), GpuError> {
        let Inner { device, raw, usage, .. } = &*self.0;
        // SAFETY: the buffer was just made from this device.
        let requirements = unsafe { device.raw.get_buffer_memory_requirements(*raw) };
        let allocation = device.allocate(name, requirements, usage.location(), true)?;
        // SAFETY: the memory meets the buffer's requirements and is its alone.
        let bound = unsafe {
            device.raw.bind_buffer_memory(*raw, allocation.memory(), allocation.offset())
        };
        *self.allocation() = Some(allocation);
        bound.map_err(vulkan_error(name))
    }

    fn allocation(&self) -> std::sync::MutexGuard<'_, Option<Allocation>> {
        self.0.allocation.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Writes at the start of a buffer that the CPU can see. The GPU must not
    /// be reading it: write after the frame began that last used it.
    ///
    /// # Errors
    /// When the bytes do not fit or the buffer is on the device.
    pub fn write(&self, bytes: &[u8]) -> Result<(), GpuError> {
        self.write_at(0, bytes)
    }

    /// Writes from an offset on, like [`Buffer::write`].
    pub(crate) fn write_at(&self, start: usize, bytes: &[u8]) -> Result<(), GpuError> {
        self.write_with(start as u64, bytes.len() as u64, |into| into.copy_from_slice(bytes))
    }

    /// Passes a range of the buffer to `write`, under the rules of [`Buffer::write`].
    ///
    /// # Errors
    /// Returns the errors of [`Buffer::write`].
    pub fn write_with(
        &self,
        start: u64,
        bytes: u64,
        write: impl FnOnce(&mut [u8]),
    ) -> Result<(), GpuError> {
        let range = start as usize..start.saturating_add(bytes) as usize;
        let mut allocation = self.allocation();
        let memory = allocation.as_mut().and_then(Allocation::mapped_slice_mut);
        let place = memory.and_then(|memory| memory.get_mut(range));
        write(place.ok_or(GpuError::Misuse("a write that does not fit its buffer"))?);
        Ok(())
    }

    /// Has a range read as the processor sees it.
    pub(crate) fn read_with(
        &self,
        range: std::ops::Range<u64>,
        read: impl FnOnce(&[u8]),
    ) -> Result<(), GpuError> {
        let is_host_visible = self.is_host_visible();
        let allocation = self.allocation();
        let memory =
            allocation.as_ref().filter(|_| is_host_visible).and_then(Allocation::mapped_slice);
        let place = memory.and_then(|memory| memory.get(range.start as usize..range.end as usize));
        read(place.ok_or(GpuError::Misuse("a read of what is out of sight"))?);
        Ok(())
    }

    /// Reports whether the processor writes to the memory directly. Software rasterizers and
    /// unified memory allow it.
    pub(crate) fn is_host_visible(&self) -> bool {
        let is_coherent = |allocation: &Allocation| {
            let properties = allocation.memory_properties();
            properties.contains(vk::MemoryPropertyFlags::HOST_COHERENT)
                && allocation.mapped_ptr().is_some()
        };
        self.allocation().as_ref().is_some_and(is_coherent)
    }

    /// Returns the bytes that [`Recorder::download_buffer`](crate::Recorder::download_buffer)
    /// copied, once its recorder was submitted and waited for.
    ///
    /// # Errors
    /// When the buffer is on the device.
    pub fn contents(&self) -> Result<Vec<u8>, GpuError> {
        self.read()
    }

    pub(crate) fn read(&self) -> Result<Vec<u8>, GpuError> {
        let mut bytes = Vec::new();
        self.read_whole_with(|contents| bytes.extend_from_slice(contents))?;
        Ok(bytes)
    }

    /// Passes the copied contents to `read`.
    pub(crate) fn read_whole_with(&self, read: impl FnOnce(&[u8])) -> Result<(), GpuError> {
        let allocation = self.allocation();
        let memory = allocation.as_ref().and_then(Allocation::mapped_slice);
        let contents = memory.and_then(|memory| memory.get(..self.0.size as usize));
        read(contents.ok_or(GpuError::Misuse("a read from a buffer on the device"))?);
        Ok(())
    }

    /// Returns the size in bytes.
    pub fn size(&self) -> u64 {
        self.0.size
    }

    /// Reports whether a shader can see so many bytes of it as a storage buffer.
    pub(crate) fn can_be_storage(&self, bytes: u64) -> bool {
        let Inner { device, usage, .. } = &*self.0;
        let is_storage = usage.flags().contains(vk::BufferUsageFlags::STORAGE_BUFFER);
        is_storage && bytes <= u64::from(device.adapter.limits.max_storage_buffer_range)
    }

    pub(crate) fn raw(&self) -> vk::Buffer {
        self.0.raw
    }

    pub(crate) fn usage(&self) -> BufferUsage {
        self.0.usage
    }
}

impl Drop for Inner {
    fn drop(&mut self) {
        let allocation = self.allocation.get_mut().unwrap_or_else(PoisonError::into_inner).take();
        self.device.discard(DiscardedObject::Buffer(self.raw, allocation));
    }
}
