//! State of a tag as readers observe it, and numbers of tags by quality.

use std::time::Duration;

use busbar_types::{Origin, Quality, Value};
use serde::{Deserialize, Serialize};

use crate::SourceTime;

/// A tag at one instant.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TagState {
    /// The last value that came, however old or bad.
    pub value: Option<Value>,
    /// Quality of the value, freshness included.
    pub quality: Quality,
    /// Quality of the report that the value is. It differs from `quality` for a double point of
    /// both ends at once: no position, and a sure sign that the contacts contradict each other.
    pub report_quality: Quality,
    /// Age of the value: time since it came, and its lag before that.
    pub age: Option<Duration>,
    /// Time at the source, where the source gave one.
    pub source_time: Option<SourceTime>,
    /// Live, or simulated, recorded and the like.
    pub origin: Origin,
}

/// Numbers of tags by quality.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct QualityCounts {
    /// Number of good tags.
    pub good: usize,
    /// Number of uncertain tags.
    pub uncertain: usize,
    /// Number of bad tags.
    pub bad: usize,
}

impl QualityCounts {
    /// Counts a tag of this quality.
    pub fn add(&mut self, quality: Quality) {
        *self.count_mut(quality.level().code()) += 1;
    }

    /// Returns the count of a quality's level, by its number.
    pub(crate) fn count_mut(&mut self, level: u8) -> &mut usize {
        match level {
            0 => &mut self.good,
            1 => &mut self.uncertain,
            _ => &mut self.bad,
        }
    }
}
