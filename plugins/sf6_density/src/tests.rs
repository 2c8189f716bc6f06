//! What is drawn of compartments.

use std::time::Duration;

use busbar_plugin_sdk::testing::{Drawing, DrawnLine, draw, draw_at, host};
use busbar_plugin_sdk::{Reason, Value, ValueKind};

use super::*;

fn overlay(more: &str) -> Sf6Density {
    let text = format!(
        r#"{{ "equipment": ["=Q1-QA1"], "filling": 7.0, "alarm": 6.4, "lock_out": 6.0{more} }}"#
    );
    Sf6Density::create(serde_json::from_str(&text).expect("settings"), host()).expect("it is made")
}

fn bindings() -> Vec<Binding> {
    [PRESSURE, TEMPERATURE]
        .map(|role| Binding {
            node: 7,
            kind: ValueKind::F64,
            limit_low: None,
            limit_high: None,
            tag_id: role.into(),
            tag_name: role.into(),
            unit: String::new(),
            node_id: "=Q1-QA1".into(),
            role: role.into(),
        })
        .into()
}

fn values(pressure: f64, celsius: f64, quality: Quality) -> [TagValue; 2] {
    [pressure, celsius].map(|value| TagValue {
        value: Some(Value::F64(value)),
        quality,
        age: Duration::ZERO,
    })
}

fn drawn(pressure: f64, celsius: f64) -> Drawing {
    let values = values(pressure, celsius, Quality::Good);
    draw(&mut overlay(""), bindings(), &values).expect("it draws")
}

#[test]
fn thresholds_are_those_at_20_degrees() {
    // Each rests on pressure and temperature.
    let entries = |drawing: Drawing| {
        let states = drawing.states.chunk_by(|a, b| a.equipment == b.equipment);
        states.map(|of| [of[0].entry, of.len()]).collect::<Vec<_>>()
    };
    // 6.4 bar at 40 °C are 5.99 at 20 °C, and 6.4 at -10 °C are 7.13.
    assert_eq!(entries(drawn(6.4, 40.0)), [[LOCK_OUT, 2]]);
    assert_eq!(entries(drawn(6.39, 20.0)), [[ALARM, 2]]);
    let calm = drawn(6.4, -10.0);
    assert!(calm.states.is_empty() && calm.lines.is_empty(), "what is well is not drawn");
    let DrawnLine { severity, text, .. } = &drawn(6.4, 40.0).lines[0];
    assert_eq!((*severity, text.as_str()), (Severity::Alarm, "5.99 bar"));
}

#[test]
fn gauges_are_read_above_the_air() {
    let mut gauge = overlay(r#", "gauge": true"#);
    // 6.4 bar and the air's 1.01325 are 7.41325 at 40 °C: 6.93979 at 20 °C, 5.92654 above it.
    let values = values(6.4, 40.0, Quality::Good);
    let drawing = draw(&mut gauge, bindings(), &values).expect("it draws");
    assert_eq!(drawing.lines[0].text, "5.93 bar");
}

#[test]
fn what_is_stale_is_left_to_the_host() {
    let values = values(7.2, 20.0, Quality::Bad(Reason::Stale));
    let drawing = draw(&mut overlay(""), bindings(), &values).expect("it draws");
    assert_eq!(drawing.states.len(), 2, "it rests on a bad value: the host shows it as unknown");
    assert!(drawing.lines.is_empty());
}

#[test]
fn a_leak_is_told() {
    let mut overlay = overlay(r#", "trend_hours": 24"#);
    let mut last = Drawing::default();
    for hour in 0..24_i32 {
        // 0.0001 bar an hour of 7 are 12.5 % a year.
        let values = values(6.35 - 0.0001 * f64::from(hour), 20.0, Quality::Good);
        let bindings = (hour == 0).then(bindings);
        last = draw_at(&mut overlay, bindings, &values, i64::from(hour) * 3_600_000_000_000)
            .expect("it draws");
    }
    assert_eq!(last.lines[0].text, "6.35 bar, 12.5 %/a lost");
}

#[test]
fn settings_that_make_no_sense_are_refused() {
    let text = r#"{ "equipment": [], "filling": 6.0, "alarm": 6.4, "lock_out": 6.0 }"#;
    let made = Sf6Density::create(serde_json::from_str(text).expect("settings"), host());
    assert!(made.err().expect("a fault").to_string().contains("rise in this order"));
}
