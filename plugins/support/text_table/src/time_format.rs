//! Formats of times: RFC 3339, counts since 1970, serial days of spreadsheets, and patterns.

use jiff::Timestamp;
use jiff::civil::{DateTime, Time};
use jiff::fmt::strtime::BrokenDownTime;
use jiff::tz::TimeZone;

use crate::number::scale;
use crate::{NumberFormat, Zone};

/// Years that a written time may have; another year is one of another format.
const MIN_YEAR: i16 = 1970;
/// The last year that a time may have.
pub const MAX_YEAR: i16 = 2100;
/// Year of the earliest time of a number: one of a smaller unit is before it.
const MIN_YEAR_OF_NUMBER: i16 = 1980;
/// Bytes of the longest pattern, and of the longest time.
const MAX_PATTERN_BYTES: usize = 100;
const MAX_TIME_BYTES: usize = 128;
/// Days from the origin of spreadsheets, 1899-12-30, to 1970-01-01.
const EXCEL_EPOCH_DAYS: i64 = 25_569;
const NANOS_PER_MILLI: i128 = 1_000_000;
const NANOS_PER_DAY: i128 = 86_400_000_000_000;
/// Decimals of a serial day that are looked at.
const SERIAL_DECIMALS: i32 = 15;

/// Format of a column of times.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum TimeFormat {
    /// RFC 3339 or ISO 8601; without a zone it is local time.
    Iso,
    /// Count of a unit since 1970-01-01T00:00:00Z; the unit is a power of ten of a second.
    Unix {
        /// Decimal digits from the unit to the nanosecond: 9 for seconds.
        digits: i32,
    },
    /// Seconds from any start.
    Relative,
    /// Serial days of a spreadsheet since 1899-12-30, local time.
    Excel,
    /// Millionths of a serial day, as WinCC writes `Time_ms`, local time.
    Wincc,
    /// Pattern in the syntax of strftime.
    Pattern(TimePattern),
}

/// Checked pattern of strftime, such as `%d.%m.%Y %H:%M:%S`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TimePattern {
    /// The pattern without the abbreviation of a zone at its end.
    pattern: String,
    has_abbreviation: bool,
    example: String,
}

/// Instant that a cell names.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Instant {
    /// Nanoseconds from 1970-01-01T00:00:00Z, or from any start for [`TimeFormat::Relative`].
    pub nanos: i64,
    /// True where the clock showed the local time twice.
    pub is_ambiguous: bool,
}

impl TimeFormat {
    /// Parses a setting: the name of a format, or a pattern with `%`.
    ///
    /// # Errors
    /// What is wrong with it, and what is allowed.
    pub fn parse(text: &str) -> Result<Self, String> {
        Ok(match text.trim() {
            "rfc3339" | "iso8601" => Self::Iso,
            "unix_seconds" => Self::Unix { digits: 9 },
            "unix_millis" => Self::Unix { digits: 6 },
            "unix_micros" => Self::Unix { digits: 3 },
            "unix_nanos" => Self::Unix { digits: 0 },
            "seconds" => Self::Relative,
            "excel" => Self::Excel,
            "wincc" => Self::Wincc,
            pattern if pattern.contains('%') => Self::Pattern(TimePattern::parse(pattern)?),
            other => {
                return Err(format!(
                    "'{}' is none of rfc3339, unix_seconds, unix_millis, unix_micros, unix_nanos, \
                     seconds, excel, wincc, nor a pattern such as %d.%m.%Y %H:%M:%S",
                    crate::shorten(other)
                ));
            }
        })
    }

    /// Reports a format whose times have no date.
    pub fn is_relative(&self) -> bool {
        *self == Self::Relative
    }

