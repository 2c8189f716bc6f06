//! What a device lacks, for tests.

use std::ffi::c_void;

use crate::chain::{Function, Handle, next_of};

/// Names the features that devices lack, with commas between.
pub const WITHOUT_VARIABLE: &str = "BUSBAR_VULKAN_WITHOUT";

/// Features that can be taken away, and their places in `VkPhysicalDeviceFeatures`.
const FEATURES: [(&str, usize); 3] =
    [("multiDrawIndirect", 9), ("drawIndirectFirstInstance", 10), ("fillModeNonSolid", 13)];

type Own = unsafe extern "system" fn(Handle, *mut c_void);

pub(crate) unsafe extern "system" fn physical_device_features(
    device: Handle,
    features: *mut c_void,
) {
    let Some(next) = next_of(device) else { return };
    let function = next.function(c"vkGetPhysicalDeviceFeatures".as_ptr());
    if function.is_null() || features.is_null() {
        return;
    }
    // SAFETY: the next layer's function of this name has this type; the arguments are the
    // caller's.
    unsafe { std::mem::transmute::<Function, Own>(function)(device, features) };
    let without = std::env::var(WITHOUT_VARIABLE).unwrap_or_default();
    for (_, place) in FEATURES.iter().filter(|(name, _)| without.split(',').any(|w| w == *name)) {
        // SAFETY: the structure is some fifty words, one a feature, that the caller gave to be
        // written.
        unsafe { *features.cast::<u32>().add(*place) = 0 };
    }
}
