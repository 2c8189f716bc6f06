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
    /// Notes that a member begins to be annunciated.
    pub(crate) fn enter(&mut self, alarm: AlarmHandle) {
        if self.annunciated == 0 {
            self.first = Some(alarm);
        }
        self.annunciated += 1;
    }

    /// Notes a member that was annunciated before the start: nobody knows which was first.
    pub(crate) fn enter_unordered(&mut self) {
        self.annunciated += 1;
    }

    /// Notes that a member is annunciated no longer. It is first no more, even if it comes
    /// back; after the last one all begins anew.
    pub(crate) fn leave(&mut self, alarm: AlarmHandle) {
        self.annunciated = self.annunciated.saturating_sub(1);
        self.first.take_if(|first| *first == alarm);
    }
}
