//! Stopwatch for the CPU time of this thread.

use rustix::time::{ClockId, clock_gettime};

const NANOS_PER_SECOND: i64 = 1_000_000_000;

/// Counts while this thread computes, and not while it waits or another has the CPU.
#[derive(Clone, Copy, Debug)]
pub struct CpuClock {
    start_nanos: i64,
}

impl CpuClock {
    /// Starts a measurement now.
    pub fn start() -> Self {
        Self { start_nanos: nanos() }
    }

    /// Milliseconds since the start.
    pub fn millis(self) -> f64 {
        (nanos() - self.start_nanos) as f64 / 1e6
    }
}

fn nanos() -> i64 {
    let time = clock_gettime(ClockId::ThreadCPUTime);
    time.tv_sec * NANOS_PER_SECOND + time.tv_nsec
}
