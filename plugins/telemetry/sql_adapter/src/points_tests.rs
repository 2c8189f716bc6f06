use busbar_plugin_sdk::testing::tag_spec;
use serde_json::{Value, json};

use super::*;
use crate::settings::Settings;

fn config() -> Config {
    let settings = json!({
        "sqlite": {"path": "/a.db"},
        "queries": [
            {"name": "wide", "sql": "SELECT 1", "poll_seconds": 1},
            {"name": "long", "sql": "SELECT 1", "poll_seconds": 1}
        ]
    });
    serde_json::from_value::<Settings>(settings).unwrap().parse().unwrap()
}

fn parse_tags(addresses: &[(ValueKind, Value)]) -> Result<Vec<Points>, String> {
    let tag = |(index, (kind, address)): (usize, &(ValueKind, Value))| {
        tag_spec(index as u32, &format!("T{index}"), *kind, address.clone())
    };
    let tags: Vec<_> = addresses.iter().enumerate().map(tag).collect();
    parse(&tags, &config()).map_err(|error| error.message().to_owned())
}

fn check_fault(kind: ValueKind, address: Value, expected: &str) {
    let fault = parse_tags(&[(kind, address.clone())]).unwrap_err();
    assert!(fault.contains(expected) && fault.contains("'T0'"), "{address}: {fault}");
}

#[test]
fn tags_are_found_by_query_and_name() {
    let points = parse_tags(&[
        (ValueKind::F64, json!({"query": "wide", "column": "oil", "time": "at"})),
        (ValueKind::F64, json!({"query": "long", "key": "T1.Oil"})),
        (ValueKind::I64, json!({"query": "long", "key": "T1.Oil"})),
        (
            ValueKind::DoublePoint,
            json!({"query": "long", "key": "Q1", "states": {" open ": "off", "shut": "on"}}),
        ),
    ])
    .unwrap();
    let Shape::Wide(columns) = &points[0].shape else { panic!("{points:?}") };
    let time = Some("at".to_owned());
    assert_eq!(columns[..], [Columns { value: "oil".into(), quality: None, time, unit: None }]);
    let Shape::Long(by_key) = &points[1].shape else { panic!("{points:?}") };
    assert_eq!(by_key["T1.Oil"], [0, 1]);
    assert_eq!(by_key["Q1"], [2]);
    assert_eq!(points[1].tags().collect::<Vec<_>>(), [1, 2, 3]);
    let states = &points[1].all[2].states;
    assert_eq!(
        states.get("open").unwrap(),
        busbar_plugin_sdk::Value::DoublePoint(busbar_plugin_sdk::DoublePoint::Off)
    );
}

#[test]
fn addresses_at_fault_are_named_with_a_remedy() {
    use ValueKind::{Bool, DoublePoint, F64, Text};
    check_fault(F64, json!({"query": "none", "key": "a"}), "there is 'wide', 'long'");
    check_fault(F64, json!({"query": "wide"}), "by one of them");
    check_fault(F64, json!({"query": "wide", "key": "a", "column": "b"}), "by one of them");
    check_fault(F64, json!({"query": "long", "key": "a", "time": "at"}), "beside `column`");
    check_fault(F64, json!({"query": "long", "key": ""}), "1 to 256 bytes");
    check_fault(F64, json!({"query": "long", "key": "a".repeat(257)}), "1 to 256 bytes");
    check_fault(F64, json!({"query": "long", "key": "a", "kex": 1}), "unknown field `kex`");
    check_fault(F64, json!("long"), "address");
    let states = |states: Value| json!({"query": "long", "key": "a", "states": states});
    check_fault(F64, states(json!({"a": 1})), "remove them");
    check_fault(Text, states(json!({"a": "on"})), "remove them");
    let unit = json!({"query": "wide", "column": "a", "unit": "u"});
    check_fault(Text, unit, "unit is that of numbers: remove it");
    check_fault(Bool, states(json!({"a": "on"})), "true and false");
    check_fault(DoublePoint, states(json!({"a": true})), "\"bad_state\"");
    let many: serde_json::Map<_, _> = (0..65).map(|n| (n.to_string(), json!(true))).collect();
    check_fault(Bool, states(many.into()), "at most 64");
}

#[test]
fn a_query_has_one_shape() {
    let fault = parse_tags(&[
        (ValueKind::F64, json!({"query": "wide", "column": "a"})),
        (ValueKind::F64, json!({"query": "wide", "key": "a"})),
        (ValueKind::F64, json!({"query": "none", "key": "a"})),
    ])
    .unwrap_err();
    assert!(fault.starts_with("2 of 3 tags") && fault.contains("'T1'"), "{fault}");
    assert!(fault.contains("not both") && fault.contains("'T2'"), "{fault}");
}
