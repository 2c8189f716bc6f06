//! Plugin `fault_injector`: well-behaved, until it is told to misbehave.
//!
//! Its settings name a fault: a [`Kind`], the function [`At`] which it strikes, and
//! how many calls of that function go well before. What comes before settings (`init`,
//! the factory) is told by [`FAULT_VARIABLE`], which holds the same JSON:
//!
//! ```json
//! { "kind": "segfault", "at": "start", "after_calls": 2 }
//! ```
//!
//! A file beside the library can hold a fault too, for one process: see [`fuse_of`].
//!
//! Without a fault it is a good plugin of every kind: telemetry that publishes a ramp
//! for each tag at once and every ten milliseconds, an overlay of one line a binding,
//! an optimiser by edge length, a chart and a list of records. The fault of the last `create` holds for all
//! instances of the process.

mod fault;
mod fuse;
mod honest;
mod kept;
mod spoil;
mod strike;
mod tables;

pub use fault::{At, FAULT_VARIABLE, Fault, Kind};
pub use fuse::{LIBRARY_STEM, PLUGIN_ID, fuse_of, struck_of};
pub use honest::{FaultInjector, PUBLISH_PERIOD};
pub use tables::busbar_plugin_entry;
