//! Payloads of plain topics: texts, or JSON with pointers into it.

use std::collections::BTreeMap;
use std::time::{Duration, SystemTime, UNIX_EPOCH};

use busbar_plugin_sdk::{Quality, Reason};
use serde_json::Value as Json;

use crate::convert::{Raw, quality_of_code};
use crate::points::Pointers;

/// A payload, read as JSON when it first needs to be.
pub(crate) struct Document<'a> {
    bytes: &'a [u8],
    /// Once it was read; nothing in it where it is no JSON.
    json: Option<Option<Json>>,
}

/// Word of a message on one point.
pub(crate) enum Content<'a> {
    Value(Raw<'a>),
    /// JSON `null`: there is no value.
    Null,
    /// No value can be read, and what is there instead.
    Unusable(&'static str),
}

/// Source time of a value, as a document has it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum DocumentTime {
    /// The settings say nothing of a time.
    NotPromised,
    At(SystemTime),
    /// Missing, unreadable or impossible.
    Unusable,
}

/// Characters of a time that a log line shows.
const MAX_SHOWN_CHARS: usize = 60;

impl<'a> Document<'a> {
    pub(crate) fn new(bytes: &'a [u8]) -> Self {
        Self { bytes, json: None }
    }

    /// Tells whether something was looked for in it, and it is no JSON.
    pub(crate) fn is_broken(&self) -> bool {
        self.json == Some(None)
    }

    fn json(&mut self) -> Option<&Json> {
        self.json.get_or_insert_with(|| serde_json::from_slice(self.bytes).ok()).as_ref()
    }

    fn at(&mut self, pointer: &str) -> Option<&Json> {
        self.json()?.pointer(pointer)
    }

    /// Reads the source time, where the settings promise one.
    pub(crate) fn time(&mut self, pointers: &Pointers) -> DocumentTime {
        let Some(pointer) = pointers.time.as_deref() else { return DocumentTime::NotPromised };
        let json = self.at(pointer);
        json.and_then(time_of).map_or(DocumentTime::Unusable, DocumentTime::At)
    }

    /// Shows, in words, where a time was promised what is there instead.
    pub(crate) fn show_time(&mut self, pointers: &Pointers) -> String {
        let pointer = pointers.time.as_deref().unwrap_or_default();
        match self.at(pointer) {
            None => format!("missing ('{pointer}')"),
            Some(json) => {
                let text: String = json.to_string().chars().take(MAX_SHOWN_CHARS).collect();
                format!("unusable ('{pointer}' has {text}; RFC 3339 with a zone, or milliseconds)")
            }
        }
    }

    /// Reads the value's quality; one that nobody can read is no good sign.
    pub(crate) fn quality(
        &mut self,
        pointers: &Pointers,
        qualities: &BTreeMap<String, Quality>,
    ) -> Quality {
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

    pub(crate) fn content(&mut self, pointers: &Pointers) -> Content<'_> {
        if self.bytes.is_empty() {
            return Content::Unusable("an empty payload");
        }
        let Some(pointer) = pointers.value.as_deref() else {
            return std::str::from_utf8(self.bytes)
                .map_or(Content::Unusable("not UTF-8"), |text| Content::Value(Raw::Text(text)));
        };
        let Some(json) = self.json() else { return Content::Unusable("no JSON") };
        match json.pointer(pointer) {
            None => Content::Unusable("a document that has nothing at the pointer"),
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
            Some(Json::Array(_)) => Content::Unusable("an array"),
            Some(Json::Object(_)) => Content::Unusable("an object"),
        }
    }
}

/// Reads the state that a payload tells, as text.
pub(crate) fn state_of(payload: &[u8], pointer: Option<&str>) -> Option<String> {
    let Some(pointer) = pointer else {
        return std::str::from_utf8(payload).ok().map(|text| text.trim().to_owned());
    };
    match serde_json::from_slice::<Json>(payload).ok()?.pointer(pointer)? {
        Json::String(text) => Some(text.clone()),
        other => Some(other.to_string()),
    }
}

/// Reads a time as text by RFC 3339, or in milliseconds since 1970; `None` where it is
/// neither, or none that a source can mean.
fn time_of(json: &Json) -> Option<SystemTime> {
    let time = match json {
        Json::String(text) => SystemTime::from(text.trim().parse::<jiff::Timestamp>().ok()?),
        Json::Number(number) => {
            let since = match number.as_u64() {
                Some(millis) => Duration::from_millis(millis),
                None => Duration::try_from_secs_f64(number.as_f64()? / 1000.0).ok()?,
            };
            UNIX_EPOCH.checked_add(since)?
        }
        _ => return None,
    };
    is_possible(time).then_some(time)
}

/// Tells whether a source can mean a time: from 1970 on, and within what counts of
/// nanoseconds reach (2262).
pub(crate) fn is_possible(time: SystemTime) -> bool {
    let since = time.duration_since(UNIX_EPOCH);
    since.is_ok_and(|since| i64::try_from(since.as_nanos()).is_ok())
}

#[cfg(test)]
#[path = "document_tests.rs"]
mod tests;
