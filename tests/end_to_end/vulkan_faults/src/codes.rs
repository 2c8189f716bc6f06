//! Result codes, and those that each command may return.

use crate::command_list::for_each_command;

/// Result code of a command (`VkResult`).
pub type Code = i32;

pub(crate) const SUCCESS: Code = 0;
pub(crate) const NOT_READY: Code = 1;
pub(crate) const SUBOPTIMAL: Code = 1_000_001_003;
pub(crate) const HOST: Code = -1;
pub(crate) const DEVICE: Code = -2;
pub(crate) const INIT: Code = -3;
pub(crate) const LOST: Code = -4;
pub(crate) const MAP: Code = -5;
pub(crate) const LAYER: Code = -6;
pub(crate) const EXTENSION: Code = -7;
pub(crate) const FEATURE: Code = -8;
pub(crate) const DRIVER: Code = -9;
pub(crate) const TOO_MANY: Code = -10;
pub(crate) const FRAGMENTED: Code = -12;
pub(crate) const POOL: Code = -1_000_069_000;
pub(crate) const FRAGMENTATION: Code = -1_000_161_000;
pub(crate) const SURFACE: Code = -1_000_000_000;
pub(crate) const IN_USE: Code = -1_000_000_001;
pub(crate) const OUT_OF_DATE: Code = -1_000_001_004;

const NAMES: [(Code, &str); 20] = [
    (SUCCESS, "VK_SUCCESS"),
    (NOT_READY, "VK_NOT_READY"),
    (SUBOPTIMAL, "VK_SUBOPTIMAL_KHR"),
    (HOST, "VK_ERROR_OUT_OF_HOST_MEMORY"),
    (DEVICE, "VK_ERROR_OUT_OF_DEVICE_MEMORY"),
    (INIT, "VK_ERROR_INITIALIZATION_FAILED"),
    (LOST, "VK_ERROR_DEVICE_LOST"),
    (MAP, "VK_ERROR_MEMORY_MAP_FAILED"),
    (LAYER, "VK_ERROR_LAYER_NOT_PRESENT"),
    (EXTENSION, "VK_ERROR_EXTENSION_NOT_PRESENT"),
    (FEATURE, "VK_ERROR_FEATURE_NOT_PRESENT"),
    (DRIVER, "VK_ERROR_INCOMPATIBLE_DRIVER"),
    (TOO_MANY, "VK_ERROR_TOO_MANY_OBJECTS"),
    (FRAGMENTED, "VK_ERROR_FRAGMENTED_POOL"),
    (POOL, "VK_ERROR_OUT_OF_POOL_MEMORY"),
    (FRAGMENTATION, "VK_ERROR_FRAGMENTATION"),
    (SURFACE, "VK_ERROR_SURFACE_LOST_KHR"),
    (IN_USE, "VK_ERROR_NATIVE_WINDOW_IN_USE_KHR"),
    (OUT_OF_DATE, "VK_ERROR_OUT_OF_DATE_KHR"),
    (-13, "VK_ERROR_UNKNOWN"),
];

/// Generates the table of the codes of each command.
macro_rules! command_codes {
    ($($name:ident ( $($argument:ident : $type:ty),* ) [ $($code:expr),* ];)*) => {
        /// Commands and their codes besides success ("Return Codes").
        const COMMANDS: &[(&str, &[Code])] = &[
            ("vkCreateInstance", &[HOST, DEVICE, INIT, LAYER, EXTENSION, DRIVER]),
            ("vkCreateDevice", &[HOST, DEVICE, INIT, EXTENSION, FEATURE, TOO_MANY, LOST]),
            $((stringify!($name), &[$($code),*]),)*
        ];
    };
}

for_each_command!(command_codes);

/// Returns a code's name in the specification; empty for one that no command here gives.
pub fn name_of(code: Code) -> &'static str {
    NAMES.iter().find(|(known, _)| *known == code).map_or("", |(_, name)| name)
}

/// Returns the codes besides success that the specification lists for a command (its "Return
/// Codes"), without those of extensions that nobody turns on here. Empty for a command that this
/// layer does not know.
pub fn codes_of(command: &str) -> &'static [Code] {
    COMMANDS.iter().find(|(name, _)| *name == command).map_or(&[], |(_, codes)| codes)
}
