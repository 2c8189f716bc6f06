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
//! started again, and after too many deaths left alone; see `supervise`.
//!
//! Invariant: whatever comes from a plugin's process is checked here before
//! anybody else sees it.

mod alarms;
mod catalog;
mod chart;
mod command;
mod confine;
mod environment;
mod feed;
mod frames;
mod loaded;
mod memory;
mod message;
mod output;
mod plugin;
mod policy;
pub mod probe;
mod proc;
mod process;
mod records;
mod ring;
mod serve;
mod shared;
mod simulator;
mod slot;
mod spawn;
mod status;
mod supervise;
mod watch;

pub use alarms::RunningAlarms;
pub use catalog::{DEFAULT_CONFINEMENT, Isolation, PluginCatalog, PluginOptions};
pub use chart::RunningChart;
pub use command::CommandError;
pub use message::Confinement;
pub use plugin::{Optimizer, Plugin, RunningOverlay, RunningTelemetry};
pub use policy::{Deadlines, RestartPolicy};
pub use process::PluginProcess;
pub use records::RunningRecords;
pub use serve::serve;
pub use simulator::RunningSimulator;
pub use status::{PluginState, PluginStatus};
