//! Logical device: queue, memory, timeline semaphore of submissions, and deferred destruction.

use std::ffi::CString;
use std::mem::ManuallyDrop;
use std::path::Path;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use ash::{ext, khr, vk};
use gpu_allocator::vulkan::{
    Allocation, AllocationCreateDesc, AllocationScheme, Allocator, AllocatorCreateDesc,
};
use gpu_allocator::{AllocationSizes, MemoryLocation};

use crate::GpuError;
use crate::adapter::Adapter;
use crate::deferred_destruction::DiscardedObject;
use crate::descriptor_pools::DescriptorPools;
use crate::error::{allocation_error, vulkan_error};
use crate::instance::Instance;
use crate::pipeline_cache::PipelineCache;

/// Time that submitted work may take before it counts as hung, milliseconds. A software rasterizer
/// on a busy machine is slow, not hung.
const MAX_WAIT_MILLIS: u64 = 30_000;

/// Attempts at a wait for which the driver lacks memory: nothing can be taken
/// apart before it.
const MAX_WAIT_TRIES: u32 = 3;

/// Block sizes of memory taken from the driver. Small, because software rasterizers take them out
/// of host memory.
const DEVICE_BLOCK_BYTES: u64 = 64 << 20;
const HOST_BLOCK_BYTES: u64 = 16 << 20;

/// Device with everything shared by the objects made from it.
pub(crate) struct Device {
    pub(crate) raw: ash::Device,
    pub(crate) queue: vk::Queue,
    pub(crate) adapter: Adapter,
    /// Taken in `drop`, before the device goes.
    allocator: ManuallyDrop<Mutex<Allocator>>,
    pub(crate) pools: Mutex<DescriptorPools>,
    timeline: vk::Semaphore,
    compiled: Mutex<PipelineCache>,
    submitted: AtomicU64,
    /// A wait ran out of time.
    hung: AtomicBool,
    discarded: Mutex<Vec<(u64, DiscardedObject)>>,
    names: Option<ext::debug_utils::Device>,
    pub(crate) instance: Arc<Instance>,
}

impl Device {
    pub(crate) fn open(
        instance: Arc<Instance>,
        adapter: Adapter,
        presents: bool,
        compiled: Option<&Path>,
    ) -> Result<Arc<Self>, GpuError> {
        let raw = create(&instance, &adapter, presents)?;
        let made = DeviceParts::new(&instance, &adapter, &raw);
        let DeviceParts { allocator, timeline } = match made {
            Ok(parts) => parts,
            Err(error) => {
                // SAFETY: `DeviceParts` leaves nothing behind when it fails.
                unsafe { raw.destroy_device(None) };
                return Err(error);
            }
        };
        let names = instance.can_name.then(|| ext::debug_utils::Device::new(&instance.raw, &raw));
        // SAFETY: one queue of this family was asked for.
        let queue = unsafe { raw.get_device_queue(adapter.queue_family, 0) };
        let compiled = PipelineCache::open(&raw, &adapter.properties, compiled);
        let device = Arc::new(Self {
            raw,
            queue,
            adapter,
            allocator: ManuallyDrop::new(Mutex::new(allocator)),
            pools: Mutex::default(),
            timeline,
            compiled: Mutex::new(compiled),
            submitted: AtomicU64::new(0),
            hung: AtomicBool::new(false),
            discarded: Mutex::default(),
            names,
            instance,
        });
        device.name(device.timeline, "submissions");
        device.name(device.queue, "queue");
        Ok(device)
    }

    /// Returns the cache of compiled pipelines; null where there is none.
    pub(crate) fn pipeline_cache(&self) -> vk::PipelineCache {
        self.compiled.lock().unwrap_or_else(PoisonError::into_inner).raw
    }

    /// Writes compiled pipelines to disk.
    pub(crate) fn save_pipeline_cache(&self) -> Result<(), GpuError> {
        self.compiled.lock().unwrap_or_else(PoisonError::into_inner).save(&self.raw)
    }

