use super::*;
use crate::Separators;

fn reader(format: &str, zone: Option<&str>) -> TimeReader {
    let zone = zone.map(|name| Zone::parse(name).unwrap());
    TimeReader {
        format: TimeFormat::parse(format).unwrap(),
        zone,
        numbers: NumberFormat::default(),
    }
}

fn at(text: &str) -> i64 {
    i64::try_from(text.parse::<Timestamp>().unwrap().as_nanosecond()).unwrap()
}

fn check(format: &str, zone: Option<&str>, text: &str, expected: &str) {
    let found = reader(format, zone).read(None, text, None);
    assert_eq!(found, Ok(Instant { nanos: at(expected), is_ambiguous: false }), "{format}: {text}");
}

#[test]
fn times_as_programs_export_them_are_read() {
    let (berlin, utc) = (Some("Europe/Berlin"), Some("UTC"));
    for (format, zone, text, expected) in [
        ("rfc3339", None, "2026-01-02T03:04:05Z", "2026-01-02T03:04:05Z"),
        ("rfc3339", None, "2026-01-02 03:04:05.25+02:00", "2026-01-02T01:04:05.25Z"),
        ("rfc3339", utc, "2026-01-02 03:04:05", "2026-01-02T03:04:05Z"),
        ("rfc3339", berlin, "2026-01-02 03:04:05 UTC", "2026-01-02T03:04:05Z"),
        ("rfc3339", berlin, "2026-01-02 03:04:05 +05:30", "2026-01-01T21:34:05Z"),
        ("rfc3339", None, "2026-01-02 03:04:05.5 -0700", "2026-01-02T10:04:05.5Z"),
        ("rfc3339", berlin, "2026-07-02T03:04:05", "2026-07-02T01:04:05Z"),
        ("iso8601", berlin, "2026-01-02 03:04:05,125", "2026-01-02T02:04:05.125Z"),
        ("%d.%m.%Y %H:%M:%S", berlin, "02.01.2026 03:04:05", "2026-01-02T02:04:05Z"),
        ("%d.%m.%Y %H:%M:%S", utc, "2.1.2026 3:04:05", "2026-01-02T03:04:05Z"),
        ("%m/%d/%Y %I:%M:%S %p", utc, "1/2/2026 3:04:05 PM", "2026-01-02T15:04:05Z"),
        ("%m/%d/%Y %I:%M:%S %p", utc, "1/2/2026 12:04:05 am", "2026-01-02T00:04:05Z"),
        ("%m/%d/%Y %I:%M:%S %p", utc, "1/2/2026 3:04:05\u{202f}PM", "2026-01-02T15:04:05Z"),
        ("%d-%b-%y %H:%M:%S", utc, "02-Jan-26 03:04:05", "2026-01-02T03:04:05Z"),
        ("%d-%b-%y %H:%M:%S%.f", utc, "02-JAN-26 03:04:05.5", "2026-01-02T03:04:05.5Z"),
        ("%Y-%m-%d %H:%M:%S %Z", berlin, "2026-01-02 03:04:05 CET", "2026-01-02T02:04:05Z"),
        ("%Y-%m-%d %H:%M:%S %Z", berlin, "2026-10-25 02:30:00 CET", "2026-10-25T01:30:00Z"),
        ("%Y-%m-%d %H:%M:%S %Z", None, "2026-01-02 03:04:05 UTC", "2026-01-02T03:04:05Z"),
        ("%Y-%m-%d %H:%M:%S %z", None, "2026-01-02 03:04:05 +0530", "2026-01-01T21:34:05Z"),
        ("%Y-%m-%d %H:%M:%S,%f", utc, "2026-01-02 03:04:05,123", "2026-01-02T03:04:05.123Z"),
        ("%Y/%m/%d %H:%M", utc, "2026/01/02 03:04", "2026-01-02T03:04:00Z"),
        ("%Y%m%d%H%M%S", utc, "20260102030405", "2026-01-02T03:04:05Z"),
        ("unix_seconds", None, "1767323045.5", "2026-01-02T03:04:05.5Z"),
        ("unix_millis", None, "1767323045000", "2026-01-02T03:04:05Z"),
        ("unix_micros", None, "1767323045000001", "2026-01-02T03:04:05.000001Z"),
        ("unix_nanos", None, "1767323045000000001", "2026-01-02T03:04:05.000000001Z"),
        ("excel", utc, "46024.127835", "2026-01-02T03:04:04.944Z"),
        ("excel", berlin, "46024.5", "2026-01-02T11:00:00Z"),
        ("excel", utc, "46024", "2026-01-02T00:00:00Z"),
        ("wincc", utc, "46024127835.648", "2026-01-02T03:04:05Z"),
    ] {
        check(format, zone, text, expected);
    }
}

