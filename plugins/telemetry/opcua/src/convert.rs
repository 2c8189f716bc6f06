//! Values, status codes and times of OPC UA -> values, qualities and times of tags.

use std::time::{Duration, SystemTime, UNIX_EPOCH};

use async_opcua::types::{DateTime, StatusCode, Variant, status_code::StatusCodeLimit};
use busbar_plugin_sdk::{DoublePoint, Quality, Reason, SampleFlags, Value, ValueKind, text_value};

use crate::points::Point;
use crate::settings::SourceTime;

/// Longest text that is read as a number or state, bytes.
const MAX_PARSED_BYTES: usize = 256;
/// Bits of a status code that hold its severity and sub-code (OPC 10000-4, 7.38.1).
const CODE_BITS: u32 = 0xFFFF_0000;
/// Bits that only a historian's value has: calculated, interpolated, partial, with extra
/// data, one of several (OPC 10000-4, 7.38.1; OPC 10000-11, 6.2).
const HISTORIAN_BITS: u32 = 0x1F;
/// Smallest positive float beyond the range of an i64, 2^63.
const I64_END: f64 = 9_223_372_036_854_775_808.0;
/// Ticks of 100 ns from 1601-01-01 to 1970-01-01 (OPC 10000-6, 5.2.2.5).
const TICKS_TO_1970: i64 = 116_444_736_000_000_000;
const NANOS_PER_TICK: u64 = 100;

/// Converts a value of the server to the value of a tag, and its quality: uncertain for a text that
/// was cut.
///
/// # Errors
/// The mismatch, in words.
pub(crate) fn value_of(point: &Point, variant: &Variant) -> Result<(Value, Quality), String> {
    let variant = match (variant, point.index) {
        (Variant::Array(array), Some(index)) => array.values.get(index).ok_or_else(|| {
            format!("the array has {} elements: correct `index`", array.values.len())
        })?,
        (Variant::Array(array), None) => {
            let count = array.values.len();
            return Err(format!("it is an array of {count}: name an element by `index`, from 0"));
        }
        (_, Some(_)) => return Err("it is no array: remove `index`".into()),
        (scalar, None) => scalar,
    };
    match point.kind {
        ValueKind::Text => text_tag_value(variant).ok_or_else(|| misfit(point, variant)),
        _ => scalar_value(point, variant).map(|value| (value, Quality::Good)),
    }
}

/// Converts a text, or a whole number to its digits, to the value of a text tag.
fn text_tag_value(variant: &Variant) -> Option<(Value, Quality)> {
    let digits = || match variant {
        Variant::UInt64(value) => Some(value.to_string()),
        // Of times, status codes and floats nobody expects digits.
        _ if bits(variant).is_some() => integer(variant).map(|value| value.to_string()),
        _ => None,
    };
    match text_of(variant) {
        Some(text) => Some(text_value(text)),
        None => digits().map(|digits| text_value(&digits)),
    }
}

/// Converts a value of the server to the value of a tag that is no text.
fn scalar_value(point: &Point, variant: &Variant) -> Result<Value, String> {
    if let Some(bit) = point.bit {
        return bits(variant)
            .map(|bits| Value::Bool(bits >> bit & 1 == 1))
            .ok_or_else(|| format!("{} has no bits: remove `bit`", name_of(variant)));
    }
    if !point.states.is_empty() {
        return state_of(point, variant);
    }
    if let Some(text) = text_of(variant) {
        return short(text)
            .and_then(|text| point.kind.parse(text))
            .ok_or_else(|| "a text that is no such value: give the tag's address `states`".into());
    }
    let value = match point.kind {
        ValueKind::F64 => number(variant).map(|raw| Value::F64(raw * point.scale + point.offset)),
        ValueKind::I64 => integer(variant).map(Value::I64),
        ValueKind::Bool => match (variant, integer(variant)) {
            (Variant::Boolean(value), _) => Some(Value::Bool(*value)),
            (_, Some(value @ 0..=1)) => Some(Value::Bool(value == 1)),
            _ => None,
        },
        // Dbpos (IEC 61850-7-3) has the same codes.
        ValueKind::DoublePoint => match integer(variant) {
            Some(bits @ 0..=3) => {
                Some(Value::DoublePoint(DoublePoint::from_bits(bits.unsigned_abs())))
            }
            _ => None,
        },
        ValueKind::Text => None,
    };
    value.ok_or_else(|| misfit(point, variant))
}

/// Returns the fault of a value whose type is not that of its tag.
fn misfit(point: &Point, variant: &Variant) -> String {
    let kind = point.kind.name();
    format!("{} is no {kind}: correct the tag's type or its node", name_of(variant))
}

