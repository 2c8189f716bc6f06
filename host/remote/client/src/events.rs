//! Bounded event queue from the viewer to the program, with merging of superseded events.

use std::collections::{HashMap, VecDeque};

use busbar_protocol::message::{
    AlarmRequest, AlarmSnapshot, CameraPose, TagSnapshot, VerdictSnapshot,
};

/// Events that wait and are not merged. Beyond that, states of an alarm are merged into its
/// last one, and of the rest the oldest goes and is counted.
pub(crate) const MAX_EVENTS: usize = 4096;
/// Names that something merged waits of: all tags, plugins and alarms that there can be.
const MAX_MERGED: usize = 1 << 18;

/// Event of a view for the program.
#[derive(Clone, Debug, PartialEq)]
pub enum Event {
    /// The first picture is there.
    Ready {
        /// Name of the graphics device.
        device: String,
    },
    /// A new picture, or a changed state of the previous one. Merged.
    Frame,
    /// A piece of equipment was picked; empty for nothing.
    Picked(String),
    /// The pointer is over this; empty for nothing. Merged.
    Hovered(String),
    /// Pose of the camera. Merged.
    Camera(CameraPose),
    /// State of an alarm. Each change is delivered while there is room, and the last one of each
    /// alarm always.
    Alarm(AlarmSnapshot),
    /// An operator wants this of an alarm that the program decides on.
    AlarmRequested {
        /// Id of the alarm.
        alarm: String,
        /// Requested action of the operator.
        action: AlarmRequest,
    },
    /// Quality and origins of a tag's value. Merged by tag.
    Quality(TagSnapshot),
    /// Verdict of an overlay on a piece of equipment. Merged by both.
    Verdict(VerdictSnapshot),
    /// State of a plugin instance. Merged by plugin.
    Plugin {
        /// Name of the plugin instance.
        plugin: String,
        /// State of the instance, in words.
        state: String,
    },
    /// A command that failed, or a fault, with a remedy.
    Error(String),
    /// Reason for which no scene can be shown at all; the viewer ends, and is started again.
    Failed(String),
    /// The viewer is silent or gone, and how. What it last drew is dead.
    Lost(String),
    /// The viewer makes progress, and its picture is old; the text has the age. The picture stays
    /// marked until the viewer is fast enough again, which an [`Event::Recovered`] reports.
    Late(String),
    /// The viewer is back: with its last good configuration, camera, alarms and tags. Or it is
    /// fast enough again.
    Recovered {
        /// Reports whether another process draws, which reports the states of all alarms anew.
        is_another: bool,
        /// Reason for the recovery, in words.
        how: String,
    },
    /// The configuration of this path is shown from here on.
    Reloaded(String),
}

/// Events that the program has not taken yet.
#[derive(Debug, Default)]
pub(crate) struct Events {
    waiting: VecDeque<Waiting>,
    /// Number of events that are not merged.
    single: usize,
    merged: HashMap<Key, Event>,
    dropped: u32,
}

#[derive(Debug)]
enum Waiting {
    Single(Event),
    Merged(Key),
}

/// Key by which a later event supersedes an earlier one.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
enum Key {
    Frame,
    Hovered,
    Camera,
    Quality(String),
    Verdict(String, String),
    Plugin(String),
    Alarm(String),
}

impl Event {
    /// Returns the merge key, if a later event of that key makes this one superfluous.
    fn key(&self) -> Option<Key> {
        match self {
            Self::Frame => Some(Key::Frame),
            Self::Hovered(_) => Some(Key::Hovered),
            Self::Camera(_) => Some(Key::Camera),
            Self::Quality(snapshot) => Some(Key::Quality(snapshot.tag.clone())),
            Self::Verdict(snapshot) => {
                Some(Key::Verdict(snapshot.equipment.clone(), snapshot.overlay.clone()))
            }
            Self::Plugin { plugin, .. } => Some(Key::Plugin(plugin.clone())),
            _ => None,
        }
    }
}

impl Events {
    /// Appends an event to the queue, or merges it.
    pub(crate) fn push(&mut self, event: Event) {
        let key = match &event {
            // One by one while there is room; but never past one that waits merged.
            Event::Alarm(snapshot) => {
                let key = Key::Alarm(snapshot.alarm.clone());
                let merges = self.single >= MAX_EVENTS || self.merged.contains_key(&key);
                merges.then_some(key)
            }
            event => event.key(),
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
            let goes =
                |w: &Waiting| matches!(w, Waiting::Single(e) if !matches!(e, Event::Alarm(_)));
            let Some(oldest) = self.waiting.iter().position(goes) else { return };
            self.waiting.remove(oldest);
            self.single -= 1;
        }
        self.waiting.push_back(Waiting::Single(event));
        self.single += 1;
    }

    /// Returns the oldest event, and how many were dropped since the event before it.
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

/// Callback that takes waiting events, each with the number of events dropped before it. Events
/// that it leaves are handed over again.
pub type Listener = Box<dyn FnMut(&mut dyn Iterator<Item = (Event, u32)>) + Send>;

#[cfg(test)]
mod tests {
    use busbar_types::{AlarmState, Origin, QualityLevel};

    use super::*;

    fn alarm(number: usize, state: AlarmState) -> Event {
        let alarm = format!("alarm {number}");
        let [standing, reason] = [const { String::new() }; 2];
        Event::Alarm(AlarmSnapshot {
            alarm,
            state,
            since: 1,
            standing,
            origin: Origin::LIVE,
            reason,
        })
    }

    fn quality(tag: &str) -> Event {
        let (quality, origin) = (QualityLevel::Good, Origin::LIVE);
        Event::Quality(TagSnapshot { tag: tag.into(), quality, origin, reason: String::new() })
    }

    #[test]
    fn what_says_the_same_is_merged_by_its_name() {
        let mut events = Events::default();
        let (hovered, picked) = (|id: &str| Event::Hovered(id.into()), Event::Picked("a".into()));
        for event in [
            hovered("a"),
            quality("t1"),
            quality("t2"),
            hovered("b"),
            quality("t1"),
            picked.clone(),
            picked.clone(),
        ] {
            events.push(event);
        }
        let left: Vec<_> = std::iter::from_fn(|| events.pop()).map(|(event, _)| event).collect();
        assert_eq!(left, [hovered("b"), quality("t1"), quality("t2"), picked.clone(), picked]);
    }

    #[test]
    fn no_alarm_is_ever_lost() {
        let mut events = Events::default();
        (0..2 * MAX_EVENTS).for_each(|_| events.push(Event::Picked("x".into())));
        for state in [AlarmState::Normal, AlarmState::Unacknowledged, AlarmState::Acknowledged] {
            (0..2 * MAX_EVENTS).for_each(|number| events.push(alarm(number, state)));
        }
        let (_, dropped) = events.pop().unwrap();
        assert_eq!(dropped as usize, MAX_EVENTS, "the picks, and they are counted");
        (0..9).for_each(|_| events.push(Event::Picked("y".into())));
        let (mut last, mut count) = (HashMap::new(), 0);
        while let Some((event, _)) = events.pop() {
            count += 1;
            if let Event::Alarm(snapshot) = event {
                last.insert(snapshot.alarm, snapshot.state);
            }
        }
        for number in 0..2 * MAX_EVENTS {
            let id = format!("alarm {number}");
            assert_eq!(last.get(&id), Some(&AlarmState::Acknowledged), "{id}");
        }
        assert!(count <= 4 * MAX_EVENTS, "{count} wait");
    }
}
