//! Cells -> values, qualities and times of tags.

use std::sync::Arc;
use std::time::{Duration, SystemTime, UNIX_EPOCH};

use busbar_plugin_sdk::{
    DoublePoint, Quality, QualityLevel, Reason, Sample, SampleFlags, Text, Value, ValueKind,
    text_value_of_bytes,
};
use source_units::UnitAgreement;
use text_table::{NumberFormat, TimeFormat, TimeReader, find_quality};

use crate::cell::Cell;
use crate::points::Point;

/// The longest text that is looked at as a value, quality or time, bytes.
const MAX_TEXT_BYTES: usize = 256;
/// The last Unix time that is taken as one, in the year 2100: milliseconds are refused
/// instead of being read as a far future.
const MAX_UNIX_SECONDS: f64 = 4_133_980_799.0;
/// From here on the integers of a float are no longer those of an i64.
const I64_END: f64 = 9_223_372_036_854_775_808.0;
/// The codes of qualities (OPC Data Access 3.00, 6.8).
const OPC_CODES: std::ops::RangeInclusive<i64> = 0..=0xFF;

/// Remark on a text that is uncertain.
const TEXT_DOUBT: &str =
    "its text is no UTF-8 or longer than a tag's may be, 255 bytes: shorten it in the query";

/// Rules by which an instance reads times: their format, and the zone of those without one.
pub(crate) type TimeRules = Arc<TimeReader>;

/// A time that a row has.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct RowTime {
    pub(crate) time: SystemTime,
    /// True where the clock of its zone showed it twice.
    pub(crate) is_ambiguous: bool,
}

/// Reading of one tag in one row.
pub(crate) struct Reading<'a> {
    pub(crate) value: Cell<'a>,
    /// `None` where the source has none.
    pub(crate) quality: Option<Cell<'a>>,
    pub(crate) time: Option<Cell<'a>>,
    pub(crate) unit: Option<Cell<'a>>,
}

impl Reading<'_> {
    /// The sample, and what is wrong with the row in words. A time that is promised and
    /// cannot be read makes a good value uncertain: nobody knows how old it is.
    pub(crate) fn sample(&self, point: &Point, rules: &TimeRules) -> (Sample, Option<String>) {
        let time = self.time.as_ref().map(|cell| time_of(cell, rules));
        let (source_time, reason, doubt) = match time {
            None => (None, Reason::Unknown, None),
            Some(Ok(Some(RowTime { time, is_ambiguous: false }))) => {
                (Some(time), Reason::Unknown, None)
            }
            Some(Ok(Some(RowTime { time, is_ambiguous: true }))) => {
                let zone = rules.zone.as_ref().map_or("UTC", |zone| zone.name());
                let doubt = format!("time: the clock of {zone} showed it twice");
                (Some(time), Reason::SourceTime, Some(doubt))
            }
            Some(Ok(None)) => (None, Reason::Unknown, Some("time: it is NULL".to_owned())),
            Some(Err(what)) => (None, Reason::SourceTime, Some(format!("time: {what}"))),
        };
        let flags = if doubt.is_some() && source_time.is_none() {
            SampleFlags::TIME_UNUSABLE
        } else {
            SampleFlags::LIVE
        };
        let bad = |reason| Sample { source_time, ..Sample::bad(point.tag, reason) };
        let misfit = |what| (Sample::bad(point.tag, Reason::Configuration), Some(what));
        let quality = match self.quality.as_ref().map(quality_of).transpose() {
            Ok(quality) => quality.unwrap_or(Quality::Good),
            Err(what) => return misfit(format!("quality: {what}")),
        };
        if self.value == Cell::Null {
            return (bad(Reason::Sensor), doubt);
        }
        let (value, own) = match value_of(point, &self.value) {
            Ok((Value::F64(value), _)) if !value.is_finite() => {
                return (bad(Reason::NotFinite), doubt);
            }
            Ok(read) => read,
            Err(what) => return misfit(what),
        };
        let (agreement, remark) = self.compare_unit(point);
        if agreement == UnitAgreement::Conflicts {
            return (bad(Reason::Configuration), remark);
        }
        let remark = if own.is_good() { remark } else { Some(TEXT_DOUBT.to_owned()) };
        let quality = match agreement.limit(quality).worst(own) {
            Quality::Good if doubt.is_some() => Quality::Uncertain(reason),
            quality => quality,
        };
        (
            Sample { tag: point.tag, value: Some(value), quality, source_time, flags },
            doubt.or(remark),
        )
    }

    /// Compares the unit of the row with the tag's, with a remark on one that does not agree.
    /// NULL states none.
    fn compare_unit(&self, point: &Point) -> (UnitAgreement, Option<String>) {
        match self.unit.as_ref() {
            None | Some(Cell::Null) => (UnitAgreement::Agrees, None),
            Some(Cell::Text(text)) => {
                let agreement = point.unit.compare([text.as_ref()]);
                (agreement, point.unit.remark(agreement, text))
            }
            Some(cell) => {
                let agreement = point.unit.judge_unreadable();
                (agreement, point.unit.remark(agreement, &cell.name()))
            }
        }
    }
}

