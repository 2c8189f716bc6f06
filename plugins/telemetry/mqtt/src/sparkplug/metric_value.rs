//! Value, time and quality of one metric (Sparkplug 3.0, 6.4.6 to 6.4.17).

use std::time::{Duration, SystemTime, UNIX_EPOCH};

use busbar_plugin_sdk::{Quality, Reason};
use srad_types::payload::{DataType, Metric, metric, property_value};

use crate::convert::{Raw, quality_of_code};
use crate::point_states::StatedUnit;
use crate::source_time::is_possible;

/// Property that has the quality code (Sparkplug 3.0, 6.4.15).
const QUALITY_KEY: &str = "Quality";
/// Properties that have the unit, in lower case without spaces, hyphens and underscores. The
/// specification names none: the first is that of Ignition and Tahu.
const UNIT_KEYS: [&str; 5] = ["engunit", "engineeringunit", "engineeringunits", "unit", "units"];

/// Converts milliseconds since 1970 to a time. `None` beyond 2262, such as for microseconds in
/// place of milliseconds.
pub(super) fn instant(millis: u64) -> Option<SystemTime> {
    UNIX_EPOCH.checked_add(Duration::from_millis(millis)).filter(|time| is_possible(*time))
}

/// Reads the type that a metric says it has; `None` where it says none.
///
/// # Errors
/// Names the fault of a type that there is not.
pub(super) fn data_type(metric: &Metric) -> Result<Option<DataType>, &'static str> {
    match metric.datatype {
        None | Some(0) => Ok(None),
        Some(number) => {
            DataType::try_from(number).map(Some).map_err(|_| "of a type that Sparkplug B lacks")
        }
    }
}

/// Reads the value of a metric by its own type, or else by that of its birth certificate.
///
/// # Errors
/// A description of the value that is there instead (Sparkplug 3.0, 6.4.16).
pub(super) fn raw_value(
    metric: &Metric,
    of_birth: Option<DataType>,
) -> Result<Raw<'_>, &'static str> {
    use metric::Value;
    let said = data_type(metric)?;
    if let (Some(said), Some(of_birth)) = (said, of_birth)
        && said != of_birth
    {
        return Err("of another type than its birth told");
    }
    let value = metric.value.as_ref().ok_or("a metric without a value")?;
    if metric.metadata.as_ref().is_some_and(|data| data.is_multi_part == Some(true)) {
        return Err("a part of a value");
    }
    let data_type = said.or(of_birth);
    match (data_type, value) {
        (Some(DataType::DataSet), _) | (_, Value::DatasetValue(_)) => Err("a data set"),
        (Some(DataType::Template), _) | (_, Value::TemplateValue(_)) => Err("a template"),
        (_, Value::BytesValue(_)) => Err("bytes, a file or an array"),
        (_, Value::ExtensionValue(_)) => Err("an extension"),
        (Some(data_type), value) if !can_hold(data_type, value) => Err("no value of its type"),
        (_, Value::FloatValue(value)) => Ok(Raw::Float(f64::from(*value))),
        (_, Value::DoubleValue(value)) => Ok(Raw::Float(*value)),
        (_, Value::BooleanValue(value)) => Ok(Raw::Bool(*value)),
        (_, Value::StringValue(value)) => Ok(Raw::Text(value)),
        (Some(data_type), Value::IntValue(value)) => integer(data_type, u64::from(*value)),
        (Some(data_type), Value::LongValue(value)) => integer(data_type, *value),
        (None, Value::IntValue(_) | Value::LongValue(_)) => {
            Err("an integer whose type no birth told")
        }
    }
}

