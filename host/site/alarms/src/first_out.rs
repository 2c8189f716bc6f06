//! First-out: which alarm of a group came first (ISA-18.1, first-out sequences).

use crate::AlarmHandle;

/// A group of alarms.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Group {
    /// The one that came first since none of them was annunciated.
    pub(crate) first: Option<AlarmHandle>,
    /// Number of annunciated alarms of the group.
    annunciated: u32,
}

impl Group {
    /// Records that a member is annunciated.
    pub(crate) fn enter(&mut self, alarm: AlarmHandle) {
        if self.annunciated == 0 {
            self.first = Some(alarm);
        }
        self.annunciated += 1;
    }

    /// Records a member that was annunciated before the start, so that its order is unknown.
    pub(crate) fn enter_unordered(&mut self) {
        self.annunciated += 1;
    }

    /// Records that a member is no longer annunciated. It loses its first-out mark, even if it
    /// returns; after the last member the group starts anew.
    pub(crate) fn leave(&mut self, alarm: AlarmHandle) {
        self.annunciated = self.annunciated.saturating_sub(1);
        self.first.take_if(|first| *first == alarm);
    }
}
