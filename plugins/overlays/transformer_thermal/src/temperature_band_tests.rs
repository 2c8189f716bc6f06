//! Band of the model against the exact model and plausible histories.

use super::*;
use crate::model::Temperatures;

/// Transformer of the example in IEC 60076-7, and one with restricted flow of oil.
fn parameters() -> [Parameters; 2] {
    let example = Parameters {
        oil_minutes: 150.0,
        winding_minutes: 7.0,
        top_oil_rise: 38.3,
        gradient: 14.5,
        hot_spot_factor: 1.4,
        loss_ratio: 1000.0,
        oil_exponent: 0.8,
        winding_exponent: 1.3,
        k: [0.5, 2.0, 2.0],
    };
    let restricted = Parameters {
        top_oil_rise: 52.0,
        gradient: 20.0,
        hot_spot_factor: 1.3,
        loss_ratio: 6.0,
        k: [0.5, 3.0, 2.0],
        ..example
    };
    [example, restricted]
}

fn drive(load: Interval, ambient: Interval, stages: &[CoolingStage]) -> Drive<'_> {
    Drive { load, ambient, stages }
}

#[test]
fn a_band_of_known_inputs_is_the_exact_model() {
    for parameters in parameters() {
        let stages = [CoolingStage::new(parameters, 1.0)];
        let at = |load| drive(Interval::point(load), Interval::point(25.6), &stages);
        let mut band = at(0.4).steady();
        let mut exact = Temperatures::steady(&parameters, 0.4, 25.6);
        for (minutes, load) in [(1.0, 1.0), (40.0, 0.6), (3.0, 2.1), (500.0, 0.0), (7.0, 1.5)] {
            band = band.after(minutes, &at(load));
            exact = exact.after(&parameters, minutes, load, 25.6);
            assert!(band.top_oil.is_point() && band.hot_spot().width() < 1e-9);
            assert!((band.top_oil.low - exact.top_oil).abs() < 1e-9);
            assert!((band.hot_spot().middle() - exact.hot_spot()).abs() < 1e-9);
            let by_oil = exact.top_oil + band.hot_spot_rise().middle();
            assert!((by_oil - exact.hot_spot()).abs() < 1e-9);
        }
    }
}

#[test]
fn every_course_of_a_load_that_was_not_seen_lies_within_the_band() {
    let mut seed = 1_u64;
    let mut random = move || {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (seed >> 11) as f64 / (1_u64 << 53) as f64
    };
    let mut closest = f64::INFINITY;
    for parameters in parameters() {
        let stages = [CoolingStage::new(parameters, 1.0)];
        for case in 0..300 {
            let unseen = drive(Interval::new(0.0, 1.8), Interval::new(-10.0, 30.0), &stages);
            let mut exact = Temperatures::steady(&parameters, random(), 20.0);
            let mut band = drive(Interval::new(0.0, 1.0), Interval::point(20.0), &stages).steady();
            for minute in 0..400 {
                let is_seen = minute > 200;
                let extreme = [0.0, 1.8][usize::from(random() < 0.5)];
                let load = if case % 2 == 0 { extreme } else { 1.8 * random() };
                let ambient = if is_seen { 20.0 } else { 40.0 * random() - 10.0 };
                exact = exact.after(&parameters, 1.0, load, ambient);
                let known = drive(Interval::point(load), Interval::point(ambient), &stages);
                band = band.after(1.0, if is_seen { &known } else { &unseen });
                let room = |of: Interval, exact: f64| (exact - of.low).min(of.high - exact);
                let room =
                    room(band.top_oil, exact.top_oil).min(room(band.hot_spot(), exact.hot_spot()));
                closest = closest.min(room);
                assert!(room > -1e-9, "case {case}, minute {minute}: {band:?} {exact:?}");
            }
        }
    }
    println!("closest to a bound: {closest} K");
}

#[test]
fn the_greatest_load_reaches_the_upper_bound() {
    for parameters in parameters() {
        let stages = [CoolingStage::new(parameters, 1.0)];
        let start = Temperatures::steady(&parameters, 0.5, 20.0);
        let known = drive(Interval::point(0.5), Interval::point(20.0), &stages);
        let unseen = drive(Interval::new(0.0, 1.8), Interval::point(20.0), &stages);
        let band = known.steady().after(90.0, &unseen).after(60.0, &known);
        let bounds = [1.8, 0.0].map(|load| {
            let after = start.after(&parameters, 90.0, load, 20.0);
            after.after(&parameters, 60.0, 0.5, 20.0).hot_spot()
        });
        let above = band.hot_spot().high - bounds[0];
        assert!((-1e-9..0.1).contains(&above), "{above}");
        // Restricted flow: the oil less its lag falls with a light load before it rises.
        let below = bounds[1] - band.hot_spot().low;
        let [_, k21, _] = parameters.k;
        assert!((-1e-9..if k21 > 2.0 { 9.0 } else { 0.5 }).contains(&below), "{below}");
    }
}

#[test]
fn time_before_holds_the_present_and_what_leads_to_it() {
    let [parameters, _] = parameters();
    let stages = [CoolingStage::new(parameters, 1.0)];
    let unseen = drive(Interval::new(0.0, 1.8), Interval::point(20.0), &stages);
    let earlier = Temperatures::steady(&parameters, 0.7, 20.0);
    for load in [0.0, 0.7, 1.8] {
        let known = drive(Interval::point(0.7), Interval::point(20.0), &stages);
        let course = drive(Interval::point(load), Interval::point(20.0), &stages);
        let now = known.steady().after(30.0, &course);
        let before = now.before(30.0, &unseen);
        assert!(before.top_oil.low <= earlier.top_oil + 1e-9);
        assert!(before.top_oil.high >= earlier.top_oil - 1e-9);
        assert!(before.hot_spot().low <= earlier.hot_spot() + 1e-9);
        assert!(before.hot_spot().high >= earlier.hot_spot() - 1e-9);
        assert!(before.top_oil.low <= now.top_oil.low && before.top_oil.high >= now.top_oil.high);
    }
    // Long ago anything plausible was.
    let long_ago = unseen.steady().after(9.0, &unseen).before(1e9, &unseen);
    assert_eq!(long_ago, unseen.steady());
}

#[test]
fn of_two_stages_both_courses_lie_within_the_band() {
    let [example, _] = parameters();
    let fans = Parameters { oil_minutes: 90.0, top_oil_rise: 30.0, ..example };
    let stages = [CoolingStage::new(example, 0.6), CoolingStage::new(fans, 1.0)];
    let at = |stages| drive(Interval::point(0.5), Interval::point(20.0), stages);
    let mut band = at(&stages[..1]).steady();
    let mut course = band;
    for minute in 0..600 {
        band = band.after(1.0, &at(&stages));
        let stage = usize::from(minute % 97 > 40);
        course = course.after(1.0, &at(&stages[stage..=stage]));
        assert!(band.top_oil.low <= course.top_oil.low + 1e-9);
        assert!(band.top_oil.high >= course.top_oil.high - 1e-9);
        assert!(band.hot_spot().low <= course.hot_spot().low + 1e-9);
        assert!(band.hot_spot().high >= course.hot_spot().high - 1e-9);
    }
}