/// Reports whether a field of this kind can hold values of a type.
fn can_hold(data_type: DataType, value: &metric::Value) -> bool {
    use DataType as Type;
    use metric::Value;
    match data_type {
        Type::Float | Type::Double => {
            matches!(value, Value::FloatValue(_) | Value::DoubleValue(_))
        }
        Type::Boolean => {
            matches!(value, Value::BooleanValue(_) | Value::IntValue(_) | Value::LongValue(_))
        }
        Type::String | Type::Text | Type::Uuid => matches!(value, Value::StringValue(_)),
        Type::Int8
        | Type::Int16
        | Type::Int32
        | Type::Int64
        | Type::UInt8
        | Type::UInt16
        | Type::UInt32
        | Type::UInt64
        | Type::DateTime => matches!(value, Value::IntValue(_) | Value::LongValue(_)),
        _ => false,
    }
}

/// Reads an integer, which is sent as the bits of its type: signed ones in two's complement,
/// by some in more bits than the type has.
fn integer(data_type: DataType, bits: u64) -> Result<Raw<'static>, &'static str> {
    let (width, is_signed) = match data_type {
        DataType::Int8 => (8, true),
        DataType::Int16 => (16, true),
        DataType::Int32 => (32, true),
        DataType::Int64 => (64, true),
        DataType::UInt8 => (8, false),
        DataType::UInt16 => (16, false),
        DataType::UInt32 => (32, false),
        DataType::UInt64 | DataType::DateTime => (64, false),
        DataType::Boolean if bits <= 1 => return Ok(Raw::Bool(bits == 1)),
        _ => return Err("a number that its type does not have"),
    };
    let is_within = width == 64 || bits >> width == 0;
    let value = match (is_signed, is_within) {
        (false, true) => i128::from(bits),
        (true, true) => i128::from(sign_extended(bits, width)),
        (true, false) => {
            let wider = [sign_extended(bits, 64), sign_extended(bits & 0xFFFF_FFFF, 32)];
            let candidates = [Some(wider[0]), (bits >> 32 == 0).then_some(wider[1])];
            let fits = |value: &i64| *value < 0 && sign_extended(*value as u64, width) == *value;
            let value = candidates.into_iter().flatten().find(fits);
            i128::from(value.ok_or("a number beyond its type")?)
        }
        (false, false) => return Err("a number beyond its type"),
    };
    Ok(Raw::Int(value))
}

/// Reads the lowest `width` bits, 1 to 64, as a number in two's complement.
fn sign_extended(bits: u64, width: u32) -> i64 {
    let unused = 64 - width;
    (bits << unused) as i64 >> unused
}

/// Reads the quality of a metric; an unreadable one is not good.
pub(super) fn quality(metric: &Metric) -> Quality {
    let Some(properties) = metric.properties.as_ref() else { return Quality::Good };
    let Some(index) = properties.keys.iter().position(|key| key == QUALITY_KEY) else {
        return Quality::Good;
    };
    let property = properties.values.get(index).and_then(|property| property.value.as_ref());
    match property {
        Some(property_value::Value::IntValue(code)) => quality_of_code((*code as i32).into()),
        Some(property_value::Value::LongValue(code)) => quality_of_code(*code as i64),
        _ => Quality::Uncertain(Reason::Configuration),
    }
}

/// Reads the unit that a metric states, by the first known property that has one.
pub(super) fn unit(metric: &Metric) -> StatedUnit<'_> {
    let Some(properties) = metric.properties.as_ref() else { return StatedUnit::Absent };
    let place = UNIT_KEYS.iter().find_map(|name| {
        properties.keys.iter().position(|key| {
            let letters = key.chars().filter(|c| !matches!(c, ' ' | '_' | '-'));
            letters.flat_map(char::to_lowercase).eq(name.chars())
        })
    });
    let Some(index) = place else { return StatedUnit::Absent };
    match properties.values.get(index) {
        Some(property) if property.is_null == Some(true) => StatedUnit::Absent,
        Some(property) => match &property.value {
            Some(property_value::Value::StringValue(text)) => StatedUnit::Named(text),
            _ => StatedUnit::Unreadable,
        },
        None => StatedUnit::Unreadable,
    }
}

#[cfg(test)]
#[path = "metric_value_tests.rs"]
mod tests;