/// Looks up a state by the names in the tag's address.
fn state_of(point: &Point, variant: &Variant) -> Result<Value, String> {
    let written = match (variant, text_of(variant)) {
        (_, Some(text)) => short(text).map(str::to_owned),
        (Variant::Boolean(value), _) => Some(value.to_string()),
        _ => integer(variant).map(|value| value.to_string()),
    };
    let state = written.and_then(|written| point.states.get(&written).cloned());
    state.ok_or_else(|| format!("{} is none of the tag's `states`: add it there", name_of(variant)))
}

/// Quality by status code (OPC 10000-4, 7.38; OPC 10000-8, 6.3). The table is in README.md.
pub(crate) fn quality_of(status: StatusCode) -> Quality {
    let code = StatusCode::from(status.bits() & CODE_BITS);
    if status.is_good() {
        return match (code, status.limit()) {
            // As where IEC 60870-5-104 says that a value is substituted.
            _ if is_substituted(code) => Quality::Uncertain(Reason::Unknown),
            (_, StatusCodeLimit::Low | StatusCodeLimit::High) => {
                Quality::Uncertain(Reason::OutOfRange)
            }
            _ => Quality::Good,
        };
    }
    if status.is_uncertain() {
        return match code {
            // What used to update the value does so no longer: it is no measurement of now.
            StatusCode::UncertainNoCommunicationLastUsableValue
            | StatusCode::UncertainLastUsableValue => Quality::Bad(Reason::Communication),
            StatusCode::UncertainSensorNotAccurate | StatusCode::UncertainSensorCalibration => {
                Quality::Uncertain(Reason::Sensor)
            }
            StatusCode::UncertainEngineeringUnitsExceeded => Quality::Uncertain(Reason::OutOfRange),
            _ => Quality::Uncertain(Reason::Unknown),
        };
    }
    Quality::Bad(match code {
        StatusCode::BadSensorFailure | StatusCode::BadDeviceFailure => Reason::Sensor,
        StatusCode::BadNotConnected | StatusCode::BadWaitingForInitialData => Reason::NotConnected,
        StatusCode::BadNoCommunication
        | StatusCode::BadCommunicationError
        | StatusCode::BadTimeout
        | StatusCode::BadServerNotConnected
        | StatusCode::BadConnectionClosed
        | StatusCode::BadShutdown
        | StatusCode::BadServerHalted => Reason::Communication,
        StatusCode::BadOutOfRange => Reason::OutOfRange,
        StatusCode::BadConfigurationError
        | StatusCode::BadNodeIdUnknown
        | StatusCode::BadNodeIdInvalid
        | StatusCode::BadAttributeIdInvalid
        | StatusCode::BadIndexRangeInvalid
        | StatusCode::BadIndexRangeNoData
        | StatusCode::BadDataEncodingInvalid
        | StatusCode::BadDataEncodingUnsupported
        | StatusCode::BadMonitoredItemFilterInvalid
        | StatusCode::BadMonitoredItemFilterUnsupported
        | StatusCode::BadFilterNotAllowed
        | StatusCode::BadDeadbandFilterInvalid
        | StatusCode::BadTooManyMonitoredItems
        | StatusCode::BadNotReadable
        | StatusCode::BadUserAccessDenied
        | StatusCode::BadTypeMismatch => Reason::Configuration,
        _ => Reason::Unknown,
    })
}

/// Reports whether a person or the server put the value in place of the measured one
/// (OPC 10000-8, 6.3; OPC 10000-4, 7.38.2).
fn is_substituted(code: StatusCode) -> bool {
    matches!(
        code,
        StatusCode::GoodLocalOverride
            | StatusCode::GoodEdited
            | StatusCode::GoodEdited_DependentValueChanged
            | StatusCode::GoodEdited_DominantValueChanged
            | StatusCode::GoodEdited_DominantValueChanged_DependentValueChanged
            | StatusCode::UncertainSubstituteValue
            | StatusCode::UncertainTransducerInManual
            | StatusCode::BadEdited_OutOfRange
            | StatusCode::BadEdited_OutOfRange_DominantValueChanged
            | StatusCode::BadEdited_OutOfRange_DominantValueChanged_DependentValueChanged
    )
}

/// Origin by status code: substituted, simulated, or a historian's.
pub(crate) fn origin_of(status: StatusCode) -> SampleFlags {
    let code = StatusCode::from(status.bits() & CODE_BITS);
    let mut flags = SampleFlags::LIVE;
    if is_substituted(code) {
        flags |= SampleFlags::SUBSTITUTED;
    }
    if code == StatusCode::UncertainSimulatedValue {
        flags |= SampleFlags::SIMULATED;
    }
    if status.bits() & HISTORIAN_BITS != 0 {
        flags |= SampleFlags::HISTORICAL | SampleFlags::BUFFERED;
    }
    flags
}