#[test]
fn a_year_of_two_digits_is_none_of_four() {
    for zone in [None, Some("Europe/Berlin")] {
        let fault = reader("%d.%m.%Y %H:%M", zone).read(None, "02.01.26 03:04", None).unwrap_err();
        assert!(fault.contains("of the year 26; a year of two digits is %y"), "{fault}");
    }
}

#[test]
fn date_and_time_may_be_two_cells() {
    let read = |format, date, time| reader(format, Some("UTC")).read(Some(date), time, None);
    let expected = Instant { nanos: at("2026-01-02T03:04:05Z"), is_ambiguous: false };
    assert_eq!(read("rfc3339", "2026-01-02", "03:04:05"), Ok(expected));
    assert_eq!(read("%d.%m.%Y %H:%M:%S", "02.01.2026", "03:04:05"), Ok(expected));
    let excel = Instant { nanos: at("2026-01-02T12:00:00Z"), ..expected };
    assert_eq!(read("excel", "46024", "0.5"), Ok(excel));
    assert!(read("rfc3339", "", "03:04:05").is_err());
}

#[test]
fn a_decimal_comma_counts_in_times_too() {
    let separators = Separators { decimal: ',', thousands: None };
    let numbers = NumberFormat::new(separators);
    let read =
        |format, text| TimeReader { numbers, ..reader(format, Some("UTC")) }.read(None, text, None);
    let nanos = |text| at(text);
    assert_eq!(read("excel", "46024,127835").unwrap().nanos, nanos("2026-01-02T03:04:04.944Z"));
    assert_eq!(
        read("unix_seconds", "1767323045,5").unwrap().nanos,
        nanos("2026-01-02T03:04:05.5Z")
    );
    assert!(read("unix_seconds", "1767323045.5").is_err());
}

#[test]
fn a_count_in_another_unit_is_refused() {
    let units = ["unix_seconds", "unix_millis", "unix_micros", "unix_nanos"];
    let mut random = fastrand::Rng::with_seed(7);
    for _ in 0..20_000 {
        // From 1990 to 2090.
        let seconds = random.i64(631_152_000..3_786_912_000);
        let (written, told) = (random.usize(0..4), random.usize(0..4));
        let text = (i128::from(seconds) * 1000_i128.pow(written as u32)).to_string();
        let read = reader(units[told], None).read(None, &text, None);
        if written == told {
            assert_eq!(read.unwrap().nanos, seconds * 1_000_000_000);
        } else {
            let fault = read.unwrap_err();
            assert!(fault.contains(&text) && fault.contains("it is of "), "{fault}");
        }
    }
    let fault = reader("unix_seconds", None).read(None, "1767323045000", None).unwrap_err();
    let right = "'1767323045000' as a number of seconds would be out of reach; as a number of \
                 milliseconds it is of 2026";
    assert_eq!(fault, right);
    assert!(reader("excel", Some("UTC")).read(None, "1767323045", None).is_err());
    assert!(reader("%d.%m.%Y %H:%M", Some("UTC")).read(None, "02.01.26 03:04", None).is_err());
}

