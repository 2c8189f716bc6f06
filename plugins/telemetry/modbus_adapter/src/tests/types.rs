//! Every type of value, whatever the transport and the server.

use busbar_plugin_sdk::{DoublePoint, Text};

use super::*;

const NOT_A_NUMBER: u32 = 99;
const NO_UTF8: u32 = 98;

/// Returns the tables of a server.
pub(super) fn values() -> serde_json::Value {
    json!({
        "holding": {
            // -1.5f32 = 0xBFC00000; 1e300 = 0x7E37E43C8800759C; -2 as i64.
            "0": [65535, 0xFFF6, 0x0001, 0x0002, 0xFFFF, 0xFFFD, 0xBFC0, 0x0000],
            "8": [0x7E37, 0xE43C, 0x8800, 0x759C, 0xFFFF, 0xFFFF, 0xFFFF, 0xFFFE],
            "16": [0x0000, 0xBFC0, 0b1000_0110, 0x7FC0, 0x0000],
            "60": [600],
            // "AUTO 電", its three bytes E9 9B BB in UTF-8, padded with a space and zeros; FFh is
            // no UTF-8.
            "70": [0x4155, 0x544F, 0x20E9, 0x9BBB, 0x2000, 0x0000, 0xFF41],
            "80": [0x5541, 0x4F54],
            "300": [1234]
        },
        "input": {"5": [250]},
        "coil": {"3": [1, 0, 1]},
        "discrete": {"1000": [0, 1, 1, 1]}
    })
}

/// Returns tag kinds, addresses and the values that they must read from [`values`].
fn cases() -> Vec<(ValueKind, serde_json::Value, Value)> {
    let (f64_kind, i64_kind) = (ValueKind::F64, ValueKind::I64);
    let double = |state| Value::DoublePoint(state);
    let text = |text| Value::Text(Text::cut(text));
    let texts = |register: u16, length: u8| json!({"table": "holding", "register": register, "length": length});
    let low_first =
        json!({"table": "holding", "register": 80, "length": 4, "byte_order": "little"});
    let holding = |register: u16, format: &str| json!({"table": "holding", "register": register, "type": format});
    let bit = |table: &str, register: u16| json!({"table": table, "register": register});
    let little = json!({"table": "holding", "register": 16, "type": "f32", "word_order": "little"});
    let scaled =
        json!({"table": "input", "register": 5, "type": "u16", "scale": 0.5, "offset": -40});
    let register_bit = |number| json!({"table": "holding", "register": 18, "bit": number});
    let register_bits = json!({"table": "holding", "register": 18, "bits": 6});
    vec![
        (f64_kind, holding(0, "u16"), Value::F64(65535.0)),
        (f64_kind, holding(0, "i16"), Value::F64(-1.0)),
        (i64_kind, holding(1, "i16"), Value::I64(-10)),
        (i64_kind, holding(2, "u32"), Value::I64(65538)),
        (f64_kind, holding(4, "i32"), Value::F64(-3.0)),
        (f64_kind, holding(6, "f32"), Value::F64(-1.5)),
        (f64_kind, holding(8, "f64"), Value::F64(1e300)),
        (i64_kind, holding(12, "i64"), Value::I64(-2)),
        (i64_kind, holding(60, "u16"), Value::I64(600)),
        (i64_kind, holding(300, "u16"), Value::I64(1234)),
        (f64_kind, little, Value::F64(-1.5)),
        (ValueKind::Text, texts(70, 12), text("AUTO 電")),
        (ValueKind::Text, texts(71, 1), text("T")),
        (ValueKind::Text, texts(75, 2), text("")),
        (ValueKind::Text, low_first, text("AUTO")),
        (ValueKind::Bool, register_bit(1), Value::Bool(true)),
        (ValueKind::Bool, register_bit(0), Value::Bool(false)),
        (ValueKind::DoublePoint, register_bits, double(DoublePoint::On)),
        (f64_kind, scaled, Value::F64(85.0)),
        (ValueKind::Bool, bit("coil", 3), Value::Bool(true)),
        (ValueKind::Bool, bit("coil", 4), Value::Bool(false)),
        (ValueKind::DoublePoint, bit("coil", 4), double(DoublePoint::On)),
        (ValueKind::DoublePoint, bit("discrete", 1000), double(DoublePoint::On)),
        (ValueKind::DoublePoint, bit("discrete", 1002), double(DoublePoint::BadState)),
    ]
}

/// Reads all of them by these settings.
#[track_caller]
pub(super) fn check(settings: serde_json::Value) {
    let cases = cases();
    let tags = (0..).zip(&cases).map(|(tag, (kind, address, _))| {
        tag_spec(tag, &format!("tag{tag}"), *kind, address.clone())
    });
    let not_a_number = json!({"table": "holding", "register": 19, "type": "f32"});
    let no_utf8 = json!({"table": "holding", "register": 76, "length": 2});
    let no_utf8 = tag_spec(NO_UTF8, "no UTF-8", ValueKind::Text, no_utf8);
    let nan = tag_spec(NOT_A_NUMBER, "nan", ValueKind::F64, not_a_number);
    let running = start_with(settings, QUICK, tags.chain([nan, no_utf8]).collect());
    for (tag, (_, _, expected)) in (0..).zip(cases) {
        running.wait_for(tag, expected);
    }
    // What is not finite is passed on for the host to mark.
    running.wait(
        "NaN",
        NOT_A_NUMBER,
        |sample| matches!(sample.value, Some(Value::F64(value)) if value.is_nan()),
    );
    let marked = Some(Value::Text(Text::cut("\u{fffd}A")));
    running.wait("text that is no UTF-8", NO_UTF8, |sample| {
        sample.value == marked && sample.quality == Quality::Uncertain(Reason::Configuration)
    });
    let recording = running.recorder.recording();
    let states: Vec<_> = recording.links.iter().map(|(state, _)| *state).collect();
    assert_eq!(states, [LinkState::Connecting, LinkState::Up], "{:?}", recording.links);
    assert!(recording.samples.iter().all(|sample| sample.source_time.is_none()));
}
