//! The sequence of events: what switched, in the order in which it came.

use std::collections::VecDeque;

use crate::{Change, HandleRemap};

/// Events that are kept; the oldest go first.
pub const MAX_EVENTS: usize = 1 << 16;

/// A change of state, and its number since the start.
#[derive(Clone, Debug, PartialEq)]
pub struct Event {
    /// 0 for the first.
    pub number: u64,
    /// Change of the tag.
    pub change: Change,
}

/// The last changes of states, not of measurements and texts.
#[derive(Clone, Debug, Default)]
pub struct EventLog {
    events: VecDeque<Event>,
    count: u64,
}

impl EventLog {
    /// Records a change of state; other changes are ignored.
    #[inline]
    pub fn note(&mut self, change: &Change) {
        if change.value.as_ref().is_some_and(|value| value.kind().is_state()) {
            self.push(change);
        }
    }

    fn push(&mut self, change: &Change) {
        if self.events.len() >= MAX_EVENTS {
            self.events.pop_front();
        }
        self.events.push_back(Event { number: self.count, change: change.clone() });
        self.count += 1;
    }

    /// Remaps the tags of all events; events of removed tags are dropped.
    pub fn renumber(&mut self, numbers: &HandleRemap) {
        self.events.retain_mut(|event| {
            let tag = numbers.tag(event.change.tag);
            event.change.tag = tag.unwrap_or(event.change.tag);
            tag.is_some()
        });
    }

    /// The events that are kept, the oldest first.
    pub fn events(&self) -> impl DoubleEndedIterator<Item = &Event> + ExactSizeIterator {
        self.events.iter()
    }

    /// Events since the start.
    pub fn count(&self) -> u64 {
        self.count
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Moment, TagHandle};
    use busbar_types::{Quality, Value};

    #[test]
    fn states_are_kept_in_order_and_measurements_are_not() {
        let mut log = EventLog::default();
        let change = |tag, value| Change {
            tag: TagHandle(tag),
            value: Some(value),
            quality: Quality::Good,
            source_time: None,
            received: Moment(0),
            origin: busbar_types::Origin::LIVE,
        };
        log.note(&change(0, Value::F64(1.0)));
        let count = MAX_EVENTS as u32 + 3;
        (0..count).for_each(|tag| log.note(&change(tag, Value::Bool(true))));
        assert_eq!((log.count(), log.events().len()), (u64::from(count), MAX_EVENTS));
        assert!(log.events().map(|event| event.number).eq(3..u64::from(count)));
    }
}
