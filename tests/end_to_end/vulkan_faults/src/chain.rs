//! Layer chain: structures that the loader hands to a layer, and the next layer of each instance
//! and device (`vk_layer.h`).

use std::collections::HashMap;
use std::ffi::{CStr, c_char, c_void};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

use crate::codes::{Code, INIT, SUCCESS};
use crate::plan;

/// Dispatchable handle: a pointer to a pointer to its dispatch table.
pub(crate) type Handle = *mut c_void;
/// Pointer to a function; null if there is none.
pub(crate) type Function = *const c_void;
pub(crate) type GetProcAddr = unsafe extern "system" fn(Handle, *const c_char) -> Function;
type Create = unsafe extern "system" fn(*const c_void, *const c_void, *mut Handle) -> Code;
type CreateOn =
    unsafe extern "system" fn(Handle, *const c_void, *const c_void, *mut Handle) -> Code;
type Destroy = unsafe extern "system" fn(Handle, *const c_void);
type Wait = unsafe extern "system" fn(Handle) -> Code;

const LOADER_INSTANCE_CREATE_INFO: i32 = 47;
const LOADER_DEVICE_CREATE_INFO: i32 = 48;
/// Value of `VK_LAYER_LINK_INFO` in C.
const LINK_INFO: i32 = 0;
/// Greatest number of structures in a chain of the loader.
const MAX_CHAIN: usize = 256;

/// Common layout of `VkLayerInstanceCreateInfo` and `VkLayerDeviceCreateInfo`.
#[repr(C)]
struct LayerCreateInfo {
    kind: i32,
    next: *mut Self,
    function: i32,
    link: *mut LayerLink,
}

/// Common layout of `VkLayerInstanceLink` and `VkLayerDeviceLink`; the last field differs.
#[repr(C)]
struct LayerLink {
    next: *mut Self,
    instance_proc_addr: GetProcAddr,
    /// Function `pfnNextGetDeviceProcAddr` of devices.
    other_proc_addr: GetProcAddr,
}

/// Next layer below, for one instance or device.
pub(crate) struct NextLayer {
    handle: usize,
    get: GetProcAddr,
    lost: AtomicBool,
}

impl NextLayer {
    pub(crate) fn function(&self, name: *const c_char) -> Function {
        // SAFETY: the handle lives while it is in the table; the name is a C string.
        unsafe { (self.get)(self.handle as Handle, name) }
    }

    pub(crate) fn is_lost(&self) -> bool {
        self.lost.load(Ordering::Acquire)
    }

    /// Marks the device as lost: nothing runs on it any more, as on a real one.
    pub(crate) fn mark_lost(&self) {
        self.lost.store(true, Ordering::Release);
        let wait = self.function(c"vkDeviceWaitIdle".as_ptr());
        if !wait.is_null() {
            // SAFETY: the next layer's function of this name has this type.
            let wait = unsafe { std::mem::transmute::<Function, Wait>(wait) };
            // SAFETY: the device lives.
            let _ = unsafe { wait(self.handle as Handle) };
        }
    }
}

type Table = Mutex<HashMap<usize, Arc<NextLayer>>>;

fn table() -> &'static Table {
    static TABLE: OnceLock<Table> = OnceLock::new();
    TABLE.get_or_init(Mutex::default)
}

/// Returns the address of the dispatch table, which a handle and all that is made from it share.
fn key_of(handle: Handle) -> usize {
    // SAFETY: dispatchable handles begin with that address ("Loader and Layer
    // Interface").
    unsafe { *handle.cast::<usize>() }
}

/// Returns the next layer below a handle.
pub(crate) fn next_of(handle: Handle) -> Option<Arc<NextLayer>> {
    if handle.is_null() {
        return None;
    }
    table().lock().unwrap_or_else(PoisonError::into_inner).get(&key_of(handle)).cloned()
}

/// Calls the next layer's query of this name, which writes a structure; reports whether it exists.
pub(crate) fn query(device: Handle, name: &CStr, structure: *mut c_void) -> bool {
    type QueryFn = unsafe extern "system" fn(Handle, *mut c_void);
    let function = function_of(device, name);
    if function.is_null() || structure.is_null() {
        return false;
    }
    // SAFETY: the next layer's functions of the names asked for have this type; the arguments
    // are the caller's.
    unsafe { std::mem::transmute::<Function, QueryFn>(function)(device, structure) };
    true
}

