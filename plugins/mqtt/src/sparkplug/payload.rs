//! Payloads of Sparkplug B (3.0, 6.4), read metric by metric: a payload of any shape takes
//! no more memory than its longest metric.

use std::time::{Duration, SystemTime, UNIX_EPOCH};

use srad_types::payload::{DataType, Message, Metric, metric, property_value};
use thiserror::Error;

use crate::convert::Raw;

/// Metrics of one payload.
pub(crate) const MAX_METRICS: usize = 100_000;
/// Bytes of one metric; longer ones are left out.
pub(crate) const MAX_METRIC_BYTES: usize = 64 * 1024;

/// Numbers of the payload's fields (Sparkplug 3.0, 6.4.1).
const TIMESTAMP: u32 = 1;
const METRICS: u32 = 2;
const SEQUENCE: u32 = 3;

/// Quality codes (Sparkplug 3.0, 6.4.15).
const QUALITY_KEY: &str = "Quality";
/// The metric that numbers a node's lives (Sparkplug 3.0, 6.4.16).
pub(crate) const BD_SEQ: &str = "bdSeq";

/// A payload that cannot be used.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
pub(crate) enum PayloadFault {
    #[error("it is no Sparkplug B payload: {0}")]
    Malformed(&'static str),
    #[error("a metric in it is malformed")]
    Metric,
    #[error("more than {MAX_METRICS} metrics")]
    TooManyMetrics,
}

/// What a payload says of itself.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Head {
    /// Milliseconds since 1970.
    pub(crate) timestamp: Option<u64>,
    pub(crate) sequence: Option<u64>,
    pub(crate) metrics: usize,
}

/// A payload whose frame is sound.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Payload<'a> {
    bytes: &'a [u8],
    pub(crate) head: Head,
}

impl<'a> Payload<'a> {
    pub(crate) fn parse(bytes: &'a [u8]) -> Result<Self, PayloadFault> {
        let mut head = Head::default();
        let mut fields = Fields(bytes);
        while let Some((number, field)) = fields.next()? {
            match (number, field) {
                (TIMESTAMP, Field::Number(millis)) => head.timestamp = Some(millis),
                (SEQUENCE, Field::Number(sequence)) => head.sequence = Some(sequence),
                (METRICS, Field::Bytes(_)) => head.metrics += 1,
                _ => {}
            }
        }
        if head.metrics > MAX_METRICS {
            return Err(PayloadFault::TooManyMetrics);
        }
        Ok(Self { bytes, head })
    }

    /// Hands on each metric in its order; those that are too long are counted.
    pub(crate) fn each_metric(self, mut take: impl FnMut(&Metric)) -> Result<usize, PayloadFault> {
        let mut too_long = 0;
        let mut fields = Fields(self.bytes);
        while let Some((number, field)) = fields.next()? {
            let (METRICS, Field::Bytes(bytes)) = (number, field) else { continue };
            if bytes.len() > MAX_METRIC_BYTES {
                too_long += 1;
                continue;
            }
            take(&Metric::decode(bytes).map_err(|_| PayloadFault::Metric)?);
        }
        Ok(too_long)
    }

    /// The number of the node's life, in a birth or death certificate.
    pub(crate) fn bd_seq(self) -> Result<Option<u64>, PayloadFault> {
        let mut number = None;
        self.each_metric(|metric| {
            if metric.name.as_deref() == Some(BD_SEQ) {
                number = match metric.value {
                    Some(metric::Value::LongValue(value)) => Some(value),
                    Some(metric::Value::IntValue(value)) => Some(value.into()),
                    _ => None,
                };
            }
        })?;
        Ok(number)
    }
}

/// A field on the wire (Protocol Buffers, encoding).
enum Field<'a> {
    Number(u64),
    Bytes(&'a [u8]),
    Fixed,
}

/// The fields of a message.
struct Fields<'a>(&'a [u8]);

impl<'a> Fields<'a> {
    fn next(&mut self) -> Result<Option<(u32, Field<'a>)>, PayloadFault> {
        if self.0.is_empty() {
            return Ok(None);
        }
        let key = self.number()?;
        let number = u32::try_from(key >> 3).map_err(|_| malformed())?;
        let field = match key & 0b111 {
            0 => Field::Number(self.number()?),
            1 => self.take(8).map(|_| Field::Fixed)?,
            2 => {
                let length = usize::try_from(self.number()?).map_err(|_| malformed())?;
                Field::Bytes(self.take(length)?)
            }
            5 => self.take(4).map(|_| Field::Fixed)?,
            _ => return Err(PayloadFault::Malformed("a field of an unknown form")),
        };
        Ok(Some((number, field)))
    }

