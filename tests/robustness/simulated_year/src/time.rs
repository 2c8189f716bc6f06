//! Wall clocks of simulated time.

use std::cell::Cell;
use std::time::{Duration, SystemTime, UNIX_EPOCH};

use tokio::time::Instant;

/// Start of the year as seconds since 1970: 1 January 2027, UTC.
const BEGINNING: u64 = 1_798_761_600;

thread_local! {
    /// Start of the year by the runtime's clock, and the seconds by which the adapter's clock is
    /// ahead of true time.
    static CLOCK: Cell<Option<(Instant, i64)>> = const { Cell::new(None) };
}

/// Wall clocks of the adapter and of its device for the year on this thread.
#[derive(Clone, Copy, Debug)]
pub struct SimulatedTime;

impl SimulatedTime {
    /// Sets the clocks to the beginning of the year.
    pub(crate) fn begin() {
        CLOCK.set(Some((Instant::now(), 0)));
    }

    pub(crate) fn set_adapter_ahead(seconds: i64) {
        CLOCK.set(CLOCK.get().map(|(started, _)| (started, seconds)));
    }

    /// Returns the time by the device's clock, by which its values move.
    pub fn of_device() -> SystemTime {
        let since = CLOCK.get().map(|(started, _)| started.elapsed());
        UNIX_EPOCH + Duration::from_secs(BEGINNING) + since.unwrap_or_default()
    }

    /// Returns the time by the clock of the adapter's machine.
    pub fn of_adapter() -> SystemTime {
        let ahead = CLOCK.get().map_or(0, |(_, ahead)| ahead);
        shift(Self::of_device(), ahead)
    }
}

/// Returns the time so many seconds later; not before 1970.
pub(crate) fn shift(time: SystemTime, seconds: i64) -> SystemTime {
    let distance = Duration::from_secs(seconds.unsigned_abs());
    let shifted = if seconds < 0 { time.checked_sub(distance) } else { time.checked_add(distance) };
    shifted.map_or(UNIX_EPOCH, |time| time.max(UNIX_EPOCH))
}
