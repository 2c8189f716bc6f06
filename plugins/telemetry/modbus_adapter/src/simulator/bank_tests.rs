use std::time::{Duration, UNIX_EPOCH};

use busbar_plugin_sdk::TagSpec;
use busbar_plugin_sdk::simulation::{Behavior, SignalShape};
use busbar_plugin_sdk::testing::tag_spec;
use serde_json::json;

use super::*;
use crate::address;
use crate::settings::Settings;

fn constant(id: &str, kind: ValueKind, address: serde_json::Value, base: f64) -> (TagSpec, Signal) {
    let behaviour =
        Behavior::new(SignalShape::Constant, base, 0.0, Duration::from_secs(1)).unwrap();
    (tag_spec(0, id, kind, address), Signal::new(1, id, kind, behaviour).unwrap())
}

fn bank(tags: Vec<(TagSpec, Signal)>) -> Result<(Bank, Option<String>), Error> {
    let settings: Settings = serde_json::from_value(json!({"host": "127.0.0.1"})).unwrap();
    let (specs, signals): (Vec<_>, Vec<_>) = tags.into_iter().unzip();
    let points = address::parse(&specs, &settings.parse().unwrap()).unwrap();
    Bank::new(points.into_iter().zip(signals).collect())
}

fn holding(register: u16, format: &str) -> serde_json::Value {
    json!({"table": "holding", "register": register, "type": format})
}

#[test]
fn cells_lie_where_addresses_say() {
    let (bank, remark) = bank(vec![
        constant("float", ValueKind::F64, holding(10, "f32"), 230.5),
        constant(
            "flag",
            ValueKind::Bool,
            json!({"table": "holding", "register": 14, "bit": 3}),
            1.0,
        ),
        constant(
            "switch",
            ValueKind::DoublePoint,
            json!({"table": "holding", "register": 14, "bits": 6}),
            2.0,
        ),
        constant(
            "other unit",
            ValueKind::I64,
            json!({"table": "holding", "register": 0, "type": "i16", "unit": 9}),
            -2.0,
        ),
        constant(
            "mode",
            ValueKind::Text,
            json!({"table": "input", "register": 30, "length": 7}),
            3.0,
        ),
        constant("coil", ValueKind::Bool, json!({"table": "coil", "register": 7}), 1.0),
    ])
    .unwrap();
    assert_eq!(remark, None);
    let read = |unit, table, first, count| bank.read(unit, table, first, count, UNIX_EPOCH);
    // 230.5 is 43668000h by IEEE 754; cells 12 and 13 are between points.
    let flags = 1 << 3 | 0b10 << 6;
    assert_eq!(read(1, Table::Holding, 10, 5), Ok(vec![0x4366, 0x8000, 0, 0, flags]));
    assert_eq!(read(1, Table::Holding, 11, 1), Ok(vec![0x8000]), "half a number");
    assert_eq!(read(9, Table::Holding, 0, 1), Ok(vec![0xFFFE]));
    assert_eq!(read(1, Table::Coil, 7, 1), Ok(vec![1]));
    // "Text 3", and the end of it, which a reach of four cells would miss.
    let text = vec![0x5465, 0x7874, 0x2033, 0];
    assert_eq!(read(1, Table::Input, 30, 4), Ok(text));
    assert_eq!(read(1, Table::Input, 32, 1), Ok(vec![0x2033]));
    let illegal = Err(ExceptionCode::IllegalDataAddress);
    assert_eq!(read(1, Table::Holding, 9, 2), illegal);
    assert_eq!(read(1, Table::Holding, 14, 2), illegal);
    assert_eq!(read(1, Table::Input, 10, 1), illegal);
    assert_eq!(read(3, Table::Holding, 10, 1), Err(ExceptionCode::GatewayTargetDevice));
    for count in [0, 126] {
        let value = Err(ExceptionCode::IllegalDataValue);
        assert_eq!(read(1, Table::Holding, 10, count), value);
    }
}

#[test]
fn the_first_of_two_tags_in_one_cell_counts() {
    let (bank, remark) = bank(vec![
        constant("word", ValueKind::I64, holding(5, "u16"), 0x0F.into()),
        constant("bit", ValueKind::Bool, json!({"table": "holding", "register": 5, "bit": 8}), 1.0),
    ])
    .unwrap();
    assert_eq!(bank.read(1, Table::Holding, 5, 1, UNIX_EPOCH), Ok(vec![0x0F]));
    assert!(remark.unwrap().contains("bit"));
}

#[test]
fn a_tag_that_shares_cells_has_all_of_its_own() {
    let (bank, remark) = bank(vec![
        constant("low", ValueKind::I64, holding(28, "i32"), 7.0),
        constant("long", ValueKind::F64, holding(28, "f64"), 1.0),
    ])
    .unwrap();
    assert!(remark.unwrap().contains("long"));
    assert_eq!(bank.read(1, Table::Holding, 28, 4, UNIX_EPOCH), Ok(vec![0, 7, 0, 0]));
}

#[test]
fn values_that_do_not_fit_are_all_named() {
    let fault = bank(vec![
        constant("one", ValueKind::F64, holding(0, "u16"), -1.0),
        constant("two", ValueKind::I64, holding(1, "i16"), 40_000.0),
        constant("good", ValueKind::I64, holding(2, "u16"), 40_000.0),
    ])
    .unwrap_err();
    let message = fault.message();
    assert!(message.contains("'one'") && message.contains("'two'"), "{message}");
    assert!(!message.contains("'good'") && message.contains("\"simulate\""), "{message}");
}
