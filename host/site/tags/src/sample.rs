//! Updates of tags: as they come, and as the table takes them.

use std::time::{Duration, SystemTime, UNIX_EPOCH};

use busbar_types::{Origin, Quality, Value};
use serde::{Deserialize, Serialize};

use crate::{Moment, TagHandle};

/// Timestamp of a source: nanoseconds since 1970-01-01 UTC.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct SourceTime(pub i64);

/// One update of one tag.
#[derive(Clone, Debug, PartialEq)]
pub struct Sample {
    /// Handle of the tag.
    pub tag: TagHandle,
    /// Value of the tag; `None` for a sample of quality alone.
    pub value: Option<Value>,
    /// Quality at the source.
    pub quality: Quality,
    /// Doubt of the host about the value, by its time or its way here; good where there is none.
    /// The doubt stays until the next value counts. Without a value the doubt concerns the last
    /// value.
    pub doubt: Quality,
    /// Time at the source, if it gave a usable one.
    pub source_time: Option<SourceTime>,
    /// Time of reception by the host.
    pub received: Moment,
    /// Time at which the value was true: its reception, less its age then.
    pub valid_from: Moment,
    /// Live, or simulated, recorded and the like.
    pub origin: Origin,
    /// Out of a buffer: older at its source than the value there is, it does not replace
    /// it. All other samples count in order of arrival.
    pub is_buffered: bool,
}

/// Change of a tag by an update: its state without freshness.
#[derive(Clone, Debug, PartialEq)]
pub struct Change {
    /// Handle of the tag.
    pub tag: TagHandle,
    /// Value after the change.
    pub value: Option<Value>,
    /// Quality after the change, by the source and the host's rules.
    pub quality: Quality,
    /// Time at the source, if it gave one.
    pub source_time: Option<SourceTime>,
    /// Time of reception by the host.
    pub received: Moment,
    /// Live, or simulated, recorded and the like.
    pub origin: Origin,
}

impl Sample {
    /// A live sample without a time of its own, true from when it came.
    pub fn live(tag: TagHandle, value: Option<Value>, quality: Quality, received: Moment) -> Self {
        Self {
            tag,
            value,
            quality,
            doubt: Quality::Good,
            source_time: None,
            received,
            valid_from: received,
            origin: Origin::LIVE,
            is_buffered: false,
        }
    }

    /// Adds a doubt about the value, which no later quality alone takes back.
    pub fn with_doubt(self, doubt: Quality) -> Self {
        Self { quality: self.quality.worst(doubt), doubt: self.doubt.worst(doubt), ..self }
    }
}

impl SourceTime {
    /// Converts a time of the wall clock; `None` where it is out of range.
    pub fn from_system_time(time: SystemTime) -> Option<Self> {
        let nanos = |duration: Duration| i64::try_from(duration.as_nanos()).ok();
        match time.duration_since(UNIX_EPOCH) {
            Ok(since) => nanos(since).map(Self),
            Err(error) => nanos(error.duration()).map(|before| Self(-before)),
        }
    }

    /// Converts to a time of the wall clock.
    pub fn to_system_time(self) -> Option<SystemTime> {
        let distance = Duration::from_nanos(self.0.unsigned_abs());
        if self.0 < 0 { UNIX_EPOCH.checked_sub(distance) } else { UNIX_EPOCH.checked_add(distance) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn source_times_are_times_of_the_wall_clock() {
        for nanos in [0, 1, -1, i64::MAX, i64::MIN + 1] {
            let time = SourceTime(nanos).to_system_time().unwrap();
            assert_eq!(SourceTime::from_system_time(time), Some(SourceTime(nanos)));
        }
        let late = UNIX_EPOCH + Duration::from_secs(1 << 40);
        assert_eq!(SourceTime::from_system_time(late), None);
    }
}
