//! Payloads of notifications: JSON that anybody in the database may have written.

use std::borrow::Cow;

use serde::Deserialize;
use serde_json::Value as Json;

use crate::cell::Cell;
use crate::convert::Reading;
use crate::points::MAX_NAME_BYTES;

/// A notification of one new value.
#[derive(Debug, Deserialize)]
pub(crate) struct Payload {
    #[serde(alias = "tag")]
    key: String,
    value: Json,
    #[serde(default, deserialize_with = "given")]
    quality: Option<Json>,
    #[serde(default, deserialize_with = "given")]
    time: Option<Json>,
    #[serde(default, deserialize_with = "given")]
    unit: Option<Json>,
}

/// A payload that cannot be used.
#[derive(Debug, PartialEq, Eq)]
pub(crate) struct PayloadFault {
    /// The fault, in words that repeat nothing of it.
    pub(crate) what: String,
    /// Key of the payload, where it has one that can be trusted.
    pub(crate) key: Option<String>,
}

/// The part of a payload that says whose it is.
#[derive(Deserialize)]
struct Addressee {
    #[serde(alias = "tag")]
    key: String,
}

/// Tells a field that is null from one that is not there.
fn given<'de, D: serde::Deserializer<'de>>(deserializer: D) -> Result<Option<Json>, D::Error> {
    Json::deserialize(deserializer).map(Some)
}

impl Payload {
    /// Reads a payload; its fields besides these are left alone.
    ///
    /// # Errors
    /// The fault, and whose payload it is, where that can be told.
    pub(crate) fn parse(text: &str) -> Result<Self, PayloadFault> {
        let key = || serde_json::from_str::<Addressee>(text).ok().map(|found| found.key);
        Self::parse_whole(text).map_err(|what| PayloadFault { what, key: key() })
    }

    fn parse_whole(text: &str) -> Result<Self, String> {
        let payload: Self = serde_json::from_str(text).map_err(|error| {
            let (line, column) = (error.line(), error.column());
            let what = match error.classify() {
                serde_json::error::Category::Data => "JSON without a text `key` and a `value`",
                _ => "no JSON",
            };
            format!("it is {what} (line {line}, column {column})")
        })?;
        if payload.key.len() > MAX_NAME_BYTES {
            return Err(format!("its key has more than {MAX_NAME_BYTES} bytes"));
        }
        Ok(payload)
    }

    pub(crate) fn key(&self) -> &str {
        &self.key
    }

    pub(crate) fn reading(&self) -> Reading<'_> {
        Reading {
            value: cell(&self.value),
            quality: self.quality.as_ref().map(cell),
            time: self.time.as_ref().map(cell),
            unit: self.unit.as_ref().map(cell),
        }
    }
}

fn cell(json: &Json) -> Cell<'_> {
    match json {
        Json::Null => Cell::Null,
        Json::Bool(value) => Cell::Bool(*value),
        Json::Number(number) => match (number.as_i64(), number.as_f64()) {
            (Some(value), _) => Cell::Int(value),
            (None, Some(value)) => Cell::Float(value),
            (None, None) => Cell::Unusable("a number beyond all ranges".into()),
        },
        Json::String(text) => Cell::Text(Cow::from(text)),
        Json::Array(_) => Cell::Unusable("a list".into()),
        Json::Object(_) => Cell::Unusable("an object".into()),
    }
}

#[cfg(test)]
#[path = "payload_tests.rs"]
mod tests;
