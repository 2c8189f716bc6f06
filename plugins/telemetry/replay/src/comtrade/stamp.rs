//! Date and time stamps (7.4.9; IEEE C37.111-1991, 7.5 has another order).

use time::{Date, Month};

use super::revision::Revision;

const NANOS_PER_SECOND: i64 = 1_000_000_000;
/// Digits of a nanosecond.
const NANO_DIGITS: usize = 9;
/// Digits of a second with which the unit of time stamps is the microsecond; with
/// more it is the nanosecond.
const MICRO_DIGITS: usize = 6;
/// Years of two digits from here on are of the last century.
const PIVOT_YEAR: i32 = 70;

/// An instant as the recorder's clock showed it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Stamp {
    /// Nanoseconds from 1970-01-01 of that clock; nothing where the date is zero,
    /// which recorders without a clock write.
    pub nanos: Option<i64>,
    /// True where it was written in nanoseconds.
    pub is_nano: bool,
    /// True where month and day were in the other order than the revision has them.
    pub is_swapped: bool,
    /// True where it was written as in ISO 8601, the year first.
    pub is_iso: bool,
    /// True where it says that it is UTC.
    pub is_utc: bool,
}

impl Stamp {
    /// A stamp of which nothing is known.
    pub(super) fn unknown() -> Self {
        Self { nanos: None, is_nano: false, is_swapped: false, is_iso: false, is_utc: false }
    }

    /// Reads `dd/mm/yyyy,hh:mm:ss.ssssss`, or `mm/dd/yy` in files of 1991, or ISO 8601.
    ///
    /// # Errors
    /// What is wrong with it.
    pub fn parse(date: &str, clock: &str, revision: Revision) -> Result<Self, String> {
        if date.is_empty() && clock.is_empty() {
            return Err("there is no date and no time".into());
        }
        // ISO 8601 may have both in one field.
        let (date, clock) = match date.split_once(['T', 't', ' ']) {
            Some((date, in_date)) if clock.is_empty() => (date, in_date.trim()),
            _ => (date, clock),
        };
        let (clock, is_utc) = match clock.strip_suffix(['Z', 'z']) {
            Some(clock) => (clock, true),
            None => (clock, false),
        };
        let (of_day, is_nano) = parse_clock(clock)?;
        let (days, is_swapped, is_iso) = match parse_iso_date(date) {
            Some(days) => (Some(days), false, true),
            None => {
                let (days, is_swapped) = parse_date(date, revision)?;
                (days, is_swapped, false)
            }
        };
        let instant = |days: i64| {
            let seconds = days.checked_mul(86_400)?.checked_mul(NANOS_PER_SECOND)?;
            seconds.checked_add(of_day)
        };
        let nanos = match days {
            None => None,
            Some(days) => Some(instant(days).ok_or("the year is not within 1678 to 2262")?),
        };
        Ok(Self { nanos, is_nano, is_swapped, is_iso, is_utc })
    }
}

/// Days since 1970-01-01 of a date whose year is first.
fn parse_iso_date(text: &str) -> Option<i64> {
    let parts: Vec<&str> = text.split(['-', '/']).map(str::trim).collect();
    let [year, month, day] = parts[..] else { return None };
    let is_number = |text: &str| text.bytes().all(|byte| byte.is_ascii_digit());
    if year.len() != 4 || !(1..=2).contains(&month.len()) || !(1..=2).contains(&day.len()) {
        return None;
    }
    if ![year, month, day].into_iter().all(is_number) {
        return None;
    }
    let month = Month::try_from(month.parse::<u8>().ok()?).ok()?;
    let date = Date::from_calendar_date(year.parse().ok()?, month, day.parse().ok()?).ok()?;
    Some(i64::from(date.to_julian_day()) - UNIX_JULIAN_DAY)
}

/// Days since 1970-01-01, nothing for a date of zeros; and whether month and day
/// were swapped.
fn parse_date(text: &str, revision: Revision) -> Result<(Option<i64>, bool), String> {
    let (order, other) = match revision {
        Revision::Of1991 => ("mm/dd/yy", "dd/mm/yy"),
        _ => ("dd/mm/yyyy", "mm/dd/yyyy"),
    };
    let fault = || format!("'{}' is no date {order}", super::fields::shorten(text));
    let parts: Vec<&str> = text.split(['/', '.']).map(str::trim).collect();
    let [first, second, year] = parts[..] else { return Err(fault()) };
    let number = |text: &str| -> Result<i32, String> {
        let is_number =
            !text.is_empty() && text.len() <= 4 && text.bytes().all(|b| b.is_ascii_digit());
        if is_number { text.parse().map_err(|_| fault()) } else { Err(fault()) }
    };
    let (first, second) = (number(first)?, number(second)?);
    let year = match (number(year)?, year.len()) {
        (year, 1 | 2) if year >= PIVOT_YEAR => 1900 + year,
        (year, 1 | 2) => 2000 + year,
        (year, _) => year,
    };
    if first == 0 && second == 0 {
        return Ok((None, false));
    }
    let (day, month) = if revision == Revision::Of1991 { (second, first) } else { (first, second) };
    let days = |day: i32, month: i32| {
        let month = Month::try_from(u8::try_from(month).ok()?).ok()?;
        let date = Date::from_calendar_date(year, month, u8::try_from(day).ok()?).ok()?;
        Some(i64::from(date.to_julian_day()) - UNIX_JULIAN_DAY)
    };
    match (days(day, month), days(month, day)) {
        (Some(days), _) => Ok((Some(days), false)),
        (None, Some(days)) => Ok((Some(days), true)),
        (None, None) => Err(format!("{}, nor {other}", fault())),
    }
}

/// The Julian day of 1970-01-01.
const UNIX_JULIAN_DAY: i64 = 2_440_588;

/// Nanoseconds of the day, and whether the text has more than microseconds.
fn parse_clock(text: &str) -> Result<(i64, bool), String> {
    let fault = || format!("'{}' is no time hh:mm:ss.ssssss", super::fields::shorten(text));
    let parts: Vec<&str> = text.split(':').map(str::trim).collect();
    let [hour, minute, second] = parts[..] else { return Err(fault()) };
    let (second, fraction) = second.split_once('.').unwrap_or((second, ""));
    let number = |text: &str, max: i64| -> Result<i64, String> {
        let is_number = (1..=2).contains(&text.len()) && text.bytes().all(|b| b.is_ascii_digit());
        let number = text.parse().ok().filter(|number| is_number && *number <= max);
        number.ok_or_else(fault)
    };
    // A leap second is :60.
    let seconds = number(hour, 23)? * 3600 + number(minute, 59)? * 60 + number(second, 60)?;
    if fraction.len() > 12 || !fraction.bytes().all(|b| b.is_ascii_digit()) {
        return Err(fault());
    }
    let nanos = fraction.bytes().chain(std::iter::repeat(b'0')).take(NANO_DIGITS);
    let nanos = nanos.fold(0, |sum, digit| sum * 10 + i64::from(digit - b'0'));
    Ok((seconds * NANOS_PER_SECOND + nanos, fraction.len() > MICRO_DIGITS))
}

#[cfg(test)]
#[path = "stamp_tests.rs"]
mod tests;
