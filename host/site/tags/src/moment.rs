//! Boot-time clock (`CLOCK_BOOTTIME`), on which freshness is counted.

use std::time::Duration;

use rustix::time::{ClockId, clock_gettime};
use serde::{Deserialize, Serialize};

const NANOS_PER_SECOND: u64 = 1_000_000_000;
/// Clock reading at boot, some 292 years. Values may be older than the uptime of the machine, and
/// their ages must not be cut there.
const BOOT: u64 = 1 << 63;

/// Instant of the boot-time clock, in nanoseconds. The clock never jumps, all processes of a
/// machine share it, and it also counts while the machine is suspended.
#[derive(
    Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize,
)]
pub struct Moment(pub u64);

impl Moment {
    /// Reads the clock now.
    pub fn now() -> Self {
        let now = clock_gettime(ClockId::Boottime);
        Self(BOOT + now.tv_sec as u64 * NANOS_PER_SECOND + now.tv_nsec as u64)
    }

    /// Returns the time since `earlier`; zero if that is later.
    pub fn since(self, earlier: Self) -> Duration {
        Duration::from_nanos(self.0.saturating_sub(earlier.0))
    }

    /// Returns the instant a duration later.
    #[must_use]
    pub fn after(self, duration: Duration) -> Self {
        Self(self.0.saturating_add(nanos(duration)))
    }

    /// Returns the instant a duration earlier.
    #[must_use]
    pub fn before(self, duration: Duration) -> Self {
        Self(self.0.saturating_sub(nanos(duration)))
    }
}

/// Nanoseconds of a duration; what does not fit is for ever.
fn nanos(duration: Duration) -> u64 {
    u64::try_from(duration.as_nanos()).unwrap_or(u64::MAX)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn moments_are_counted_in_nanoseconds_and_never_wrap() {
        let second = Duration::from_secs(1);
        assert_eq!(Moment(5).after(second), Moment(1_000_000_005));
        assert_eq!(Moment(5).before(second), Moment(0));
        assert_eq!(Moment(u64::MAX).after(Duration::MAX), Moment(u64::MAX));
        assert_eq!(Moment(7).since(Moment(9)), Duration::ZERO);
        let long_ago = Duration::from_secs(200 * 365 * 86_400);
        let now = Moment::now();
        assert_eq!(now.since(now.before(long_ago)), long_ago, "before the machine was up");
        assert!(Moment::now() >= now);
    }
}
