//! Animated travel of a switch between its ends.

use busbar_plugin_sdk::DoublePoint;

/// Least share of the travel shown away from either end before the end is reported.
const LEAST: f64 = 0.06;
/// Position shown of a switch that travels from an unknown end.
const MIDDLE: f64 = 0.5;

/// Travel of one switch, from open, 0, to closed, 1.
#[derive(Clone, Debug)]
pub struct Travel {
    seconds: f64,
    /// End at which the switch was last reported.
    end: Option<f64>,
    /// Begin of the travel, nanoseconds since 1970-01-01 UTC.
    since: Option<i64>,
}

impl Travel {
    /// Creates the travel of a switch with this travel time, seconds.
    pub fn taking(seconds: f64) -> Self {
        Self { seconds, end: None, since: None }
    }

    /// Returns the position shown for a report at an instant, nanoseconds since 1970-01-01 UTC;
    /// none for a contradictory report.
    pub fn at(&mut self, point: DoublePoint, unix_nanos: i64) -> Option<f64> {
        let end = match point {
            DoublePoint::Off => 0.0,
            DoublePoint::On => 1.0,
            DoublePoint::Intermediate => return Some(self.on_its_way(unix_nanos)),
            DoublePoint::BadState => {
                (self.end, self.since) = (None, None);
                return None;
            }
        };
        (self.end, self.since) = (Some(end), None);
        Some(end)
    }

    fn on_its_way(&mut self, unix_nanos: i64) -> f64 {
        let since = *self.since.get_or_insert(unix_nanos);
        let Some(from) = self.end.filter(|_| self.seconds > 0.0) else { return MIDDLE };
        // The clock may be set back.
        let gone = unix_nanos.saturating_sub(since).max(0) as f64 * 1e-9;
        let share = (gone / self.seconds).clamp(LEAST, 1.0 - LEAST);
        if from == 0.0 { share } else { 1.0 - share }
    }
}