    fn allocator(&self) -> MutexGuard<'_, Allocator> {
        self.allocator.lock().unwrap_or_else(PoisonError::into_inner)
    }

    pub(crate) fn allocate(
        &self,
        name: &'static str,
        requirements: vk::MemoryRequirements,
        location: MemoryLocation,
        linear: bool,
    ) -> Result<Allocation, GpuError> {
        self.allocator()
            .allocate(&AllocationCreateDesc {
                name,
                requirements,
                location,
                linear,
                allocation_scheme: AllocationScheme::GpuAllocatorManaged,
            })
            .map_err(allocation_error(name))
    }

    /// Names an object in messages of the validation layer and in debuggers.
    pub(crate) fn name<T: vk::Handle>(&self, object: T, name: &str) {
        let (Some(names), Ok(name)) = (&self.names, CString::new(name)) else {
            return;
        };
        let info =
            vk::DebugUtilsObjectNameInfoEXT::default().object_handle(object).object_name(&name);
        // SAFETY: the object was just made from this device. A name that is
        // lost for want of memory harms nothing.
        let _ = unsafe { names.set_debug_utils_object_name(&info) };
    }

    /// Records barriers for images and for memory.
    ///
    /// # Safety
    /// The commands belong to this device, are being recorded, outside any pass, and keep the
    /// images alive.
    pub(crate) unsafe fn record_barriers(
        &self,
        commands: vk::CommandBuffer,
        images: &[vk::ImageMemoryBarrier2<'_>],
        memory: &[vk::MemoryBarrier2<'_>],
    ) {
        let info =
            vk::DependencyInfo::default().image_memory_barriers(images).memory_barriers(memory);
        // SAFETY: the caller's promise.
        unsafe { self.raw.cmd_pipeline_barrier2(commands, &info) };
    }

    /// Begins a stretch of commands that debuggers show under this name.
    pub(crate) fn begin_label(&self, commands: vk::CommandBuffer, name: &str) {
        if let (Some(names), Ok(name)) = (&self.names, CString::new(name)) {
            let label = vk::DebugUtilsLabelEXT::default().label_name(&name);
            // SAFETY: the commands are being recorded.
            unsafe { names.cmd_begin_debug_utils_label(commands, &label) };
        }
    }

    /// Ends the stretch begun last.
    pub(crate) fn end_label(&self, commands: vk::CommandBuffer) {
        if let Some(names) = &self.names {
            // SAFETY: the commands are being recorded, and a stretch was begun.
            unsafe { names.cmd_end_debug_utils_label(commands) };
        }
    }

    /// Destroys something once the submission now being recorded is done, or
    /// the next one if none is.
    pub(crate) fn discard(&self, object: DiscardedObject) {
        let value = self.submitted() + 1;
        self.discarded().push((value, object));
    }

    /// Destroys discarded objects that the GPU is done with.
    pub(crate) fn destroy_finished(&self) -> Result<(), GpuError> {
        let finished = self.finished()?;
        let mut discarded = self.discarded();
        let done: Vec<_> = discarded.extract_if(.., |(value, _)| *value <= finished).collect();
        drop(discarded);
        self.destroy(done);
        Ok(())
    }

    fn destroy(&self, discarded: Vec<(u64, DiscardedObject)>) {
        // Descriptor sets go back to pools that allocation uses too.
        let _pools = self.pools.lock().unwrap_or_else(PoisonError::into_inner);
        let mut allocator = self.allocator();
        for (_, item) in discarded {
            // SAFETY: all was made from this device; the submissions that used
            // it are finished; the pools are locked.
            unsafe { item.destroy(&self.raw, &mut allocator) };
        }
    }

    fn discarded(&self) -> MutexGuard<'_, Vec<(u64, DiscardedObject)>> {
        self.discarded.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Returns the number of the last submission.
    pub(crate) fn submitted(&self) -> u64 {
        self.submitted.load(Ordering::Acquire)
    }

    /// Returns the number of the last submission that is finished.
    pub(crate) fn finished(&self) -> Result<u64, GpuError> {
        // SAFETY: the semaphore is this device's timeline.
        unsafe { self.raw.get_semaphore_counter_value(self.timeline) }
            .map_err(vulkan_error("reading the timeline"))
    }

    /// Waits until a submission is finished.
    pub(crate) fn wait(&self, value: u64, what: &'static str) -> Result<(), GpuError> {
        let timeout = || GpuError::Timeout { what, millis: MAX_WAIT_MILLIS };
        // One wait of that length is enough to find out.
        if self.hung.load(Ordering::Acquire) {
            return Err(timeout());
        }
        let (semaphores, values) = ([self.timeline], [value]);
        let info = vk::SemaphoreWaitInfo::default().semaphores(&semaphores).values(&values);
        // SAFETY: the semaphore is this device's timeline.
        let wait = || unsafe { self.raw.wait_semaphores(&info, MAX_WAIT_MILLIS * 1_000_000) };
        match retry_on_out_of_memory(wait) {
            Ok(()) => Ok(()),
            Err(vk::Result::TIMEOUT) => {
                self.hung.store(true, Ordering::Release);
                Err(timeout())
            }
            Err(code) => Err(vulkan_error(what)(code)),
        }
    }

    /// Waits until the queue is idle, presents included.
    pub(crate) fn wait_for_queue(&self, what: &'static str) -> Result<(), GpuError> {
        // SAFETY: `&mut GpuQueue` stands behind every use of the queue.
        retry_on_out_of_memory(|| unsafe { self.raw.queue_wait_idle(self.queue) })
            .map_err(vulkan_error(what))
    }

    /// Destroys all discarded objects, whatever commands were recorded with them. The caller knows
    /// that none of those will ever be submitted, and that everything submitted is finished.
    pub(crate) fn destroy_discarded(&self) {
        let discarded = std::mem::take(&mut *self.discarded());
        self.destroy(discarded);
    }

    /// Waits until everything submitted is finished.
    pub(crate) fn wait_for_all(&self, what: &'static str) -> Result<(), GpuError> {
        self.wait(self.submitted(), what)
    }

    /// Submits a command buffer and returns its number on the timeline.
    ///
    /// # Safety
    /// The command buffer belongs to this device, is executable and not
    /// pending; the semaphores are binary and in the right state; only one
    /// thread submits.
    pub(crate) unsafe fn submit(
        &self,
        commands: vk::CommandBuffer,
        wait: Option<vk::Semaphore>,
        signal: Option<vk::Semaphore>,
    ) -> Result<u64, GpuError> {
        let value = self.submitted() + 1;
        let buffers = [vk::CommandBufferSubmitInfo::default().command_buffer(commands)];
        let info = |semaphore, stages| {
            vk::SemaphoreSubmitInfo::default().semaphore(semaphore).stage_mask(stages)
        };
        let waits: Vec<_> =
            wait.into_iter().map(|s| info(s, vk::PipelineStageFlags2::ALL_TRANSFER)).collect();
        let mut signals =
            vec![info(self.timeline, vk::PipelineStageFlags2::ALL_COMMANDS).value(value)];
        signals.extend(signal.map(|s| info(s, vk::PipelineStageFlags2::ALL_COMMANDS)));
        let submit = vk::SubmitInfo2::default()
            .command_buffer_infos(&buffers)
            .wait_semaphore_infos(&waits)
            .signal_semaphore_infos(&signals);
        // SAFETY: the caller's promise.
        unsafe { self.raw.queue_submit2(self.queue, &[submit], vk::Fence::null()) }
            .map_err(vulkan_error("submitting a frame"))?;
        self.submitted.store(value, Ordering::Release);
        Ok(value)
    }
}

impl Drop for Device {
    fn drop(&mut self) {
        // A hung device cannot be taken apart: freeing under it would crash.
        if let Err(error) = self.wait_for_all("closing the device")
            && !matches!(error, GpuError::DeviceLost(_))
        {
            tracing::error!(%error, "the device is left as it is");
            std::mem::forget(Arc::clone(&self.instance));
            return;
        }
        let discarded = std::mem::take(&mut *self.discarded());
        self.destroy(discarded);
        // SAFETY: everything made from the device held an Arc of it and is
        // gone; the queue is idle or lost; the allocator is not used again.
        unsafe {
            self.pools.lock().unwrap_or_else(PoisonError::into_inner).destroy(&self.raw);
            ManuallyDrop::drop(&mut self.allocator);
            self.raw.destroy_pipeline_cache(self.pipeline_cache(), None);
            self.raw.destroy_semaphore(self.timeline, None);
            self.raw.destroy_device(None);
        }
    }
}

/// Tries a wait again for which there was no memory.
fn retry_on_out_of_memory(wait: impl Fn() -> Result<(), vk::Result>) -> Result<(), vk::Result> {
    let mut tries = 1;
    loop {
        match wait() {
            Err(vk::Result::ERROR_OUT_OF_HOST_MEMORY | vk::Result::ERROR_OUT_OF_DEVICE_MEMORY)
                if tries < MAX_WAIT_TRIES =>
            {
                tries += 1
            }
            waited => return waited,
        }
    }
}

/// Parts that are made right after the device and may fail.
struct DeviceParts {
    allocator: Allocator,
    timeline: vk::Semaphore,
}

impl DeviceParts {
    fn new(instance: &Instance, adapter: &Adapter, device: &ash::Device) -> Result<Self, GpuError> {
        let allocator = Allocator::new(&AllocatorCreateDesc {
            instance: instance.raw.clone(),
            device: device.clone(),
            physical_device: adapter.raw,
            debug_settings: Default::default(),
            buffer_device_address: false,
            allocation_sizes: AllocationSizes::new(DEVICE_BLOCK_BYTES, HOST_BLOCK_BYTES),
        })
        .map_err(allocation_error("preparing GPU memory"))?;
        let mut kind =
            vk::SemaphoreTypeCreateInfo::default().semaphore_type(vk::SemaphoreType::TIMELINE);
        let info = vk::SemaphoreCreateInfo::default().push_next(&mut kind);
        // SAFETY: the device was made with timeline semaphores.
        let timeline = unsafe { device.create_semaphore(&info, None) }
            .map_err(vulkan_error("creating the timeline"))?;
        Ok(Self { allocator, timeline })
    }
}

fn create(instance: &Instance, adapter: &Adapter, presents: bool) -> Result<ash::Device, GpuError> {
    let priorities = [1.0];
    let queues = [vk::DeviceQueueCreateInfo::default()
        .queue_family_index(adapter.queue_family)
        .queue_priorities(&priorities)];
    let extensions = if presents { vec![khr::swapchain::NAME.as_ptr()] } else { Vec::new() };
    // SAFETY: the adapter belongs to this instance.
    let offered = unsafe { instance.raw.get_physical_device_features(adapter.raw) };
    let features = vk::PhysicalDeviceFeatures::default()
        .robust_buffer_access(true)
        // Without it, a mesh may have no more than 2^24 - 1 vertices.
        .full_draw_index_uint32(offered.full_draw_index_uint32 == vk::TRUE)
        .multi_draw_indirect(adapter.draws_indirectly)
        .draw_indirect_first_instance(adapter.draws_indirectly)
        .fill_mode_non_solid(adapter.can_draw_lines);
    let mut vulkan_12 = vk::PhysicalDeviceVulkan12Features::default().timeline_semaphore(true);
    let mut vulkan_13 = vk::PhysicalDeviceVulkan13Features::default()
        .dynamic_rendering(true)
        .synchronization2(true);
    let info = vk::DeviceCreateInfo::default()
        .queue_create_infos(&queues)
        .enabled_extension_names(&extensions)
        .enabled_features(&features)
        .push_next(&mut vulkan_12)
        .push_next(&mut vulkan_13);
    // SAFETY: the adapter was examined for each feature and extension, and all
    // that `info` points to lives until the call returns.
    unsafe { instance.raw.create_device(adapter.raw, &info, None) }
        .map_err(vulkan_error("opening the device"))
}