    /// Description of its times for messages.
    fn expected(&self) -> String {
        match self {
            Self::Iso => "a time such as 2024-02-29T13:14:15Z".into(),
            Self::Unix { digits: 9 } | Self::Relative => "a number of seconds".into(),
            Self::Unix { digits: 6 } => "a number of milliseconds".into(),
            Self::Unix { digits: 3 } => "a number of microseconds".into(),
            Self::Unix { .. } => "a number of nanoseconds".into(),
            Self::Excel => "a serial day such as 46024.127835".into(),
            Self::Wincc => "millionths of a serial day such as 46024127835.648".into(),
            Self::Pattern(pattern) => format!("a time such as {}", pattern.example),
        }
    }
}

impl TimePattern {
    fn parse(text: &str) -> Result<Self, String> {
        let fault = |why: &str| format!("the pattern '{}' {why}", crate::shorten(text));
        if text.len() > MAX_PATTERN_BYTES {
            return Err(fault("is too long"));
        }
        let (pattern, has_abbreviation) = match text.strip_suffix("%Z") {
            Some(rest) => (rest.trim_end().to_owned(), true),
            None => (text.to_owned(), false),
        };
        if pattern.contains("%Z") {
            return Err(fault("has %Z, which is read at its end alone"));
        }
        let sample = DateTime::constant(2026, 11, 22, 15, 4, 5, 123_000_000);
        let zoned = sample.to_zoned(TimeZone::UTC).map_err(|error| fault(&error.to_string()))?;
        let example = jiff::fmt::strtime::format(&pattern, &zoned)
            .map_err(|error| fault(&format!("is none: {error}")))?;
        let read = BrokenDownTime::parse(&pattern, &example)
            .map_err(|error| fault(&format!("cannot be read back: {error}")))?;
        if read.to_date().is_err() && read.to_timestamp().is_err() {
            return Err(fault("names no day: it needs year, month and day, as %Y-%m-%d"));
        }
        if read.hour().is_some_and(|hour| hour != 15) {
            return Err(fault("has hours of 12 (%I) without %p"));
        }
        let zone = if has_abbreviation { " CET" } else { "" };
        Ok(Self { pattern, has_abbreviation, example: format!("{example}{zone}") })
    }

    fn read(&self, text: &str, zone: Option<&Zone>, last: Option<i64>) -> Result<Instant, Fault> {
        let (text, abbreviation) = if self.has_abbreviation {
            let start = text.rfind(|c: char| !c.is_ascii_alphabetic()).map_or(0, |at| at + 1);
            let (time, name) = text.split_at_checked(start).ok_or(Fault::Format)?;
            if name.is_empty() {
                return Err(Fault::Format);
            }
            (time.trim_end(), Some(name))
        } else {
            (text, None)
        };
        let read = BrokenDownTime::parse(&self.pattern, text).map_err(|_| Fault::Format)?;
        if read.offset().is_some() || read.timestamp().is_some() {
            return absolute(read.to_timestamp().map_err(|_| Fault::Format)?);
        }
        if read.iana_time_zone().is_some() {
            let zoned = read.to_zoned_with(&jiff::tz::TimeZoneDatabase::bundled());
            return absolute(zoned.map_err(|_| Fault::Format)?.timestamp());
        }
        let civil = match read.to_datetime() {
            Ok(civil) => civil,
            // A pattern without a time of day is midnight.
            Err(_) => read.to_date().map_err(|_| Fault::Format)?.to_datetime(Time::midnight()),
        };
        match abbreviation {
            Some("UTC" | "GMT" | "Z") if zone.is_none() => {
                local(civil, Some(&Zone::utc()), None, None)
            }
            _ => local(civil, zone, last, abbreviation),
        }
    }
}

/// Fault of a time.
enum Fault {
    /// Text that does not match the format.
    Format,
    /// Time of an implausible year.
    Implausible(Option<i16>),
    /// Another one, in words.
    Other(String),
}

/// Reads times of one column.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TimeReader {
    /// Format of the column.
    pub format: TimeFormat,
    /// Zone of times that name none.
    pub zone: Option<Zone>,
    /// Format of numbers, where times are numbers.
    pub numbers: NumberFormat,
}

