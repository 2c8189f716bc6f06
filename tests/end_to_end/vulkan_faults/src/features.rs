//! Simulated lack of optional device features, for tests.

use std::ffi::c_void;

use crate::chain::{Handle, query};

/// Environment variable with the features that devices lack, separated by commas.
pub const WITHOUT_VARIABLE: &str = "BUSBAR_VULKAN_WITHOUT";

/// Features that can be removed, with their indices in `VkPhysicalDeviceFeatures`.
const FEATURES: [(&str, usize); 3] =
    [("multiDrawIndirect", 9), ("drawIndirectFirstInstance", 10), ("fillModeNonSolid", 13)];

pub(crate) unsafe extern "system" fn physical_device_features(
    device: Handle,
    features: *mut c_void,
) {
    if !query(device, c"vkGetPhysicalDeviceFeatures", features) {
        return;
    }
    let without = std::env::var(WITHOUT_VARIABLE).unwrap_or_default();
    for (_, place) in FEATURES.iter().filter(|(name, _)| without.split(',').any(|w| w == *name)) {
        // SAFETY: the structure is some fifty words, one a feature, that the caller gave to be
        // written.
        unsafe { *features.cast::<u32>().add(*place) = 0 };
    }
}
