//! Conversion of payload contents into values and qualities of tags.

use std::collections::BTreeMap;

use busbar_plugin_sdk::{
    DoublePoint, Quality, Reason, Text, Value, ValueKind, text_value, text_value_of_bytes,
};

use crate::payload_format::prefixed_hex_number;

/// Value as the payload encodes it, before its conversion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Raw<'a> {
    Float(f64),
    /// Wide enough for signed and unsigned integers of 64 bits.
    Int(i128),
    Bool(bool),
    Text(&'a str),
    /// Whole payload, whose bytes are text.
    Payload(&'a [u8]),
}

/// Conversion of payload values into values of a tag.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Mapping {
    pub(crate) kind: ValueKind,
    pub(crate) scale: f64,
    pub(crate) offset: f64,
    /// Values by their text, such as `"closed"` or `"true"`, before all else.
    pub(crate) values: BTreeMap<String, Value>,
}

impl Mapping {
    /// Converts a payload value to the value of the tag; `None` where it does not fit. The quality
    /// is not good where a text was cut, or is no UTF-8.
    pub(crate) fn value_of(&self, raw: Raw<'_>) -> Option<(Value, Quality)> {
        match (self.kind, raw) {
            (ValueKind::Text, Raw::Text(text)) => Some(text_value(text)),
            // Who clears a retained topic says nothing.
            (ValueKind::Text, Raw::Payload([])) => None,
            (ValueKind::Text, Raw::Payload(bytes)) => Some(text_value_of_bytes(bytes)),
            (ValueKind::Text, Raw::Int(number)) => {
                Some((Value::Text(Text::cut(&number.to_string())), Quality::Good))
            }
            (ValueKind::Text, Raw::Float(_) | Raw::Bool(_)) => None,
            (_, Raw::Payload(bytes)) => {
                let text = str::from_utf8(bytes).ok()?;
                Some((self.plain_value(Raw::Text(text))?, Quality::Good))
            }
            (_, raw) => Some((self.plain_value(raw)?, Quality::Good)),
        }
    }

    /// Converts a payload value to a number or a state; `None` where it does not fit.
    fn plain_value(&self, raw: Raw<'_>) -> Option<Value> {
        if !self.values.is_empty()
            && let Some(value) = self.by_text(raw)
        {
            return Some(value);
        }
        match (self.kind, raw) {
            (ValueKind::F64, Raw::Float(value)) => Some(self.scaled(value)),
            (ValueKind::F64, Raw::Int(value)) => Some(self.scaled(value as f64)),
            (ValueKind::I64, Raw::Int(value)) => i64::try_from(value).ok().map(Value::I64),
            (ValueKind::I64, Raw::Float(value)) => whole(value).map(Value::I64),
            // 1, 1.0 and "1.0" are one state.
            (ValueKind::Bool | ValueKind::DoublePoint, Raw::Float(value)) => {
                self.plain_value(Raw::Int(whole(value)?.into()))
            }
            (ValueKind::Bool, Raw::Bool(value)) => Some(Value::Bool(value)),
            (ValueKind::Bool, Raw::Int(bit @ 0..=1)) => Some(Value::Bool(bit == 1)),
            (ValueKind::DoublePoint, Raw::Int(bits @ 0..=3)) => {
                Some(Value::DoublePoint(DoublePoint::from_bits(bits as u64)))
            }
            (kind, Raw::Text(text)) => match kind.parse(text) {
                Some(Value::F64(value)) => Some(self.scaled(value)),
                Some(value) => Some(value),
                // A prefix shows that no decimal number is meant: `0x1F`.
                None => match (prefixed_hex_number(text), kind) {
                    (Some(number), _) => self.plain_value(Raw::Int(number)),
                    (None, ValueKind::F64) => None,
                    (None, _) => {
                        let number = text.trim().parse::<f64>().ok().and_then(whole)?;
                        self.plain_value(Raw::Int(number.into()))
                    }
                },
            },
            _ => None,
        }
    }

    fn by_text(&self, raw: Raw<'_>) -> Option<Value> {
        let named = match raw {
            Raw::Text(text) => self.values.get(text.trim()),
            Raw::Bool(value) => self.values.get(if value { "true" } else { "false" }),
            Raw::Int(value) => self.values.get(&value.to_string()),
            Raw::Float(value) => self.values.get(&whole(value)?.to_string()),
            Raw::Payload(_) => None,
        };
        named.cloned()
    }

    fn scaled(&self, value: f64) -> Value {
        Value::F64(value * self.scale + self.offset)
    }
}

/// Converts a number without a fraction to an integer, where an i64 can hold it.
fn whole(value: f64) -> Option<i64> {
    // Both limits are exact as f64; the upper one is the first that does not fit.
    const LIMIT: f64 = 9_223_372_036_854_775_808.0;
    (value.fract() == 0.0 && (-LIMIT..LIMIT).contains(&value)).then_some(value as i64)
}

/// Quality by a number: 0, 192 and 500 as Sparkplug 3.0, 6.4.15 has them; in between by the
/// two highest of the eight bits of OPC DA, from which these come.
pub(crate) fn quality_of_code(code: i64) -> Quality {
    match code {
        192..=255 => Quality::Good,
        64..=191 => Quality::Uncertain(Reason::Unknown),
        500 => Quality::Bad(Reason::Communication),
        _ => Quality::Bad(Reason::Unknown),
    }
}

/// Names the type of a payload value, for messages.
pub(crate) fn name_of(raw: Raw<'_>) -> &'static str {
    match raw {
        Raw::Float(_) => "a number with a fraction",
        Raw::Int(_) => "an integer",
        Raw::Bool(_) => "a boolean",
        Raw::Text(_) => "a text",
        Raw::Payload([]) => "an empty payload",
        Raw::Payload(bytes) if str::from_utf8(bytes).is_err() => "not UTF-8",
        Raw::Payload(_) => "a text",
    }
}

#[cfg(test)]
#[path = "convert_tests.rs"]
mod tests;
