//! Positions and verdicts of switches, as the host reads them.

#![allow(clippy::unwrap_used)]

use std::time::Duration;

use busbar_plugin_sdk::testing::{DrawnQuantity, draw_at, host};
use busbar_plugin_sdk::{DoublePoint, Origin, Plugin, Quality, Reason, ValueKind};

use super::*;

const SECOND: i64 = 1_000_000_000;

fn overlay(settings: serde_json::Value) -> Result<SwitchPosition, Error> {
    SwitchPosition::create(serde_json::from_value(settings).unwrap(), host())
}

fn binding(node: u32, node_id: &str, role: &str) -> Binding {
    Binding {
        node,
        kind: ValueKind::DoublePoint,
        limit_low: None,
        limit_high: None,
        tag_id: String::new(),
        tag_name: String::new(),
        unit: String::new(),
        node_id: node_id.into(),
        role: role.into(),
    }
}

fn value(point: DoublePoint) -> TagValue {
    let value = Some(Value::DoublePoint(point));
    TagValue { value, quality: Quality::Good, age: Duration::ZERO, origin: Origin::LIVE }
}

#[test]
fn each_mechanism_has_its_own_position() {
    let mut overlay = overlay(serde_json::json!({ "switches": [
        { "equipment": "Q9", "mechanism": "blade" },
        { "equipment": "Q9", "mechanism": "earth", "role": "earth_switch" },
        { "equipment": "absent" },
    ] }))
    .unwrap();
    assert_eq!(overlay.describe().mechanisms, ["blade", "earth", "main"]);
    let bindings = vec![
        binding(4, "Q9", "load"),
        binding(4, "Q9", "earth_switch"),
        binding(4, "Q9", "position"),
    ];
    let values = [DoublePoint::On, DoublePoint::BadState, DoublePoint::On].map(value);
    let drawn = draw_at(&mut overlay, Some(bindings), &values, 0).unwrap();
    let expected =
        [DrawnQuantity::Position([2, 0, 0], Some(1.0)), DrawnQuantity::Position([1, 0, 1], None)];
    assert_eq!(drawn.quantities, expected);
}

#[test]
fn a_switch_on_its_way_is_as_far_as_its_time_and_never_at_an_end() {
    let settings = serde_json::json!({ "switches": [{ "equipment": "Q9", "travel_seconds": 8 }] });
    let mut overlay = overlay(settings).unwrap();
    let mut bindings = Some(vec![binding(4, "Q9", "position")]);
    let mut shown = |point, seconds: i64| {
        let drawn = draw_at(&mut overlay, bindings.take(), &[value(point)], seconds * SECOND);
        match drawn.unwrap().quantities[..] {
            [DrawnQuantity::Position([0, 0, 0], travelled)] => travelled,
            ref other => panic!("{other:?}"),
        }
    };
    use DoublePoint::{BadState, Intermediate, Off, On};
    assert_eq!(shown(Intermediate, 0), Some(0.5), "nobody knows from where");
    assert_eq!(shown(On, 1), Some(1.0));
    assert_eq!(shown(Intermediate, 10), Some(1.0 - 0.06), "it has left");
    assert_eq!(shown(Intermediate, 12), Some(0.75));
    assert_eq!(shown(Intermediate, 5), Some(1.0 - 0.06), "the clock was set back");
    assert_eq!(shown(Intermediate, 60), Some(1.0 - (1.0 - 0.06)), "it has not arrived");
    assert_eq!(shown(Off, 61), Some(0.0));
    assert_eq!(shown(Intermediate, 70), Some(0.06));
    assert_eq!(shown(Intermediate, 74), Some(0.5));
    assert_eq!(shown(BadState, 75), None);
    assert_eq!(shown(Intermediate, 76), Some(0.5));
}

#[test]
fn a_position_rests_on_its_tag_whatever_its_quality() {
    let settings = serde_json::json!({ "switches": [{ "equipment": "Q9" }] });
    let mut overlay = overlay(settings).unwrap();
    let stale = TagValue { quality: Quality::Bad(Reason::Stale), ..value(DoublePoint::On) };
    let drawn = draw_at(&mut overlay, Some(vec![binding(4, "Q9", "position")]), &[stale], 0);
    let expected = [DrawnQuantity::Position([0, 0, 0], Some(1.0))];
    assert_eq!(drawn.unwrap().quantities, expected, "the host marks it");
}

#[test]
fn settings_that_make_no_sense_are_told() {
    let named = |mechanism: String| serde_json::json!({ "equipment": "Q", "mechanism": mechanism });
    let many: Vec<_> = (0..17).map(|index| named(index.to_string())).collect();
    for (settings, words) in [
        (serde_json::json!({ "switches": many }), "16 kinds"),
        (serde_json::json!({ "switches": [named(String::new())] }), "1 to 64 bytes"),
        (
            serde_json::json!({ "switches": [{ "equipment": "Q", "travel_seconds": -1 }] }),
            "0 to 600 s",
        ),
    ] {
        let fault = overlay(settings).err().unwrap().to_string();
        assert!(fault.contains(words), "{fault}");
    }
}
