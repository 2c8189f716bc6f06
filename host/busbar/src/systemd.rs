//! What systemd is told, where it started this (sd_notify(3)).

use std::time::{Duration, Instant};

use sd_notify::NotifyState;

/// How often its watchdog is fed.
const FEED_PERIOD: Duration = Duration::from_secs(1);

/// Tells systemd that this goes on.
#[derive(Default)]
pub(crate) struct Watchdog {
    fed_at: Option<Instant>,
}

impl Watchdog {
    /// It goes on; the first time also: it is ready.
    pub(crate) fn feed(&mut self) {
        if self.fed_at.is_none() {
            tell(NotifyState::Ready);
        }
        if self.fed_at.is_none_or(|at| at.elapsed() >= FEED_PERIOD) {
            self.fed_at = Some(Instant::now());
            tell(NotifyState::Watchdog);
        }
    }

    /// It ends, as it is to.
    pub(crate) fn end(&self) {
        tell(NotifyState::Stopping);
    }
}

fn tell(state: NotifyState<'_>) {
    // Without systemd there is nobody to be told.
    if let Err(error) = sd_notify::notify(false, &[state]) {
        tracing::debug!("systemd is not told: {error}");
    }
}
