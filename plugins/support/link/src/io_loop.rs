//! I/O event loop of a plugin's thread.

use std::io;
use std::time::Duration;

use tokio::runtime::{Builder, Runtime};
use tokio::task::LocalSet;

/// Longest wait for a name lookup that hangs in the system.
const LOOKUP_LIMIT: Duration = Duration::from_millis(500);

/// Event loop that runs on one thread.
#[derive(Debug)]
pub struct IoLoop(Runtime);

impl IoLoop {
    /// Creates the loop before its thread starts, so that a failure can be reported. `lookups` is
    /// the greatest number of concurrent name lookups.
    ///
    /// # Errors
    /// What the system lacks.
    pub fn new(lookups: usize) -> io::Result<Self> {
        let mut builder = Builder::new_current_thread();
        Ok(Self(builder.enable_all().max_blocking_threads(lookups.max(1)).build()?))
    }

    /// Runs `work`, which may spawn local tasks, until it ends or `stopped` does.
    /// All tasks and sockets are gone when this returns.
    pub fn run_until(self, stopped: impl Future<Output = ()>, work: impl Future<Output = ()>) {
        let tasks = LocalSet::new();
        self.0.block_on(tasks.run_until(async {
            tokio::select! {
                biased;
                () = stopped => {}
                () = work => {}
            }
        }));
        drop(tasks);
        self.0.shutdown_timeout(LOOKUP_LIMIT);
    }
}
