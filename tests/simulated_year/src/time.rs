//! Wall clocks of simulated time.

use std::cell::Cell;
use std::time::{Duration, SystemTime, UNIX_EPOCH};

use tokio::time::Instant;

/// When a year begins: 1 January 2027, UTC, seconds since 1970.
const BEGINNING: u64 = 1_798_761_600;

thread_local! {
    /// When the year began by the runtime's clock, and how many seconds the adapter's
    /// clock is ahead of the true time.
    static CLOCK: Cell<Option<(Instant, i64)>> = const { Cell::new(None) };
}

/// The wall clocks of the adapter and of its device, of the year on this thread.
#[derive(Clone, Copy, Debug)]
pub struct SimulatedTime;

impl SimulatedTime {
    /// Now it is the beginning of the year.
    pub(crate) fn begin() {
        CLOCK.set(Some((Instant::now(), 0)));
    }

    pub(crate) fn set_adapter_ahead(seconds: i64) {
        CLOCK.set(CLOCK.get().map(|(started, _)| (started, seconds)));
    }

    /// By which the device's values move.
    pub fn of_device() -> SystemTime {
        let since = CLOCK.get().map(|(started, _)| started.elapsed());
        UNIX_EPOCH + Duration::from_secs(BEGINNING) + since.unwrap_or_default()
    }

    /// What the adapter's machine has for the time.
    pub fn of_adapter() -> SystemTime {
        let ahead = CLOCK.get().map_or(0, |(_, ahead)| ahead);
        shift(Self::of_device(), ahead)
    }
}

/// A time so many seconds later; not before 1970.
pub(crate) fn shift(time: SystemTime, seconds: i64) -> SystemTime {
    let distance = Duration::from_secs(seconds.unsigned_abs());
    let shifted = if seconds < 0 { time.checked_sub(distance) } else { time.checked_add(distance) };
    shifted.map_or(UNIX_EPOCH, |time| time.max(UNIX_EPOCH))
}
