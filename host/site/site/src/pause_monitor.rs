//! Pauses of the process or the machine: watched by a thread, so that a slow frame is none.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError, Weak};
use std::thread;
use std::time::Duration;

use busbar_tags::{ClockReadings, Pause, PauseDetector};

/// Period of the readings: well below the gap that counts as a pause.
const PERIOD: Duration = Duration::from_millis(500);

/// Watches the clocks for as long as it lives.
pub(crate) struct PauseMonitor(Arc<Mutex<MonitorState>>);

#[derive(Default)]
struct MonitorState {
    detector: PauseDetector,
    /// Last pause that was not taken; of several, the one that invalidates most values.
    pending: Option<Pause>,
    count: u64,
}

impl PauseMonitor {
    /// Starts the thread; without one (the system has none left) a slow frame counts as a
    /// pause, which distrusts more than need be.
    pub(crate) fn start() -> Self {
        let state = Arc::new(Mutex::new(MonitorState::default()));
        let weak = Arc::downgrade(&state);
        let spawned = thread::Builder::new().name("clocks".into()).spawn(move || monitor(&weak));
        if let Err(error) = spawned {
            tracing::warn!("the clocks have no thread: {error}");
        }
        Self(state)
    }

    /// Takes the pause that ended since the last call, up to this very moment.
    pub(crate) fn take(&self) -> Option<Pause> {
        let mut state = lock(&self.0);
        state.read();
        state.pending.take()
    }

    /// Number of pauses since the start.
    pub(crate) fn count(&self) -> u64 {
        lock(&self.0).count
    }
}

impl MonitorState {
    fn read(&mut self) {
        let Some(pause) = self.detector.observe(ClockReadings::now()) else { return };
        self.count += 1;
        let worse = |before: &Pause| before.trusted_from() > pause.trusted_from();
        self.pending = self.pending.filter(worse).or(Some(pause));
    }
}

fn monitor(state: &Weak<Mutex<MonitorState>>) {
    while let Some(state) = state.upgrade() {
        lock(&state).read();
        drop(state);
        thread::sleep(PERIOD);
    }
}

fn lock(state: &Mutex<MonitorState>) -> MutexGuard<'_, MonitorState> {
    state.lock().unwrap_or_else(PoisonError::into_inner)
}
