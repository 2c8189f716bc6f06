//! Loss of life of the paper, accumulated over the scene's time (IEC 60076-7:2018, 6.4).

use crate::ageing::Paper;
use crate::assessment::GOOD_WIDTH;
use crate::interval::Interval;

/// Minutes of an hour.
const HOUR: f64 = 60.0;
/// Nanoseconds of a minute.
const NANOS_A_MINUTE: f64 = 60e9;
/// Greatest ageing rate that counts: that of normal paper at 337 degrees Celsius.
const MAX_RATE: f64 = 1e12;

/// Hours of life lost since the count began.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub(crate) struct LossOfLife {
    /// Hours of life lost, between bounds.
    pub(crate) hours: Interval,
    /// Hours of the scene's time that were counted.
    pub(crate) counted_hours: f64,
    /// Latest time counted, nanoseconds since 1970-01-01 UTC: where the clock is set back a
    /// little, time does not count twice.
    counted_until: i64,
}

impl LossOfLife {
    /// Begins a count at an instant.
    pub(crate) fn new(now: i64) -> Self {
        Self { hours: Interval::point(0.0), counted_hours: 0.0, counted_until: now }
    }

    /// Counts the time up to an instant between two hot-spot temperatures, from the first
    /// good one on. In time that was not seen the bounds hold for all of it, else the rate
    /// goes evenly from one to the other.
    pub(crate) fn count(
        &mut self,
        now: i64,
        paper: &Paper,
        [before, after]: [Interval; 2],
        is_seen: bool,
    ) {
        let minutes = now.saturating_sub(self.counted_until) as f64 / NANOS_A_MINUTE;
        if minutes <= 0.0 {
            return;
        }
        if self.counted_hours == 0.0 && before.width() > GOOD_WIDTH {
            self.counted_until = now;
            return;
        }
        let rates = |of: Interval| of.map(|degrees| paper.ageing_rate(degrees).min(MAX_RATE));
        let [before, after] = [rates(before), rates(after)];
        let rate = match is_seen {
            true => Interval::new(before.low.midpoint(after.low), before.high.midpoint(after.high)),
            false => before.hull(after),
        };
        self.counted_until = now;
        self.counted_hours += minutes / HOUR;
        self.hours = self.hours + rate.map(|rate| rate * minutes / HOUR);
    }

    /// Reports whether the numbers can be those of a count.
    pub(crate) fn is_plausible(&self) -> bool {
        let Interval { low, high } = self.hours;
        0.0 <= low
            && low <= high
            && high.is_finite()
            && (0.0..=f64::MAX).contains(&self.counted_hours)
    }
}
