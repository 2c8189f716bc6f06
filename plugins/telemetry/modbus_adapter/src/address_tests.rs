use busbar_plugin_sdk::testing::tag_spec;
use serde_json::{Value, json};

use super::*;
use crate::settings::Settings;

fn config() -> Config {
    let settings = json!({
        "host": "h", "unit": 3,
        "poll_groups": {"fast": {"poll_seconds": 0.1}, "slow": {"poll_seconds": 60}}
    });
    serde_json::from_value::<Settings>(settings).unwrap().parse().unwrap()
}

fn one(kind: ValueKind, address: Value) -> Result<Point, Error> {
    parse(&[tag_spec(9, "T1.x", kind, address)], &config()).map(|mut points| points.remove(0))
}

#[test]
fn addresses_become_points() {
    let number =
        |format, word_order, scale, offset| Decoding::Number { format, word_order, scale, offset };
    let integer = |format| Decoding::Integer { format, word_order: WordOrder::Big };
    let cases = [
        (
            ValueKind::F64,
            json!({"table": "holding", "register": 10, "type": "i16", "scale": 0.1, "offset": -40}),
            (Table::Holding, 10, 1),
            number(Format::I16, WordOrder::Big, 0.1, -40.0),
        ),
        (
            ValueKind::F64,
            json!({"table": "input", "register": 65532, "type": "f64", "word_order": "little"}),
            (Table::Input, 65532, 4),
            number(Format::F64, WordOrder::Little, 1.0, 0.0),
        ),
        (
            ValueKind::I64,
            json!({"table": "input", "register": 0, "type": "u32"}),
            (Table::Input, 0, 2),
            integer(Format::U32),
        ),
        (
            ValueKind::Bool,
            json!({"table": "holding", "register": 5, "type": "u16", "bit": 15}),
            (Table::Holding, 5, 1),
            Decoding::RegisterBit(15),
        ),
        (
            ValueKind::DoublePoint,
            json!({"table": "holding", "register": 5, "bits": 14}),
            (Table::Holding, 5, 1),
            Decoding::RegisterBitPair(14),
        ),
        (
            ValueKind::Bool,
            json!({"table": "coil", "register": 65535}),
            (Table::Coil, 65535, 1),
            Decoding::Bit,
        ),
        (
            ValueKind::DoublePoint,
            json!({"table": "discrete", "register": 2}),
            (Table::Discrete, 2, 2),
            Decoding::BitPair,
        ),
        (
            ValueKind::Text,
            json!({"table": "holding", "register": 65411, "length": 250}),
            (Table::Holding, 65411, 125),
            Decoding::Text { length: 250, byte_order: ByteOrder::Big },
        ),
        (
            ValueKind::Text,
            json!({"table": "input", "register": 0, "length": 5, "byte_order": "little"}),
            (Table::Input, 0, 3),
            Decoding::Text { length: 5, byte_order: ByteOrder::Little },
        ),
    ];
    for (kind, address, (table, first, count), decoding) in cases {
        let expected =
            Point { tag: 9, id: "T1.x".into(), unit: 3, table, group: 0, first, count, decoding };
        assert_eq!(one(kind, address.clone()).unwrap(), expected, "{address}");
    }
}

#[test]
fn unit_and_group_can_be_named() {
    let address = json!({
        "table": "coil", "register": 0, "unit": 17, "poll_group": "slow"
    });
    let point = one(ValueKind::Bool, address).unwrap();
    assert_eq!((point.unit, point.group), (17, 2));
}

