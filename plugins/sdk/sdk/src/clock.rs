//! Clock that workers wait by: the system's, or a simulated one in tests.

use std::sync::{Arc, Condvar, Mutex, PoisonError};
use std::time::{Duration, Instant};

/// Clock that can be waited on. Clones share it.
#[derive(Clone, Debug, Default)]
pub(crate) struct Clock(Arc<Shared>);

#[derive(Debug, Default)]
struct Shared {
    state: Mutex<State>,
    changed: Condvar,
}

#[derive(Debug, Default)]
struct State {
    /// Time since the start of a test's clock; none for the system's.
    test_time: Option<Duration>,
    /// Number of workers that wait now.
    waiting: usize,
}

impl Clock {
    /// Creates a clock that stands still until a test moves it.
    pub(crate) fn for_test() -> Self {
        let state = State { test_time: Some(Duration::ZERO), waiting: 0 };
        Self(Arc::new(Shared { state: Mutex::new(state), changed: Condvar::new() }))
    }

    /// Waits until `duration` has passed, or until a wake-up finds `is_over` true.
    pub(crate) fn wait(&self, duration: Duration, is_over: impl Fn() -> bool) {
        let started = Instant::now();
        let mut state = self.0.state.lock().unwrap_or_else(PoisonError::into_inner);
        let test_end = state.test_time.map(|now| now.saturating_add(duration));
        state.waiting += 1;
        self.0.changed.notify_all();
        while !is_over() {
            let left = match (test_end, state.test_time) {
                (Some(end), Some(now)) if now >= end => break,
                // Woken by the test, or by the end.
                (Some(_), _) => Duration::MAX,
                (None, _) => duration.saturating_sub(started.elapsed()),
            };
            if left.is_zero() {
                break;
            }
            let woken = self.0.changed.wait_timeout(state, left);
            state = woken.unwrap_or_else(PoisonError::into_inner).0;
        }
        state.waiting -= 1;
    }

    /// Wakes every waiting worker, so that it checks whether it is over.
    pub(crate) fn wake(&self) {
        // Locked, so that none is between its look and its wait.
        let _state = self.0.state.lock().unwrap_or_else(PoisonError::into_inner);
        self.0.changed.notify_all();
    }

    /// Moves a test's clock once a worker waits; returns false if none does in time.
    pub(crate) fn advance(&self, duration: Duration, limit: Duration) -> bool {
        let state = self.0.state.lock().unwrap_or_else(PoisonError::into_inner);
        let waited = self.0.changed.wait_timeout_while(state, limit, |state| state.waiting == 0);
        let (mut state, timeout) = waited.unwrap_or_else(PoisonError::into_inner);
        if timeout.timed_out() {
            return false;
        }
        state.test_time = state.test_time.map(|now| now.saturating_add(duration));
        self.0.changed.notify_all();
        true
    }
}
