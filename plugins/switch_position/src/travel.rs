//! How far a switch is on its way.

use busbar_plugin_sdk::DoublePoint;

/// Before its end is reported a switch is not shown there, nor where it began.
const LEAST: f64 = 0.06;
/// Where it is shown that is on its way, nobody knows from where.
const MIDDLE: f64 = 0.5;

/// The way of one switch, from open, 0, to closed, 1.
#[derive(Clone, Debug)]
pub struct Travel {
    seconds: f64,
    /// The end where it was last reported.
    end: Option<f64>,
    /// Since when it has been on its way, nanoseconds since 1970-01-01 UTC.
    since: Option<i64>,
}

impl Travel {
    /// Of a switch that takes so many seconds.
    pub fn taking(seconds: f64) -> Self {
        Self { seconds, end: None, since: None }
    }

    /// Where it is shown when it is reported so at an instant, nanoseconds since 1970-01-01
    /// UTC; none where that contradicts itself.
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
