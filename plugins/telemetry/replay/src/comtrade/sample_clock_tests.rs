use super::*;
use crate::comtrade::Revision;
use crate::comtrade::writer::{HERTZ, Recipe};

fn cfg(has_timestamps: bool, data: DataType) -> Cfg {
    let recipe =
        Recipe { has_timestamps, samples: 1_000_000, ..Recipe::new(Revision::Of1999, data) };
    Cfg::parse(recipe.cfg().as_bytes()).unwrap()
}

/// Time of a sample by the first rate, nanoseconds.
fn nanos(count: u64) -> i64 {
    ((count - 1) as f64 * 1e9 / HERTZ as f64).round() as i64
}

/// Time stamp of a sample, microseconds.
fn stamp(count: u64) -> Option<f64> {
    Some((nanos(count) as f64 / 1000.0).round())
}

/// Counts of records, each a number and the sample that it truly is, where it has a stamp.
fn counts(records: &[(u64, Option<u64>)], has_timestamps: bool) -> Vec<Result<u64, String>> {
    let cfg = cfg(has_timestamps, DataType::Binary);
    let mut clock = SampleClock::default();
    let mut found = Vec::new();
    for (number, sample) in records {
        let place = clock.count(&cfg, *number, sample.and_then(stamp));
        found.push(place.map(|place| {
            if let Some(sample) = sample {
                let error = (place.nanos - nanos(*sample)).abs();
                assert!(error <= 1000, "{number} of {sample}: {error} ns");
            }
            place.count
        }));
    }
    found
}

fn ok(counts: &[u64]) -> Vec<Result<u64, String>> {
    counts.iter().map(|count| Ok(*count)).collect()
}

#[test]
fn numbers_that_begin_at_0_are_counted_from_1() {
    let records = [(0, None), (1, None), (2, None)];
    assert_eq!(counts(&records, false), ok(&[1, 2, 3]));
    assert_eq!(counts(&[(0, Some(1)), (1, Some(2))], true), ok(&[1, 2]));
}

#[test]
fn a_first_number_is_one_of_the_start_where_its_stamp_says_so() {
    assert_eq!(counts(&[(500, Some(1)), (501, Some(2))], false), ok(&[1, 2]));
    // The beginning was cut off.
    assert_eq!(counts(&[(500, Some(500)), (501, Some(501))], false), ok(&[500, 501]));
    assert_eq!(counts(&[(500, None), (501, None)], false), ok(&[500, 501]));
}

#[test]
fn a_counter_that_wraps_is_counted_on() {
    for (end, next) in [(65_535, 0), (65_535, 1), (32_767, 0), (99_999, 0), (9_999, 1)] {
        let mut clock = SampleClock::default();
        let cfg = cfg(false, DataType::Binary);
        for number in 1..=end {
            assert_eq!(clock.count(&cfg, number, None).unwrap().count, number);
        }
        let place = clock.count(&cfg, next, None).unwrap();
        assert_eq!((place.count, place.nanos), (end + 1, cfg.nanos(end + 1, None).unwrap()));
        let remark = place.remark.unwrap();
        assert!(remark.contains(&format!("from {end} to {next}: counted on")), "{remark}");
        assert_eq!(clock.count(&cfg, next + 1, None).unwrap().count, end + 2);
    }
    // Wherever it wraps, stamps that go on tell it.
    assert_eq!(
        counts(&[(1, Some(1)), (2, Some(2)), (0, Some(3)), (1, Some(4))], false),
        ok(&[1, 2, 3, 4])
    );
    // With a gap over the wrap.
    assert_eq!(counts(&[(1, Some(1)), (2, Some(2)), (1, Some(6))], false), ok(&[1, 2, 6]));
}

#[test]
fn a_record_that_is_earlier_is_refused() {
    let found = counts(&[(1, None), (2, None), (3, None), (1, None), (4, None)], false);
    assert_eq!(found[3], Err("sample 1 is earlier than the one before it".into()));
    assert_eq!(found[4], Ok(4));
    let found = counts(&[(1, Some(1)), (2, Some(2)), (3, Some(3)), (2, Some(2))], false);
    assert!(found[3].is_err());
}

#[test]
fn a_jump_of_numbers_is_a_gap_where_the_stamps_jump_too() {
    assert_eq!(counts(&[(1, Some(1)), (2, Some(2)), (9, Some(9))], false), ok(&[1, 2, 9]));
    assert_eq!(
        counts(&[(1, Some(1)), (2, Some(2)), (9, Some(3)), (10, Some(4))], false),
        ok(&[1, 2, 3, 4])
    );
    assert_eq!(counts(&[(1, None), (9, None)], false), ok(&[1, 9]));
}

#[test]
fn a_stamp_of_32_bits_that_wraps_goes_on() {
    let cfg = cfg(true, DataType::Binary);
    let mut clock = SampleClock::default();
    let step = 1_000_000_000.0;
    let mut last = -1;
    for number in 1..=20_u64 {
        let stamp = ((number - 1) as f64 * step) % STAMPS;
        let place = clock.count(&cfg, number, Some(stamp)).unwrap();
        assert_eq!(place.nanos, (number as i64 - 1) * 1_000_000_000_000);
        assert!(place.nanos > last);
        last = place.nanos;
    }
}

#[test]
fn any_numbers_and_stamps_have_times_that_do_not_fail() {
    let mut random = fastrand::Rng::with_seed(3);
    for round in 0..2000 {
        let cfg = cfg(round % 2 == 0, DataType::Ascii);
        let mut clock = SampleClock::default();
        for _ in 0..50 {
            let number = [random.u64(..), random.u64(0..20), u64::MAX, 0][random.usize(0..4)];
            let stamp =
                [None, Some(random.f64() * 1e15), Some(-1e300), Some(0.0)][random.usize(0..4)];
            if let Ok(place) = clock.count(&cfg, number, stamp) {
                assert!(place.count > 0);
            }
        }
    }
}
