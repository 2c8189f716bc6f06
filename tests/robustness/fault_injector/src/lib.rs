//! Plugin `fault_injector`: well-behaved, until it is told to misbehave.
//!
//! Its settings name a fault: a [`Misbehavior`], its [`CallSite`], and
//! how many calls of that function go well before. What comes before settings (`init`,
//! the factory) is told by [`FAULT_VARIABLE`], which holds the same JSON:
//!
//! ```json
//! { "kind": "segfault", "at": "start", "after_calls": 2 }
//! ```
//!
//! A file beside the library can hold a fault too, for one process: see [`armed_fault_path`].
//!
//! Without a fault it is a good plugin of every kind: telemetry that publishes a ramp
//! for each tag at once and every ten milliseconds, an overlay of one line a binding,
//! an optimiser by edge length, a chart and a list of records. The fault of the last `create` holds for all
//! instances of the process.

mod armed_fault;
mod corrupted_tables;
mod corruption;
mod data_sources;
mod entry;
mod fault;
mod injection;
mod plugin;
mod sdk_tables;

pub use armed_fault::{LIBRARY_STEM, PLUGIN_ID, armed_fault_path, fault_time_path};
pub use entry::busbar_plugin_entry;
pub use fault::{CallSite, FAULT_VARIABLE, Fault, Misbehavior};
pub use plugin::{FaultInjector, PUBLISH_PERIOD};
