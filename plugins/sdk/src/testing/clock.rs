//! A clock that a test moves.

use std::time::Duration;

use crate::Host;
use crate::clock::Clock;

/// How long a test waits for a worker to wait.
const MAX_WAIT: Duration = Duration::from_secs(10);

/// A clock for [`crate::Worker`]s that stands still until it is told to move, so
/// that a test of a plugin that polls once a minute takes no minute.
#[derive(Clone, Debug)]
pub struct TestClock(Clock);

impl Default for TestClock {
    fn default() -> Self {
        Self::new()
    }
}

impl TestClock {
    /// A clock at its start.
    pub fn new() -> Self {
        Self(Clock::for_test())
    }

    /// A host without a log, whose workers wait by this clock.
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
