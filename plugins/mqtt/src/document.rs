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

/// What a message says of one point.
pub(crate) enum Content<'a> {
    Value(Raw<'a>),
    Null,
    /// What it is instead of a value.
    Misfit(&'static str),
    /// The payload has nothing for the point.
    Missing,
}

impl<'a> Document<'a> {
    pub(crate) fn new(bytes: &'a [u8]) -> Self {
        Self { bytes, json: None }
    }

    /// Whether something was looked for in it, and it is no JSON.
    pub(crate) fn is_broken(&self) -> bool {
        self.json == Some(None)
    }

    fn json(&mut self) -> Option<&Json> {
        self.json.get_or_insert_with(|| serde_json::from_slice(self.bytes).ok()).as_ref()
    }

    fn at(&mut self, pointer: &str) -> Option<&Json> {
        self.json()?.pointer(pointer)
    }

    pub(crate) fn time(&mut self, pointers: &Pointers) -> Option<SystemTime> {
        time_of(self.at(pointers.time.as_deref()?)?)
    }

    /// What a payload says of the value's quality; what nobody can read is no good sign.
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
pub(crate) fn state_of(payload: &[u8], pointer: Option<&str>) -> Option<String> {
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

#[cfg(test)]
#[path = "document_tests.rs"]
mod tests;