/// Reads the value of a tag, with the quality that it has of its own: not good where a text was
/// cut, or is no UTF-8.
///
/// # Errors
/// The misfit, in words.
pub(crate) fn value_of(point: &Point, cell: &Cell<'_>) -> Result<(Value, Quality), String> {
    match (point.kind, cell) {
        (_, Cell::Unusable(what)) => Err(what.to_string()),
        // The database pads texts of a fixed length with blanks.
        (ValueKind::Text, Cell::Text(text)) => Ok(text_value_of_bytes(text.as_bytes())),
        (ValueKind::Text, Cell::NotUtf8(bytes)) => Ok(text_value_of_bytes(bytes)),
        (ValueKind::Text, Cell::Int(number)) => {
            Ok((Value::Text(Text::cut(&number.to_string())), Quality::Good))
        }
        (ValueKind::Text, _) => Err(format!(
            "{} is no text: cast it in the query, or correct the tag's type",
            cell.name()
        )),
        _ => plain_value_of(point, cell).map(|value| (value, Quality::Good)),
    }
}

/// Reads the value of a tag that is a number or a state.
fn plain_value_of(point: &Point, cell: &Cell<'_>) -> Result<Value, String> {
    if !point.states.is_empty() {
        return state_of(point, cell);
    }
    if let Cell::Text(text) = cell {
        let text = short(text)?;
        return parse(point.kind, text).ok_or_else(|| {
            let (shown, kind) = (text_table::shorten(text), name_of(point.kind));
            format!("the text '{shown}' is no {kind}: give the tag's address `states`")
        });
    }
    let value = match point.kind {
        ValueKind::F64 => number(cell).map(Value::F64),
        ValueKind::I64 => integer(cell).map(Value::I64),
        ValueKind::Bool => match integer(cell) {
            Some(state @ 0..=1) => Some(Value::Bool(state == 1)),
            _ => None,
        },
        ValueKind::DoublePoint => match integer(cell) {
            Some(bits @ 0..=3) if !matches!(cell, Cell::Bool(_)) => {
                Some(Value::DoublePoint(DoublePoint::from_bits(bits.unsigned_abs())))
            }
            _ => None,
        },
        ValueKind::Text => None,
    };
    value.ok_or_else(|| {
        let (found, kind) = (cell.name(), name_of(point.kind));
        format!("{found} is no {kind}: correct the query or the tag's type")
    })
}

/// A text as a value; whole numbers may be written `1.0`, and booleans in any case.
fn parse(kind: ValueKind, text: &str) -> Option<Value> {
    let whole = || NumberFormat::default().parse_i64(text).ok();
    match kind {
        ValueKind::F64 => kind.parse(text),
        ValueKind::I64 => whole().map(Value::I64),
        ValueKind::Bool if text.eq_ignore_ascii_case("true") => Some(Value::Bool(true)),
        ValueKind::Bool if text.eq_ignore_ascii_case("false") => Some(Value::Bool(false)),
        ValueKind::Bool => whole().filter(|n| (0..=1).contains(n)).map(|n| Value::Bool(n == 1)),
        ValueKind::DoublePoint => {
            let bits = whole().filter(|bits| (0..=3).contains(bits))?;
            Some(Value::DoublePoint(DoublePoint::from_bits(bits.unsigned_abs())))
        }
        ValueKind::Text => None,
    }
}

