//! Timer queue of alarms: at most one due time each, so that a burst of changes leaves no stale
//! entries.

use std::collections::BTreeSet;

use busbar_tags::Moment;

use crate::AlarmHandle;

/// Alarms by the moment at which something of theirs is due.
#[derive(Debug, Default)]
pub(crate) struct Timers {
    due: BTreeSet<(Moment, AlarmHandle)>,
}

impl Timers {
    /// Moves an alarm from one moment to another.
    pub(crate) fn set(&mut self, alarm: AlarmHandle, from: Option<Moment>, to: Option<Moment>) {
        if from == to {
            return;
        }
        if let Some(from) = from {
            self.due.remove(&(from, alarm));
        }
        if let Some(to) = to {
            self.due.insert((to, alarm));
        }
    }

    /// The first alarm that is due by `now`.
    pub(crate) fn first_due(&self, now: Moment) -> Option<AlarmHandle> {
        self.due.first().filter(|(at, _)| *at <= now).map(|(_, alarm)| *alarm)
    }

    /// Returns the next due time.
    pub(crate) fn next(&self) -> Option<Moment> {
        self.due.first().map(|(at, _)| *at)
    }

    #[cfg(test)]
    pub(crate) fn len(&self) -> usize {
        self.due.len()
    }
}
