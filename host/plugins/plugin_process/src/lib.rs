//! Plugins in supervised processes of their own.
//!
//! [`PluginCatalog`] finds plugins and makes instances of them, in this process
//! or each in a process of its own; [`Plugin`] and the `Running...` types are the
//! same to the viewer either way. [`serve`] is the other end: what `busbar
//! plugin-host` does. There the plugin is driven by `busbar_plugin_host`, as it
//! is in the viewer's process without isolation.
//!
//! Calls go over a socket, samples through a ring in shared memory, meshes
//! through sealed memory. A process that dies, hangs, floods or lies is ended and
//! started again, and after too many deaths left alone; see `supervisor`.
//!
//! `busbar simulate` registers its process in a folder of the user
//! ([`SimulatorRegistration`]). Samples of a plugin that is connected to it are marked as
//! simulated: before the first value of a link is handed over, and each second, `/proc` is
//! asked for the plugin's TCP connections. Simulators of other users, in other networks,
//! and behind relays or brokers are not found so.
//!
//! Invariant: whatever comes from a plugin's process is checked here before
//! anybody else sees it.
#![doc = include_str!("../DESIGN.md")]

mod capability_definitions;
mod capability_handles;
mod capability_messages;
mod catalog;
mod command;
mod environment;
mod framing;
mod loaded;
mod log_capture;
mod memory;
mod message;
mod picture_mailbox;
mod plugin;
mod plugin_server;
pub mod probe;
mod process;
mod process_monitor;
mod process_spawn;
mod process_state;
mod resident_memory;
mod restart_policy;
mod ring;
mod sample_feed;
mod sandbox;
mod simulator;
mod simulator_detection;
mod simulator_registry;
mod socket_table;
mod status;
mod supervisor;

pub use capability_handles::{RunningAlarms, RunningChart, RunningNotifier, RunningRecords};
pub use catalog::{DEFAULT_CONFINEMENT, Isolation, PluginCatalog, PluginOptions};
pub use command::CommandError;
pub use message::Confinement;
pub use plugin::{InProcessTelemetry, Optimizer, Plugin, RunningOverlay, RunningTelemetry};
pub use plugin_server::serve;
pub use process::PluginProcess;
pub use restart_policy::{Deadlines, RestartPolicy};
pub use simulator::RunningSimulator;
pub use simulator_registry::SimulatorRegistration;
pub use status::{PluginState, PluginStatus};
