//! Vulkan layer for fault injection: it makes calls fail, for tests of error handling.
//!
//! The loader puts it between a program and the driver. It counts the calls that
//! may fail and, told so by the environment ([`FAULT_VARIABLE`]), answers one of
//! them with an error instead of passing it on. A device that is lost stays lost:
//! whatever can say so then does, as the specification asks ("Lost Device").
//!
//! Interface: "Loader and Layer Interface", version 2, of the Vulkan-Loader
//! documentation; structures of `vk_layer.h`.

mod card;
mod chain;
mod codes;
mod command_list;
mod commands;
mod features;
mod plan;
mod setup;

pub use card::AS_CARD_VARIABLE;
pub use codes::{Code, codes_of, name_of};
pub use features::WITHOUT_VARIABLE;
pub use plan::{CALLS_VARIABLE, FAULT_VARIABLE, STRUCK_VARIABLE, VulkanFault};
pub use setup::{LAYER_NAME, VALIDATION_LAYER_NAME, install};