#[test]
fn what_cannot_work_is_refused_with_tag_and_remedy() {
    let cases = [
        (ValueKind::Bool, json!({"table": "input", "register": 0, "type": "f32"}), "make the tag"),
        (ValueKind::Bool, json!({"table": "input", "register": 0}), "needs \"bit\""),
        (ValueKind::Bool, json!({"table": "input", "register": 0, "bit": 16}), "0 to 15"),
        (ValueKind::DoublePoint, json!({"table": "input", "register": 0}), "needs \"bits\""),
        (ValueKind::DoublePoint, json!({"table": "input", "register": 0, "bits": 15}), "15 and 16"),
        (ValueKind::DoublePoint, json!({"table": "coil", "register": 65535}), "pass 65535"),
        (ValueKind::F64, json!({"table": "coil", "register": 0}), "make the tag bool"),
        (ValueKind::I64, json!({"table": "discrete", "register": 0}), "make the tag bool"),
        (ValueKind::F64, json!({"table": "holding", "register": 0}), "needs \"type\""),
        (
            ValueKind::F64,
            json!({"table": "holding", "register": 0, "type": "u16", "scale": 0}),
            "not 0",
        ),
        (
            ValueKind::F64,
            json!({"table": "holding", "register": 0, "type": "u16", "bit": 1}),
            "bit has no meaning",
        ),
        (
            ValueKind::F64,
            json!({"table": "holding", "register": 65535, "type": "f32"}),
            "pass 65535",
        ),
        (
            ValueKind::I64,
            json!({"table": "holding", "register": 0, "type": "f32"}),
            "make the tag f64",
        ),
        (
            ValueKind::I64,
            json!({"table": "holding", "register": 0, "type": "u16", "scale": 2}),
            "or make the tag f64",
        ),
        (ValueKind::Bool, json!({"table": "coil", "register": 0, "bit": 0}), "bit has no meaning"),
        (
            ValueKind::Bool,
            json!({"table": "coil", "register": 0, "poll_group": "quick"}),
            "there are 'fast', 'slow'",
        ),
        (ValueKind::Bool, json!({"table": "coils", "register": 0}), "unknown variant `coils`"),
        (ValueKind::Bool, json!({"table": "coil", "register": 65536}), "65536"),
        (ValueKind::Bool, json!({"table": "coil", "register": -1}), "-1"),
        (ValueKind::Bool, json!({"table": "coil"}), "missing field `register`"),
        (ValueKind::Bool, json!({"table": "coil", "register": 0, "x": 1}), "unknown field `x`"),
        (ValueKind::Bool, json!("40001"), "tag 'T1.x'"),
        (ValueKind::Text, json!({"table": "holding", "register": 0}), "needs \"length\""),
        (ValueKind::Text, json!({"table": "holding", "register": 0, "length": 0}), "1 to 250"),
        (ValueKind::Text, json!({"table": "holding", "register": 0, "length": 251}), "1 to 250"),
        (ValueKind::Text, json!({"table": "holding", "register": 0, "length": 256}), "256"),
        (ValueKind::Text, json!({"table": "input", "register": 65535, "length": 3}), "pass 65535"),
        (ValueKind::Text, json!({"table": "coil", "register": 0, "length": 2}), "is a bit, not"),
        (
            ValueKind::Text,
            json!({"table": "input", "register": 0, "length": 4, "type": "u32", "scale": 2}),
            "type, scale has no meaning",
        ),
        (
            ValueKind::F64,
            json!({"table": "input", "register": 0, "type": "u32", "length": 4}),
            "length has no meaning",
        ),
        (
            ValueKind::I64,
            json!({"table": "input", "register": 0, "type": "u32", "byte_order": "big"}),
            "byte_order has no meaning",
        ),
    ];
    for (kind, address, part) in cases {
        let error = one(kind, address.clone()).unwrap_err();
        assert!(error.message().contains(part), "{address}: {error}");
        assert!(error.message().contains("tag 'T1.x'"), "{address}: {error}");
    }
}

#[test]
fn all_tags_at_fault_are_in_one_message() {
    let bad = json!({"table": "coil", "register": 0});
    let good = json!({"table": "coil", "register": 0});
    let tags = [
        tag_spec(1, "a", ValueKind::F64, bad.clone()),
        tag_spec(2, "b", ValueKind::Bool, good),
        tag_spec(3, "c", ValueKind::I64, bad),
    ];
    let error = parse(&tags, &config()).unwrap_err();
    assert!(error.message().starts_with("2 of 3 tags"), "{error}");
    assert!(error.message().contains("tag 'a'") && error.message().contains("tag 'c'"));
    assert!(!error.message().contains("tag 'b'"));
}
