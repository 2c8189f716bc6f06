//! Intercepted commands that may fail, and the layer's entry points.

use std::ffi::{CStr, c_char, c_void};

use crate::chain::{
    Function, GetProcAddr, Handle, create_device, create_instance, destroy_device,
    destroy_instance, next_of,
};
use crate::codes::*;
use crate::command_list::for_each_command;
use crate::features::physical_device_features;
use crate::{card, plan};

/// Pointer as it crosses the ABI; `U` is a non-dispatchable handle.
type P = *mut c_void;
type U = u64;

/// Generates for each command a function that counts, fails or passes on, and its entry in the table
/// of functions.
macro_rules! commands {
    ($($name:ident ( $($argument:ident : $type:ty),* ) [ $($code:expr),* ];)*) => {
        $(
            #[allow(
                non_snake_case,
                clippy::too_many_arguments,
                reason = "names and arguments are the specification's"
            )]
            unsafe extern "system" fn $name(handle: Handle, $($argument: $type),*) -> Code {
                type CommandFn = unsafe extern "system" fn(Handle, $($type),*) -> Code;
                let Some(next) = next_of(handle) else { return INIT };
                let codes: &[Code] = &[$($code),*];
                let fault = plan::count(stringify!($name));
                if fault == Some(LOST) {
                    next.mark_lost();
                }
                if next.is_lost() && codes.contains(&LOST) {
                    return LOST;
                }
                if let Some(code) = fault
                    && !has_effect_despite_code(stringify!($name), code)
                {
                    return code;
                }
                const NAME: &str = concat!(stringify!($name), "\0");
                let function = next.function(NAME.as_ptr().cast());
                if function.is_null() {
                    return EXTENSION;
                }
                // SAFETY: the next layer's function of this name has this type;
                // the arguments are the caller's.
                let code = unsafe {
                    std::mem::transmute::<Function, CommandFn>(function)(handle, $($argument),*)
                };
                if code == SUCCESS { fault.unwrap_or(code) } else { code }
            }
        )*

        fn intercepted(name: &str) -> Option<Function> {
            match name {
                $(stringify!($name) => Some($name as Function),)*
                _ => None,
            }
        }
    };
}

/// Reports whether a call has its effect in spite of the code: success codes, and presentation,
/// whose semaphores are waited for all the same (vkQueuePresentKHR).
fn has_effect_despite_code(command: &str, code: Code) -> bool {
    code > SUCCESS || (command == "vkQueuePresentKHR" && matches!(code, OUT_OF_DATE | SURFACE))
}

for_each_command!(commands);

/// Mirror of the C structure `VkNegotiateLayerInterface`.
#[repr(C)]
struct Negotiation {
    kind: i32,
    next: *mut c_void,
    version: u32,
    instance_proc_addr: Option<GetProcAddr>,
    device_proc_addr: Option<GetProcAddr>,
    physical_device_proc_addr: Option<GetProcAddr>,
}

/// The version of the interface that this layer speaks.
const INTERFACE_VERSION: u32 = 2;

/// Negotiates the interface with the loader, which calls this first, and reports the other entry
/// points.
///
/// # Safety
/// `negotiation` is null or a `VkNegotiateLayerInterface` that may be written.
#[unsafe(no_mangle)]
unsafe extern "system" fn vkNegotiateLoaderLayerInterfaceVersion(negotiation: *mut c_void) -> Code {
    // SAFETY: the caller's promise.
    let Some(negotiation) = (unsafe { negotiation.cast::<Negotiation>().as_mut() }) else {
        return INIT;
    };
    if negotiation.version < INTERFACE_VERSION {
        return INIT;
    }
    negotiation.version = INTERFACE_VERSION;
    negotiation.instance_proc_addr = Some(get_instance_proc_addr);
    negotiation.device_proc_addr = Some(get_device_proc_addr);
    negotiation.physical_device_proc_addr = None;
    SUCCESS
}

unsafe extern "system" fn get_instance_proc_addr(
    instance: Handle,
    name: *const c_char,
) -> Function {
    // SAFETY: callers give a C string.
    let text = unsafe { CStr::from_ptr(name) }.to_str().unwrap_or_default();
    match text {
        "vkGetInstanceProcAddr" => get_instance_proc_addr as Function,
        "vkGetDeviceProcAddr" => get_device_proc_addr as Function,
        "vkCreateInstance" => create_instance as Function,
        "vkGetPhysicalDeviceFeatures" => physical_device_features as Function,
        "vkDestroyInstance" => destroy_instance as Function,
        "vkCreateDevice" => create_device as Function,
        "vkDestroyDevice" => destroy_device as Function,
        _ => intercepted_or_next(instance, name, text),
    }
}

unsafe extern "system" fn get_device_proc_addr(device: Handle, name: *const c_char) -> Function {
    // SAFETY: callers give a C string.
    let text = unsafe { CStr::from_ptr(name) }.to_str().unwrap_or_default();
    match text {
        "vkGetDeviceProcAddr" => get_device_proc_addr as Function,
        "vkDestroyDevice" => destroy_device as Function,
        _ => intercepted_or_next(device, name, text),
    }
}

/// Returns the layer's own function where there is one below to pass on to; else the one below.
fn intercepted_or_next(handle: Handle, name: *const c_char, text: &str) -> Function {
    let Some(next) = next_of(handle) else { return std::ptr::null() };
    let below = next.function(name);
    let function = match text {
        "vkAllocateMemory" => Some(allocate_memory as Function),
        _ => intercepted(text).or_else(|| card::intercepted(text)),
    };
    function.filter(|_| !below.is_null()).unwrap_or(below)
}

unsafe extern "system" fn allocate_memory(device: Handle, info: P, allocation: P, out: P) -> Code {
    // SAFETY: the caller's promise.
    unsafe {
        card::with_underlying_memory_type(info, |info| {
            vkAllocateMemory(device, info, allocation, out)
        })
    }
}
