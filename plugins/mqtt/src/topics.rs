//! Tags of plain topics: payloads as text or JSON, retained messages, availability.

use std::collections::{BTreeMap, HashMap};
use std::ops::Range;

use busbar_plugin_sdk::{LogLevel, Quality, Reason};
use rumqttc_v4::mqttbytes::{has_wildcards, matches};

use crate::desk::Desk;
use crate::document::{Content, Document, state_of};
use crate::points::Pointers;
use crate::settings::{Availability, Config, Retained};

/// The plain topics of all tags.
pub(crate) struct Topics {
    by_name: HashMap<Box<str>, Topic>,
    /// By point; points of topics are the first.
    pointers: Vec<Pointers>,
    guards: Vec<Guard>,
    retained: Retained,
    qualities: BTreeMap<String, Quality>,
}

#[derive(Clone, Debug)]
struct Topic {
    points: Range<usize>,
    /// What tells whether its source is there.
    guard: Option<usize>,
}

/// A source whose availability is told by a topic.
struct Guard {
    availability: Availability,
    is_gone: bool,
    points: Vec<Range<usize>>,
}

impl Topics {
    /// `places` are those of the first points, in their order.
    pub(crate) fn new(places: Vec<(String, Pointers)>, config: &Config) -> Self {
        let guard = |availability: &Availability| Guard {
            availability: availability.clone(),
            is_gone: false,
            points: Vec::new(),
        };
        let mut guards: Vec<_> = config.availability.iter().map(guard).collect();
        let mut pointers = Vec::with_capacity(places.len());
        let mut by_name: HashMap<Box<str>, Topic> = HashMap::new();
        for (index, (topic, place)) in places.into_iter().enumerate() {
            pointers.push(place);
            match by_name.get_mut(topic.as_str()) {
                Some(known) => known.points.end = index + 1,
                None => {
                    let guard =
                        guards.iter().position(|guard| covers(&guard.availability.covers, &topic));
                    by_name.insert(topic.into(), Topic { points: index..index + 1, guard });
                }
            }
        }
        for topic in by_name.values() {
            if let Some(guard) = topic.guard.and_then(|guard| guards.get_mut(guard)) {
                guard.points.push(topic.points.clone());
            }
        }
        let qualities = config.qualities.clone();
        Self { by_name, pointers, guards, retained: config.retained, qualities }
    }

    /// The filters to subscribe to, each once: those of the settings, and each topic that
    /// they do not cover.
    pub(crate) fn filters(&self, subscriptions: &[String]) -> Vec<String> {
        if self.by_name.is_empty() {
            return Vec::new();
        }
        let is_covered = |topic: &str| subscriptions.iter().any(|filter| covers(filter, topic));
        let guards = self.guards.iter().map(|guard| guard.availability.topic.as_str());
        let mut alone: Vec<_> = self
            .by_name
            .keys()
            .map(|topic| &**topic)
            .chain(guards)
            .filter(|topic| !is_covered(topic))
            .map(str::to_owned)
            .collect();
        alone.sort_unstable();
        alone.dedup();
        subscriptions.iter().cloned().chain(alone).collect()
    }

    /// The points that a filter would have brought.
    pub(crate) fn under(&self, filter: &str) -> Vec<Range<usize>> {
        let topics = self.by_name.iter().filter(|(topic, _)| covers(filter, topic));
        topics.map(|(_, topic)| topic.points.clone()).collect()
    }

    /// A connection begins: nobody has told yet who is there.
    pub(crate) fn begin(&mut self) {
        for guard in &mut self.guards {
            guard.is_gone = false;
        }
    }

    /// Takes a message.
    pub(crate) fn heed(&mut self, topic: &str, payload: &[u8], is_retained: bool, desk: &mut Desk) {
        let is_told = self.heed_availability(topic, payload, desk);
        let Some(Topic { points, guard }) = self.by_name.get(topic).cloned() else {
            desk.ignored.topics += u64::from(!is_told);
            return;
        };
        let is_gone = guard.and_then(|guard| self.guards.get(guard)).is_some_and(|g| g.is_gone);
        let mut document = Document::new(payload);
        for index in points {
            let Some(pointers) = self.pointers.get(index) else { continue };
            let time = document.time(pointers);
            if is_retained && time.is_none() && self.retained == Retained::Ignore {
                desk.ignored.retained += 1;
                continue;
            }
            let quality = if is_gone {
                Quality::Bad(Reason::Communication)
            } else {
                let is_ageless = is_retained && time.is_none();
                let told = document.quality(pointers, &self.qualities);
                match told {
                    Quality::Good if is_ageless && self.retained == Retained::Uncertain => {
                        Quality::Uncertain(Reason::Unknown)
                    }
                    told => told,
                }
            };
            match document.content(pointers) {
                Content::Value(raw) => desk.take(index, raw, quality, time),
                Content::Null => desk.take_null(index, time),
                Content::Misfit(what) => desk.take_misfit(index, what),
                Content::Missing => {
                    let place = pointers.value.as_deref().unwrap_or_default();
                    let text = format!("a message of '{topic}' has nothing at '{place}'");
                    desk.tell_of_point(index, &text);
                }
            }
        }
        if document.is_broken() {
            desk.ignored.malformed += 1;
        }
    }

    /// Whether a topic tells of a source; if so, takes what it tells.
    fn heed_availability(&mut self, topic: &str, payload: &[u8], desk: &mut Desk) -> bool {
        let Some(guard) = self.guards.iter_mut().find(|guard| guard.availability.topic == topic)
        else {
            return false;
        };
        let state = state_of(payload, guard.availability.pointer.as_deref());
        let is_there = state.is_some_and(|state| guard.availability.online.contains(&state));
        let was_gone = std::mem::replace(&mut guard.is_gone, !is_there);
        if !is_there {
            for points in guard.points.clone() {
                desk.mark(points, Reason::Communication);
            }
        }
        if was_gone == is_there {
            let what = if is_there { "is there again" } else { "is gone" };
            let covers = &guard.availability.covers;
            desk.tell(LogLevel::Info, &format!("'{topic}': the source of '{covers}' {what}"));
        }
        true
    }
}

/// Whether a filter brings a topic (MQTT 3.1.1, 4.7).
fn covers(filter: &str, topic: &str) -> bool {
    // Most filters of a site differ from most of its topics before their first wildcard.
    let literal = filter.find(['+', '#']).map_or(filter, |first| &filter[..first]);
    let stem = literal.strip_suffix('/').unwrap_or(literal);
    topic.starts_with(stem)
        && if has_wildcards(filter) { matches(topic, filter) } else { filter == topic }
}

#[cfg(test)]
#[path = "topics_tests.rs"]
mod tests;
