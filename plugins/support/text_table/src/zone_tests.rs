use super::*;

const HOUR: i64 = 3_600_000_000_000;

fn at(text: &str) -> i64 {
    i64::try_from(text.parse::<jiff::Timestamp>().unwrap().as_nanosecond()).unwrap()
}

fn resolve(zone: &str, civil: &str, last: Option<i64>) -> Result<(i64, bool), String> {
    let resolved = Zone::parse(zone).unwrap().resolve(civil.parse().unwrap(), last, None)?;
    Ok((resolved.nanos, resolved.is_ambiguous))
}

#[test]
fn zones_are_names_and_offsets() {
    for (zone, expected) in [
        ("UTC", "2026-01-02T03:04:05Z"),
        ("utc", "2026-01-02T03:04:05Z"),
        ("Europe/Berlin", "2026-01-02T02:04:05Z"),
        ("europe/berlin", "2026-01-02T02:04:05Z"),
        ("Asia/Shanghai", "2026-01-01T19:04:05Z"),
        ("America/New_York", "2026-01-02T08:04:05Z"),
        ("+05:30", "2026-01-01T21:34:05Z"),
        ("-3", "2026-01-02T06:04:05Z"),
    ] {
        let found = resolve(zone, "2026-01-02T03:04:05", None);
        assert_eq!(found, Ok((at(expected), false)), "{zone}");
    }
    for zone in ["", "Berlin/Europe", "CEST?", "+25:00", "+05:60", "+", "+1:2:3", "MEZ"] {
        assert!(Zone::parse(zone).unwrap_err().contains("Europe/Berlin"), "{zone}");
    }
}

#[test]
fn a_time_that_was_skipped_is_refused_and_one_that_was_twice_is_in_doubt() {
    let skipped = resolve("Europe/Berlin", "2026-03-29T02:30:00", None).unwrap_err();
    assert!(skipped.contains("never was in Europe/Berlin"), "{skipped}");
    let first = at("2026-10-25T00:30:00Z");
    let twice = |last| resolve("Europe/Berlin", "2026-10-25T02:30:00", last);
    assert_eq!(twice(None), Ok((first, true)));
    assert_eq!(twice(Some(first)), Ok((first, true)));
    // Rows in order tell that the hour is the second.
    assert_eq!(twice(Some(first + 1)), Ok((first + HOUR, true)));
    assert_eq!(
        resolve("+01:00", "2026-03-29T02:30:00", None).unwrap().0,
        at("2026-03-29T01:30:00Z")
    );
}

#[test]
fn an_abbreviation_tells_which_of_two_times_is_meant() {
    let berlin = Zone::parse("Europe/Berlin").unwrap();
    let named = |civil: &str, name| berlin.resolve(civil.parse().unwrap(), None, Some(name));
    let twice = "2026-10-25T02:30:00";
    let [summer, winter] = [at("2026-10-25T00:30:00Z"), at("2026-10-25T01:30:00Z")];
    let certain = |nanos| Ok(Resolved { nanos, is_ambiguous: false });
    assert_eq!(named(twice, "CEST"), certain(summer));
    assert_eq!(named(twice, "CET"), certain(winter));
    assert_eq!(named(twice, "MEZ"), certain(winter));
    assert_eq!(named(twice, "MESZ"), certain(summer));
    assert_eq!(named("2026-01-02T03:04:05", "CET"), certain(at("2026-01-02T02:04:05Z")));
    for other in ["CEST", "PST", "UTC"] {
        let fault = named("2026-01-02T03:04:05", other).unwrap_err();
        assert!(fault.contains(other) && fault.contains("had CET"), "{fault}");
    }
}

#[test]
fn every_local_time_of_a_year_is_resolved_as_the_data_base_has_it() {
    let mut random = fastrand::Rng::with_seed(26);
    let database = TimeZoneDatabase::bundled();
    for name in ["Europe/Berlin", "America/Sao_Paulo", "Australia/Lord_Howe", "Asia/Kathmandu"] {
        let (zone, theirs) = (Zone::parse(name).unwrap(), database.get(name).unwrap());
        for _ in 0..5000 {
            let second = random.i64(0..2_000_000_000);
            let timestamp = jiff::Timestamp::from_second(second).unwrap();
            let civil = theirs.to_datetime(timestamp);
            let nanos = second * 1_000_000_000;
            // What the clock showed is read as what it was, or is in doubt.
            let found = zone.resolve(civil, None, None).unwrap();
            assert!(found.nanos == nanos || found.is_ambiguous, "{name} {civil}");
            assert_eq!(zone.resolve(civil, Some(nanos), None).unwrap().nanos, nanos, "{civil}");
        }
    }
}
