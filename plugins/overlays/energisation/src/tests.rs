//! Pictures of the overlay on a small network, as the host reads them.

use std::time::Duration;

use busbar_plugin_sdk::testing::draw;
use busbar_plugin_sdk::{DoublePoint, Origin, Reason, ValueKind};

use super::*;

/// Two busbars, a coupler between them, a feeder with an earth switch on each.
const NETWORK: &str = r##"{
    "levels": [{ "name": "220 kV", "color": "#7a4fb5" }],
    "nodes": [
        { "id": "bus 1", "level": "220 kV", "equipment": ["=WA1"] },
        { "id": "bus 2", "level": "220 kV", "equipment": ["=WA2"] },
        { "id": "line", "level": "220 kV", "equipment": ["=FA1"] },
        { "id": "load", "level": "220 kV" }
    ],
    "branches": [
        { "equipment": "=QA1", "between": ["line", "bus 1"], "switch": true },
        { "equipment": "=QA30", "between": ["bus 1", "bus 2"], "switch": true },
        { "equipment": "=QA2", "between": ["bus 2", "load"], "switch": true }
    ],
    "earths": [{ "equipment": "=QC9", "node": "load" }],
    "sources": [{ "node": "line" }]
}"##;

fn settings(text: &str) -> Settings {
    serde_json::from_str(text).unwrap()
}

const OPEN: Value = Value::DoublePoint(DoublePoint::Off);
const CLOSED: Value = Value::DoublePoint(DoublePoint::On);
const TRAVELLING: Value = Value::DoublePoint(DoublePoint::Intermediate);

fn binding(id: &str) -> Binding {
    Binding {
        node: 0,
        kind: ValueKind::DoublePoint,
        limit_low: None,
        limit_high: None,
        tag_id: format!("{id}.Pos"),
        tag_name: String::new(),
        unit: String::new(),
        node_id: id.into(),
        role: "position".into(),
    }
}

/// States that are shown of equipment, and the bindings that they rest on.
fn shown(values: [(Value, Quality); 4]) -> Vec<(String, String, Vec<usize>)> {
    let settings = settings(NETWORK);
    let mut overlay =
        EnergisationOverlay::create(settings, busbar_plugin_sdk::testing::host()).unwrap();
    let Description { legend, equipment, .. } = overlay.describe();
    let bindings = ["=QA1", "=QA30", "=QA2", "=QC9"].map(binding).to_vec();
    let values = values.map(|(value, quality)| TagValue {
        value: Some(value),
        quality,
        age: Duration::ZERO,
        origin: Origin::LIVE,
    });
    let drawing = draw(&mut overlay, bindings, &values).unwrap();
    let name = |states: &[busbar_plugin_sdk::testing::DrawnState]| {
        let entry = legend[states[0].entry].name.clone();
        let bindings = states.iter().map(|state| state.binding).collect();
        (equipment[states[0].equipment].clone(), entry, bindings)
    };
    drawing.states.chunk_by(|a, b| a.equipment == b.equipment).map(name).collect()
}

fn states_of(shown: &[(String, String, Vec<usize>)]) -> Vec<(&str, &str)> {
    shown.iter().map(|(id, state, _)| (id.as_str(), state.as_str())).collect()
}

#[test]
fn equipment_shows_the_more_urgent_of_its_ends() {
    let good = |value| (value, Quality::Good);
    let all = shown([good(CLOSED), good(OPEN), good(OPEN), good(CLOSED)]);
    let expected = [
        ("=WA1", "220 kV energised"),
        ("=WA2", "dead"),
        ("=FA1", "220 kV energised"),
        ("=QA1", "220 kV energised"),
        ("=QA30", "220 kV energised"),
        ("=QA2", "dead"),
        ("=QC9", "earthed"),
    ];
    assert_eq!(states_of(&all), expected);
    // On what each rests: the second busbar on what parts it from the first (beyond the
    // other switch there is no source), the earth switch on itself and on what parts the
    // load.
    let basis = |at: usize| all[at].2.as_slice();
    assert_eq!([0, 1, 2, 4, 5, 6].map(basis), [&[0][..], &[1], &[0], &[0, 1], &[1, 2, 3], &[2, 3]]);
}

#[test]
fn what_rests_on_an_unknown_position_is_unknown() {
    let good = |value| (value, Quality::Good);
    for unknown in [(TRAVELLING, Quality::Good), (CLOSED, Quality::Bad(Reason::Stale))] {
        let all = shown([good(CLOSED), unknown, good(OPEN), good(OPEN)]);
        let states = states_of(&all);
        assert_eq!(states[0], ("=WA1", "220 kV energised"), "whatever the coupler does");
        assert_eq!(states[1], ("=WA2", "unknown"));
        assert_eq!(states[6], ("=QC9", "dead"), "not earthed");
        // A switch rests on its own position, too; what is unknown on one that is good.
        assert_eq!((all[4].0.as_str(), all[4].2.as_slice()), ("=QA30", &[0, 1][..]));
        assert_eq!(all[1].2, [0]);
    }
}

#[test]
fn a_source_that_earth_is_joined_to_is_a_contradiction() {
    let good = |value| (value, Quality::Good);
    let all = shown([good(CLOSED), good(CLOSED), good(CLOSED), good(CLOSED)]);
    assert!(all.iter().all(|(_, state, _)| state.starts_with("contradiction")), "{all:?}");
}

#[test]
fn a_network_that_contradicts_itself_is_refused_by_name() {
    let check = |from: &str, to: &str, words: &str| {
        assert!(NETWORK.contains(from), "{from}");
        let fault = Topology::new(&settings(&NETWORK.replacen(from, to, 1))).unwrap_err();
        assert!(fault.to_string().contains(words), "{fault}");
    };
    check(r#""node": "load""#, r#""node": "lode""#, "the node 'lode', which is not there");
    check(r#"["line", "bus 1"]"#, r#"["line", "line"]"#, "'=QA1' joins a node to itself");
    check(r#""id": "bus 2""#, r#""id": "bus 1""#, "the node 'bus 1' is there twice");
    check(r#""level": "220 kV""#, r#""level": "110 kV""#, "the voltage level '110 kV'");
    check(r#"{ "node": "line" }"#, "", "no source feeds the network");
    check(r#"["=WA2"]"#, r#"["=WA1"]"#, "the equipment '=WA1' is there twice");
    check(r#""equipment": "=QC9""#, r#""equipment": "=QA1""#, "the switch '=QA1' is there twice");
    let color = NETWORK.replace("#7a4fb5", "violet");
    let fault = serde_json::from_str::<Settings>(&color).unwrap_err();
    assert!(fault.to_string().contains("'violet' is no colour"), "{fault}");
}
