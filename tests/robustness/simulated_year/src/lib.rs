//! A year of an adapter and its device in simulated time, from a seed: link losses,
//! half-open links, slow peers, restarts, jumps of both clocks, reloads; and what must
//! hold all the while.
//!
//! The adapter is the plugin's own event loop, the device its own simulator with the
//! faults of `device_server`. Memory takes the place of sockets, and
//! the runtime's paused clock that of time, so that the same seed gives the same year.
//! Whatever does not hold panics, with the instant.

mod fault_schedule;
mod network;
mod rig;
mod tally;
mod time;
mod year;

use std::sync::Arc;
use std::time::Duration;

use busbar_link::Dial;
use busbar_plugin_sdk::{SampleSink, SimulatedTag};
use device_server::FaultyLink;
use tokio::io::DuplexStream;
use tokio::sync::mpsc;

pub use crate::fault_schedule::FaultSchedule;
pub use crate::rig::{DAY, HOUR, SignalParameters, serve_clients, tags};
pub use crate::tally::Tally;
pub use crate::time::SimulatedTime;
pub use crate::year::run;

/// Test rig: an adapter and the device that it reads.
pub trait Rig {
    /// The protocol's deadline for answers.
    const DEADLINE: Duration;
    /// Longest time from the beginning of a fault until the adapter has noticed it.
    const NOTICED_AFTER: Duration;
    /// Longest time from the end of a fault, or the adapter's start, until every tag is good.
    const WELL_AFTER: Duration;
    /// Greatest age of a value without disturbance.
    const MAX_AGE: Duration;
    /// Number of the device's tasks without disturbance.
    const TASKS: usize;

    /// Returns the tags; their handles count from 0.
    fn tags(&self) -> &[SimulatedTag];

    /// Serves the tags until it is dropped.
    fn run_adapter(
        &self,
        sink: SampleSink,
        dial: Arc<dyn Dial>,
    ) -> impl Future<Output = ()> + 'static;

    /// Serves clients until it is dropped, with all that belongs to them.
    fn run_device(
        &self,
        clients: mpsc::Receiver<DuplexStream>,
        link: FaultyLink,
    ) -> impl Future<Output = ()> + 'static;
}
