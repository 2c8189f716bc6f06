//! Objects on the wire -> values and qualities of tags.

use busbar_plugin_sdk::{DoublePoint, Quality, Reason, SampleFlags, Value, ValueKind};

use crate::codec::{self, Flags, Object};
use crate::points::{ObjectType, Point};

/// A normalised value of one is 2^15.
const NORMALIZED_ONE: f64 = 32_768.0;

/// The value of a tag; nothing where the object's type does not fit the tag.
pub(crate) fn value_of(point: &Point, value: codec::Value) -> Option<Value> {
    if point.object_type != ObjectType::Any && point.object_type != type_of(value) {
        return None;
    }
    match point.kind {
        ValueKind::Bool => match (value, point.bit) {
            (codec::Value::Single(is_on), None) => Some(Value::Bool(is_on)),
            (codec::Value::Bits(bits), Some(bit)) => Some(Value::Bool(bits >> bit & 1 == 1)),
            _ => None,
        },
        ValueKind::DoublePoint => match value {
            codec::Value::Double(bits) => {
                Some(Value::DoublePoint(DoublePoint::from_bits(bits.into())))
            }
            _ => None,
        },
        ValueKind::F64 => Some(Value::F64(number(value)? * point.scale + point.offset)),
        ValueKind::I64 => integer(value).map(Value::I64),
        // The protocol has none; the check refuses such tags.
        ValueKind::Text => None,
    }
}

/// Quality by the station's bits (IEC 60870-5-101, 7.2.6.3), the worst first.
/// EI concerns the elapsed time of protection events, which no tag takes.
pub(crate) fn quality_of(object: &Object) -> Quality {
    let flags = object.flags;
    let doubtful = |flags: Flags| {
        let is_moving = matches!(object.value, codec::Value::Step { is_transient: true, .. });
        flags.is_substituted() || flags.is_blocked() || is_moving
    };
    if flags.is_invalid() {
        Quality::Bad(Reason::Sensor)
    } else if flags.is_not_topical() {
        Quality::Bad(Reason::Communication)
    } else if flags.is_overflow() {
        Quality::Uncertain(Reason::OutOfRange)
    } else if doubtful(flags) {
        Quality::Uncertain(Reason::Unknown)
    } else {
        Quality::Good
    }
}

/// Quality of a tag's value: that of its object, unless it is none of the process or no
/// number at all.
pub(crate) fn quality_of_value(value: &Value, object: &Object, is_test: bool) -> Quality {
    let quality = quality_of(object);
    let is_number = !matches!(value, Value::F64(number) if !number.is_finite());
    match quality {
        Quality::Bad(_) => quality,
        _ if !is_number => Quality::Bad(Reason::NotFinite),
        // What is sent as a test must not be taken for the process.
        _ if is_test => Quality::Bad(Reason::Unknown),
        _ => quality,
    }
}

/// Origin by SB (IEC 60870-5-101, 7.2.6.3) and by T of the cause (7.2.3).
pub(crate) fn origin_of(flags: Flags, is_test: bool) -> SampleFlags {
    let mut origin = SampleFlags::LIVE;
    if flags.is_substituted() {
        origin |= SampleFlags::SUBSTITUTED;
    }
    if is_test {
        origin |= SampleFlags::TEST;
    }
    origin
}

fn type_of(value: codec::Value) -> ObjectType {
    match value {
        codec::Value::Single(_) => ObjectType::Single,
        codec::Value::Double(_) => ObjectType::Double,
        codec::Value::Step { .. } => ObjectType::Step,
        codec::Value::Bits(_) => ObjectType::Bitstring,
        codec::Value::Normalized(_) | codec::Value::Scaled(_) | codec::Value::Float(_) => {
            ObjectType::Measured
        }
        codec::Value::Counter { .. } => ObjectType::Counter,
    }
}

fn number(value: codec::Value) -> Option<f64> {
    Some(match value {
        codec::Value::Normalized(value) => f64::from(value) / NORMALIZED_ONE,
        codec::Value::Scaled(value) => f64::from(value),
        codec::Value::Float(value) => f64::from(value),
        codec::Value::Step { position, .. } => f64::from(position),
        codec::Value::Counter { count, .. } => f64::from(count),
        codec::Value::Single(_) | codec::Value::Double(_) | codec::Value::Bits(_) => return None,
    })
}

fn integer(value: codec::Value) -> Option<i64> {
    Some(match value {
        codec::Value::Scaled(value) => i64::from(value),
        codec::Value::Step { position, .. } => i64::from(position),
        codec::Value::Counter { count, .. } => i64::from(count),
        codec::Value::Bits(bits) => i64::from(bits),
        _ => return None,
    })
}

/// Returns the name of a value's type for messages.
pub(crate) fn name_of(value: codec::Value) -> &'static str {
    match value {
        codec::Value::Single(_) => "a single point",
        codec::Value::Double(_) => "a double point",
        codec::Value::Step { .. } => "a step position",
        codec::Value::Bits(_) => "a bitstring",
        codec::Value::Normalized(_) => "a normalised value",
        codec::Value::Scaled(_) => "a scaled value",
        codec::Value::Float(_) => "a floating-point value",
        codec::Value::Counter { .. } => "a counter",
    }
}

#[cfg(test)]
#[path = "convert_tests.rs"]
mod tests;
