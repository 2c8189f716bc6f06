//! Cells -> values, qualities and times of tags.

use std::time::{Duration, SystemTime, UNIX_EPOCH};

use busbar_plugin_sdk::{DoublePoint, Quality, Reason, Sample, SampleFlags, Value, ValueKind};
use jiff::Timestamp;
use jiff::civil::DateTime;
use jiff::tz::TimeZone;

use crate::cell::Cell;
use crate::points::Point;

/// The longest text that is looked at as a value, quality or time, bytes.
const MAX_TEXT_BYTES: usize = 256;
/// The last Unix time that is taken as one, in the year 9999: milliseconds are refused
/// instead of being read as a far future.
const MAX_UNIX_SECONDS: f64 = 253_402_300_799.0;
/// From here on the integers of a float are no longer those of an i64.
const I64_END: f64 = 9_223_372_036_854_775_808.0;
/// The bits of a quality code, and of what they can be, good and uncertain (OPC Data
/// Access 3.00, 6.8).
const OPC_CODES: std::ops::RangeInclusive<i64> = 0..=0xFF;
const OPC_QUALITY: i64 = 0xC0;
const OPC_GOOD: i64 = 0xC0;
const OPC_UNCERTAIN: i64 = 0x40;

/// How a source writes times without a zone.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum ZonelessTime {
    /// They are UTC, as SQLite's own functions give them.
    Utc,
    /// Nobody knows which.
    Refused,
}

/// What one row has for one tag.
pub(crate) struct Reading<'a> {
    pub(crate) value: Cell<'a>,
    /// `None` where the source has none.
    pub(crate) quality: Option<Cell<'a>>,
    pub(crate) time: Option<Cell<'a>>,
}

impl Reading<'_> {
    /// The sample, and what is wrong with the row in words. A time that is promised and
    /// cannot be read makes a good value uncertain: nobody knows how old it is.
    pub(crate) fn sample(&self, point: &Point, zoneless: ZonelessTime) -> (Sample, Option<String>) {
        let time = self.time.as_ref().map(|cell| time_of(cell, zoneless));
        let (source_time, reason, doubt) = match time {
            None => (None, Reason::Unknown, None),
            Some(Ok(Some(time))) => (Some(time), Reason::Unknown, None),
            Some(Ok(None)) => (None, Reason::Unknown, Some("time: it is NULL".to_owned())),
            Some(Err(what)) => (None, Reason::SourceTime, Some(format!("time: {what}"))),
        };
        let flags = if doubt.is_some() { SampleFlags::TIME_UNUSABLE } else { SampleFlags::LIVE };
        let bad = |reason| Sample { source_time, ..Sample::bad(point.tag, reason) };
        let misfit = |what| (Sample::bad(point.tag, Reason::Configuration), Some(what));
        let quality = match self.quality.as_ref().map(quality_of).transpose() {
            Ok(quality) => quality.unwrap_or(Quality::Good),
            Err(what) => return misfit(format!("quality: {what}")),
        };
        if self.value == Cell::Null {
            return (bad(Reason::Sensor), doubt);
        }
        let value = match value_of(point, &self.value) {
            Ok(Value::F64(value)) if !value.is_finite() => {
                return (bad(Reason::NotFinite), doubt);
            }
            Ok(value) => value,
            Err(what) => return misfit(what),
        };
        let quality = match quality {
            Quality::Good if doubt.is_some() => Quality::Uncertain(reason),
            quality => quality,
        };
        (Sample { tag: point.tag, value: Some(value), quality, source_time, flags }, doubt)
    }
}

/// The value of a tag.
///
/// # Errors
/// What does not fit, in words.
pub(crate) fn value_of(point: &Point, cell: &Cell<'_>) -> Result<Value, String> {
    if let Cell::Unusable(what) = cell {
        return Err(what.to_string());
    }
    if !point.states.is_empty() {
        return state_of(point, cell);
    }
    if let Cell::Text(text) = cell {
        let text = short(text)?;
        return point.kind.parse(text).ok_or_else(|| {
            format!("a text that is no {}: give the tag's address `states`", name_of(point.kind))
        });
    }
    let value = match point.kind {
        ValueKind::F64 => number(cell).map(Value::F64),
        ValueKind::I64 => integer(cell).map(Value::I64),
        ValueKind::Bool => match cell {
            Cell::Bool(value) => Some(Value::Bool(*value)),
            Cell::Int(value @ 0..=1) => Some(Value::Bool(*value == 1)),
            _ => None,
        },
        ValueKind::DoublePoint => match integer(cell) {
            Some(bits @ 0..=3) if !matches!(cell, Cell::Bool(_)) => {
                Some(Value::DoublePoint(DoublePoint::from_bits(bits.unsigned_abs())))
            }
            _ => None,
        },
    };
    value.ok_or_else(|| {
        let (found, kind) = (cell.name(), name_of(point.kind));
        format!("{found} is no {kind}: correct the query or the tag's type")
    })
}