/// Calls the next layer's query of this name about an object; reports whether it exists.
pub(crate) fn query_object<T>(
    device: Handle,
    name: &CStr,
    about: T,
    structure: *mut c_void,
) -> bool {
    type QueryFn<T> = unsafe extern "system" fn(Handle, T, *mut c_void);
    let function = function_of(device, name);
    if function.is_null() || structure.is_null() {
        return false;
    }
    // SAFETY: as above.
    unsafe { std::mem::transmute::<Function, QueryFn<T>>(function)(device, about, structure) };
    true
}

fn function_of(handle: Handle, name: &CStr) -> Function {
    next_of(handle).map_or(std::ptr::null(), |next| next.function(name.as_ptr()))
}

fn remember(handle: Handle, get: GetProcAddr) {
    let next = NextLayer { handle: handle as usize, get, lost: AtomicBool::new(false) };
    table().lock().unwrap_or_else(PoisonError::into_inner).insert(key_of(handle), Arc::new(next));
}

/// Takes the loader's link from the chain of a create info, and advances the chain for the next
/// layer.
fn take_link(info: *const c_void, kind: i32) -> Option<&'static LayerLink> {
    let mut at = info.cast_mut().cast::<LayerCreateInfo>();
    for _ in 0..MAX_CHAIN {
        if at.is_null() {
            return None;
        }
        // SAFETY: every structure of the chain begins with kind and next; the
        // rest is read only where the kind says what it is. The loader lets
        // layers change its link, and keeps it until the call returns.
        unsafe {
            if (*at).kind == kind && (*at).function == LINK_INFO {
                let link = (*at).link;
                if link.is_null() {
                    return None;
                }
                (*at).link = (*link).next;
                return Some(&*link);
            }
            at = (*at).next;
        }
    }
    None
}

pub(crate) unsafe extern "system" fn create_instance(
    info: *const c_void,
    allocation: *const c_void,
    instance: *mut Handle,
) -> Code {
    if let Some(code) = plan::count("vkCreateInstance") {
        return code;
    }
    let Some(link) = take_link(info, LOADER_INSTANCE_CREATE_INFO) else { return INIT };
    let get = link.instance_proc_addr;
    // SAFETY: a null instance asks for what needs none.
    let create = unsafe { get(std::ptr::null_mut(), c"vkCreateInstance".as_ptr()) };
    if create.is_null() {
        return INIT;
    }
    // SAFETY: the next layer's function of this name has this type; the
    // arguments are the caller's.
    let code =
        unsafe { std::mem::transmute::<Function, Create>(create)(info, allocation, instance) };
    if code == SUCCESS {
        // SAFETY: just made.
        remember(unsafe { *instance }, get);
    }
    code
}

pub(crate) unsafe extern "system" fn create_device(
    physical: Handle,
    info: *const c_void,
    allocation: *const c_void,
    device: *mut Handle,
) -> Code {
    if let Some(code) = plan::count("vkCreateDevice") {
        return code;
    }
    let (Some(below), Some(link)) = (next_of(physical), take_link(info, LOADER_DEVICE_CREATE_INFO))
    else {
        return INIT;
    };
    let get = link.other_proc_addr;
    let create = below.function(c"vkCreateDevice".as_ptr());
    if create.is_null() {
        return INIT;
    }
    // SAFETY: the next layer's function of this name has this type; the
    // arguments are the caller's.
    let code = unsafe {
        std::mem::transmute::<Function, CreateOn>(create)(physical, info, allocation, device)
    };
    if code == SUCCESS {
        // SAFETY: just made.
        remember(unsafe { *device }, get);
    }
    code
}

pub(crate) unsafe extern "system" fn destroy_instance(instance: Handle, allocation: *const c_void) {
    destroy(instance, allocation, c"vkDestroyInstance".as_ptr());
}

pub(crate) unsafe extern "system" fn destroy_device(device: Handle, allocation: *const c_void) {
    destroy(device, allocation, c"vkDestroyDevice".as_ptr());
}

fn destroy(handle: Handle, allocation: *const c_void, name: *const c_char) {
    let Some(next) = next_of(handle) else { return };
    let function = next.function(name);
    table().lock().unwrap_or_else(PoisonError::into_inner).remove(&key_of(handle));
    if !function.is_null() {
        // SAFETY: the next layer's function of this name has this type; the
        // arguments are the caller's.
        unsafe { std::mem::transmute::<Function, Destroy>(function)(handle, allocation) };
    }
}
