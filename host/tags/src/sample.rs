//! Updates of tags: as they come, and as the table takes them.

use std::time::{Duration, SystemTime, UNIX_EPOCH};

use serde::{Deserialize, Serialize};

use crate::{Moment, Quality, TagHandle, Update, Value};

/// When something was so at its source: nanoseconds since 1970-01-01 UTC.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct SourceTime(pub i64);

/// One update of one tag.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// The tag.
    pub tag: TagHandle,
    /// The value; `None` says something about quality only.
    pub value: Option<Value>,
    /// Quality at the source.
    pub quality: Quality,
    /// Time at the source, if it gave one. Orders the values of a tag.
    pub source_time: Option<SourceTime>,
    /// When the host got it.
    pub received: Moment,
    /// When the value was true: when it came, less how old it was then.
    pub valid_from: Moment,
}

/// What an update changed: the tag as it is now, freshness aside.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Change {
    /// The tag.
    pub tag: TagHandle,
    /// Its value.
    pub value: Option<Value>,
    /// Its quality, as its source and the host's rules have it.
    pub quality: Quality,
    /// Time at the source, if it gave one.
    pub source_time: Option<SourceTime>,
    /// When the host got it.
    pub received: Moment,
}

impl SourceTime {
    /// Of a time of the wall clock, as far as it can be counted.
    pub fn of(time: SystemTime) -> Option<Self> {
        let nanos = |duration: Duration| i64::try_from(duration.as_nanos()).ok();
        match time.duration_since(UNIX_EPOCH) {
            Ok(since) => nanos(since).map(Self),
            Err(error) => nanos(error.duration()).map(|before| Self(-before)),
        }
    }

    /// As a time of the wall clock.
    pub fn to_system_time(self) -> Option<SystemTime> {
        let distance = Duration::from_nanos(self.0.unsigned_abs());
        if self.0 < 0 { UNIX_EPOCH.checked_sub(distance) } else { UNIX_EPOCH.checked_add(distance) }
    }
}

impl Update for Sample {
    fn tag(&self) -> u32 {
        self.tag.0
    }

    fn has_value(&self) -> bool {
        self.value.is_some()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn source_times_are_times_of_the_wall_clock() {
        for nanos in [0, 1, -1, i64::MAX, i64::MIN + 1] {
            let time = SourceTime(nanos).to_system_time().unwrap();
            assert_eq!(SourceTime::of(time), Some(SourceTime(nanos)));
        }
        let late = UNIX_EPOCH + Duration::from_secs(1 << 40);
        assert_eq!(SourceTime::of(late), None);
    }
}
