//! Scene loader: reads a configuration and all it names, without a graphics device.
//!
//! [`LoadedScene::load`] reads a configuration, imports its models, creates its plugin instances
//! and reports every fault. [`LoadedScene::reload`] loads a changed configuration in place of a
//! scene that is still shown. [`create_instances`] creates single plugin instances for commands.
//!
//! Invariant: a loaded scene names no renderer, no graphics device and no panel.
#![doc = include_str!("../DESIGN.md")]

mod alarms;
mod bindings;
mod config_file;
mod config_upgrade;
mod diagnostics;
mod equipment;
mod file_version;
mod font;
mod load;
mod loaded_model;
mod loaded_scene;
mod mesh_cache;
mod mesh_splitting;
mod models;
mod moving_part_check;
mod moving_parts;
mod overlay_check;
mod plugin_duties;
mod plugins;
mod reload;
mod reuse;
mod stack_builder;
mod theta_policies;

pub use bindings::tag_specs;
pub use config_file::{MAX_CONFIG_FILE_BYTES, config_folder, read_config, read_config_text};
pub use config_upgrade::upgraded_text;
pub use diagnostics::{DiagnosticsCollector, LoadError};
pub use equipment::{EquipmentIndex, EquipmentNames, is_designation};
pub use file_version::{FileVersion, version as file_version};
pub use loaded_model::{LoadMillis, LoadProgress, LoadedModel};
pub use loaded_scene::{Binding, LoadedAlarms, LoadedScene};
pub use moving_parts::{MovingPartKind, MovingPartTable};
pub use plugin_duties::{source_policy, telemetry_tags};
pub use plugins::{create_instances, may_use_network, plugin_catalog, report_plugin_error};
pub use reload::ReloadedScene;
pub use stack_builder::{BuiltStacks, StackBuilder, millis_since};