#[test]
fn what_is_no_time_says_what_is_expected() {
    for (format, zone, text, part) in [
        ("rfc3339", None, "2026-01-02T03:04:05", "it has no zone: set `zone`"),
        ("rfc3339", None, "02.01.2026 03:04:05", "is not a time such as 2024-02-29T13:14:15Z"),
        ("%d.%m.%Y %H:%M:%S", Some("UTC"), "soon", "is not a time such as 22.11.2026 15:04:05"),
        ("%d.%m.%Y %H:%M:%S", None, "02.01.2026 03:04:05", "it has no zone"),
        ("%d.%m.%Y %H:%M", Some("UTC"), "31.02.2026 03:04", "is not a time"),
        ("%d.%m.%Y %H:%M", Some("UTC"), "02.01.2026 03:04:05", "is not a time"),
        ("%Y-%m-%d %H:%M %Z", Some("Europe/Berlin"), "2026-01-02 03:04 PST", "had CET"),
        ("%Y-%m-%d %H:%M %Z", None, "2026-01-02 03:04 CET", "it has no zone"),
        ("%Y-%m-%d %H:%M %Z", None, "2026-01-02 03:04", "is not a time"),
        ("rfc3339", Some("Europe/Berlin"), "2026-03-29 02:30:00", "never was in Europe/Berlin"),
        ("unix_seconds", None, "1.76E+09", "is not a number of seconds"),
        ("unix_seconds", None, "", "is not a number of seconds"),
        ("excel", None, "46024.5", "it has no zone"),
        ("excel", Some("UTC"), "2026-01-02", "is not a serial day"),
    ] {
        let fault = reader(format, zone).read(None, text, None).unwrap_err();
        assert!(fault.contains(part) && fault.contains(text), "{format}: {fault}");
    }
}

#[test]
fn formats_are_checked_before_the_first_time() {
    for (format, part) in [
        ("dd.mm.yyyy", "nor a pattern such as %d.%m.%Y"),
        ("%H:%M:%S", "names no day"),
        ("%d.%m %H:%M", "names no day"),
        ("%Y-%m-%d %I:%M:%S", "without %p"),
        ("%Z %Y-%m-%d", "at its end alone"),
        ("%Y-%m-%d %!", "the pattern '%Y-%m-%d %!'"),
        ("%Y-%m-%d %", "the pattern"),
    ] {
        let fault = TimeFormat::parse(format).unwrap_err();
        assert!(fault.contains(part), "{format}: {fault}");
    }
    assert!(TimeFormat::parse(&"%Y".repeat(80)).is_err());
}

#[test]
fn seconds_from_any_start_are_exact_and_cut() {
    let read = |text| reader("seconds", None).read(None, text, None).map(|instant| instant.nanos);
    assert_eq!(read("-0.25"), Ok(-250_000_000));
    assert_eq!(read("1.0000000009"), Ok(1_000_000_000));
    assert_eq!(read(".1"), Ok(100_000_000));
    for text in ["99999999999", "x", "1e3", "."] {
        assert!(read(text).is_err(), "{text}");
    }
}

#[test]
fn what_a_pattern_writes_it_reads_again() {
    let mut random = fastrand::Rng::with_seed(11);
    let patterns = [
        "%d.%m.%Y %H:%M:%S",
        "%m/%d/%Y %I:%M:%S %p",
        "%d-%b-%y %H:%M:%S",
        "%Y-%m-%d %H:%M:%S%.f",
        "%Y%m%dT%H%M%S",
        "%d/%m/%y %H:%M:%S,%f",
        "%B %d, %Y %H:%M:%S",
    ];
    let zone = TimeZone::get("America/New_York").unwrap();
    for _ in 0..20_000 {
        let pattern = patterns[random.usize(0..patterns.len())];
        let second = random.i64(10_000_000..3_000_000_000);
        let time = Timestamp::from_second(second).unwrap().to_zoned(zone.clone());
        let text = jiff::fmt::strtime::format(pattern, &time).unwrap();
        let reader = reader(pattern, Some("America/New_York"));
        let read = reader.read(None, &text, Some(second * 1_000_000_000)).unwrap();
        assert_eq!(read.nanos, second * 1_000_000_000, "{pattern}: {text}");
    }
}

#[test]
fn any_text_is_a_time_or_refused() {
    let mut random = fastrand::Rng::with_seed(5);
    let alphabet: Vec<char> = "0123456789-:./ TZeE+,%PMä\u{202f}".chars().collect();
    let formats = ["rfc3339", "unix_nanos", "excel", "wincc", "%d.%m.%Y %H:%M:%S %Z", "seconds"];
    for _ in 0..50_000 {
        let text: String =
            (0..random.usize(0..40)).map(|_| alphabet[random.usize(0..alphabet.len())]).collect();
        let reader = reader(formats[random.usize(0..formats.len())], Some("Europe/Berlin"));
        let _ = reader.read(random.bool().then_some("2026-01-02"), &text, None);
    }
}
