//! Back ends of the command line's verbs, for any program that offers them.
//!
//! | verb | back end |
//! |---|---|
//! | `optimize` | [`OptimizedModel`] |
//! | `import` | [`import_scene`], [`DevicePointSource`] |
//! | `simulate` | [`SimulatedDevices`] |
//! | `doctor` | [`check_links`] |
//! | commands of plugins | [`offered_commands`], [`plugin_with_command`], [`InstanceCommand`] |
//!
//! Invariant: nothing here prints, draws or parses arguments.
#![doc = include_str!("../DESIGN.md")]

mod device_points;
mod device_simulation;
mod instance_commands;
mod link_check;
mod optimize;
mod plugin_commands;
mod scene_import;

pub use device_points::{DevicePointSource, DevicePoints, POINTS_COMMAND};
pub use device_simulation::{SimulatedDevice, SimulatedDevices};
pub use instance_commands::InstanceCommand;
pub use link_check::{CheckedLink, check_links};
pub use optimize::{ImportedStats, OptimizeError, OptimizeStats, OptimizedModel};
pub use plugin_commands::{OfferedCommand, offered_commands, plugin_with_command};
pub use scene_import::{ImportedScene, SceneImportError, SceneRequest, import_scene};
