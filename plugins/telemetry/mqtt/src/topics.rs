//! Tags of plain topics: payloads as text or JSON, retained messages, availability.

use std::collections::{BTreeMap, HashMap};
use std::ops::Range;

use busbar_plugin_sdk::{LogLevel, Quality, Reason, SampleFlags, Value};
use rumqttc_v4::mqttbytes::{has_wildcards, matches};

use crate::availability::Guard;
use crate::convert::name_of;
use crate::document::{Content, Document, DocumentTime};
use crate::point_states::{PointStates, Stamp};
use crate::points::Pointers;
use crate::settings::{Config, Retained};
use crate::source_time::TimeUnit;

/// The plain topics of all tags.
pub(crate) struct Topics {
    by_name: HashMap<Box<str>, Topic>,
    /// By point; points of topics are the first.
    pointers: Vec<Pointers>,
    guards: Vec<Guard>,
    retained: Retained,
    qualities: BTreeMap<String, Quality>,
    /// Unit of counts of time of tags that name none.
    time_unit: Option<TimeUnit>,
}

#[derive(Clone, Debug)]
struct Topic {
    points: Range<usize>,
    /// Index of the availability guard of the topic's source.
    guard: Option<usize>,
}

impl Topics {
    /// `places` are those of the first points, in their order.
    pub(crate) fn new(places: Vec<(String, Pointers)>, config: &Config) -> Self {
        let mut guards: Vec<_> = config.availability.iter().map(Guard::new).collect();
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
        let (retained, time_unit) = (config.retained, config.time_unit);
        Self { by_name, pointers, guards, retained, qualities, time_unit }
    }

    /// Returns the topic filters to subscribe to, each once: those of the settings, and each topic
    /// that they do not cover.
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

    /// Returns the points of all topics that a filter covers.
    pub(crate) fn under(&self, filter: &str) -> Vec<Range<usize>> {
        let topics = self.by_name.iter().filter(|(topic, _)| covers(filter, topic));
        topics.map(|(_, topic)| topic.points.clone()).collect()
    }

    /// Reports whether the settings treat retained values of unknown age as new.
    pub(crate) fn takes_retained_as_new(&self) -> bool {
        self.retained == Retained::Good && !self.by_name.is_empty()
    }

    /// Begins a connection, in which the state of all sources is not known yet.
    pub(crate) fn begin(&mut self) {
        self.guards.iter_mut().for_each(Guard::begin);
    }

    /// Takes a message; its payload is missing where it was too long.
    pub(crate) fn handle(
        &mut self,
        topic: &str,
        payload: Option<&[u8]>,
        is_retained: bool,
        point_states: &mut PointStates,
    ) {
        let is_told = self.heed_availability(topic, payload, point_states);
        let Some(Topic { points, guard }) = self.by_name.get(topic).cloned() else {
            point_states.ignored.topics += u64::from(!is_told);
            return;
        };
        let is_gone = guard.and_then(|guard| self.guards.get(guard)).is_some_and(|g| g.is_gone);
        let Some(payload) = payload else {
            for index in points {
                take_unusable(index, "a message that is too long", is_gone, point_states);
            }
            return;
        };
        let mut document = Document::new(payload);
        for index in points {
            let Some(pointers) = self.pointers.get(index) else { continue };
            let time = document.time(pointers, self.time_unit);
            let is_ageless = is_retained && !matches!(time, DocumentTime::At(_));
            if is_ageless && self.retained == Retained::Ignore {
                point_states.ignored.retained += 1;
                continue;
            }
            let mut stamp = Stamp {
                quality: document.quality(pointers, &self.qualities),
                source_time: None,
                flags: SampleFlags::LIVE,
            };
            if is_gone {
                stamp.quality = Quality::Bad(Reason::Communication);
            }
            match time {
                DocumentTime::At(time) => stamp.source_time = Some(time),
                DocumentTime::Unusable => {
                    stamp.flags |= SampleFlags::TIME_UNUSABLE;
                    point_states.tell_time(index, || document.show_time(pointers, self.time_unit));
                }
                // Only the settings can say that such a value is new.
                DocumentTime::NotPromised if is_ageless && self.retained != Retained::Good => {
                    stamp.flags |= SampleFlags::TIME_UNUSABLE;
                }
                DocumentTime::NotPromised => {}
            }
            if is_retained && stamp.source_time.is_some() {
                // The broker's store: older than what came live, if its time says so.
                stamp.flags |= SampleFlags::BUFFERED;
            }
            if pointers.unit.is_some() {
                point_states.note_unit(index, document.unit(pointers));
            }
            match document.content(pointers) {
                Content::Value(raw) => match point_states.value_of(index, raw) {
                    Some((Value::F64(number), _)) if !number.is_finite() => {
                        take_unusable(index, "no finite number", is_gone, point_states);
                    }
                    Some(value) => point_states.take_value(index, value, stamp),
                    None => take_unusable(index, name_of(raw), is_gone, point_states),
                },
                Content::Null => point_states.take_null(index, stamp),
                Content::Unusable(what) => take_unusable(index, &what, is_gone, point_states),
            }
        }
        if document.is_broken() {
            point_states.ignored.malformed += 1;
        }
    }

    /// Handles the message of an availability topic; false for other topics. A source whose state
    /// cannot be read counts as offline.
    fn heed_availability(
        &mut self,
        topic: &str,
        payload: Option<&[u8]>,
        point_states: &mut PointStates,
    ) -> bool {
        let Some(guard) = self.guards.iter_mut().find(|guard| guard.availability.topic == topic)
        else {
            return false;
        };
        let notice = guard.take(payload);
        if !notice.is_there {
            for points in guard.points.clone() {
                point_states.mark(points, Reason::Communication);
            }
        }
        if let Some((is_warning, line)) = notice.line {
            let level = if is_warning { LogLevel::Warning } else { LogLevel::Info };
            point_states.tell(level, &line);
        }
        true
    }
}

/// Publishes an unusable value, or a bad one where the source is offline.
fn take_unusable(index: usize, what: &str, is_gone: bool, point_states: &mut PointStates) {
    if is_gone {
        point_states.mark(index..index + 1, Reason::Communication);
    } else {
        point_states.take_unusable(index, what);
    }
}

/// Reports whether a filter matches a topic (MQTT 3.1.1, 4.7).
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
