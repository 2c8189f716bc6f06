//! What waits to be told, in order and within a limit.

use std::collections::{HashMap, VecDeque};

use busbar_protocol::message::{AlarmAction, CameraPose, TagQuality};

use crate::abi::*;

/// Events that wait and are not merged. Beyond that, states of an alarm are merged into its
/// last one, and of the rest the oldest goes and is counted.
pub(crate) const MAX_EVENTS: usize = 4096;
/// Names that something merged waits of: all tags, plugins and alarms that there can be.
const MAX_MERGED: usize = 1 << 18;

/// Something to tell.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Event {
    pub(crate) kind: u32,
    pub(crate) state: u32,
    pub(crate) unix_nanos: i64,
    pub(crate) number: f64,
    pub(crate) pose: Option<CameraPose>,
    pub(crate) id: String,
    pub(crate) text: String,
}

/// Events that wait.
#[derive(Debug, Default)]
pub(crate) struct Events {
    waiting: VecDeque<Waiting>,
    /// How many of them are single.
    single: usize,
    merged: HashMap<Key, Event>,
    dropped: u32,
}

#[derive(Debug)]
enum Waiting {
    Single(Event),
    Merged(Key),
}

/// Kind and name.
type Key = (u32, String);

impl Event {
    /// With a text alone.
    pub(crate) fn words(kind: u32, text: impl Into<String>) -> Self {
        Self { kind, text: text.into(), ..Self::default() }
    }

    /// With an id alone.
    pub(crate) fn of(kind: u32, id: impl Into<String>) -> Self {
        Self { kind, id: id.into(), ..Self::default() }
    }

    /// What it is merged by, if a later one says all that it does.
    fn key(&self) -> Option<Key> {
        match self.kind {
            BUSBAR_VIEW_QUALITY | BUSBAR_VIEW_PLUGIN => Some((self.kind, self.id.clone())),
            BUSBAR_VIEW_FRAME | BUSBAR_VIEW_HOVERED | BUSBAR_VIEW_CAMERA => {
                Some((self.kind, String::new()))
            }
            _ => None,
        }
    }
}

impl Events {
    /// Puts one behind the others.
    pub(crate) fn push(&mut self, event: Event) {
        let key = match event.kind {
            // One by one while there is room; but never past one that waits merged.
            BUSBAR_VIEW_ALARM => {
                let key = (event.kind, event.id.clone());
                let merges = self.single >= MAX_EVENTS || self.merged.contains_key(&key);
                merges.then_some(key)
            }
            _ => event.key(),
        };
        match key {
            Some(key) => self.merge(key, event),
            None => self.push_single(event),
        }
    }

    fn merge(&mut self, key: Key, event: Event) {
        if let Some(before) = self.merged.get_mut(&key) {
            *before = event;
        } else if self.merged.len() < MAX_MERGED {
            self.waiting.push_back(Waiting::Merged(key.clone()));
            self.merged.insert(key, event);
        } else {
            self.dropped = self.dropped.saturating_add(1);
        }
    }

    fn push_single(&mut self, event: Event) {
        if self.single >= MAX_EVENTS {
            self.dropped = self.dropped.saturating_add(1);
            let goes = |w: &Waiting| matches!(w, Waiting::Single(e) if e.kind != BUSBAR_VIEW_ALARM);
            let Some(oldest) = self.waiting.iter().position(goes) else { return };
            self.waiting.remove(oldest);
            self.single -= 1;
        }
        self.waiting.push_back(Waiting::Single(event));
        self.single += 1;
    }

    /// The oldest, and how many were dropped since the one before.
    pub(crate) fn pop(&mut self) -> Option<(Event, u32)> {
        let event = match self.waiting.pop_front()? {
            Waiting::Single(event) => {
                self.single -= 1;
                event
            }
            Waiting::Merged(key) => self.merged.remove(&key)?,
        };
        Some((event, std::mem::take(&mut self.dropped)))
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.waiting.is_empty()
    }
}

/// As the header has it.
pub(crate) fn quality_number(quality: TagQuality) -> u32 {
    match quality {
        TagQuality::Good => BUSBAR_VIEW_GOOD,
        TagQuality::Uncertain => BUSBAR_VIEW_UNCERTAIN,
        TagQuality::Bad => BUSBAR_VIEW_BAD,
    }
}

/// As the header has it, with seconds on the shelf.
pub(crate) fn action_number(action: AlarmAction) -> (u32, f64) {
    match action {
        AlarmAction::Acknowledge => (BUSBAR_VIEW_ACKNOWLEDGE, 0.0),
        AlarmAction::Shelve(seconds) => (BUSBAR_VIEW_SHELVE, f64::from(seconds)),
        AlarmAction::Unshelve => (BUSBAR_VIEW_UNSHELVE, 0.0),
        AlarmAction::Reset => (BUSBAR_VIEW_RESET, 0.0),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn all(events: &mut Events) -> Vec<(u32, String, u32)> {
        std::iter::from_fn(|| events.pop()).map(|(e, _)| (e.kind, e.id, e.state)).collect()
    }

    fn alarm(number: usize, state: u32) -> Event {
        Event { state, ..Event::of(BUSBAR_VIEW_ALARM, format!("alarm {number}")) }
    }

    #[test]
    fn what_says_the_same_is_merged_by_its_name() {
        let mut events = Events::default();
        for (kind, id) in [
            (BUSBAR_VIEW_HOVERED, "a"),
            (BUSBAR_VIEW_QUALITY, "t1"),
            (BUSBAR_VIEW_QUALITY, "t2"),
            (BUSBAR_VIEW_HOVERED, "b"),
            (BUSBAR_VIEW_QUALITY, "t1"),
            (BUSBAR_VIEW_PICKED, "a"),
            (BUSBAR_VIEW_PICKED, "a"),
        ] {
            events.push(Event::of(kind, id));
        }
        let left: Vec<_> = all(&mut events).into_iter().map(|(_, id, _)| id).collect();
        assert_eq!(left, ["b", "t1", "t2", "a", "a"]);
    }

    #[test]
    fn no_alarm_is_ever_lost() {
        let mut events = Events::default();
        (0..2 * MAX_EVENTS).for_each(|_| events.push(Event::of(BUSBAR_VIEW_PICKED, "x")));
        for state in 0..3 {
            (0..2 * MAX_EVENTS).for_each(|number| events.push(alarm(number, state)));
        }
        let (_, dropped) = events.pop().unwrap();
        assert_eq!(dropped as usize, MAX_EVENTS, "the picks, and they are counted");
        (0..9).for_each(|_| events.push(Event::of(BUSBAR_VIEW_PICKED, "y")));
        let left = all(&mut events);
        let last: HashMap<_, _> = left.iter().map(|(_, id, state)| (id.clone(), *state)).collect();
        for number in 0..2 * MAX_EVENTS {
            let id = format!("alarm {number}");
            assert_eq!(last.get(&id), Some(&2), "{id}");
        }
        assert!(left.len() <= 4 * MAX_EVENTS, "{} wait", left.len());
    }
}