/// Source time as the settings use it, and what is wrong with it.
pub(crate) fn source_time_of(
    time: Option<&DateTime>,
    usage: SourceTime,
) -> (Option<SystemTime>, SampleFlags) {
    match (time, usage) {
        (_, SourceTime::Ignored) | (None, SourceTime::Optional) => (None, SampleFlags::LIVE),
        (None, SourceTime::Required) => (None, SampleFlags::TIME_UNUSABLE),
        (Some(time), _) => match time_of(time) {
            Some(time) => (Some(time), SampleFlags::LIVE),
            None => (None, SampleFlags::TIME_UNUSABLE),
        },
    }
}

/// Converts a time; none where it is unset or outside the range from 1970 on.
pub(crate) fn time_of(time: &DateTime) -> Option<SystemTime> {
    let ticks = time.checked_ticks();
    // The last tick means a time without end.
    let since = u64::try_from(ticks.checked_sub(TICKS_TO_1970)?).ok()?;
    if ticks == 0 || ticks == i64::MAX {
        return None;
    }
    UNIX_EPOCH.checked_add(Duration::from_nanos(since.checked_mul(NANOS_PER_TICK)?))
}

/// Returns a text; none where there is none, a null one among them.
fn text_of(variant: &Variant) -> Option<&str> {
    match variant {
        Variant::String(text) => text.value().as_deref(),
        Variant::LocalizedText(text) => text.text.value().as_deref(),
        Variant::QualifiedName(name) => name.name.value().as_deref(),
        _ => None,
    }
}

fn short(text: &str) -> Option<&str> {
    (text.len() <= MAX_PARSED_BYTES).then(|| text.trim())
}

fn number(variant: &Variant) -> Option<f64> {
    Some(match variant {
        Variant::Float(value) => f64::from(*value),
        Variant::Double(value) => *value,
        Variant::UInt64(value) => *value as f64,
        Variant::DateTime(time) => time_of(time)?.duration_since(UNIX_EPOCH).ok()?.as_secs_f64(),
        other => integer(other)? as f64,
    })
}

fn integer(variant: &Variant) -> Option<i64> {
    Some(match variant {
        Variant::SByte(value) => (*value).into(),
        Variant::Byte(value) => (*value).into(),
        Variant::Int16(value) => (*value).into(),
        Variant::UInt16(value) => (*value).into(),
        Variant::Int32(value) => (*value).into(),
        Variant::UInt32(value) => (*value).into(),
        Variant::Int64(value) => *value,
        Variant::UInt64(value) => i64::try_from(*value).ok()?,
        Variant::StatusCode(status) => status.bits().into(),
        Variant::Float(value) => whole(f64::from(*value))?,
        Variant::Double(value) => whole(*value)?,
        Variant::DateTime(time) => {
            let since = time_of(time)?.duration_since(UNIX_EPOCH).ok()?;
            i64::try_from(since.as_millis()).ok()?
        }
        _ => return None,
    })
}

fn whole(value: f64) -> Option<i64> {
    let fits = value.fract() == 0.0 && (-I64_END..I64_END).contains(&value);
    fits.then_some(value as i64)
}

fn bits(variant: &Variant) -> Option<u64> {
    Some(match variant {
        Variant::SByte(value) => u64::from(value.cast_unsigned()),
        Variant::Int16(value) => u64::from(value.cast_unsigned()),
        Variant::Int32(value) => u64::from(value.cast_unsigned()),
        Variant::Int64(value) => value.cast_unsigned(),
        Variant::UInt64(value) => *value,
        Variant::Byte(value) => (*value).into(),
        Variant::UInt16(value) => (*value).into(),
        Variant::UInt32(value) => (*value).into(),
        _ => return None,
    })
}

fn name_of(variant: &Variant) -> &'static str {
    match variant {
        Variant::Empty => "no value",
        Variant::Boolean(_) => "a Boolean",
        Variant::Float(_) | Variant::Double(_) => "a floating-point number",
        Variant::String(_) | Variant::LocalizedText(_) | Variant::QualifiedName(_) => "a text",
        Variant::DateTime(_) => "a time",
        Variant::ExtensionObject(_) => "a structure",
        Variant::Array(_) => "an array",
        other if bits(other).is_some() => "an integer",
        _ => "a value of this type",
    }
}

#[cfg(test)]
#[path = "convert_tests.rs"]
mod tests;