/// A state by the names of the tag's address: 1, 1.0, true and '1' are one.
fn state_of(point: &Point, cell: &Cell<'_>) -> Result<Value, String> {
    let written = match cell {
        Cell::Text(text) => short(text)?.to_owned(),
        Cell::Int(value) => value.to_string(),
        Cell::Float(value) => value.to_string(),
        Cell::Bool(value) => value.to_string(),
        _ => return Err(format!("{} is none of the tag's `states`", cell.name())),
    };
    point.states.get(&written).ok_or_else(|| {
        let (found, known) = (cell.name(), point.states.list());
        format!("{found} is none of the tag's `states` {known}: add it there")
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
        Cell::Int(_) | Cell::Float(_) => {
            let code = integer(cell).filter(|code| OPC_CODES.contains(code));
            let quality = code.and_then(|code| find_quality(&code.to_string()));
            quality.map(with_reason).ok_or_else(|| no_quality(cell))
        }
        Cell::Text(text) => {
            find_quality(short(text)?).map(with_reason).ok_or_else(|| no_quality(cell))
        }
        other => Err(no_quality(other)),
    }
}

fn with_reason(level: QualityLevel) -> Quality {
    let is_bad = level == QualityLevel::Bad;
    Quality::new(level, if is_bad { Reason::Sensor } else { Reason::Unknown })
}

fn no_quality(cell: &Cell<'_>) -> String {
    format!(
        "{} is no quality: give a boolean, good, uncertain or bad, or a code of OPC (192 is good)",
        cell.name()
    )
}

/// A time: a timestamp with its zone or in the zone of the settings, a text or number of the
/// settings' format, or Unix seconds. NULL is none.
///
/// # Errors
/// What it is instead, in words.
pub(crate) fn time_of(cell: &Cell<'_>, rules: &TimeReader) -> Result<Option<RowTime>, String> {
    let certain = |time| Some(RowTime { time, is_ambiguous: false });
    let is_written = matches!(rules.format, TimeFormat::Iso | TimeFormat::Pattern(_));
    match cell {
        Cell::Null => Ok(None),
        Cell::Time(time) if *time >= UNIX_EPOCH => Ok(certain(*time)),
        Cell::LocalTime(nanos) => {
            let zone = rules.zone.as_ref().ok_or(
                "a timestamp without time zone: set `zone`, or write AT TIME ZONE with the zone \
                 that it is of",
            )?;
            let resolved = zone.resolve_nanos(*nanos)?;
            row_time(resolved.nanos, resolved.is_ambiguous).map(Some)
        }
        Cell::Int(seconds) if is_written => unix_time(*seconds as f64).map(certain),
        Cell::Float(seconds) if is_written => unix_time(*seconds).map(certain),
        Cell::Int(_) | Cell::Float(_) | Cell::Text(_) => {
            let text = match cell {
                Cell::Int(count) => count.to_string(),
                Cell::Float(count) => count.to_string(),
                Cell::Text(text) => short(text)?.to_owned(),
                _ => String::new(),
            };
            let instant = rules.read(None, &text, None)?;
            row_time(instant.nanos, instant.is_ambiguous).map(Some)
        }
        Cell::Unusable(what) => Err(what.to_string()),
        other => Err(format!("{} is no time after 1970", other.name())),
    }
}

fn row_time(nanos: i64, is_ambiguous: bool) -> Result<RowTime, String> {
    let since = u64::try_from(nanos).map_err(|_| "a time before 1970".to_owned())?;
    Ok(RowTime { time: UNIX_EPOCH + Duration::from_nanos(since), is_ambiguous })
}

fn unix_time(seconds: f64) -> Result<SystemTime, String> {
    if !(0.0..=MAX_UNIX_SECONDS).contains(&seconds) {
        return Err(format!(
            "{seconds} is no Unix time in seconds: `time_format` names another unit"
        ));
    }
    Ok(UNIX_EPOCH + Duration::from_secs_f64(seconds))
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
        ValueKind::Text => "text",
    }
}

/// Rules of RFC 3339 with a zone, for tests.
#[cfg(test)]
pub(crate) fn rules_of_tests(zone: Option<&str>) -> TimeRules {
    let zone = zone.map(|name| text_table::Zone::parse(name).unwrap());
    Arc::new(TimeReader { format: TimeFormat::Iso, zone, numbers: NumberFormat::default() })
}

#[cfg(test)]
#[path = "convert_tests.rs"]
mod tests;