impl TimeReader {
    /// Reads a time; `date` is that of a column of its own, `last` the time before it, which
    /// tells apart the two passes of an hour that the clock showed twice.
    ///
    /// # Errors
    /// What is wrong with it, in words that say what is expected.
    pub fn read(
        &self,
        date: Option<&str>,
        time: &str,
        last: Option<i64>,
    ) -> Result<Instant, String> {
        let joined = match date {
            Some(date) => format!("{} {}", date.trim(), time.trim()),
            None => time.trim().to_owned(),
        };
        // Some programs write a narrow space before AM and PM.
        let text = joined.replace(['\u{a0}', '\u{202f}'], " ");
        if text.len() > MAX_TIME_BYTES {
            return Err(format!("'{}' is too long for a time", crate::shorten(&text)));
        }
        let text = text.trim();
        let read = match &self.format {
            TimeFormat::Iso => read_iso(text, self.zone.as_ref(), last),
            TimeFormat::Pattern(pattern) => pattern.read(text, self.zone.as_ref(), last),
            TimeFormat::Relative => {
                let nanos = self.count(text, 9);
                return match nanos.and_then(|nanos| i64::try_from(nanos).ok()) {
                    Some(nanos) => Ok(Instant { nanos, is_ambiguous: false }),
                    None => Err(self.in_words(text, Fault::Format)),
                };
            }
            TimeFormat::Unix { digits } => self.read_unix(text, *digits),
            TimeFormat::Excel => self.read_serial(date, time, 0, last),
            TimeFormat::Wincc => self.read_serial(date, time, -6, last),
        };
        let instant = read.map_err(|fault| self.in_words(text, fault))?;
        self.check_year(text, instant)
    }

    fn in_words(&self, text: &str, fault: Fault) -> String {
        let shown = crate::shorten(text);
        match fault {
            Fault::Format => format!("'{shown}' is not {}", self.format.expected()),
            Fault::Implausible(year) => self.implausible(text, year),
            Fault::Other(what) => format!("'{shown}': {what}"),
        }
    }

    fn check_year(&self, text: &str, instant: Instant) -> Result<Instant, String> {
        let is_number =
            matches!(self.format, TimeFormat::Unix { .. } | TimeFormat::Excel | TimeFormat::Wincc);
        let least = if is_number { MIN_YEAR_OF_NUMBER } else { MIN_YEAR };
        match year_of(instant.nanos.into()) {
            Some(year) if (least..=MAX_YEAR).contains(&year) => Ok(instant),
            year => Err(self.implausible(text, year)),
        }
    }

    fn implausible(&self, text: &str, year: Option<i16>) -> String {
        let shown = crate::shorten(text);
        let expected = self.format.expected();
        let year = year.map_or("out of reach".into(), |year| format!("of the year {year}"));
        // Another unit of which it would be a time of today tells the fault.
        let units = [9, 6, 3, 0].map(|digits| Self {
            format: TimeFormat::Unix { digits },
            zone: None,
            numbers: self.numbers,
        });
        let right = units.iter().find_map(|unit| {
            let TimeFormat::Unix { digits } = unit.format else { return None };
            let year = year_of(self.count(text, digits)?)?;
            let is_plausible = (MIN_YEAR_OF_NUMBER..=MAX_YEAR).contains(&year);
            is_plausible.then(|| format!("as {} it is of {year}", unit.format.expected()))
        });
        let right = right.unwrap_or_else(|| match &self.format {
            TimeFormat::Pattern(_) => "a year of two digits is %y: is it in another format?".into(),
            _ => "is it in another unit or format?".into(),
        });
        format!("'{shown}' as {expected} would be {year}; {right}")
    }

    /// A number times ten to the power of `digits`, whole; nothing where it is none. An exponent
    /// is refused: programs that write one have lost digits.
    fn count(&self, text: &str, digits: i32) -> Option<i128> {
        let plain = self.numbers.normalize(text).ok()?;
        if plain.contains(['e', 'E']) {
            return None;
        }
        scale(&plain, digits).map(|(number, _)| number)
    }

