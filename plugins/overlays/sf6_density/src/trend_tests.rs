//! Loss rates of synthetic leaks.

use super::*;

const DAY: i64 = 86_400_000_000_000;
const MONTH: f64 = 730.5 * 3600.0;

/// Trend of a month, sampled each hour of so many days.
fn trend(days: i64, sample: impl Fn(f64) -> f64) -> Trend {
    let mut trend = Trend::new(MONTH, 0.0);
    for hour in 0..24 * days {
        let at = hour as f64 / 24.0;
        trend.push(hour * DAY / 24, Sample { percent: sample(at), celsius: 20.0 });
    }
    trend.update();
    trend
}

/// Loss of a year by the days.
fn leak(percent_a_year: f64, days: f64) -> f64 {
    100.0 - percent_a_year * days / 365.25
}

#[test]
fn a_steady_loss_is_found_and_memory_is_bounded() {
    let trend = trend(400, |days| leak(1.0, days));
    let loss = trend.loss().expect("a rate");
    assert!((loss.percent_a_year - 1.0).abs() < 1e-6, "{loss:?}");
    assert!((loss.certain - 1.0).abs() < 1e-6 && loss.is_daily, "{loss:?}");
    assert_eq!((loss.outliers, loss.refills), (0, 0));
    assert!(trend.buckets.len() as i64 <= MAX_BUCKETS + 1);
}

#[test]
fn a_week_is_waited_for() {
    assert_eq!(trend(8, |days| leak(1.0, days)).loss(), None);
    assert!(trend(10, |days| leak(1.0, days)).loss().is_some());
}

#[test]
fn zeros_do_not_make_a_leak() {
    // One zero sample made 38 % a year for a month with least squares.
    let one = trend(30, |days| if (days - 3.0).abs() < 0.01 { 0.0 } else { leak(0.3, days) });
    assert!((one.loss().expect("a rate").percent_a_year - 0.3).abs() < 0.01);
    let days = trend(30, |days| if (3.0..5.0).contains(&days) { 0.0 } else { leak(0.3, days) });
    let loss = days.loss().expect("a rate");
    assert!((loss.percent_a_year - 0.3).abs() < 0.05, "{loss:?}");
    assert_eq!((loss.outliers, loss.refills), (2, 0), "two days are cut out and told");
}

#[test]
fn a_refill_parts_the_days_and_is_told() {
    let refilled = |days: f64| leak(12.0, days) + if days >= 18.0 { 9.0 } else { 0.0 };
    let loss = trend(30, refilled).loss().expect("a rate");
    assert!((loss.percent_a_year - 12.0).abs() < 0.01, "{loss:?}");
    assert_eq!((loss.outliers, loss.refills), (0, 1));
}

#[test]
fn days_are_whole() {
    // The error of compensation over a day is no leak, whatever the hour is.
    let daily = |days: f64| leak(0.2, days) + 0.8 * (days * std::f64::consts::TAU).sin();
    let mut found = trend(20, daily);
    let until_noon = (20 * 24..20 * 24 + 8).map(|hour| (hour, daily(hour as f64 / 24.0)));
    for (hour, percent) in until_noon {
        found.push(hour * DAY / 24, Sample { percent, celsius: 20.0 });
    }
    found.update();
    let loss = found.loss().expect("a rate");
    assert!((loss.percent_a_year - 0.2).abs() < 0.1, "{loss:?}");
}

#[test]
fn a_drift_of_the_temperature_makes_less_certain() {
    let mut trend = Trend::new(MONTH, 0.015);
    for day in 0..30_i64 {
        let celsius = day as f64 * 0.5;
        trend.push(day * DAY, Sample { percent: leak(1.0, day as f64), celsius });
    }
    trend.update();
    let loss = trend.loss().expect("a rate");
    // 0.5 K a day are 182.6 K a year, at 0.015 % each.
    assert!((loss.percent_a_year - loss.certain - 2.739).abs() < 0.01, "{loss:?}");
}

#[test]
fn clocks_that_stand_jump_or_run_are_taken() {
    let sample = Sample { percent: 100.0, celsius: 20.0 };
    let mut found = trend(30, |days| leak(1.0, days));
    for _ in 0..100_000 {
        found.push(30 * DAY, sample);
    }
    assert!(found.open.as_ref().is_some_and(|open| open.samples.len() <= MAX_SAMPLES));
    found.push(30 * DAY - 1, sample);
    assert!(found.loss().is_some(), "a second back is no new recording");
    found.push(0, sample);
    assert_eq!(found.loss(), None, "the recording began anew");
    for nanos in [i64::MAX, i64::MIN, 0, i64::MAX, i64::MAX - 1] {
        found.push(nanos, sample);
        found.update();
    }
    let mut short = Trend::new(0.01 * 3600.0, 0.0);
    for nanos in [i64::MIN, i64::MAX] {
        short.push(nanos, sample);
        short.update();
    }
}
