//! Source times of documents: RFC 3339, or a count of a unit of time since 1970.

use std::time::{Duration, SystemTime, UNIX_EPOCH};

use schemars::JsonSchema;
use serde::Deserialize;
use serde_json::Value as Json;

/// Seconds since 1970 of 2000-01-01 and 2100-01-01, between which clocks of sources run.
const PLAUSIBLE_SECONDS: std::ops::Range<u64> = 946_684_800..4_102_444_800;
/// Characters of a time that a log line shows.
const MAX_SHOWN_CHARS: usize = 60;

/// Unit of counts of time since 1970.
#[derive(Clone, Copy, Debug, Default, Deserialize, JsonSchema, PartialEq, Eq, PartialOrd, Ord)]
#[serde(rename_all = "lowercase")]
pub(crate) enum TimeUnit {
    /// Seconds since 1970-01-01 UTC.
    S,
    /// Milliseconds since 1970-01-01 UTC.
    #[default]
    Ms,
    /// Microseconds since 1970-01-01 UTC.
    Us,
    /// Nanoseconds since 1970-01-01 UTC.
    Ns,
}

impl TimeUnit {
    const ALL: [Self; 4] = [Self::S, Self::Ms, Self::Us, Self::Ns];

    /// Returns the word of the settings for this unit.
    fn word(self) -> &'static str {
        match self {
            Self::S => "s",
            Self::Ms => "ms",
            Self::Us => "us",
            Self::Ns => "ns",
        }
    }

    fn per_second(self) -> u64 {
        match self {
            Self::S => 1,
            Self::Ms => 1_000,
            Self::Us => 1_000_000,
            Self::Ns => 1_000_000_000,
        }
    }

    /// Converts a count to a time; `None` where no source can mean it.
    fn time_of(self, count: Count) -> Option<SystemTime> {
        let since = match count {
            Count::Whole(count) => {
                let nanos = count % self.per_second() * (1_000_000_000 / self.per_second());
                Duration::new(count / self.per_second(), u32::try_from(nanos).ok()?)
            }
            Count::Fraction(count) => {
                Duration::try_from_secs_f64(count / self.per_second() as f64).ok()?
            }
        };
        UNIX_EPOCH.checked_add(since).filter(|time| is_possible(*time))
    }
}

/// A count of units.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Count {
    Whole(u64),
    Fraction(f64),
}

/// Reads a source time. Without a `unit` in the settings, counts are milliseconds, and texts are no
/// counts. Unreadable or impossible times are `None`, and so are counts that would be plausible in
/// another unit alone.
pub(crate) fn time_of(json: &Json, unit: Option<TimeUnit>) -> Option<SystemTime> {
    let Some(count) = count_of(json, unit) else {
        let Json::String(text) = json else { return None };
        let time = SystemTime::from(text.trim().parse::<jiff::Timestamp>().ok()?);
        return is_possible(time).then_some(time);
    };
    let unit = unit.unwrap_or_default();
    unit.time_of(count).filter(|_| better_unit(count, unit).is_none())
}

/// Shows, in words and with a remedy, a time that cannot be used.
pub(crate) fn show_unusable(pointer: &str, json: &Json, unit: Option<TimeUnit>) -> String {
    let text: String = json.to_string().chars().take(MAX_SHOWN_CHARS).collect();
    let used = unit.unwrap_or_default();
    let remedy = match (count_of(json, unit), json) {
        (Some(count), _) => {
            let other = better_unit(count, used).and_then(|other| {
                let time = jiff::Timestamp::try_from(other.time_of(count)?).ok()?;
                Some(format!(", but {time} as {0}: set time_unit to \"{0}\"", other.word()))
            });
            let other =
                other.unwrap_or_else(|| ": correct the source's clock, or time_unit".into());
            format!("no time of a source as {}{other}", used.word())
        }
        (None, Json::String(text)) if count_of_text(text.trim()).is_some() => {
            "a count as text: set time_unit to \"s\", \"ms\", \"us\" or \"ns\"".to_owned()
        }
        (None, Json::String(text)) if text.trim().parse::<jiff::civil::DateTime>().is_ok() => {
            "a time without a zone: have the source send one, such as Z or +01:00".to_owned()
        }
        _ => format!("RFC 3339 with a zone, or a number of {} (time_unit)", used.word()),
    };
    format!("unusable ('{pointer}' has {text}; {remedy})")
}

fn count_of(json: &Json, unit: Option<TimeUnit>) -> Option<Count> {
    match json {
        Json::Number(number) => {
            number.as_u64().map(Count::Whole).or_else(|| number.as_f64().map(Count::Fraction))
        }
        Json::String(text) if unit.is_some() => count_of_text(text.trim()),
        _ => None,
    }
}

fn count_of_text(text: &str) -> Option<Count> {
    // Digits and a point alone: no exponent, no `inf`.
    let is_count = text.bytes().all(|byte| byte.is_ascii_digit() || byte == b'.');
    let whole = text.parse().ok().map(Count::Whole);
    whole.or_else(|| text.parse().ok().map(Count::Fraction)).filter(|_| is_count)
}

/// Returns another unit in which a count is a plausible time, where it is none in `unit`.
fn better_unit(count: Count, unit: TimeUnit) -> Option<TimeUnit> {
    let is_plausible = |unit: TimeUnit| {
        let since = unit.time_of(count).and_then(|time| time.duration_since(UNIX_EPOCH).ok());
        since.is_some_and(|since| PLAUSIBLE_SECONDS.contains(&since.as_secs()))
    };
    let mut others = TimeUnit::ALL.into_iter().filter(|other| *other != unit);
    if is_plausible(unit) { None } else { others.find(|other| is_plausible(*other)) }
}

/// Reports whether a source can mean a time: from 1970 to 2262, the range of nanoseconds in 63
/// bits.
pub(crate) fn is_possible(time: SystemTime) -> bool {
    let since = time.duration_since(UNIX_EPOCH);
    since.is_ok_and(|since| i64::try_from(since.as_nanos()).is_ok())
}

#[cfg(test)]
#[path = "source_time_tests.rs"]
mod tests;
