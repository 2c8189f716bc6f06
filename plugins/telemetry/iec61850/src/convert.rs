//! Data on the wire -> values, qualities and times of tags.

use std::time::{Duration, SystemTime, UNIX_EPOCH};

use busbar_plugin_sdk as sdk;
use busbar_plugin_sdk::{DoublePoint, Reason, ValueKind, text_value, text_value_of_bytes};
use iec61850_rs::common::{EntryTime, Source};
use iec61850_rs::proto::data::{Typed, Value, tag};
use iec61850_rs::{Quality, UtcTime, Validity};

use crate::points::Point;
use crate::service::AccessError;

/// Converts data to the value of a tag, with its quality: uncertain for a text that was cut or has
/// bytes that are no characters. Nothing where the data does not fit the tag.
pub(crate) fn value_of(point: &Point, data: &Value) -> Option<(sdk::Value, sdk::Quality)> {
    let value = match point.kind {
        ValueKind::Text => return text_of(data),
        ValueKind::Bool => data.as_bool().map(sdk::Value::Bool),
        ValueKind::DoublePoint => {
            let position = data.as_dbpos()?;
            Some(sdk::Value::DoublePoint(DoublePoint::from_bits(position.to_code().into())))
        }
        ValueKind::I64 => integer(data).map(sdk::Value::I64),
        ValueKind::F64 => {
            let number = data.as_f64().or_else(|| integer(data).map(|value| value as f64))?;
            Some(sdk::Value::F64(number * point.scale + point.offset))
        }
    };
    value.map(|value| (value, sdk::Quality::Good))
}

/// Returns a text, or the digits of a whole number.
fn text_of(data: &Value) -> Option<(sdk::Value, sdk::Quality)> {
    match data {
        Value::VisibleString(text) | Value::MmsString(text) => {
            Some(text_value_of_bytes(text.as_bytes()))
        }
        Value::Integer(value) => Some(text_value(&value.to_string())),
        Value::Unsigned(value) => Some(text_value(&value.to_string())),
        Value::Other { bytes, .. } if is_text(data) => Some(text_value_of_bytes(bytes)),
        _ => None,
    }
}

/// Reports whether data is a text, also one whose bytes are no characters of its type.
fn is_text(data: &Value) -> bool {
    match data {
        Value::VisibleString(_) | Value::MmsString(_) => true,
        Value::Other { tag: number, constructed, .. } => {
            !constructed && matches!(*number, tag::VISIBLE_STRING | tag::MMS_STRING)
        }
        _ => false,
    }
}

fn integer(data: &Value) -> Option<i64> {
    data.as_i64().or_else(|| data.as_u64().and_then(|value| value.try_into().ok()))
}

/// Returns the name of a data type for messages.
pub(crate) fn name_of(data: &Value) -> &'static str {
    match data {
        _ if is_text(data) => "a text",
        Value::Array(_) => "an array",
        Value::Structure(_) => "a structure",
        Value::Boolean(_) => "a boolean",
        Value::BitString { unused: 6, bytes } if bytes.len() == 1 => "a double point",
        Value::BitString { .. } => "a bit string",
        Value::Integer(_) | Value::Unsigned(_) => "an integer",
        Value::Float32(_) | Value::Float64(_) => "a floating-point number",
        Value::OctetString(_) => "an octet string",
        Value::UtcTime(_) | Value::BinaryTime(_) => "a time",
        Value::VisibleString(_) | Value::MmsString(_) | Value::Other { .. } => "of another type",
    }
}

/// Quality by the bits of IEC 61850-7-3, 6.2, the worst first. The README has it as a
/// table.
pub(crate) fn quality_of(quality: Quality) -> sdk::Quality {
    use sdk::Quality::{Bad, Good, Uncertain};
    let is_out_of_range = quality.overflow || quality.out_of_range;
    match quality.validity {
        _ if quality.failure => Bad(Reason::Sensor),
        _ if quality.old_data => Bad(Reason::Communication),
        Validity::Invalid if is_out_of_range => Bad(Reason::OutOfRange),
        Validity::Invalid => Bad(Reason::Sensor),
        Validity::Reserved => Bad(Reason::Unknown),
        // What is put in for a test must not be taken for the process.
        _ if quality.test => Bad(Reason::Unknown),
        _ if is_out_of_range => Uncertain(Reason::OutOfRange),
        Validity::Questionable => Uncertain(Reason::Unknown),
        Validity::Good => {
            let is_doubtful = quality.bad_reference
                || quality.oscillatory
                || quality.inconsistent
                || quality.inaccurate
                || quality.source == Source::Substituted
                || quality.operator_blocked;
            if is_doubtful { Uncertain(Reason::Unknown) } else { Good }
        }
    }
}

/// Origin by `source` and `test` (IEC 61850-7-3, 6.2).
pub(crate) fn origin_of(quality: Quality) -> sdk::SampleFlags {
    let mut origin = sdk::SampleFlags::LIVE;
    if quality.source == Source::Substituted {
        origin |= sdk::SampleFlags::SUBSTITUTED;
    }
    if quality.test {
        origin |= sdk::SampleFlags::TEST;
    }
    origin
}

/// Returns the reason of a tag whose variable the server refuses.
pub(crate) fn reason_of(error: AccessError) -> Reason {
    match error {
        AccessError::HARDWARE_FAULT => Reason::Sensor,
        AccessError::TEMPORARILY_UNAVAILABLE => Reason::Communication,
        _ => Reason::Configuration,
    }
}

/// A time `t` (IEC 61850-7-2, 6.1.2.9).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum Stamp {
    /// No timestamp was sent.
    #[default]
    Absent,
    /// Never set, or of a clock that is not synchronised: it may be far off, and says
    /// nothing of a value that is told as it is now.
    Untrusted,
    /// To be ignored, for the clock has failed, or no time at all.
    Unusable,
    At(SystemTime),
}

/// Reads a time by its quality.
pub(crate) fn stamp_of(time: UtcTime) -> Stamp {
    if time.quality.clock_failure {
        Stamp::Unusable
    } else if time.quality.clock_not_synchronized || time.seconds == 0 {
        Stamp::Untrusted
    } else {
        Stamp::At(UNIX_EPOCH + Duration::from_nanos(time.to_unix_nanos()))
    }
}

/// The time of a report's entry, if it was set.
pub(crate) fn entry_time_of(time: EntryTime) -> Option<SystemTime> {
    (time != EntryTime::default())
        .then(|| UNIX_EPOCH + Duration::from_millis(time.to_unix_millis()))
}

#[cfg(test)]
#[path = "convert_tests.rs"]
mod tests;
