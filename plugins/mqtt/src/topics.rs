//! Tags of plain topics: payloads as text or JSON, retained messages, availability.

use std::collections::{BTreeMap, HashMap};
use std::ops::Range;
use std::time::{Duration, SystemTime, UNIX_EPOCH};

use busbar_plugin_sdk::{LogLevel, Quality, Reason};
use rumqttc_v4::mqttbytes::{has_wildcards, matches};
use serde_json::Value as Json;

use crate::convert::{Raw, quality_of_code};
use crate::desk::Desk;
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

/// A payload, read as JSON when it first needs to be.
struct Document<'a> {
    bytes: &'a [u8],
    /// Once it was read; nothing in it where it is no JSON.
    json: Option<Option<Json>>,
}

/// What a message says of one point.
enum Content<'a> {
    Value(Raw<'a>),
    Null,
    /// What it is instead of a value.
    Misfit(&'static str),
    /// The payload has nothing for the point.
    Missing,
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
        let mut document = Document { bytes: payload, json: None };
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
        if document.json == Some(None) {
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

impl Document<'_> {
    fn json(&mut self) -> Option<&Json> {
        self.json.get_or_insert_with(|| serde_json::from_slice(self.bytes).ok()).as_ref()
    }

    fn at(&mut self, pointer: &str) -> Option<&Json> {
        self.json()?.pointer(pointer)
    }

    fn time(&mut self, pointers: &Pointers) -> Option<SystemTime> {
        time_of(self.at(pointers.time.as_deref()?)?)
    }

    /// What a payload says of the value's quality; what nobody can read is no good sign.
    fn quality(&mut self, pointers: &Pointers, qualities: &BTreeMap<String, Quality>) -> Quality {
        let Some(pointer) = pointers.quality.as_deref() else { return Quality::Good };
        let unknown = Quality::Uncertain(Reason::Configuration);
        let words = |text: &str| qualities.get(&text.trim().to_lowercase()).copied();
        match self.at(pointer) {
            Some(Json::String(text)) => words(text).unwrap_or(unknown),
            Some(Json::Bool(flag)) => {
                words(if *flag { "true" } else { "false" }).unwrap_or(unknown)
            }
            Some(Json::Number(number)) => words(&number.to_string())
                .or_else(|| number.as_i64().map(quality_of_code))
                .unwrap_or(unknown),
            _ => unknown,
        }
    }

    fn content(&mut self, pointers: &Pointers) -> Content<'_> {
        if self.bytes.is_empty() {
            return Content::Null;
        }
        let Some(pointer) = pointers.value.as_deref() else {
            return std::str::from_utf8(self.bytes)
                .map_or(Content::Misfit("no text"), |text| Content::Value(Raw::Text(text)));
        };
        let Some(json) = self.json() else { return Content::Misfit("no JSON") };
        match json.pointer(pointer) {
            None => Content::Missing,
            Some(Json::Null) => Content::Null,
            Some(Json::Bool(flag)) => Content::Value(Raw::Bool(*flag)),
            Some(Json::String(text)) => Content::Value(Raw::Text(text)),
            Some(Json::Number(number)) => Content::Value(
                number
                    .as_i64()
                    .map(i128::from)
                    .or_else(|| number.as_u64().map(i128::from))
                    .map_or_else(|| Raw::Float(number.as_f64().unwrap_or(f64::NAN)), Raw::Int),
            ),
            Some(Json::Array(_)) => Content::Misfit("an array"),
            Some(Json::Object(_)) => Content::Misfit("an object"),
        }
    }
}

/// The state that a payload tells, as text.
fn state_of(payload: &[u8], pointer: Option<&str>) -> Option<String> {
    let Some(pointer) = pointer else {
        return std::str::from_utf8(payload).ok().map(|text| text.trim().to_owned());
    };
    match serde_json::from_slice::<Json>(payload).ok()?.pointer(pointer)? {
        Json::String(text) => Some(text.clone()),
        other => Some(other.to_string()),
    }
}

/// A time as text by RFC 3339, or in milliseconds since 1970.
fn time_of(json: &Json) -> Option<SystemTime> {
    match json {
        Json::String(text) => text.trim().parse::<jiff::Timestamp>().ok().map(SystemTime::from),
        Json::Number(number) => {
            let since = match number.as_u64() {
                Some(millis) => Duration::from_millis(millis),
                None => Duration::try_from_secs_f64(number.as_f64()? / 1000.0).ok()?,
            };
            UNIX_EPOCH.checked_add(since)
        }
        _ => None,
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
