use busbar_plugin_sdk::testing::tag_spec;
use serde_json::json;

use super::*;

fn config(form: &str) -> Config {
    let settings = match form {
        "comtrade" => json!({"file": "/a.cfg"}),
        form => json!({"file": "/a.csv", "csv": {"form": form}}),
    };
    serde_json::from_value::<crate::Settings>(settings).unwrap().parse().unwrap()
}

fn parse(form: &str, kind: ValueKind, address: serde_json::Value) -> Result<Point, String> {
    let points = Points::parse(&[tag_spec(7, "T", kind, address)], &config(form));
    points.map(|mut points| points.0.remove(0)).map_err(|error| error.message().to_owned())
}

#[test]
fn every_form_has_its_address() {
    let one = |form, kind, address| parse(form, kind, address).unwrap().source;
    let named = |name: &str| Source::One(Column::Name(name.into()));
    assert_eq!(one("comtrade", ValueKind::F64, json!({"channel": "IA"})), named("IA"));
    assert_eq!(
        one("comtrade", ValueKind::Bool, json!({"channel": 3})),
        Source::One(Column::Number(3))
    );
    assert_eq!(one("wide", ValueKind::I64, json!({"column": "Oil"})), named("Oil"));
    assert_eq!(one("long", ValueKind::DoublePoint, json!({"name": "Q1"})), named("Q1"));
    let two = one("comtrade", ValueKind::DoublePoint, json!({"off": "CB_OFF", "on": 2}));
    assert_eq!(two, Source::Two(Column::Name("CB_OFF".into()), Column::Number(2)));
    let point =
        parse("comtrade", ValueKind::F64, json!({"channel": 1, "values": "primary"})).unwrap();
    assert_eq!((point.tag, point.values), (7, Values::Primary));
}

#[test]
fn what_has_no_effect_is_refused() {
    use ValueKind::{Bool, DoublePoint, F64, Text};
    for (form, kind, address, part) in [
        ("comtrade", F64, json!({"column": "IA"}), "must be as {\"channel\": \"IA\"}"),
        ("comtrade", F64, json!({"channel": "IA", "column": 1}), "must be as"),
        ("comtrade", F64, json!({"channel": 0}), "counted from 1"),
        ("comtrade", F64, json!({"channel": 1, "quality": 2}), "quality is for CSV in wide form"),
        ("comtrade", Bool, json!({"channel": 1, "values": "primary"}), "values is for numbers"),
        ("comtrade", DoublePoint, json!({"channel": 1}), "a double_point is two channels"),
        ("comtrade", DoublePoint, json!({"off": 1}), "off and on go together"),
        ("comtrade", F64, json!({"off": 1, "on": 2}), "off and on go together"),
        ("wide", F64, json!({"column": 1, "values": "primary"}), "values is for COMTRADE"),
        ("wide", F64, json!({"name": "a"}), "must be as {\"column\": \"Oil\"}"),
        ("long", F64, json!({"column": 1}), "must be as {\"name\": \"T1.Oil\"}"),
        ("long", DoublePoint, json!({"off": 1, "on": 2}), "off and on go together"),
        ("comtrade", Text, json!({"channel": 1}), "COMTRADE has no texts: take the tag from CSV"),
        ("wide", Text, json!({"column": 1, "unit": "kV"}), "unit is that of numbers"),
        ("long", Text, json!({"name": "a", "unit": "kV"}), "unit is that of numbers"),
        ("wide", Text, json!({"column": 1, "states": {"A": "on"}}), "states are for bool and"),
        ("wide", Text, json!({"off": 1, "on": 2}), "off and on go together"),
        ("wide", F64, json!({"colum": 1}), "colum"),
        ("wide", F64, json!("a"), "tag 'T'"),
    ] {
        let fault = parse(form, kind, address.clone()).unwrap_err();
        assert!(fault.contains(part) && fault.contains("'T'"), "{address}: {fault}");
    }
}
