//! What is drawn of contacts.

use std::time::Duration;

use busbar_plugin_sdk::testing::{Drawing, draw, host};
use busbar_plugin_sdk::{Quality, Reason, Value, ValueKind};

use super::*;

const EQUIPMENT: [&str; 4] = ["=Q1-QB1-L1", "=Q1-QB1-L2", "=Q1-QB1-L3", "=Q2-QB1-L1"];

fn binding(node_id: &str, role: &str) -> Binding {
    Binding {
        node: 7,
        kind: ValueKind::F64,
        limit_low: None,
        limit_high: None,
        tag_id: node_id.into(),
        tag_name: node_id.into(),
        unit: "°C".into(),
        node_id: node_id.into(),
        role: role.into(),
    }
}

/// Contacts of these temperatures, a lonely one of another bay, in air of 20 °C.
fn drawn(degrees: [f64; 4], air: Quality) -> Drawing {
    let settings = serde_json::json!({ "equipment": EQUIPMENT });
    let settings = serde_json::from_value(settings).expect("settings");
    let mut overlay = Thermography::create(settings, host()).expect("it is made");
    let mut bindings: Vec<_> =
        EQUIPMENT.iter().map(|id| binding(id, "contact_temperature")).collect();
    bindings.push(binding("=Z1", "ambient"));
    let value =
        |value, quality| TagValue { value: Some(Value::F64(value)), quality, age: Duration::ZERO };
    let mut values: Vec<_> = degrees.iter().map(|&of| value(of, Quality::Good)).collect();
    values.push(value(20.0, air));
    draw(&mut overlay, bindings, &values).expect("it draws")
}

#[test]
fn a_phase_is_judged_by_the_coolest_of_its_device() {
    let drawing = drawn([45.0, 82.0, 44.0, 60.0], Quality::Good);
    // (82 - 44) / (82 - 20) = 61 %; L1 is 1 K warmer than L3; the lonely one has no peer.
    let shown: Vec<_> = drawing.states.iter().map(|state| (state.equipment, state.entry)).collect();
    assert_eq!(shown, [(1, Defect::General as usize); 4], "it rests on three phases and the air");
    assert_eq!(drawing.lines.len(), 1);
    assert_eq!(drawing.lines[0].text, "82 °C, difference 61 %");
}

#[test]
fn heat_alone_is_enough() {
    let drawing = drawn([95.0, 96.0, 94.0, 140.0], Quality::Good);
    let states = drawing.states.chunk_by(|a, b| a.equipment == b.equipment);
    let entries: Vec<_> = states.map(|state| state[0].entry).collect();
    let [serious, critical] = [Defect::Serious, Defect::Critical].map(|defect| defect as usize);
    assert_eq!(entries, [serious, serious, serious, critical]);
}

#[test]
fn without_the_air_nothing_is_judged() {
    let drawing = drawn([45.0, 82.0, 44.0, 60.0], Quality::Bad(Reason::Stale));
    assert!(drawing.lines.is_empty());
    let states = drawing.states.chunk_by(|a, b| a.equipment == b.equipment);
    let rests_on: Vec<_> = states.map(|of| of.iter().any(|state| state.binding == 4)).collect();
    assert_eq!(rests_on, [true; 4], "all rest on the air: the host shows them as unknown");
}
