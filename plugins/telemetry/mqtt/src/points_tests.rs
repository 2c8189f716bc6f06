use busbar_plugin_sdk::testing::tag_spec;
use serde_json::json;

use super::*;

fn parse_json(kind: ValueKind, address: serde_json::Value) -> Result<(Place, Point), String> {
    parse_one(&tag_spec(7, "Tag", kind, address))
}

#[test]
fn addresses_are_topics_or_metrics() {
    let (place, point) = parse_json(
        ValueKind::F64,
        json!({"topic": "a/b", "pointer": "/v", "time": "/t", "quality": "/q", "scale": 0.1}),
    )
    .unwrap();
    let text = |text: &str| Some(text.to_owned());
    let pointers = Pointers {
        value: text("/v"),
        time: text("/t"),
        quality: text("/q"),
        ..Pointers::default()
    };
    assert_eq!(place, Place::Topic { topic: "a/b".into(), pointers });
    assert_eq!((point.tag, point.mapping.scale, point.mapping.offset), (7, 0.1, 0.0));

    let (place, _) = parse_json(
        ValueKind::Bool,
        json!({"group": "g", "edge_node": "e", "device": "d", "metric": "a/b", "values": {"on": true}}),
    )
    .unwrap();
    let metric = MetricPlace {
        group: "g".into(),
        edge_node: "e".into(),
        device: text("d"),
        metric: "a/b".into(),
    };
    assert_eq!(place, Place::Metric(metric));
}

#[test]
fn faults_name_tag_and_remedy() {
    use ValueKind::{Bool, DoublePoint, F64, Text};
    let cases = [
        (F64, json!({}), "name either a topic, or group"),
        (F64, json!({"topic": "a", "metric": "b"}), "name either a topic"),
        (F64, json!({"topic": "a", "device": "b"}), "name either a topic"),
        (F64, json!({"topic": "a/+"}), "put the filter into the setting subscriptions"),
        (F64, json!({"topic": ""}), "a topic has 1 to 65535 bytes"),
        (F64, json!({"topic": "a", "pointer": "v"}), "pointer: 'v' is no JSON pointer"),
        (F64, json!({"topic": "a", "time": "/t"}), "say by pointer where the value is"),
        (F64, json!({"group": "a/b", "edge_node": "e", "metric": "m"}), "group: give 1"),
        (F64, json!({"group": "a", "edge_node": "#", "metric": "m"}), "edge_node: give 1"),
        (F64, json!({"group": "a", "edge_node": "e", "metric": ""}), "metric: give 1"),
        (F64, json!({"group": "a", "edge_node": "e", "metric": "m", "time": "/t"}), "its own time"),
        (F64, json!({"topic": "a", "pointer": "/v", "time_unit": "s"}), "say by time where"),
        (F64, json!({"topic": "a", "unit": "/u"}), "say by pointer where the value is"),
        (F64, json!({"topic": "a", "pointer": "/v", "unit": "u"}), "unit: 'u' is no JSON pointer"),
        (
            F64,
            json!({"topic": "a", "pointer": "/v", "unit": "/u", "scale": 2}),
            "remove it, or scale",
        ),
        (Bool, json!({"topic": "a", "pointer": "/v", "unit": "/u"}), "unit is that of numbers"),
        (F64, json!({"group": "a", "edge_node": "e", "metric": "m", "unit": "/u"}), "its own time"),
        (F64, json!({"topic": "a", "pointer": "/v", "time": "/t", "time_unit": "h"}), "`h`"),
        (F64, json!({"topic": "a", "format": "f32"}), "needs byte_order"),
        (F64, json!({"topic": "a", "format": "f16"}), "`f16`"),
        (F64, json!({"topic": "a", "byte_order": "big"}), "set format to u8"),
        (
            F64,
            json!({"group": "a", "edge_node": "e", "metric": "m", "format": "u8"}),
            "a metric has its own type",
        ),
        (Bool, json!({"topic": "a", "scale": 2}), "scale and offset are for f64 tags"),
        (F64, json!({"topic": "a", "scale": 0}), "scale must be finite and not 0"),
        (DoublePoint, json!({"topic": "a", "values": {"x": 4}}), "'x' stands for 4"),
        (F64, json!({"topic": "a", "values": {"x": "y"}}), "'x' stands for"),
        (Text, json!({"topic": "a", "values": {"x": 1}}), "values are names of numbers and states"),
        (Text, json!({"topic": "a", "scale": 2}), "scale and offset are for f64 tags"),
        (Text, json!({"topic": "a", "pointer": "/v", "unit": "/u"}), "unit is that of numbers"),
        (
            Text,
            json!({"topic": "a", "format": "f32", "byte_order": "big"}),
            "a text tag takes texts and whole numbers",
        ),
        (
            Text,
            json!({"group": "a", "edge_node": "e", "metric": "m", "offset": 1}),
            "scale and offset are for f64 tags",
        ),
        (F64, json!({"topic": "a", "pinter": "/v"}), "unknown field `pinter`"),
    ];
    for (kind, address, part) in cases {
        let fault = parse_json(kind, address.clone()).unwrap_err();
        assert!(fault.starts_with("tag 'Tag': ") && fault.contains(part), "{address}: {fault}");
    }
}
