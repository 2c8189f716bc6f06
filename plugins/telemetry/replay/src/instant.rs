//! Instants as recordings write them, in nanoseconds.

use std::time::{Duration, SystemTime, UNIX_EPOCH};

use time::OffsetDateTime;
use time::format_description::well_known::Rfc3339;

/// Nanoseconds of a second.
pub(crate) const SECOND: i64 = 1_000_000_000;

/// Nanoseconds from 1970-01-01T00:00:00Z of a time by RFC 3339, which has a zone.
pub(crate) fn parse_rfc3339(text: &str) -> Option<i64> {
    let time = OffsetDateTime::parse(text, &Rfc3339).ok()?;
    i64::try_from(time.unix_timestamp_nanos()).ok()
}

/// Nanoseconds of so many seconds.
pub(crate) fn nanos_of_seconds(seconds: f64) -> i64 {
    // Saturates: what is out of reach is after every recording.
    (seconds * SECOND as f64).round() as i64
}

/// An instant from 1970 on.
pub(crate) fn system_time(unix_nanos: i64) -> Option<SystemTime> {
    UNIX_EPOCH.checked_add(Duration::from_nanos(u64::try_from(unix_nanos).ok()?))
}

/// Nanoseconds from 1970-01-01T00:00:00Z, or zero before.
pub(crate) fn unix_nanos(time: SystemTime) -> i64 {
    let since = time.duration_since(UNIX_EPOCH).unwrap_or_default();
    i64::try_from(since.as_nanos()).unwrap_or(i64::MAX)
}

/// An instant for people.
pub(crate) fn in_words(unix_nanos: i64) -> String {
    let time = OffsetDateTime::from_unix_timestamp(unix_nanos.div_euclid(SECOND));
    time.ok().and_then(|time| time.format(&Rfc3339).ok()).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_have_a_zone() {
        let expected = Some(1_709_212_455_500_000_000);
        assert_eq!(parse_rfc3339("2024-02-29T13:14:15.5Z"), expected);
        assert_eq!(parse_rfc3339("2024-02-29T15:14:15.5+02:00"), expected);
        assert_eq!(parse_rfc3339("2024-02-29T13:14:15.5"), None);
        assert_eq!(parse_rfc3339("2023-02-29T13:14:15Z"), None);
        assert_eq!(in_words(1_709_212_455_500_000_000), "2024-02-29T13:14:15Z");
    }

    #[test]
    fn nothing_before_1970_is_an_instant() {
        assert_eq!(system_time(-1), None);
        assert_eq!(system_time(SECOND), Some(UNIX_EPOCH + Duration::from_secs(1)));
        assert_eq!(nanos_of_seconds(f64::MAX), i64::MAX);
    }
}
