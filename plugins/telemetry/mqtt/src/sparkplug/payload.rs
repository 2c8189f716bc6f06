//! Payloads of Sparkplug B (3.0, 6.4), read metric by metric. A payload of any shape takes no more
//! memory than its longest metric.

use srad_types::payload::{Message, Metric, metric};
use thiserror::Error;

use crate::names::MAX_TEXT;

/// Metrics of one payload.
pub(crate) const MAX_METRICS: usize = 100_000;
/// Longest metric, bytes; of a longer one only name, alias and type are read.
pub(crate) const MAX_METRIC_BYTES: usize = 64 * 1024;

/// Numbers of the payload's fields (Sparkplug 3.0, 6.4.1).
const TIMESTAMP: u32 = 1;
const METRICS: u32 = 2;
const SEQUENCE: u32 = 3;
const UUID: u32 = 4;
/// Numbers of a metric's fields (Sparkplug 3.0, 6.4.5).
const NAME: u32 = 1;
const ALIAS: u32 = 2;
const DATA_TYPE: u32 = 4;

/// Mark of a payload that holds another one, compressed.
const COMPRESSED: &[u8] = b"SPBV1.0_COMPRESSED";
/// The metric that numbers a node's lives (Sparkplug 3.0, 6.4.16).
pub(crate) const BD_SEQ: &str = "bdSeq";

/// A payload that cannot be used.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
pub(crate) enum PayloadFault {
    #[error("it is no Sparkplug B payload: {0}")]
    Malformed(&'static str),
    #[error("it has more than {MAX_METRICS} metrics")]
    TooManyMetrics,
    #[error("it is compressed")]
    Compressed,
    #[error("it has {0} bytes, more than max_payload_bytes or its properties may have")]
    TooLong(usize),
}

/// A metric of a payload.
#[derive(Debug)]
pub(crate) enum Entry<'a> {
    Metric(&'a Metric),
    /// One that is longer than is read, by name, alias and type.
    TooLong(&'a Metric),
    /// One that cannot be read: cut short, or its name is not UTF-8.
    Malformed,
}

/// Fields of a payload beside its metrics.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Head {
    /// Timestamp of the payload, milliseconds since 1970-01-01 UTC.
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
                (UUID, Field::Bytes(COMPRESSED)) => return Err(PayloadFault::Compressed),
                // A field of another form than its number's is no payload of Sparkplug B.
                (TIMESTAMP | METRICS | SEQUENCE, _) => {
                    return Err(PayloadFault::Malformed("a field is of another type"));
                }
                _ => {}
            }
        }
        if head.metrics > MAX_METRICS {
            return Err(PayloadFault::TooManyMetrics);
        }
        Ok(Self { bytes, head })
    }

    /// Hands on each metric in its order.
    pub(crate) fn each_metric(self, mut take: impl FnMut(Entry<'_>)) {
        let mut fields = Fields(self.bytes);
        while let Ok(Some((number, field))) = fields.next() {
            let (METRICS, Field::Bytes(bytes)) = (number, field) else { continue };
            if bytes.len() > MAX_METRIC_BYTES {
                match identity_of(bytes) {
                    Some(metric) => take(Entry::TooLong(&metric)),
                    None => take(Entry::Malformed),
                }
                continue;
            }
            match Metric::decode(bytes) {
                Ok(metric) => take(Entry::Metric(&metric)),
                Err(_) => take(Entry::Malformed),
            }
        }
    }

    /// Returns bdSeq, the number of the node's life, from a birth or death certificate.
    pub(crate) fn bd_seq(self) -> Option<u64> {
        let mut number = None;
        self.each_metric(|entry| {
            if let Entry::Metric(metric) = entry
                && metric.name.as_deref() == Some(BD_SEQ)
            {
                number = match metric.value {
                    Some(metric::Value::LongValue(value)) => Some(value),
                    Some(metric::Value::IntValue(value)) => Some(value.into()),
                    _ => None,
                };
            }
        });
        number
    }
}

/// Reads only name, alias and type of a metric; `None` where it is malformed, or has neither name
/// nor alias.
fn identity_of(bytes: &[u8]) -> Option<Metric> {
    let mut metric = Metric::default();
    let mut fields = Fields(bytes);
    while let Some((number, field)) = fields.next().ok()? {
        match (number, field) {
            (NAME, Field::Bytes(name)) => {
                metric.name =
                    Some(str::from_utf8(name).ok().filter(|name| !is_too_long(name))?.into());
            }
            (ALIAS, Field::Number(alias)) => metric.alias = Some(alias),
            (DATA_TYPE, Field::Number(number)) => metric.datatype = u32::try_from(number).ok(),
            (NAME | ALIAS | DATA_TYPE, _) => return None,
            _ => {}
        }
    }
    (metric.name.is_some() || metric.alias.is_some()).then_some(metric)
}

/// Reports whether a name is longer than that of any tag.
fn is_too_long(name: &str) -> bool {
    name.len() > MAX_TEXT
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

#[cfg(test)]
#[path = "payload_tests.rs"]
mod tests;
