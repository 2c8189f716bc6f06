//! What devices lack, and what kind they say they are, for tests.

use std::ffi::{CStr, c_void};

use crate::chain::{Function, Handle, next_of};

/// Names the features that devices lack, with commas between.
pub const WITHOUT_VARIABLE: &str = "BUSBAR_VULKAN_WITHOUT";

/// Features that can be taken away, and their places in `VkPhysicalDeviceFeatures`.
const FEATURES: [(&str, usize); 3] =
    [("multiDrawIndirect", 9), ("drawIndirectFirstInstance", 10), ("fillModeNonSolid", 13)];

/// Says that devices are graphics cards, whatever they are, where it is set: a software
/// rasteriser is drawn with as those are.
pub const AS_CARD_VARIABLE: &str = "BUSBAR_VULKAN_AS_CARD";

/// The place of the kind of a device in `VkPhysicalDeviceProperties`, and that of a card.
const KIND: usize = 4;
const DISCRETE_GPU: u32 = 2;

type Own = unsafe extern "system" fn(Handle, *mut c_void);

/// Lets the next layer's function of a name write a structure; tells whether it did.
fn ask(device: Handle, name: &CStr, structure: *mut c_void) -> bool {
    let Some(next) = next_of(device) else { return false };
    let function = next.function(name.as_ptr());
    if function.is_null() || structure.is_null() {
        return false;
    }
    // SAFETY: the next layer's functions of the names asked for have this type; the arguments
    // are the caller's.
    unsafe { std::mem::transmute::<Function, Own>(function)(device, structure) };
    true
}

pub(crate) unsafe extern "system" fn physical_device_properties(
    device: Handle,
    properties: *mut c_void,
) {
    if ask(device, c"vkGetPhysicalDeviceProperties", properties)
        && std::env::var_os(AS_CARD_VARIABLE).is_some()
    {
        // SAFETY: the structure begins with five words, which the caller gave to be written.
        unsafe { *properties.cast::<u32>().add(KIND) = DISCRETE_GPU };
    }
}

pub(crate) unsafe extern "system" fn physical_device_features(
    device: Handle,
    features: *mut c_void,
) {
    if !ask(device, c"vkGetPhysicalDeviceFeatures", features) {
        return;
    }
    let without = std::env::var(WITHOUT_VARIABLE).unwrap_or_default();
    for (_, place) in FEATURES.iter().filter(|(name, _)| without.split(',').any(|w| w == *name)) {
        // SAFETY: the structure is some fifty words, one a feature, that the caller gave to be
        // written.
        unsafe { *features.cast::<u32>().add(*place) = 0 };
    }
}
