//! Notifications to systemd, where it started this program (sd_notify(3)).

use std::time::{Duration, Instant};

use sd_notify::NotifyState;

/// Period at which systemd's watchdog is fed.
const FEED_PERIOD: Duration = Duration::from_secs(1);

/// Watchdog of systemd, fed while the program makes progress.
#[derive(Default)]
pub(crate) struct Watchdog {
    fed_at: Option<Instant>,
}

impl Watchdog {
    /// Feeds the watchdog; the first call also reports readiness.
    pub(crate) fn feed(&mut self) {
        if self.fed_at.is_none() {
            notify(NotifyState::Ready);
        }
        if self.fed_at.is_none_or(|at| at.elapsed() >= FEED_PERIOD) {
            self.fed_at = Some(Instant::now());
            notify(NotifyState::Watchdog);
        }
    }

    /// Reports the intended end of the program.
    pub(crate) fn end(&self) {
        notify(NotifyState::Stopping);
    }
}

fn notify(state: NotifyState<'_>) {
    // Without systemd there is nobody to be told.
    if let Err(error) = sd_notify::notify(false, &[state]) {
        tracing::debug!("systemd is not told: {error}");
    }
}
