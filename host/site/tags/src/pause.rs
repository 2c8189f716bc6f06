//! Pause detection: suspend, stop and continue, pauses of a virtual machine.
//!
//! Three clocks are compared. While the machine is suspended the boot-time clock goes on
//! and the monotonic one stands still. While a process is stopped both go on and nobody
//! reads them. While a virtual machine is paused both stand still, and the wall clock is
//! set forward afterwards, as far as the guest keeps it in step. A pause that no clock
//! shows (a paused guest whose wall clock is never corrected) is not found.

use std::time::Duration;

use rustix::time::{ClockId, clock_gettime};

use crate::{Moment, SourceTime};

/// Longest time between two readings that is no pause: threads of a starved machine wait.
pub(crate) const MAX_READING_GAP: Duration = Duration::from_millis(1500);
/// Least difference of clocks that is a pause and no correction of one of them.
pub(crate) const MIN_CLOCK_DIFFERENCE: Duration = Duration::from_secs(1);

/// Readings of the three clocks at one instant.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ClockReadings {
    /// Boot-time clock, on which freshness is counted.
    pub boot: Moment,
    /// Reading of the monotonic clock, which stops while the machine is suspended, nanoseconds.
    pub monotonic_nanos: u64,
    /// Reading of the wall clock.
    pub wall: SourceTime,
}

/// A time in which nothing was read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Pause {
    /// The last reading before.
    pub from: Moment,
    /// The first reading after.
    pub until: Moment,
    /// Duration by the clock that shows most of it.
    pub duration: Duration,
    /// Clock or gap that showed it.
    pub evidence: PauseEvidence,
}

/// Kind of a pause, by what shows it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PauseEvidence {
    /// The boot-time clock went on without the monotonic one: the machine was suspended.
    Suspended,
    /// The clocks were not read for too long: the process was stopped, or starved.
    Stopped,
    /// The wall clock advanced without the others: the virtual machine was paused, or the wall
    /// clock was set forward.
    WallClockAhead,
}

/// Detector of pauses by successive readings.
#[derive(Clone, Copy, Debug, Default)]
pub struct PauseDetector {
    last: Option<ClockReadings>,
}

impl ClockReadings {
    /// Reads the three clocks.
    pub fn now() -> Self {
        let monotonic = clock_gettime(ClockId::Monotonic);
        let monotonic_nanos = monotonic.tv_sec as u64 * 1_000_000_000 + monotonic.tv_nsec as u64;
        let wall = SourceTime::from_system_time(std::time::SystemTime::now())
            .unwrap_or(SourceTime(i64::MAX));
        Self { boot: Moment::now(), monotonic_nanos, wall }
    }
}

impl PauseDetector {
    /// Compares readings with the ones before; returns the pause between them, if any.
    pub fn observe(&mut self, readings: ClockReadings) -> Option<Pause> {
        let last = self.last.replace(readings)?;
        let boot = readings.boot.since(last.boot);
        let monotonic =
            Duration::from_nanos(readings.monotonic_nanos.saturating_sub(last.monotonic_nanos));
        let wall = readings.wall.0.saturating_sub(last.wall.0);
        let wall = Duration::from_nanos(u64::try_from(wall).unwrap_or(0));
        let (duration, evidence) = if boot.saturating_sub(monotonic) >= MIN_CLOCK_DIFFERENCE {
            (boot, PauseEvidence::Suspended)
        } else if wall.saturating_sub(boot) >= MIN_CLOCK_DIFFERENCE {
            (wall, PauseEvidence::WallClockAhead)
        } else if boot >= MAX_READING_GAP {
            (boot, PauseEvidence::Stopped)
        } else {
            return None;
        };
        Some(Pause { from: last.boot, until: readings.boot, duration, evidence })
    }
}

impl Pause {
    /// Moment from which values are believed. While only this process stood still, what
    /// others published meanwhile is as good as ever.
    pub fn trusted_from(&self) -> Moment {
        match self.evidence {
            PauseEvidence::Stopped => self.from,
            PauseEvidence::Suspended | PauseEvidence::WallClockAhead => self.until,
        }
    }
}

impl std::fmt::Display for Pause {
    /// A sentence for log and panels.
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let seconds = self.duration.as_secs_f64();
        f.write_str(match self.evidence {
            PauseEvidence::Suspended => "the machine was suspended",
            PauseEvidence::Stopped => "the process was stopped",
            PauseEvidence::WallClockAhead => {
                "the virtual machine was paused, or the clock was set forward,"
            }
        })?;
        write!(f, " for {seconds:.1} s: values from before are stale until they are read anew")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Readings after so many milliseconds of each clock.
    fn at(boot: u64, monotonic: u64, wall: i64) -> ClockReadings {
        ClockReadings {
            boot: Moment(boot * 1_000_000),
            monotonic_nanos: monotonic * 1_000_000,
            wall: SourceTime(wall * 1_000_000),
        }
    }

    fn between(before: ClockReadings, after: ClockReadings) -> Option<PauseEvidence> {
        let mut detector = PauseDetector::default();
        assert_eq!(detector.observe(before), None);
        detector.observe(after).map(|pause| pause.evidence)
    }

    #[test]
    fn each_kind_of_pause_is_told_from_the_others_and_from_none() {
        let start = at(1000, 500, 9000);
        assert_eq!(between(start, at(1100, 600, 9100)), None);
        assert_eq!(between(start, at(2400, 1900, 10_400)), None, "a starved thread");
        assert_eq!(between(start, at(1100, 600, 9900)), None, "a small correction");
        assert_eq!(between(start, at(1100, 600, 2000)), None, "set back");
        let cases = [
            (at(6000, 5500, 14_000), PauseEvidence::Stopped),
            (at(6000, 600, 14_000), PauseEvidence::Suspended),
            (at(2050, 550, 10_050), PauseEvidence::Suspended),
            (at(1100, 600, 14_000), PauseEvidence::WallClockAhead),
        ];
        for (after, evidence) in cases {
            assert_eq!(between(start, after), Some(evidence), "{after:?}");
        }
    }

    #[test]
    fn readings_of_this_machine_show_no_pause() {
        let mut detector = PauseDetector::default();
        assert_eq!(detector.observe(ClockReadings::now()), None);
        assert_eq!(detector.observe(ClockReadings::now()), None);
    }
}
