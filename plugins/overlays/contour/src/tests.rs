//! Levels as the host reads them.

#![allow(clippy::unwrap_used)]

use std::time::Duration;

use busbar_plugin_sdk::testing::{DrawnQuantity, draw, host};
use busbar_plugin_sdk::{Origin, Quality, Reason, Value, ValueKind};
use serde_json::{Value as Json, json};

use super::*;

fn settings() -> Json {
    json!({
        "name": "Contacts", "unit": "°C", "role": "contact", "equipment": ["A", "B"],
        "reach_metres": 6, "high": 70, "step": 10,
    })
}

fn overlay(settings: Json) -> Result<Contour, Error> {
    Contour::create(serde_json::from_value(settings).unwrap(), host())
}

fn binding(node_id: &str, role: &str, unit: &str) -> Binding {
    Binding {
        node: 7,
        kind: ValueKind::F64,
        limit_low: None,
        limit_high: None,
        tag_id: "T".into(),
        tag_name: String::new(),
        unit: unit.into(),
        node_id: node_id.into(),
        role: role.into(),
    }
}

#[test]
fn each_value_is_a_level_at_its_equipment_good_or_not() {
    let bindings = vec![
        binding("C", "contact", "°C"),
        binding("B", "contact", "°C"),
        binding("B", "load", "%"),
        binding("A", "contact", "°C"),
    ];
    let value = |value: Option<f64>, quality| TagValue {
        value: value.map(Value::F64),
        quality,
        age: Duration::ZERO,
        origin: Origin::LIVE,
    };
    let (good, stale) = (Quality::Good, Quality::Bad(Reason::Stale));
    let known = [(Some(1.0), good), (Some(52.5), stale), (Some(3.0), good), (None, stale)];
    let values = known.map(|(number, quality)| value(number, quality));
    let drawn = draw(&mut overlay(settings()).unwrap(), bindings, &values).unwrap();
    let expected = [DrawnQuantity::Level([3, 0], 0.0), DrawnQuantity::Level([1, 1], 52.5)];
    assert_eq!(drawn.quantities, expected);
}

#[test]
fn it_is_hidden_until_somebody_wants_it() {
    let description = overlay(settings()).unwrap().describe();
    assert!(description.starts_hidden);
    assert_eq!(description.contour.unwrap().high, Some(70.0));
    let mut shown = settings();
    shown["shown"] = json!(true);
    assert!(!overlay(shown).unwrap().describe().starts_hidden);
}

#[test]
fn what_makes_no_sense_is_told() {
    for (key, value, words) in [
        ("low", json!(70), "band from 70 to 70"),
        ("high", json!(null), "name the normal band"),
        ("step", json!(0), "a step of 0"),
        ("reach_metres", json!(0), "not 0"),
        ("name", json!(""), "1 to 64 bytes"),
    ] {
        let mut settings = settings();
        settings[key] = value;
        let fault = overlay(settings).err().unwrap().to_string();
        assert!(fault.contains(words), "{fault}");
    }
}
