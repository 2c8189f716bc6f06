use std::time::{Duration, SystemTime, UNIX_EPOCH};

use busbar_plugin_sdk::testing::{Recorder, tag_spec};
use busbar_plugin_sdk::{DoublePoint, Sample, Text, ValueKind};
use serde_json::json;

use super::*;
use crate::probe::ClientProbe;

/// A client of one tag, number 1.
fn client(
    settings: serde_json::Value,
    kind: ValueKind,
    address: serde_json::Value,
) -> (ClientProbe, Recorder) {
    let mut settings = settings;
    settings["host"] = "a".into();
    let settings = serde_json::from_value(settings).unwrap();
    let recorder = Recorder::new();
    let tags = [tag_spec(1, "Tag", kind, address)];
    (ClientProbe::new(settings, &tags, recorder.sink()).unwrap(), recorder)
}

/// The sample that one message gives.
fn sample_of(
    settings: serde_json::Value,
    kind: ValueKind,
    address: serde_json::Value,
    payload: &[u8],
) -> Sample {
    let topic = address["topic"].as_str().unwrap().to_owned();
    let (mut client, recorder) = client(settings, kind, address);
    client.message(&topic, payload, false);
    recorder.latest(1).unwrap()
}

#[test]
fn numbers_come_as_hexadecimal_text_and_as_bytes() {
    use ValueKind::{Bool, DoublePoint as Position, F64, I64};
    let raw =
        |format: &str, order: &str| json!({"topic": "t", "format": format, "byte_order": order});
    let at_pointer = |more: serde_json::Value| {
        let mut address = json!({"topic": "t", "pointer": "/v"});
        address.as_object_mut().unwrap().extend(more.as_object().unwrap().clone());
        address
    };
    let text = json!({"topic": "t"});
    let hex = json!({"topic": "t", "format": "hex"});
    let scaled = json!({"topic": "t", "format": "i16", "byte_order": "big", "scale": 0.1});
    let cases: Vec<(_, serde_json::Value, Vec<u8>, Value)> = vec![
        (I64, text.clone(), b"0x1F".into(), Value::I64(31)),
        (F64, text.clone(), b" 0X1f ".into(), Value::F64(31.0)),
        (Bool, text.clone(), b"0x01".into(), Value::Bool(true)),
        (Position, text, b"0x02".into(), Value::DoublePoint(DoublePoint::On)),
        (I64, hex.clone(), b"1F".into(), Value::I64(31)),
        // A meter number in any form is its digits.
        (ValueKind::Text, hex.clone(), b"1F".into(), Value::Text(Text::cut("31"))),
        (
            ValueKind::Text,
            raw("u32", "big"),
            4_000_000_000_u32.to_be_bytes().into(),
            Value::Text(Text::cut("4000000000")),
        ),
        (I64, hex, b"10".into(), Value::I64(16)),
        (F64, raw("f32", "big"), 25.5_f32.to_be_bytes().into(), Value::F64(25.5)),
        (F64, raw("f64", "little"), 25.5_f64.to_le_bytes().into(), Value::F64(25.5)),
        (I64, raw("i16", "little"), (-2_i16).to_le_bytes().into(), Value::I64(-2)),
        (I64, raw("u32", "big"), 4_000_000_000_u32.to_be_bytes().into(), Value::I64(4_000_000_000)),
        (F64, scaled, (-400_i16).to_be_bytes().into(), Value::F64(-40.0)),
        (
            Position,
            json!({"topic": "t", "format": "u8"}),
            vec![1],
            Value::DoublePoint(DoublePoint::Off),
        ),
        (I64, at_pointer(json!({"format": "hex"})), br#"{"v": "FF"}"#.into(), Value::I64(255)),
        (I64, at_pointer(json!({})), br#"{"v": "0xFF"}"#.into(), Value::I64(255)),
        (
            F64,
            at_pointer(json!({"format": "f32", "byte_order": "big"})),
            br#"{"v": "41C80000"}"#.into(),
            Value::F64(25.0),
        ),
    ];
    for (kind, address, payload, expected) in cases {
        let sample = sample_of(json!({}), kind, address.clone(), &payload);
        assert_eq!((sample.value, sample.quality), (Some(expected), Quality::Good), "{address}");
    }
}

#[test]
fn bytes_that_do_not_fit_their_format_are_no_value() {
    let f32 = json!({"topic": "t", "format": "f32", "byte_order": "big"});
    let not_a_number = f32::NAN.to_be_bytes();
    let hex = json!({"topic": "t", "pointer": "/v", "format": "hex"});
    let cases: [(_, &[u8]); 9] = [
        (f32.clone(), b"25.5!"),
        (f32.clone(), b""),
        (f32.clone(), &[0; 3]),
        (f32.clone(), &[0; 5]),
        (f32, &not_a_number),
        (hex.clone(), br#"{"v": 10}"#),
        (hex.clone(), br#"{"v": "xyz"}"#),
        (json!({"topic": "t", "format": "hex"}), b"1FG"),
        (json!({"topic": "t"}), b"1F"),
    ];
    for (address, payload) in cases {
        let sample = sample_of(json!({}), ValueKind::F64, address.clone(), payload);
        let found = (sample.value, sample.quality);
        assert_eq!(found, (None, Quality::Bad(Reason::Configuration)), "{address}");
    }
}

#[test]
fn counts_of_time_are_of_the_unit_that_is_set() {
    let of_address =
        |unit: &str| json!({"topic": "t", "pointer": "/v", "time": "/t", "time_unit": unit});
    let plain = json!({"topic": "t", "pointer": "/v", "time": "/t"});
    let good = UNIX_EPOCH + Duration::from_secs(1_700_000_000);
    let check = |settings, address, time: serde_json::Value, expected: Option<SystemTime>| {
        let payload = json!({"v": 1, "t": time}).to_string();
        let sample = sample_of(settings, ValueKind::I64, address, payload.as_bytes());
        assert_eq!(sample.value, Some(Value::I64(1)));
        let flags = if expected.is_some() { SampleFlags::LIVE } else { SampleFlags::TIME_UNUSABLE };
        assert_eq!((sample.source_time, sample.flags), (expected, flags), "{payload}");
    };
    for (unit, count) in [
        ("s", 1_700_000_000_u64),
        ("ms", 1_700_000_000_000),
        ("us", 1_700_000_000_000_000),
        ("ns", 1_700_000_000_000_000_000),
    ] {
        let setting = json!({"time_unit": unit});
        check(json!({}), of_address(unit), count.into(), Some(good));
        check(json!({}), of_address(unit), count.to_string().into(), Some(good));
        check(setting.clone(), plain.clone(), count.into(), Some(good));
        // The address comes before the settings.
        check(setting, of_address("ms"), 1_700_000_000_000_u64.into(), Some(good));
        // Any other unit than the one that is set.
        check(json!({}), plain.clone(), count.into(), (unit == "ms").then_some(good));
    }
}

#[test]
fn a_source_that_says_it_is_there_in_capitals_is_there() {
    let settings = json!({"availability": [{"topic": "s/status", "covers": "s/#"}]});
    let (mut client, recorder) = client(settings, ValueKind::I64, json!({"topic": "s/a"}));
    for (number, (word, is_there)) in (0..).zip([
        ("Online", true),
        ("OFFLINE", false),
        ("Connected", true),
        ("Down", false),
        ("UP", true),
        ("FALSE", false),
        ("True", true),
        ("rebooting", false),
    ]) {
        client.message("s/status", word.as_bytes(), false);
        client.message("s/a", number.to_string().as_bytes(), false);
        let quality = if is_there { Quality::Good } else { Quality::Bad(Reason::Communication) };
        let sample = recorder.latest(1).unwrap();
        assert_eq!((sample.value, sample.quality), (Some(Value::I64(number)), quality), "{word}");
    }
}

#[test]
fn filters_cover_what_the_standard_says() {
    let cases = [
        ("a/b", "a/b", true),
        ("a/b", "a/b/c", false),
        ("a/#", "a", true),
        ("a/#", "a/b/c", true),
        ("a/#", "ab", false),
        ("+/b", "a/b", true),
        ("+/b", "a/c", false),
        ("a/+/c", "a/b/c", true),
        ("a/+", "a", false),
        ("#", "a/b", true),
        ("#", "$SYS/a", false),
    ];
    for (filter, topic, expected) in cases {
        assert_eq!(covers(filter, topic), expected, "{filter} {topic}");
    }
}
