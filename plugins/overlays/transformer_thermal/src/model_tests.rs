//! Exact model against the printed example of IEC 60076-7 and its own limits.

use super::*;

/// The transformer of the example in IEC 60076-7.
const EXAMPLE: Parameters = Parameters {
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
const AMBIENT: f64 = 25.6;
const FIRST_TOP_OIL: f64 = 38.3;
/// Load until a minute, and the printed top-oil and hot-spot temperatures then.
const PRINTED: [(f64, f64, [f64; 2]); 6] = [
    (190.0, 1.0, [61.9, 83.8]),
    (365.0, 0.6, [44.4, 54.0]),
    (500.0, 1.5, [89.2, 127.0]),
    (705.0, 0.3, [35.0, 37.5]),
    (730.0, 2.1, [67.9, 138.6]),
    (745.0, 0.0, [60.3, 75.3]),
];

/// Temperatures at the printed points, in steps of so many minutes at most.
fn walk(step: f64) -> Vec<[f64; 2]> {
    let mut temperatures = Temperatures::with_top_oil(FIRST_TOP_OIL);
    let mut minute = 0.0;
    let mut all = Vec::new();
    for (until, load, _) in PRINTED {
        while minute < until {
            let minutes = f64::min(step, until - minute);
            temperatures = temperatures.after(&EXAMPLE, minutes, load, AMBIENT);
            minute += minutes;
        }
        all.push([temperatures.top_oil, temperatures.hot_spot()]);
    }
    all
}

#[test]
fn the_standards_example_is_met_within_a_kelvin_and_a_tenth() {
    for ((until, _, printed), ours) in PRINTED.into_iter().zip(walk(1.0)) {
        println!("minute {until}: {ours:.2?}, printed {printed:?}");
        for (printed, ours) in printed.into_iter().zip(ours) {
            assert!((printed - ours).abs() <= 1.1, "minute {until}: {ours} for {printed}");
        }
    }
}

#[test]
fn the_length_of_steps_changes_nothing() {
    for (fine, coarse) in walk(0.05).into_iter().zip(walk(1e9)) {
        for (fine, coarse) in fine.into_iter().zip(coarse) {
            assert!((fine - coarse).abs() < 1e-6, "{fine} {coarse}");
        }
    }
}

#[test]
fn a_long_load_comes_to_the_steady_state() {
    let steady = Temperatures::steady(&EXAMPLE, 0.8, 20.0);
    let after = Temperatures::with_top_oil(90.0).after(&EXAMPLE, 1e5, 0.8, 20.0);
    assert!((after.top_oil - steady.top_oil).abs() < 1e-9);
    assert!((after.hot_spot() - steady.hot_spot()).abs() < 1e-9);
    // Of the rated load: rises add up to the limits of a transformer as built.
    let rated = Temperatures::steady(&EXAMPLE, 1.0, 20.0);
    assert!((rated.top_oil - 58.3).abs() < 1e-9);
    assert!((rated.hot_spot() - (58.3 + 1.4 * 14.5)).abs() < 1e-9);
}

#[test]
fn paper_ages_at_its_rated_temperature_as_rated() {
    let at = |hot_spot| Temperatures::with_top_oil(hot_spot);
    assert!((at(98.0).ageing(false) - 1.0).abs() < 1e-12);
    assert!((at(104.0).ageing(false) - 2.0).abs() < 1e-12);
    assert!((at(110.0).ageing(true) - 1.0).abs() < 1e-12);
    // IEC 60076-7, table 2: thermally upgraded paper at 98 degrees Celsius.
    assert!((at(98.0).ageing(true) - 0.282).abs() < 1e-3);
}
