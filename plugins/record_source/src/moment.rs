//! Times as business systems write them.

use time::format_description::well_known::Rfc3339;
use time::{Date, Month, OffsetDateTime, Time};

/// Nanoseconds since 1970-01-01 UTC of a date of ISO 8601, `2026-11-23`, behind which a time of
/// day may follow, `T12:04`, `T12:04:15` or with a zone by RFC 3339; none where it is no time.
/// Without a zone it is UTC.
pub(crate) fn unix_nanos(text: &str) -> Option<i64> {
    let (date, rest) = text.split_at_checked(10)?;
    let date = date_of(date)?;
    let at = match rest.strip_prefix(['T', 't', ' ']) {
        None if rest.is_empty() => date.midnight().assume_utc(),
        None => return None,
        Some(time) => match time_of(time) {
            Some(time) => date.with_time(time).assume_utc(),
            None => {
                let text = format!("{}T{time}", &text[..10]);
                OffsetDateTime::parse(&text, &Rfc3339).ok()?
            }
        },
    };
    i64::try_from(at.unix_timestamp_nanos()).ok()
}

fn date_of(text: &str) -> Option<Date> {
    let mut parts = text.split('-');
    let (year, month, day) = (parts.next()?, parts.next()?, parts.next()?);
    let month = Month::try_from(number(month, 2)? as u8).ok()?;
    Date::from_calendar_date(number(year, 4)? as i32, month, number(day, 2)? as u8).ok()
}

fn time_of(text: &str) -> Option<Time> {
    let mut parts = text.split(':');
    let (hour, minute) = (number(parts.next()?, 2)?, number(parts.next()?, 2)?);
    let second = parts.next().map_or(Some(0), |second| number(second, 2))?;
    if parts.next().is_some() {
        return None;
    }
    Time::from_hms(hour as u8, minute as u8, second as u8).ok()
}

fn number(text: &str, digits: usize) -> Option<u32> {
    let is_number = text.len() == digits && text.bytes().all(|b| b.is_ascii_digit());
    is_number.then(|| text.parse().ok())?
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::unix_nanos;

    const SECOND: i64 = 1_000_000_000;

    #[test]
    fn dates_and_times_are_read_and_others_are_not() {
        for (text, seconds) in [
            ("1970-01-01", 0),
            ("2024-02-29", 1_709_164_800),
            ("1970-01-02 01:02", 86_400 + 3720),
            ("1970-01-01T00:00:09", 9),
            ("1970-01-01T02:00:00+02:00", 0),
            ("1969-12-31T23:59:59Z", -1),
        ] {
            assert_eq!(unix_nanos(text), Some(seconds * SECOND), "{text}");
        }
        for text in [
            "",
            "2023-02-29",
            "2026-13-01",
            "23.11.2026",
            "2026-11-23x",
            "2026-1-1",
            "äöü-äö-äö",
            "2026-11-23T",
            "2026-11-23 25:00",
            "2026-11-23 1:00",
            "9999-12-31",
            "+026-11-23",
            "2026-11-23 10:00:00:00",
        ] {
            assert_eq!(unix_nanos(text), None, "{text}");
        }
    }

    proptest! {
        #[test]
        fn whatever_text_is_read_or_refused(text in "\\PC{0,30}") {
            let _ = unix_nanos(&text);
        }
    }
}
