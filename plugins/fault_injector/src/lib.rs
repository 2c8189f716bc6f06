//! Plugin `fault_injector`: behaves, until it is told to misbehave.
//!
//! Its settings name a fault: a [`Kind`], the function [`At`] which it strikes, and
//! how many calls of that function go well before. What comes before settings (`init`,
//! the factory) is told by [`FAULT_VARIABLE`], which holds the same JSON:
//!
//! ```json
//! { "kind": "segfault", "at": "start", "after_calls": 2 }
//! ```
//!
//! Without a fault it is a good plugin of every kind: telemetry that publishes a ramp
//! for each tag at once and every ten milliseconds, an overlay of one line a binding,
//! and an optimiser by edge length. The fault of the last `create` holds for all
//! instances of the process.

mod fault;
mod honest;
mod spoil;
mod strike;
mod tables;

pub use fault::{At, FAULT_VARIABLE, Fault, Kind};
pub use honest::{FaultInjector, PUBLISH_PERIOD};
pub use tables::busbar_plugin_entry;