    fn take(&mut self, count: usize) -> Result<&'a [u8], PayloadFault> {
        let (taken, rest) = self.0.split_at_checked(count).ok_or_else(malformed)?;
        self.0 = rest;
        Ok(taken)
    }

    fn number(&mut self) -> Result<u64, PayloadFault> {
        const MAX_BYTES: usize = 10;
        let mut value = 0_u64;
        for (index, byte) in self.0.iter().take(MAX_BYTES).enumerate() {
            value |= u64::from(byte & 0x7F).checked_shl(7 * index as u32).unwrap_or(0);
            if byte & 0x80 == 0 {
                self.0 = self.0.get(index + 1..).unwrap_or_default();
                return Ok(value);
            }
        }
        Err(malformed())
    }
}

fn malformed() -> PayloadFault {
    PayloadFault::Malformed("it ends within a field")
}

/// An instant by its milliseconds since 1970; nothing beyond what a clock can show.
pub(crate) fn instant(millis: u64) -> Option<SystemTime> {
    UNIX_EPOCH.checked_add(Duration::from_millis(millis))
}

/// The type that a metric says it has; nothing where it says none.
pub(crate) fn data_type(metric: &Metric) -> Option<DataType> {
    metric.datatype.and_then(|number| DataType::try_from(number).ok())
}

/// The value of a metric by its type, which its birth told; an error names what it is
/// instead (Sparkplug 3.0, 6.4.16).
pub(crate) fn raw_value(
    metric: &Metric,
    data_type: Option<DataType>,
) -> Result<Raw<'_>, &'static str> {
    use metric::Value;
    let value = metric.value.as_ref().ok_or("a metric without a value")?;
    Ok(match (data_type, value) {
        (Some(DataType::DataSet), _) | (_, Value::DatasetValue(_)) => return Err("a data set"),
        (Some(DataType::Template), _) | (_, Value::TemplateValue(_)) => return Err("a template"),
        (_, Value::BytesValue(_)) => return Err("bytes, a file or an array"),
        (_, Value::ExtensionValue(_)) => return Err("an extension"),
        (_, Value::FloatValue(value)) => Raw::Float(f64::from(*value)),
        (_, Value::DoubleValue(value)) => Raw::Float(*value),
        (_, Value::BooleanValue(value)) => Raw::Bool(*value),
        (_, Value::StringValue(value)) => Raw::Text(value),
        (Some(data_type), Value::IntValue(value)) => integer(data_type, u64::from(*value))?,
        (Some(data_type), Value::LongValue(value)) => integer(data_type, *value)?,
        (None, Value::IntValue(_) | Value::LongValue(_)) => {
            return Err("an integer whose type no birth told");
        }
    })
}

/// Integers are sent as the bits of their type: signed ones in two's complement, by some in
/// more bits than the type has.
fn integer(data_type: DataType, bits: u64) -> Result<Raw<'static>, &'static str> {
    Ok(match data_type {
        DataType::Int8 => Raw::Int((bits as u8 as i8).into()),
        DataType::Int16 => Raw::Int((bits as u16 as i16).into()),
        DataType::Int32 => Raw::Int((bits as u32 as i32).into()),
        DataType::Int64 => Raw::Int((bits as i64).into()),
        DataType::UInt8 => Raw::Int((bits as u8).into()),
        DataType::UInt16 => Raw::Int((bits as u16).into()),
        DataType::UInt32 => Raw::Int((bits as u32).into()),
        DataType::UInt64 | DataType::DateTime => Raw::Int(bits.into()),
        DataType::Boolean => Raw::Bool(bits != 0),
        _ => return Err("a number that its type does not have"),
    })
}

/// The quality code of a metric, where it tells one.
pub(crate) fn quality_code(metric: &Metric) -> Option<i64> {
    let properties = metric.properties.as_ref()?;
    let index = properties.keys.iter().position(|key| key == QUALITY_KEY)?;
    match properties.values.get(index)?.value {
        Some(property_value::Value::IntValue(code)) => Some((code as i32).into()),
        Some(property_value::Value::LongValue(code)) => Some(code as i64),
        _ => None,
    }
}

#[cfg(test)]
#[path = "payload_tests.rs"]
mod tests;
