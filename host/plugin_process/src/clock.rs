//! The monotonic clock that all processes of a machine share.

use std::time::{Duration, Instant};

use rustix::time::{ClockId, clock_gettime};

/// Nanoseconds of the monotonic clock.
pub(crate) fn monotonic_nanos() -> u64 {
    let now = clock_gettime(ClockId::Monotonic);
    now.tv_sec as u64 * 1_000_000_000 + now.tv_nsec as u64
}

/// Turns times of that clock into instants, never later than now.
pub(crate) struct Instants {
    now: Instant,
    now_nanos: u64,
}

impl Instants {
    pub(crate) fn now() -> Self {
        Self { now: Instant::now(), now_nanos: monotonic_nanos() }
    }

    pub(crate) fn at(&self, monotonic_nanos: u64) -> Instant {
        let age = Duration::from_nanos(self.now_nanos.saturating_sub(monotonic_nanos));
        self.now.checked_sub(age).unwrap_or(self.now)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_of_another_process_are_instants_here() {
        let instants = Instants::now();
        assert_eq!(instants.at(instants.now_nanos), instants.now);
        assert_eq!(instants.at(u64::MAX), instants.now, "no sample comes from the future");
        let earlier = instants.at(instants.now_nanos - 1_000_000);
        assert_eq!(instants.now - earlier, Duration::from_millis(1));
    }
}
