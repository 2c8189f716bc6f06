//! Arrows and verdicts of flows, as the host reads them.

#![allow(clippy::unwrap_used)]

use std::time::Duration;

use busbar_plugin_sdk::testing::{Drawing, DrawnQuantity, draw, host};
use busbar_plugin_sdk::{Origin, Quality, Reason, Value, ValueKind};
use serde_json::{Value as Json, json};

use super::*;

fn overlay(rating: f64, to: &str) -> Result<LoadFlow, Error> {
    let settings: Json = json!({ "flows": [
        { "measured_at": "BC1", "from": "BC1", "to": to, "rating_mva": rating },
    ] });
    LoadFlow::create(serde_json::from_value(settings).unwrap(), host())
}

fn binding(unit: &str) -> Binding {
    Binding {
        node: 7,
        kind: ValueKind::F64,
        limit_low: None,
        limit_high: None,
        tag_id: "P".into(),
        tag_name: String::new(),
        unit: unit.into(),
        node_id: "BC1".into(),
        role: "active_power".into(),
    }
}

fn drawn(unit: &str, value: Option<f64>, quality: Quality) -> Drawing {
    let value = TagValue {
        value: value.map(Value::F64),
        quality,
        age: Duration::ZERO,
        origin: Origin::LIVE,
    };
    draw(&mut overlay(200.0, "BV1").unwrap(), vec![binding(unit)], &[value]).unwrap()
}

#[track_caller]
fn check(unit: &str, value: f64, share: f64, severity: Severity, text: &str) {
    let drawn = drawn(unit, Some(value), Quality::Good);
    assert_eq!(drawn.quantities, [DrawnQuantity::Flow([0, 0, 1], share)]);
    let line = &drawn.lines[0];
    assert_eq!((line.node, line.severity, line.text.as_str()), (7, severity, text));
}

#[test]
fn a_flow_is_a_share_of_its_rating_with_its_sign() {
    check("MW", 50.0, 0.25, Severity::Normal, "50.0 MW  25 %");
    check("MW", -200.0, -1.0, Severity::Normal, "-200 MW  100 %");
    check("MW", -201.0, -1.005, Severity::Warning, "-201 MW  100 %");
    check("GW", 0.3, 1.5, Severity::Warning, "300 MW  150 %");
    check("kW", 2000.0, 0.01, Severity::Normal, "2.00 MW  1 %");
}

#[test]
fn the_last_flow_stays_with_the_tag_that_it_rests_on() {
    let stale = drawn("MW", Some(50.0), Quality::Bad(Reason::Stale));
    assert_eq!(stale.quantities, [DrawnQuantity::Flow([0, 0, 1], 0.25)]);
    let none = drawn("MW", None, Quality::Bad(Reason::NotConnected));
    assert_eq!(none.quantities, [DrawnQuantity::Flow([0, 0, 1], 0.0)]);
    assert_eq!(none.lines[0].text, "–");
}

#[test]
fn what_makes_no_sense_is_told() {
    for (rating, to, words) in
        [(0.0, "BV1", "0 MVA"), (-9.0, "BV1", "-9 MVA"), (9.0, "BC1", "itself")]
    {
        let fault = overlay(rating, to).err().unwrap().to_string();
        assert!(fault.contains(words), "{fault}");
    }
}
