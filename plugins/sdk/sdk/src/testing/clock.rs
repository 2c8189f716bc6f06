//! Simulated clock for tests of workers.

use std::time::Duration;

use crate::Host;
use crate::clock::Clock;

/// Longest time that a test waits until a worker waits.
const MAX_WAIT: Duration = Duration::from_secs(10);

/// Simulated clock for [`crate::Worker`]s, which stands still until a test moves it. A test of a
/// plugin that polls once a minute takes no minute.
#[derive(Clone, Debug)]
pub struct TestClock(Clock);

impl Default for TestClock {
    fn default() -> Self {
        Self::new()
    }
}

impl TestClock {
    /// Creates a clock at its start.
    pub fn new() -> Self {
        Self(Clock::for_test())
    }

    /// Creates a host without a log, whose workers wait by this clock.
    pub fn host(&self) -> Host {
        Host::with_clock(self.0.clone())
    }

    /// Moves the clock, once a worker waits for it.
    ///
    /// # Panics
    /// When none waits within ten seconds: the plugin's thread hangs elsewhere.
    pub fn advance(&self, duration: Duration) {
        assert!(self.0.advance(duration, MAX_WAIT), "no worker waited within {MAX_WAIT:?}");
    }
}
