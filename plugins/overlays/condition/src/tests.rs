//! Drawings of monitored quantities, and verdicts on them.

use std::time::Duration;

use busbar_plugin_sdk::testing::{Drawing, draw, host};
use busbar_plugin_sdk::{Origin, Reason, Value, ValueKind};

use super::*;

const SETTINGS: &str = r#"{
    "quantities": [
        { "name": "Core current", "role": "core", "attention": 100, "alarm": 300 },
        { "name": "Oil level", "role": "level", "attention": 20, "alarm": 10, "bad": "below" }
    ],
    "equipment": ["=T1-TA1"]
}"#;

fn drawn(core: f64, level: f64, quality: Quality) -> Drawing {
    let settings = serde_json::from_str(SETTINGS).expect("settings");
    let mut overlay = Condition::create(settings, host()).expect("it is made");
    let binding = |role: &str, unit: &str| Binding {
        node: 7,
        kind: ValueKind::F64,
        limit_low: None,
        limit_high: None,
        tag_id: role.into(),
        tag_name: role.into(),
        unit: unit.into(),
        node_id: "=T1-TA1".into(),
        role: role.into(),
    };
    let value = |value| TagValue {
        value: Some(Value::F64(value)),
        quality,
        age: Duration::ZERO,
        origin: Origin::LIVE,
    };
    let bindings = vec![binding("core", "mA"), binding("level", "%"), binding("other", "")];
    draw(&mut overlay, bindings, &[value(core), value(level), value(0.0)]).expect("it draws")
}

#[test]
fn thresholds_part_attention_from_alarm_on_both_sides() {
    let entries = |core, level| -> Vec<usize> {
        drawn(core, level, Quality::Good).states.iter().map(|state| state.entry).collect()
    };
    assert!(entries(99.9, 20.1).is_empty());
    assert_eq!(entries(100.0, 50.0), [0]);
    assert_eq!(entries(300.0, 50.0), [1]);
    assert_eq!(entries(0.0, 20.0), [2]);
    assert_eq!(entries(0.0, 10.0), [3]);
    // The worst comes last: of several states the last one shows.
    assert_eq!(entries(301.0, 15.0), [2, 1]);
    let drawing = drawn(120.0, 50.0, Quality::Good);
    assert_eq!(drawing.lines[0].text, "120.00 mA");
    assert_eq!(drawing.lines[0].severity, Severity::Warning);
}

#[test]
fn what_is_not_known_is_left_to_the_host() {
    let drawing = drawn(500.0, 50.0, Quality::Bad(Reason::Stale));
    assert!(drawing.lines.is_empty());
    assert_eq!(drawing.states.len(), 2, "they rest on bad values: the host shows them so");
}

#[test]
fn thresholds_that_make_no_sense_are_refused() {
    let text = SETTINGS.replace("300", "50");
    let made = Condition::create(serde_json::from_str(&text).expect("settings"), host());
    let words = made.err().expect("a fault").to_string();
    assert!(words.contains("Core current: alarm 50 must be beyond attention 100"), "{words}");
}
