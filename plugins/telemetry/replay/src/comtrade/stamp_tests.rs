use super::*;

/// Instant 2024-02-29T13:14:15Z, in nanoseconds.
const LEAP_DAY: i64 = 1_709_212_455 * NANOS_PER_SECOND;

fn nanos(date: &str, clock: &str, revision: Revision) -> Option<i64> {
    Stamp::parse(date, clock, revision).unwrap().nanos
}

#[test]
fn both_orders_are_read() {
    let later = nanos("29/02/2024", "13:14:15.123456", Revision::Of1999);
    assert_eq!(later, Some(LEAP_DAY + 123_456_000));
    let first = nanos("02/29/24", "13:14:15.123456", Revision::Of1991);
    assert_eq!(first, later);
    assert_eq!(nanos("1/2/70", "0:00:00", Revision::Of1991), Some(86_400 * NANOS_PER_SECOND));
    let other = Stamp::parse("29/02/2024", "13:14:15", Revision::Of1991).unwrap();
    assert_eq!((other.nanos, other.is_swapped), (Some(LEAP_DAY), true));
}

#[test]
fn the_fraction_says_the_unit() {
    let micro = Stamp::parse("29/02/2024", "13:14:15.000001", Revision::Of2013).unwrap();
    assert!(!micro.is_nano);
    let nano = Stamp::parse("29/02/2024", "13:14:15.000000001", Revision::Of2013).unwrap();
    assert_eq!((nano.nanos, nano.is_nano), (Some(LEAP_DAY + 1), true));
    assert_eq!(
        nanos("29/02/2024", "13:14:60", Revision::Of2013),
        Some(LEAP_DAY + 45 * NANOS_PER_SECOND)
    );
}

#[test]
fn dates_with_the_year_first_and_with_points_are_read() {
    let expected = Some(LEAP_DAY);
    for (date, clock) in [
        ("2024-02-29", "13:14:15"),
        ("2024/02/29", "13:14:15"),
        ("2024-02-29T13:14:15", ""),
        ("2024-02-29 13:14:15Z", ""),
        ("29.02.2024", "13:14:15"),
    ] {
        assert_eq!(nanos(date, clock, Revision::Of1999), expected, "{date} {clock}");
    }
    assert!(Stamp::parse("2024-02-29", "13:14:15Z", Revision::Of1999).unwrap().is_utc);
}

#[test]
fn a_date_of_zeros_is_none() {
    assert_eq!(nanos("00/00/0000", "00:00:00.000000", Revision::Of1999), None);
}

#[test]
fn what_is_no_stamp_is_named() {
    for (date, clock) in [
        ("31/04/2024", "00:00:00"),
        ("1-2-2024", "00:00:00"),
        ("1/2", "00:00:00"),
        ("1/2/20244", "00:00:00"),
        ("1/+2/2024", "00:00:00"),
        ("1/2/9999", "00:00:00"),
        ("1/2/2024", "24:00:00"),
        ("1/2/2024", "00:60:00"),
        ("1/2/2024", "00:00:61"),
        ("1/2/2024", "00:00"),
        ("1/2/2024", "00:00:00.x"),
        ("1/2/2024", "00:00:00.1234567890123"),
        ("", ""),
    ] {
        let fault = Stamp::parse(date, clock, Revision::Of1999).unwrap_err();
        assert!(
            fault.contains("no date") || fault.contains("no time") || fault.contains("year"),
            "{date} {clock}: {fault}"
        );
    }
}
