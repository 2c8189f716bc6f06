//! Snapshot: states of all tags at one instant.

use crate::{QualityCounts, TagHandle, TagState, TagTable};

/// States of all tags at the instant to which their table was last advanced. The snapshot borrows
/// the table, so nothing changes meanwhile and nothing is copied.
#[derive(Clone, Copy, Debug)]
pub struct Snapshot<'a> {
    table: &'a TagTable,
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
