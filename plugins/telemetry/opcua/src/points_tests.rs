use busbar_plugin_sdk::testing::tag_spec;
use serde_json::json;

use super::*;
use crate::Settings;

fn config() -> Config {
    let settings: Settings = serde_json::from_value(json!({"url": "opc.tcp://plc"})).unwrap();
    settings.parse().unwrap()
}

fn parse(addresses: &[(ValueKind, Json)]) -> Result<Points, String> {
    let tags: Vec<_> = (0..)
        .zip(addresses)
        .map(|(tag, (kind, address))| tag_spec(tag, &format!("T{tag}"), *kind, address.clone()))
        .collect();
    Points::parse(&tags, &config()).map_err(|error| error.message().to_owned())
}

#[test]
fn tags_of_one_node_share_an_item() {
    let points = parse(&[
        (ValueKind::F64, json!({"node": "ns=2;s=A", "index": 0})),
        (ValueKind::F64, json!({"node": "ns=2;s=A", "index": 1})),
        (ValueKind::F64, json!({"node": "ns=2;s=A", "deadband": 0.5})),
        (ValueKind::Bool, json!({"node": "ns=2;s=B", "bit": 3})),
    ])
    .unwrap();
    let served: Vec<_> = points.items.iter().map(|item| item.points.clone()).collect();
    assert_eq!(served, [vec![0, 1], vec![2], vec![3]]);
    assert_eq!(points.items[1].deadband, Deadband::Absolute(0.5));
    assert_eq!(points.items[0].queue, 1);
}

#[test]
fn states_have_the_tags_kind() {
    let states = json!({"OPEN": "off", "CLOSED": "on"});
    let points =
        parse(&[(ValueKind::DoublePoint, json!({"node": "i=1", "states": states}))]).unwrap();
    assert_eq!(
        points.all[0].states["OPEN"],
        busbar_plugin_sdk::Value::DoublePoint(busbar_plugin_sdk::DoublePoint::Off)
    );
    let fault = parse(&[(ValueKind::F64, json!({"node": "i=1", "states": {"a": true}}))]);
    assert!(fault.unwrap_err().contains("states are for bool and double_point"));
}

#[test]
fn every_fault_names_its_tag_and_remedy() {
    let cases = [
        (ValueKind::F64, json!({"node": "A"}), "is no node id"),
        (ValueKind::F64, json!({"nodes": "i=1"}), "nodes"),
        (ValueKind::I64, json!({"node": "i=1", "scale": 2.0}), "scale and offset are for f64"),
        (ValueKind::F64, json!({"node": "i=1", "scale": 0.0}), "no number to calculate with"),
        (ValueKind::F64, json!({"node": "i=1", "bit": 0}), "bit is for bool tags"),
        (ValueKind::Bool, json!({"node": "i=1", "bit": 64}), "bit: 0 to 63"),
        (ValueKind::F64, json!({"node": "i=1", "deadband": 0.0}), "deadband: give a number above"),
        (
            ValueKind::F64,
            json!({"node": "i=1", "deadband": 1.0, "deadband_percent": 1.0}),
            "not both",
        ),
        (ValueKind::F64, json!({"node": "i=1", "deadband_percent": 101.0}), "at most 100"),
        (ValueKind::F64, json!({"node": "i=1", "queue": 0}), "queue: 1 to 1000"),
        (ValueKind::F64, json!({"node": "i=1", "sampling_seconds": 3600.001}), "0 to 3600"),
        (ValueKind::Bool, json!({"node": "i=1", "states": {"a": "on"}}), "true and false"),
        (ValueKind::Bool, json!({"condition": "i=1"}), "give node, or condition and field"),
        (
            ValueKind::Bool,
            json!({"condition": "i=1", "field": "Severity"}),
            "Severity is an i64 or f64",
        ),
        (ValueKind::Bool, json!({"condition": "i=1", "field": "Retain", "bit": 1}), "nothing else"),
        (ValueKind::Text, json!({"node": "i=1", "scale": 2.0}), "scale and offset are for f64"),
        (ValueKind::Text, json!({"node": "i=1", "offset": 0.0}), "scale and offset are for f64"),
        (ValueKind::Text, json!({"node": "i=1", "bit": 0}), "bit is for bool tags"),
        (ValueKind::Text, json!({"node": "i=1", "states": {"1": "A"}}), "taken as it is: remove"),
        (ValueKind::Text, json!({"node": "i=1", "deadband": 1.0}), "a text has no deadband"),
        (ValueKind::Text, json!({"node": "i=1", "deadband_percent": 1.0}), "has no deadband"),
        (
            ValueKind::Text,
            json!({"condition": "i=1", "field": "ActiveState"}),
            "all other fields are bool",
        ),
        (
            ValueKind::Text,
            json!({"condition": "i=1", "field": "Severity"}),
            "Severity is an i64 or f64",
        ),
    ];
    for (kind, address, fault) in &cases {
        let found = parse(&[(*kind, address.clone())]).unwrap_err();
        assert!(found.contains("tag 'T0'") && found.contains(fault), "{address}: {found}");
    }
    let all: Vec<_> = cases.iter().map(|(kind, address, _)| (*kind, address.clone())).collect();
    assert!(parse(&all).unwrap_err().starts_with("23 of 23 tags cannot be served: tag 'T0'"));
}

#[test]
fn tags_of_one_condition_come_with_its_events() {
    let points = parse(&[
        (ValueKind::Bool, json!({"condition": "ns=2;s=A", "field": "ActiveState"})),
        (ValueKind::F64, json!({"node": "ns=2;s=A"})),
        (ValueKind::I64, json!({"condition": "ns=2;s=A", "field": "Severity"})),
    ])
    .unwrap();
    assert_eq!(points.items.len(), 1);
    assert_eq!(points.conditions.len(), 1);
    let expected = [(0, Field::ActiveState), (2, Field::Severity)];
    assert_eq!(points.conditions[0].points, expected);
}
