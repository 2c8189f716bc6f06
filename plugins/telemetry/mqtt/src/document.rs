//! Payloads of plain topics: texts, or JSON with pointers into it.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::time::SystemTime;

use busbar_plugin_sdk::{Quality, Reason};
use serde_json::Value as Json;

use crate::convert::{Raw, quality_of_code};
use crate::payload_format::{PayloadFormat, hex_number};
use crate::point_states::StatedUnit;
use crate::points::Pointers;
use crate::source_time::{TimeUnit, show_unusable, time_of};

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
    /// Unreadable value, with a description of what is there instead.
    Unusable(Cow<'static, str>),
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

impl<'a> Document<'a> {
    pub(crate) fn new(bytes: &'a [u8]) -> Self {
        Self { bytes, json: None }
    }

    /// Reports whether a lookup found that the document is no JSON.
    pub(crate) fn is_broken(&self) -> bool {
        self.json == Some(None)
    }

    fn json(&mut self) -> Option<&Json> {
        self.json.get_or_insert_with(|| serde_json::from_slice(self.bytes).ok()).as_ref()
    }

    fn at(&mut self, pointer: &str) -> Option<&Json> {
        self.json()?.pointer(pointer)
    }

    /// Reads the source time, where the settings promise one; `unit` is that of the settings.
    pub(crate) fn time(&mut self, pointers: &Pointers, unit: Option<TimeUnit>) -> DocumentTime {
        let Some(pointer) = pointers.time.as_deref() else { return DocumentTime::NotPromised };
        let unit = pointers.time_unit.or(unit);
        let time = self.at(pointer).and_then(|json| time_of(json, unit));
        time.map_or(DocumentTime::Unusable, DocumentTime::At)
    }

    /// Describes what stands in place of the source time.
    pub(crate) fn show_time(&mut self, pointers: &Pointers, unit: Option<TimeUnit>) -> String {
        let pointer = pointers.time.as_deref().unwrap_or_default();
        match self.at(pointer) {
            None => format!("missing ('{pointer}')"),
            Some(json) => show_unusable(pointer, json, pointers.time_unit.or(unit)),
        }
    }

    /// Reads the quality of the value; an unreadable one is uncertain.
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

    /// Reads the unit of the value, where the settings promise one; JSON `null` states none.
    pub(crate) fn unit(&mut self, pointers: &Pointers) -> StatedUnit<'_> {
        let Some(pointer) = pointers.unit.as_deref() else { return StatedUnit::Absent };
        match self.json().map(|json| json.pointer(pointer)) {
            Some(Some(Json::String(text))) => StatedUnit::Named(text),
            // Of a document that is no JSON, the value tells.
            None | Some(Some(Json::Null)) => StatedUnit::Absent,
            Some(_) => StatedUnit::Unreadable,
        }
    }

    pub(crate) fn content(&mut self, pointers: &Pointers) -> Content<'_> {
        let format = pointers.format;
        if format == PayloadFormat::Text && pointers.value.is_none() {
            return Content::Value(Raw::Payload(self.bytes));
        }
        if self.bytes.is_empty() {
            return Content::Unusable("an empty payload".into());
        }
        let Some(pointer) = pointers.value.as_deref() else {
            return match (format, str::from_utf8(self.bytes)) {
                (PayloadFormat::Bytes(format), _) => content_of(format.read(self.bytes)),
                (_, Err(_)) => Content::Unusable("not UTF-8".into()),
                (_, Ok(text)) => content_of(read_hex(text)),
            };
        };
        let Some(json) = self.json() else { return Content::Unusable("no JSON".into()) };
        match (format, json.pointer(pointer)) {
            (_, None) => Content::Unusable("a document that has nothing at the pointer".into()),
            (_, Some(Json::Null)) => Content::Null,
            (PayloadFormat::Text, Some(json)) => plain_content(json),
            (PayloadFormat::Hex, Some(Json::String(text))) => content_of(read_hex(text)),
            (PayloadFormat::Bytes(format), Some(Json::String(text))) => {
                content_of(format.read(text.as_bytes()))
            }
            (_, Some(_)) => Content::Unusable("no text of hexadecimal digits".into()),
        }
    }
}

fn content_of<'a>(read: Result<Raw<'a>, Cow<'static, str>>) -> Content<'a> {
    read.map_or_else(Content::Unusable, Content::Value)
}

fn read_hex(text: &str) -> Result<Raw<'static>, Cow<'static, str>> {
    hex_number(text).map(Raw::Int).ok_or_else(|| "no hexadecimal number of 64 bits".into())
}

/// Converts a JSON value to the content of a message.
fn plain_content(json: &Json) -> Content<'_> {
    match json {
        Json::Null => Content::Null,
        Json::Bool(flag) => Content::Value(Raw::Bool(*flag)),
        Json::String(text) => Content::Value(Raw::Text(text)),
        Json::Number(number) => Content::Value(
            number
                .as_i64()
                .map(i128::from)
                .or_else(|| number.as_u64().map(i128::from))
                .map_or_else(|| Raw::Float(number.as_f64().unwrap_or(f64::NAN)), Raw::Int),
        ),
        Json::Array(_) => Content::Unusable("an array".into()),
        Json::Object(_) => Content::Unusable("an object".into()),
    }
}
