//! Snapshot: states of all tags at one instant.

use std::time::Duration;

use serde::{Deserialize, Serialize};

use crate::{Origin, Quality, SourceTime, TagHandle, TagTable, Value};

/// A tag at one instant.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct TagState {
    /// The last value that came, however old or bad.
    pub value: Option<Value>,
    /// Quality of the value, freshness included.
    pub quality: Quality,
    /// Age of the value: time since it came, and its lag before that.
    pub age: Option<Duration>,
    /// Time at the source, where the source gave one.
    pub source_time: Option<SourceTime>,
    /// Live, or simulated, recorded and the like.
    pub origin: Origin,
}

/// States of all tags at the instant to which their table was last advanced. The snapshot borrows
/// the table, so nothing changes meanwhile and nothing is copied.
#[derive(Clone, Copy, Debug)]
pub struct Snapshot<'a> {
    table: &'a TagTable,
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

impl<'a> Snapshot<'a> {
    pub(crate) fn new(table: &'a TagTable) -> Self {
        Self { table }
    }

    /// The state of a tag of the same table.
    pub fn state(self, tag: TagHandle) -> Option<TagState> {
        self.table.state(tag)
    }

    /// Iterates over the states of all tags, by handle.
    pub fn states(self) -> impl ExactSizeIterator<Item = TagState> + 'a {
        self.table.states()
    }

    /// The tags that changed since the instant before, in value or quality, each once;
    /// becoming stale is a change.
    pub fn changed(self) -> &'a [TagHandle] {
        self.table.changed()
    }

    /// Returns the numbers of tags by quality.
    pub fn counts(self) -> QualityCounts {
        self.table.counts()
    }
}

impl QualityCounts {
    /// Counts a tag of this quality.
    pub fn add(&mut self, quality: Quality) {
        *self.count_mut(quality.rank()) += 1;
    }

    /// The count of a quality's rank.
    pub(crate) fn count_mut(&mut self, rank: u8) -> &mut usize {
        match rank {
            0 => &mut self.good,
            1 => &mut self.uncertain,
            _ => &mut self.bad,
        }
    }
}
