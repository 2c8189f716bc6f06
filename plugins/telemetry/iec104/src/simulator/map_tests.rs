use std::time::Duration;

use busbar_plugin_sdk::TagSpec;
use busbar_plugin_sdk::simulation::{Behavior, SignalShape};
use busbar_plugin_sdk::testing::tag_spec;
use serde_json::json;

use super::*;
use crate::settings::Settings;

/// A tag, and the constant that it has.
pub(crate) fn constant(
    tag: u32,
    kind: ValueKind,
    address: serde_json::Value,
    base: f64,
) -> (TagSpec, Signal) {
    let behaviour =
        Behavior::new(SignalShape::Constant, base, 0.0, Duration::from_secs(1)).unwrap();
    moving(tag, kind, address, behaviour)
}

pub(crate) fn moving(
    tag: u32,
    kind: ValueKind,
    address: serde_json::Value,
    behaviour: Behavior,
) -> (TagSpec, Signal) {
    let spec = tag_spec(tag, &format!("tag{tag}"), kind, address);
    let signal = Signal::new(1, &spec.id, kind, behaviour).unwrap();
    (spec, signal)
}

pub(crate) fn map(tags: &[(TagSpec, Signal)]) -> Result<(StationMap, Option<String>), Error> {
    let settings: Settings = serde_json::from_value(json!({"host": "127.0.0.1"})).unwrap();
    let specs: Vec<_> = tags.iter().map(|(spec, _)| spec.clone()).collect();
    let points = Points::parse(&specs, &settings.parse().unwrap()).unwrap();
    let signal_of =
        |tag| tags.iter().find(|(spec, _)| spec.tag == tag).map(|(_, signal)| signal.clone());
    StationMap::new(&points, signal_of)
}

#[test]
fn every_kind_of_tag_finds_an_object_that_it_can_read() {
    use codec::Value as Object;
    let counter =
        |count| Object::Counter { count, sequence: 0, is_carried: false, is_adjusted: false };
    let step = |position| Object::Step { position, is_transient: false };
    let cases = [
        (ValueKind::Bool, json!({}), 1.0, Object::Single(true)),
        (ValueKind::DoublePoint, json!({}), 2.0, Object::Double(2)),
        (ValueKind::F64, json!({}), 230.5, Object::Float(230.5)),
        (ValueKind::F64, json!({"scale": 0.5, "offset": 10}), 230.0, Object::Float(440.0)),
        (ValueKind::F64, json!({"type": "step"}), -7.0, step(-7)),
        (ValueKind::F64, json!({"type": "counter", "scale": 0.1}), 12.3, counter(123)),
        (ValueKind::I64, json!({}), -5.0, Object::Scaled(-5)),
        (ValueKind::I64, json!({}), 40_000.0, Object::Bits(40_000)),
        (ValueKind::I64, json!({"type": "measured"}), 9.0, Object::Scaled(9)),
        (ValueKind::I64, json!({"type": "step"}), 63.0, step(63)),
        (ValueKind::I64, json!({"type": "counter"}), 70_000.0, counter(70_000)),
        (ValueKind::I64, json!({"type": "bitstring"}), 5.0, Object::Bits(5)),
    ];
    for (kind, mut address, base, expected) in cases {
        address["ioa"] = json!(7);
        let (map, remark) = map(&[constant(0, kind, address.clone(), base)]).unwrap();
        let object = &map.objects()[0];
        assert_eq!((object.common_address, object.address, remark), (1, 7, None));
        assert_eq!(object.value_at(SystemTime::UNIX_EPOCH), expected, "{kind:?} {address}");
        assert_eq!(object.is_counter(), address["type"] == "counter");
    }
}

#[test]
fn bits_share_an_object_and_others_do_not() {
    let bit = |tag, bit, base| constant(tag, ValueKind::Bool, json!({"ioa": 7, "bit": bit}), base);
    let (station, remark) = map(&[
        bit(0, 0, 1.0),
        bit(1, 5, 1.0),
        bit(2, 6, 0.0),
        bit(3, 5, 0.0),
        constant(4, ValueKind::F64, json!({"ioa": 7}), 1.0),
    ])
    .unwrap();
    assert_eq!(station.objects().len(), 1);
    let value = station.objects()[0].value_at(SystemTime::UNIX_EPOCH);
    assert_eq!(value, codec::Value::Bits(1 | 1 << 5));
    let remark = remark.unwrap();
    assert!(remark.contains("2 tags") && remark.contains("tag3, tag4"), "{remark}");
}

#[test]
fn groups_are_parts_without_gaps() {
    let tags: Vec<_> = (1..=100)
        .map(|ioa| {
            let address = if ioa % 5 == 0 {
                json!({"ioa": ioa, "type": "counter"})
            } else {
                json!({"ioa": ioa})
            };
            constant(ioa, ValueKind::I64, address, 1.0)
        })
        .chain([constant(200, ValueKind::Bool, json!({"ioa": 1, "common_address": 9}), 1.0)])
        .collect();
    let (station, _) = map(&tags).unwrap();
    assert_eq!(station.common_addresses(), [1, 9]);
    assert_eq!(station.range(1, ObjectSelection::Values(None)).len(), 80);
    assert_eq!(station.range(1, ObjectSelection::Counters(None)).len(), 20);
    assert_eq!(station.range(9, ObjectSelection::Values(None)).len(), 1);
    let parts = |count, wanted: fn(Option<usize>) -> ObjectSelection| {
        let ranges = (0..count).map(|group| station.range(1, wanted(Some(group))));
        ranges.flatten().collect::<Vec<_>>()
    };
    let all = |wanted| station.range(1, wanted).collect::<Vec<_>>();
    assert_eq!(parts(GROUPS, ObjectSelection::Values), all(ObjectSelection::Values(None)));
    assert_eq!(
        parts(COUNTER_GROUPS, ObjectSelection::Counters),
        all(ObjectSelection::Counters(None))
    );
}

#[test]
fn values_that_do_not_fit_are_all_named() {
    let fault = map(&[
        constant(0, ValueKind::F64, json!({"ioa": 1, "type": "step"}), 64.0),
        constant(1, ValueKind::I64, json!({"ioa": 2}), -40_000.0),
        constant(2, ValueKind::F64, json!({"ioa": 3, "scale": 1e-39}), 1.0),
        constant(3, ValueKind::F64, json!({"ioa": 4}), 1.0),
    ])
    .unwrap_err();
    let message = fault.message();
    assert!(["'tag0'", "'tag1'", "'tag2'"].iter().all(|tag| message.contains(tag)), "{message}");
    assert!(!message.contains("'tag3'") && message.contains("\"simulate\""), "{message}");
}