/// A state by the names of the tag's address.
fn state_of(point: &Point, cell: &Cell<'_>) -> Result<Value, String> {
    let written = match cell {
        Cell::Text(text) => short(text)?.to_owned(),
        Cell::Int(value) => value.to_string(),
        Cell::Bool(value) => value.to_string(),
        _ => return Err(format!("{} is none of the tag's `states`", cell.name())),
    };
    point.states.get(&written).copied().ok_or_else(|| match cell {
        Cell::Text(_) => "a text that is none of the tag's `states`: add it there".to_owned(),
        _ => format!("{} is none of the tag's `states`: add it there", cell.name()),
    })
}

/// A quality: a boolean, a word, or a code of OPC. NULL says nothing, so that nobody can
/// call the value good.
///
/// # Errors
/// What it is instead, in words.
pub(crate) fn quality_of(cell: &Cell<'_>) -> Result<Quality, String> {
    let bad = Quality::Bad(Reason::Sensor);
    let uncertain = Quality::Uncertain(Reason::Unknown);
    match cell {
        Cell::Null => Ok(uncertain),
        Cell::Bool(is_good) => Ok(if *is_good { Quality::Good } else { bad }),
        Cell::Int(code) if OPC_CODES.contains(code) => Ok(match code & OPC_QUALITY {
            OPC_GOOD => Quality::Good,
            OPC_UNCERTAIN => uncertain,
            _ => bad,
        }),
        Cell::Text(text) => match short(text)?.to_ascii_lowercase().as_str() {
            "good" => Ok(Quality::Good),
            "uncertain" => Ok(uncertain),
            "bad" => Ok(bad),
            _ => Err("a text that is none of good, uncertain, bad".into()),
        },
        other => Err(format!(
            "{} is no quality: give a boolean, good, uncertain or bad, or a code of OPC (192 is \
             good)",
            other.name()
        )),
    }
}

/// A time: a timestamp with its zone, RFC 3339, or Unix seconds. NULL is none.
///
/// # Errors
/// What it is instead, in words.
pub(crate) fn time_of(
    cell: &Cell<'_>,
    zoneless: ZonelessTime,
) -> Result<Option<SystemTime>, String> {
    match cell {
        Cell::Null => Ok(None),
        Cell::Time(time) if *time >= UNIX_EPOCH => Ok(Some(*time)),
        Cell::Int(seconds) => unix_time(*seconds as f64).map(Some),
        Cell::Float(seconds) => unix_time(*seconds).map(Some),
        Cell::Text(text) => written_time(short(text)?, zoneless).map(Some),
        Cell::Unusable(what) => Err(what.to_string()),
        other => Err(format!("{} is no time after 1970", other.name())),
    }
}

fn unix_time(seconds: f64) -> Result<SystemTime, String> {
    if !(0.0..=MAX_UNIX_SECONDS).contains(&seconds) {
        return Err(format!("{seconds} is no Unix time in seconds"));
    }
    Ok(UNIX_EPOCH + Duration::from_secs_f64(seconds))
}

fn written_time(text: &str, zoneless: ZonelessTime) -> Result<SystemTime, String> {
    let written = text.parse::<Timestamp>().ok();
    let timestamp = match zoneless {
        _ if written.is_some() => written,
        ZonelessTime::Refused => None,
        ZonelessTime::Utc => {
            let civil = text.parse::<DateTime>().ok();
            civil
                .and_then(|civil| civil.to_zoned(TimeZone::UTC).ok())
                .map(|zoned| zoned.timestamp())
        }
    };
    let timestamp = timestamp.filter(|timestamp| *timestamp >= Timestamp::UNIX_EPOCH);
    let expected = match zoneless {
        ZonelessTime::Utc => "as in 2026-11-22T03:50:29Z (RFC 3339)",
        ZonelessTime::Refused => "with its zone, as in 2026-11-22T03:50:29Z (RFC 3339)",
    };
    timestamp.map(SystemTime::from).ok_or_else(|| format!("a text that is no time {expected}"))
}

fn short(text: &str) -> Result<&str, String> {
    if text.len() <= MAX_TEXT_BYTES {
        return Ok(text.trim());
    }
    Err(format!("a text of {} bytes; at most {MAX_TEXT_BYTES} are looked at", text.len()))
}

fn number(cell: &Cell<'_>) -> Option<f64> {
    match cell {
        Cell::Bool(value) => Some(f64::from(u8::from(*value))),
        Cell::Int(value) => Some(*value as f64),
        Cell::Float(value) => Some(*value),
        _ => None,
    }
}

fn integer(cell: &Cell<'_>) -> Option<i64> {
    match cell {
        Cell::Bool(value) => Some(i64::from(*value)),
        Cell::Int(value) => Some(*value),
        Cell::Float(value) if value.fract() == 0.0 && (-I64_END..I64_END).contains(value) => {
            Some(*value as i64)
        }
        _ => None,
    }
}

fn name_of(kind: ValueKind) -> &'static str {
    match kind {
        ValueKind::F64 => "number",
        ValueKind::I64 => "integer of 64 bits",
        ValueKind::Bool => "boolean",
        ValueKind::DoublePoint => "double point",
    }
}

#[cfg(test)]
#[path = "convert_tests.rs"]
mod tests;
