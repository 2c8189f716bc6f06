//! Losses of gas as they are told, over frames of a month.

use busbar_plugin_sdk::Origin;
use busbar_plugin_sdk::testing::{Drawing, draw_at};
use serde_json::json;

use super::tests::{binding, bindings, entry, good, overlay, verdict};
use super::*;
use crate::compartments::{PRESSURE, TEMPERATURE};
use crate::outcome::ATTENTION;

pub(crate) const DAY: i64 = 86_400_000_000_000;

#[test]
fn a_leak_is_told_in_an_alarm() {
    let mut overlay = overlay(&json!({ "trend_days": 1 }));
    let mut last = Drawing::default();
    for hour in 0..25_i64 {
        // 0.0001 bar an hour are 13.5 % of the density at 7 bar a year.
        let values = [good(6.35 - 0.0001 * hour as f64), good(20.0)];
        let bindings = (hour == 0).then(bindings);
        last = draw_at(&mut overlay, bindings, &values, hour * DAY / 24).expect("it draws");
    }
    assert_eq!(last.lines[0].text, "6.35 bar, 13.6 %/a lost");
}

/// Pressure, MPa, of gas of a density, by bisection of the plugin's virial equation, which
/// `references/compare.py` compares with the reference equation.
fn pressure_of(density: f64, kelvin: f64) -> f64 {
    let [mut low, mut high] = [0.0, 1.2];
    for _ in 0..50 {
        let middle = 0.5 * (low + high);
        let is_less = virial_density(middle, kelvin).is_some_and(|found| found < density);
        if is_less { low = middle } else { high = middle }
    }
    low
}

/// Drawing after a month of a loss, % a year, from a filled compartment, at temperatures by the day.
pub(crate) fn month(overlay: &mut Sf6Density, loss: f64, celsius: impl Fn(f64) -> f64) -> Drawing {
    let mut last = Drawing::default();
    let full = virial_density(0.7, REFERENCE).expect("gas");
    for hour in 0..31 * 24_i64 {
        let days = hour as f64 / 24.0;
        let density = full * (1.0 - loss / 100.0 * days / 365.25);
        let celsius = celsius(days);
        let kelvin = celsius + ZERO_CELSIUS;
        let saturated = vapor_pressure(kelvin).unwrap_or(f64::INFINITY);
        let pressure = 10.0 * pressure_of(density, kelvin).min(saturated);
        let bindings = (hour == 0).then(bindings);
        let values = [good(pressure), good(celsius)];
        last = draw_at(overlay, bindings, &values, hour * DAY / 24).expect("it draws");
    }
    last
}

#[test]
fn a_leak_is_told_before_an_alarm() {
    let spring = |days: f64| 0.4 * days + 6.0 * (days * std::f64::consts::TAU).sin();
    let leaking = month(&mut overlay(&json!({})), 5.0, spring);
    assert_eq!((verdict(&leaking).verdict, entry(&leaking)), (Verdict::Abnormal, Some(ATTENTION)));
    assert!(leaking.lines[0].text.ends_with("5.0 %/a lost"), "{leaking:?}");
    assert!(verdict(&leaking).reason.contains("more than 0.5 %/a allowed"), "{leaking:?}");
    let tight = month(&mut overlay(&json!({})), 0.1, spring);
    assert_eq!(verdict(&tight).verdict, Verdict::Normal, "{tight:?}");
    let allowed = month(&mut overlay(&json!({ "leak_limit": 8.0 })), 5.0, spring);
    assert_eq!(verdict(&allowed).verdict, Verdict::Normal, "{allowed:?}");
}

#[test]
fn condensed_gas_is_no_leak() {
    // Ever more of each day lies below the line of condensation, up to 23 hours.
    let cold = |days: f64| if days.fract() < days / 31.0 * 0.95 { -40.0 } else { 5.0 };
    let thawed = month(&mut overlay(&json!({})), 0.1, cold);
    assert_eq!(verdict(&thawed).verdict, Verdict::Normal, "{thawed:?}");
    let leaking = month(&mut overlay(&json!({})), 5.0, cold);
    // Medians of the warm hours come ever later in the day.
    assert!(leaking.lines[0].text.ends_with("5.1 %/a lost"), "{leaking:?}");
}

#[test]
fn a_trend_outlives_bindings_that_do_not_concern_it() {
    let mut overlay = overlay(&json!({}));
    month(&mut overlay, 5.0, |_| 20.0);
    let mut more = bindings();
    more.insert(0, binding("=Q9-QA1", PRESSURE, "bar"));
    more.insert(1, binding("=Q9-QA1", TEMPERATURE, "°C"));
    let values = [7.0, 20.0, 6.9, 20.0].map(good);
    let drawing = draw_at(&mut overlay, Some(more), &values, 31 * DAY).expect("it draws");
    assert!(verdict(&drawing).reason.contains("5.0 %/a lost"), "{drawing:?}");
    let mut other = bindings();
    other[0].tag_id = "another sensor".into();
    let drawing =
        draw_at(&mut overlay, Some(other), &[6.9, 20.0].map(good), 31 * DAY).expect("it draws");
    assert_eq!(verdict(&drawing).verdict, Verdict::Normal, "its history is another's");
}

/// A leak that was simulated, recorded or tested is none of the real plant.
#[test]
fn a_trend_of_another_origin_says_nothing_of_live_values() {
    let of = |origin| [7.0, 20.0].map(|number| TagValue { origin, ..good(number) });
    for origin in [Origin::SIMULATED, Origin::RECORDED, Origin::TEST] {
        let mut leaking = overlay(&json!({}));
        month(&mut leaking, 5.0, |_| 20.0);
        // What a person put in place of a measured value is of the same plant.
        let after =
            draw_at(&mut leaking, None, &of(Origin::SUBSTITUTED), 31 * DAY).expect("it draws");
        assert!(verdict(&after).reason.contains("5.0 %/a lost"), "{after:?}");
        let other = draw_at(&mut leaking, None, &of(origin), 31 * DAY).expect("it draws");
        assert_eq!(verdict(&other).verdict, Verdict::Normal, "{origin}: {other:?}");
    }
}