    fn read_unix(&self, text: &str, digits: i32) -> Result<Instant, Fault> {
        let nanos = self.count(text, digits).ok_or(Fault::Format)?;
        match i64::try_from(nanos) {
            Ok(nanos) => Ok(Instant { nanos, is_ambiguous: false }),
            Err(_) => Err(Fault::Implausible(year_of(nanos))),
        }
    }

    fn read_serial(
        &self,
        date: Option<&str>,
        time: &str,
        shift: i32,
        last: Option<i64>,
    ) -> Result<Instant, Fault> {
        let serial = |text: &str| self.count(text, SERIAL_DECIMALS + shift).ok_or(Fault::Format);
        let date = date.map_or(Ok(0), serial)?;
        let total = serial(time)?.checked_add(date).ok_or(Fault::Format)?;
        let unit = 10_i128.pow(SERIAL_DECIMALS as u32);
        let days = total.div_euclid(unit);
        let fraction = total.rem_euclid(unit) * (NANOS_PER_DAY / NANOS_PER_MILLI);
        // Serial days have no finer digits than a millisecond for certain.
        let millis = (fraction + unit / 2) / unit;
        let days = i64::try_from(days).map_err(|_| Fault::Format)? - EXCEL_EPOCH_DAYS;
        let nanos = i128::from(days) * NANOS_PER_DAY + millis * NANOS_PER_MILLI;
        let time = Timestamp::from_nanosecond(nanos).map_err(|_| Fault::Format)?;
        local(TimeZone::UTC.to_datetime(time), self.zone.as_ref(), last, None)
    }
}

/// The year of an instant; nothing after 9999.
fn year_of(nanos: i128) -> Option<i16> {
    let time = Timestamp::from_nanosecond(nanos).ok()?;
    Some(TimeZone::UTC.to_datetime(time).year())
}

fn absolute(timestamp: Timestamp) -> Result<Instant, Fault> {
    let nanos = i64::try_from(timestamp.as_nanosecond()).map_err(|_| Fault::Format)?;
    Ok(Instant { nanos, is_ambiguous: false })
}

fn local(
    civil: DateTime,
    zone: Option<&Zone>,
    last: Option<i64>,
    abbreviation: Option<&str>,
) -> Result<Instant, Fault> {
    if !(MIN_YEAR..=MAX_YEAR).contains(&civil.year()) {
        return Err(Fault::Implausible(Some(civil.year())));
    }
    let zone = zone.ok_or_else(|| {
        Fault::Other("it has no zone: set `zone`, such as UTC or Europe/Berlin".into())
    })?;
    let resolved = zone.resolve(civil, last, abbreviation).map_err(Fault::Other)?;
    Ok(Instant { nanos: resolved.nanos, is_ambiguous: resolved.is_ambiguous })
}

/// Joins an offset that stands apart, as in `2026-01-02 03:04:05 +01:00` or `... UTC`.
fn join_offset(text: &str) -> Option<String> {
    let (time, zone) = text.rsplit_once(' ')?;
    let is_offset = |text: &str| text.starts_with(['+', '-']);
    match zone {
        "UTC" | "GMT" | "Z" => Some(format!("{time}Z")),
        offset if is_offset(offset) => Some(format!("{time}{offset}")),
        _ => None,
    }
}

fn read_iso(text: &str, zone: Option<&Zone>, last: Option<i64>) -> Result<Instant, Fault> {
    let joined = join_offset(text);
    if let Ok(timestamp) = joined.as_deref().unwrap_or(text).parse::<Timestamp>() {
        return absolute(timestamp);
    }
    let civil = text.parse::<DateTime>().map_err(|_| Fault::Format)?;
    local(civil, zone, last, None)
}

#[cfg(test)]
#[path = "time_format_tests.rs"]
mod tests;
