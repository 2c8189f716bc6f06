//! Texts of alarms: times, conditions, log records.

use std::time::Duration;

use busbar_alarms::{AlarmRecord, AlarmSource, Condition, TagCondition, VerdictCondition};
use busbar_tags::{SourceTime, TagSet};
use busbar_types::Severity;

use crate::panel_rows::value_text;

const NANOS_PER_SECOND: i64 = 1_000_000_000;
const SECONDS_PER_DAY: i64 = 86_400;

/// A time of day, UTC; with the date where that is not today's.
pub(super) fn time(at: SourceTime, now: SourceTime) -> String {
    let [at, now] = [at, now].map(|time| time.0.div_euclid(NANOS_PER_SECOND));
    let of_day = at.rem_euclid(SECONDS_PER_DAY);
    let [hours, minutes, seconds] = [of_day / 3600, of_day / 60 % 60, of_day % 60];
    let day = at.div_euclid(SECONDS_PER_DAY);
    if day == now.div_euclid(SECONDS_PER_DAY) {
        return format!("{hours:02}:{minutes:02}:{seconds:02}");
    }
    let (month, day) = month_and_day(day);
    format!("{month:02}-{day:02} {hours:02}:{minutes:02}")
}

/// Month and day of a day since 1970-01-01 (H. Hinnant, "chrono-Compatible Low-Level Date
/// Algorithms", `civil_from_days`).
fn month_and_day(days: i64) -> (i64, i64) {
    let shifted = days + 719_468;
    let of_era = shifted.rem_euclid(146_097);
    let year = (of_era - of_era / 1_460 + of_era / 36_524 - of_era / 146_096) / 365;
    let of_year = of_era - (365 * year + year / 4 - year / 100);
    let month = (5 * of_year + 2) / 153;
    let day = of_year - (153 * month + 2) / 5 + 1;
    (if month < 10 { month + 3 } else { month - 9 }, day)
}

/// Describes an alarm's condition: `above 95 °C (back at 93 °C), for 5 s`.
pub(super) fn condition(source: &AlarmSource, tags: &TagSet) -> String {
    let mut words = match source {
        AlarmSource::Tag { trigger, .. } => watch_text(trigger, tags),
        AlarmSource::Verdict { trigger, .. } => verdict_text(trigger),
        AlarmSource::Mirrored => return String::new(),
    };
    for (delay, what) in source.delays().into_iter().zip(["for", "over after"]) {
        if delay > Duration::ZERO {
            words += &format!(", {what} {} s", delay.as_secs_f64());
        }
    }
    if let Some(by) = source.suppressed_by() {
        words += &format!("; not while {}", watch_text(by, tags));
    }
    words
}

fn verdict_text(VerdictCondition { overlay, equipment, severity }: &VerdictCondition) -> String {
    let judged = match severity {
        Severity::Alarm => "an alarm",
        Severity::Normal | Severity::Warning => "abnormal",
    };
    format!("'{overlay}' judges {equipment} to be {judged}")
}

fn watch_text(TagCondition { tag, condition }: &TagCondition, tags: &TagSet) -> String {
    let Some(tag) = tags.spec(*tag) else { return String::new() };
    let unit = if tag.unit.is_empty() { String::new() } else { format!(" {}", tag.unit) };
    let holds = match condition {
        Condition::Limit { limit, at, deadband } => {
            let side = if limit.is_upper() { "above" } else { "below" };
            let sign = if limit.is_upper() { -1.0 } else { 1.0 };
            let back = match *deadband {
                0.0 => String::new(),
                deadband => format!(" (back at {}{unit})", at + sign * deadband),
            };
            format!("{side} {at}{unit}{back}")
        }
        Condition::Equals(value) => format!("is {}", value_text(value)),
        Condition::Differs(value) => format!("is not {}", value_text(value)),
        Condition::BadQuality => "is bad".to_owned(),
    };
    format!("{} {holds}", tag.id)
}

/// A line of the audit log: `12:03:07  T1.Hot  acknowledged by A. Operator: ...`.
pub(super) fn record(record: &AlarmRecord, now: SourceTime) -> String {
    let mut words =
        format!("{}  {}  {}", time(record.time, now), record.alarm, record.happened.name());
    if let Some(operator) = &record.operator {
        words += &format!(" by {operator}");
    }
    if let Some(until) = record.standing.shelved_until {
        words += &format!(" until {}", time(until, now));
    }
    if let Some(value) = &record.value {
        words += &format!(" at {}", value_text(value));
    }
    if let Some(reason) = &record.reason {
        words += &format!(": {reason}");
    }
    if record.is_assumed && !record.reason.as_ref().is_some_and(|of| of.contains("assumed")) {
        words += ", assumed";
    }
    if !record.origin.is_live() {
        words += &format!(" ({})", record.origin);
    }
    if record.is_first_out {
        words += ", first out";
    }
    if record.from != record.to {
        words += &format!("; {}, before: {}", record.to.name(), record.from.name());
    }
    words
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_have_a_date_where_it_is_not_today() {
        let at = |seconds: i64| SourceTime(seconds * NANOS_PER_SECOND);
        // 2024-02-29 12:34:56 UTC.
        let leap_day = 1_709_210_096;
        assert_eq!(time(at(leap_day), at(leap_day + 60)), "12:34:56");
        assert_eq!(time(at(leap_day), at(leap_day + SECONDS_PER_DAY)), "02-29 12:34");
        assert_eq!(time(at(-1), at(0)), "12-31 23:59");
    }
}
