//! Simulated graphics card, for tests: devices report its kind, and memory of which the processor
//! sees only a part. Allocations below this layer stay as they are.

use std::ffi::c_void;

use crate::chain::{Function, Handle, query, query_object};

/// Environment variable that makes devices report a graphics card.
pub const AS_CARD_VARIABLE: &str = "BUSBAR_VULKAN_AS_CARD";

/// Value of `VK_PHYSICAL_DEVICE_TYPE_DISCRETE_GPU`, and the word of the type in
/// `VkPhysicalDeviceProperties`.
const DISCRETE_GPU: u32 = 2;
const KIND: usize = 4;

/// Heap and type of the device's own memory, which the processor does not see, and of the
/// processor's.
const OF_DEVICE: u32 = 0;
const OF_PROCESSOR: u32 = 1;
/// Bit `VK_MEMORY_PROPERTY_DEVICE_LOCAL_BIT`, and the bits "host visible", "coherent" and "cached".
const DEVICE_LOCAL: u32 = 1;
const HOST_VISIBLE_COHERENT_CACHED: u32 = 2 | 4 | 8;

/// Mirror of the C structure `VkPhysicalDeviceMemoryProperties`.
#[repr(C)]
struct MemoryProperties {
    type_count: u32,
    /// Property flags and heap index of each memory type.
    types: [[u32; 2]; 32],
    heap_count: u32,
    heaps: [Heap; 16],
}

/// Mirror of the C structure `VkMemoryHeap`.
#[derive(Clone, Copy)]
#[repr(C)]
struct Heap {
    size: u64,
    flags: u32,
}

/// Mirror of the C structure `VkMemoryRequirements`.
#[repr(C)]
struct Requirements {
    size: u64,
    alignment: u64,
    /// Bit set of the allowed memory types.
    types: u32,
}

/// Extensible structure with its header, such as `VkMemoryRequirements2`.
#[repr(C)]
struct Extended<T> {
    kind: i32,
    next: *mut c_void,
    own: T,
}

/// Body of `VkMemoryAllocateInfo` without its header.
#[derive(Clone, Copy)]
#[repr(C)]
struct Allocation {
    size: u64,
    memory_type: u32,
}

fn is_card() -> bool {
    std::env::var_os(AS_CARD_VARIABLE).is_some()
}

unsafe extern "system" fn properties(device: Handle, properties: *mut c_void) {
    if query(device, c"vkGetPhysicalDeviceProperties", properties) && is_card() {
        // SAFETY: the structure begins with five words, which the caller gave to be written.
        unsafe { *properties.cast::<u32>().add(KIND) = DISCRETE_GPU };
    }
}

impl MemoryProperties {
    fn divide(&mut self) {
        let size = self.heaps[0].size;
        self.type_count = 2;
        self.types[0] = [DEVICE_LOCAL, OF_DEVICE];
        self.types[1] = [HOST_VISIBLE_COHERENT_CACHED, OF_PROCESSOR];
        self.heap_count = 2;
        self.heaps[0] = Heap { size, flags: DEVICE_LOCAL };
        self.heaps[1] = Heap { size, flags: 0 };
    }
}

unsafe extern "system" fn memory_properties(device: Handle, properties: *mut c_void) {
    if query(device, c"vkGetPhysicalDeviceMemoryProperties", properties) && is_card() {
        // SAFETY: it is what the caller gave to be written, and was.
        unsafe { (*properties.cast::<MemoryProperties>()).divide() };
    }
}

unsafe extern "system" fn memory_properties2(device: Handle, properties: *mut c_void) {
    if query(device, c"vkGetPhysicalDeviceMemoryProperties2", properties) && is_card() {
        // SAFETY: as above.
        unsafe { (*properties.cast::<Extended<MemoryProperties>>()).own.divide() };
    }
}

/// Allows buffers in either memory.
unsafe extern "system" fn buffer_requirements(device: Handle, buffer: u64, out: *mut c_void) {
    if query_object(device, c"vkGetBufferMemoryRequirements", buffer, out) && is_card() {
        // SAFETY: it is what the caller gave to be written, and was.
        unsafe { (*out.cast::<Requirements>()).types = 1 << OF_DEVICE | 1 << OF_PROCESSOR };
    }
}

unsafe extern "system" fn buffer_requirements2(device: Handle, about: Handle, out: *mut c_void) {
    if query_object(device, c"vkGetBufferMemoryRequirements2", about, out) && is_card() {
        let types = 1 << OF_DEVICE | 1 << OF_PROCESSOR;
        // SAFETY: as above.
        unsafe { (*out.cast::<Extended<Requirements>>()).own.types = types };
    }
}

/// Calls `allocate` with the memory type that exists below this layer.
///
/// # Safety
/// As for `vkAllocateMemory`.
pub(crate) unsafe fn with_underlying_memory_type<R>(
    info: *mut c_void,
    allocate: impl FnOnce(*mut c_void) -> R,
) -> R {
    if info.is_null() || !is_card() {
        return allocate(info);
    }
    // SAFETY: the caller's promise.
    let Extended { kind, next, own } = unsafe { info.cast::<Extended<Allocation>>().read() };
    let mut below = Extended { kind, next, own: Allocation { memory_type: 0, ..own } };
    allocate((&raw mut below).cast())
}

/// Returns this layer's implementation of a query about the device, if it has one.
pub(crate) fn intercepted(name: &str) -> Option<Function> {
    Some(match name {
        "vkGetPhysicalDeviceProperties" => properties as Function,
        "vkGetPhysicalDeviceMemoryProperties" => memory_properties as Function,
        "vkGetPhysicalDeviceMemoryProperties2" => memory_properties2 as Function,
        "vkGetBufferMemoryRequirements" => buffer_requirements as Function,
        "vkGetBufferMemoryRequirements2" => buffer_requirements2 as Function,
        _ => return None,
    })
}
