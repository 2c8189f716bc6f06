use busbar_plugin_sdk::testing::tag_spec;
use serde_json::{Value, json};

use super::*;
use crate::Settings;

fn parse(tags: &[(ValueKind, Value)]) -> Result<Points, Error> {
    let config = serde_json::from_value::<Settings>(json!({"host": "a", "common_address": 7}))
        .unwrap()
        .parse()
        .unwrap();
    let tags: Vec<_> = (0..)
        .zip(tags)
        .map(|(tag, (kind, address))| tag_spec(tag, &format!("t{tag}"), *kind, address.clone()))
        .collect();
    Points::parse(&tags, &config)
}

#[test]
fn points_are_found_by_their_addresses() {
    let points = parse(&[
        (ValueKind::Bool, json!({"ioa": 5, "bit": 3})),
        (ValueKind::F64, json!({"ioa": 16_777_215, "common_address": 9, "scale": 0.5})),
        (ValueKind::Bool, json!({"ioa": 5, "bit": 4, "type": "bitstring"})),
        (ValueKind::DoublePoint, json!({"ioa": 5, "common_address": 2, "type": "double"})),
    ])
    .unwrap();
    assert_eq!(points.common_addresses(), [2, 7, 9]);
    let tags = |range: Range<usize>| points.all()[range].iter().map(|p| p.tag).collect::<Vec<_>>();
    assert_eq!(tags(points.of_object(7, 5)), [0, 2]);
    assert_eq!(tags(points.of_object(2, 5)), [3]);
    assert_eq!(tags(points.of_object(9, 16_777_215)), [1]);
    assert_eq!(tags(points.of_object(7, 6)), [] as [u32; 0]);
    assert_eq!(tags(points.of_object(1, 5)), [] as [u32; 0]);
    assert_eq!(tags(points.of_station(7)), [0, 2]);
    assert_eq!(tags(points.of_station(8)), [] as [u32; 0]);
}

#[test]
fn every_tag_at_fault_is_named() {
    let cases = [
        (ValueKind::F64, json!({}), "missing field `ioa`"),
        (ValueKind::F64, json!({"ioa": 0}), "ioa 0 is not within 1 to 16777215"),
        (ValueKind::F64, json!({"ioa": 16_777_216}), "ioa 16777216 is not within"),
        (ValueKind::F64, json!({"ioa": 1, "common_address": 65535}), "common_address 65535"),
        (ValueKind::F64, json!({"ioa": 1, "common_address": 0}), "common_address 0"),
        (ValueKind::F64, json!({"ioa": 1, "scale": 0}), "scale must be finite and not 0"),
        (ValueKind::I64, json!({"ioa": 1, "scale": 2}), "scale and offset are for f64"),
        (ValueKind::Bool, json!({"ioa": 1, "bit": 32}), "bit 32 does not exist"),
        (ValueKind::I64, json!({"ioa": 1, "bit": 3}), "bit is for bool tags"),
        (ValueKind::Bool, json!({"ioa": 1, "bit": 3, "type": "single"}), "bit is for bool tags"),
        (ValueKind::Bool, json!({"ioa": 1, "type": "bitstring"}), "needs \"bit\""),
        (ValueKind::F64, json!({"ioa": 1, "type": "single"}), "make the tag bool"),
        (ValueKind::Bool, json!({"ioa": 1, "type": "double"}), "make the tag double_point"),
        (ValueKind::F64, json!({"ioa": 1, "type": "bitstring"}), "a bitstring is an i64"),
        (ValueKind::Bool, json!({"ioa": 1, "type": "step"}), "a number is an f64 or i64"),
        (ValueKind::Text, json!({"ioa": 1}), "carries no text: make the tag"),
        (ValueKind::Text, json!({"ioa": 1, "type": "bitstring"}), "carries no text: make the tag"),
        (ValueKind::Text, json!({"ioa": 1, "scale": 2}), "carries no text: make the tag"),
        (ValueKind::F64, json!({"ioa": 1, "type": "float"}), "unknown variant `float`"),
        (ValueKind::F64, json!({"ioa": 1, "register": 1}), "unknown field `register`"),
    ];
    let tags: Vec<_> = cases.iter().map(|(kind, address, _)| (*kind, address.clone())).collect();
    let error = parse(&tags).unwrap_err();
    let message = error.message();
    assert!(message.starts_with("20 of 20 tags cannot be served: "), "{message}");
    for (index, (_, _, part)) in cases.iter().enumerate() {
        let of_tag = message.split("; ").find(|said| said.contains(&format!("'t{index}'")));
        assert!(of_tag.is_some_and(|said| said.contains(part)), "{index} {part}: {message}");
    }
}

#[test]
fn too_many_common_addresses_are_refused() {
    let tag =
        |common_address| (ValueKind::F64, json!({"ioa": 1, "common_address": common_address}));
    let most: Vec<_> = (1..=256).map(tag).collect();
    assert_eq!(parse(&most).unwrap().common_addresses().len(), 256);
    let more: Vec<_> = (1..=257).map(tag).collect();
    assert!(parse(&more).unwrap_err().message().contains("257 common addresses; at most 256"));
}
