//! Observed motion of a switch: settled, travelling within its time, or too long.

use busbar_plugin_sdk::DoublePoint;

const NANOS_PER_SECOND: f64 = 1e9;
/// Longest travel of a switch that has no time of its own, seconds: motor drives of
/// disconnectors take up to some 20 s.
pub(crate) const DEFAULT_TRAVEL_SECONDS: f64 = 30.0;

/// Observed motion of a switch.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Motion {
    /// Switch at one of its ends.
    Settled,
    /// Switch that travels for no longer than its travel time.
    Travelling,
    /// Switch that travels for longer than its travel time.
    TooLong,
    /// Switch that travels since an unknown instant.
    SinceUnknown,
    /// Switch reported open and closed at once.
    Contradiction,
    /// Switch of an unknown position.
    Unknown,
}

/// Bounds of a switch's time of travel: since it was last observed elsewhere, and since it was
/// first observed travelling without a gap.
#[derive(Clone, Debug, Default)]
pub(crate) struct MotionWatch {
    /// Instant at which it was last seen not travelling, nanoseconds since 1970-01-01 UTC.
    elsewhere: Option<i64>,
    /// Instant since which it has been seen travelling without a gap.
    travelling: Option<i64>,
    /// Instant of the last frame.
    latest: Option<i64>,
}

impl MotionWatch {
    /// Takes an observation at an instant, none where it is not good, of a switch with this travel
    /// time, seconds.
    pub(crate) fn see(
        &mut self,
        point: Option<DoublePoint>,
        unix_nanos: i64,
        travel_seconds: f64,
    ) -> Motion {
        if self.latest.is_some_and(|latest| latest > unix_nanos) {
            // The clock was set back: what was seen is of another time.
            *self = Self::default();
        }
        self.latest = Some(unix_nanos);
        match point {
            None => {
                self.travelling = None;
                Motion::Unknown
            }
            Some(DoublePoint::Intermediate) => {
                let since = *self.travelling.get_or_insert(unix_nanos);
                let seconds = |from: i64| unix_nanos.saturating_sub(from) as f64 / NANOS_PER_SECOND;
                if seconds(since) > travel_seconds {
                    return Motion::TooLong;
                }
                match self.elsewhere {
                    Some(instant) if seconds(instant) <= travel_seconds => Motion::Travelling,
                    _ => Motion::SinceUnknown,
                }
            }
            Some(end) => {
                (self.elsewhere, self.travelling) = (Some(unix_nanos), None);
                match end {
                    DoublePoint::BadState => Motion::Contradiction,
                    _ => Motion::Settled,
                }
            }
        }
    }
}
