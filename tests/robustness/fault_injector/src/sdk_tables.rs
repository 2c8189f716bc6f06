//! The SDK's own tables, which the corrupted ones pass calls on to.

use std::ffi::c_void;
use std::sync::OnceLock;

use busbar_plugin_sdk::abi;

/// Wrong size that a struct claims, bytes.
pub(crate) const SHORT: u32 = 8;

pub(crate) type GetCapability =
    unsafe extern "C" fn(*const abi::BusbarPlugin, abi::BusbarStr) -> *const c_void;

/// Function of the SDK that an instance no longer names.
pub(crate) static SDK_GET_CAPABILITY: OnceLock<GetCapability> = OnceLock::new();

/// Returns the SDK's own table of a capability.
pub(crate) fn sdk_table<T>(id: &'static str) -> Option<&'static T> {
    let get = SDK_GET_CAPABILITY.get()?;
    // SAFETY: the SDK looks at the id alone, and its tables are static and of this type.
    unsafe { get(std::ptr::null(), abi::BusbarStr::from_static(id)).cast::<T>().as_ref() }
}
