use async_opcua::types::{Array, LocalizedText, QualifiedName, VariantScalarTypeId};
use busbar_plugin_sdk::Text;
use proptest::prelude::*;
use serde_json::json;

use super::*;
use crate::Settings;
use crate::points::Points;

fn point(kind: ValueKind, more: serde_json::Value) -> Point {
    let settings: Settings = serde_json::from_value(json!({"url": "opc.tcp://plc"})).unwrap();
    let mut address = json!({"node": "i=1"});
    address.as_object_mut().unwrap().extend(more.as_object().unwrap().clone());
    let tag = busbar_plugin_sdk::testing::tag_spec(1, "T", kind, address);
    Points::parse(&[tag], &settings.parse().unwrap()).unwrap().all.remove(0)
}

fn read(
    kind: ValueKind,
    more: serde_json::Value,
    variant: impl Into<Variant>,
) -> Result<Value, String> {
    let (value, quality) = value_of(&point(kind, more), &variant.into())?;
    assert_eq!(quality, Quality::Good);
    Ok(value)
}

fn text(text: &str) -> Value {
    Value::Text(Text::cut(text))
}

#[test]
fn numbers_of_all_types_are_read() {
    let none = json!({});
    for variant in [
        Variant::SByte(7),
        Variant::Byte(7),
        Variant::Int16(7),
        Variant::UInt16(7),
        Variant::Int32(7),
        Variant::UInt32(7),
        Variant::Int64(7),
        Variant::UInt64(7),
        Variant::Float(7.0),
        Variant::Double(7.0),
        Variant::String("7".into()),
    ] {
        assert_eq!(read(ValueKind::F64, none.clone(), variant.clone()), Ok(Value::F64(7.0)));
        assert_eq!(read(ValueKind::I64, none.clone(), variant), Ok(Value::I64(7)));
    }
    let scaled = json!({"scale": 0.1, "offset": -1.0});
    assert_eq!(read(ValueKind::F64, scaled, 20_i32), Ok(Value::F64(1.0)));
    assert!(read(ValueKind::I64, none.clone(), u64::MAX).unwrap_err().contains("is no i64"));
    assert!(read(ValueKind::I64, none.clone(), 0.5).unwrap_err().contains("is no i64"));
    assert_eq!(read(ValueKind::F64, none, u64::MAX), Ok(Value::F64(u64::MAX as f64)));
}

#[test]
fn states_and_bits_are_read() {
    let none = json!({});
    assert_eq!(read(ValueKind::Bool, none.clone(), true), Ok(Value::Bool(true)));
    assert_eq!(read(ValueKind::Bool, none.clone(), 1_u8), Ok(Value::Bool(true)));
    assert!(read(ValueKind::Bool, none.clone(), 2_u8).is_err());
    let on = Value::DoublePoint(DoublePoint::On);
    assert_eq!(read(ValueKind::DoublePoint, none.clone(), 2_i32), Ok(on.clone()));
    assert!(read(ValueKind::DoublePoint, none.clone(), 4_i32).is_err());
    assert!(read(ValueKind::DoublePoint, none, true).unwrap_err().contains("a Boolean is no"));
    let states = json!({"states": {"CLOSED": "on", "true": "on", "5": "on"}});
    let closed = Variant::from(LocalizedText::new("en", "CLOSED"));
    for variant in [closed, Variant::from("CLOSED"), true.into(), 5_u16.into()] {
        assert_eq!(read(ValueKind::DoublePoint, states.clone(), variant), Ok(on.clone()));
    }
    assert!(read(ValueKind::DoublePoint, states, "x").unwrap_err().contains("`states`"));
    for (bit, expected) in [(0, false), (15, true)] {
        let value = read(ValueKind::Bool, json!({"bit": bit}), i16::MIN);
        assert_eq!(value, Ok(Value::Bool(expected)));
    }
    assert!(read(ValueKind::Bool, json!({"bit": 0}), 1.0).unwrap_err().contains("has no bits"));
}

#[test]
fn texts_and_digits_of_whole_numbers_are_texts() {
    let none = json!({});
    for (variant, expected) in [
        (Variant::from("AUTO"), "AUTO"),
        (Variant::from(" AUTO "), " AUTO "),
        (Variant::from(""), ""),
        (Variant::from(LocalizedText::new("de", "Wärmer")), "Wärmer"),
        (Variant::from(QualifiedName::new(2, "Q1")), "Q1"),
        (Variant::SByte(-7), "-7"),
        (Variant::Byte(7), "7"),
        (Variant::Int16(-7), "-7"),
        (Variant::UInt16(7), "7"),
        (Variant::Int32(-7), "-7"),
        (Variant::UInt32(7), "7"),
        (Variant::Int64(i64::MIN), "-9223372036854775808"),
        (Variant::UInt64(u64::MAX), "18446744073709551615"),
    ] {
        assert_eq!(read(ValueKind::Text, none.clone(), variant), Ok(text(expected)), "{expected}");
    }
    for variant in [
        Variant::Empty,
        Variant::Boolean(true),
        Variant::Float(7.0),
        Variant::Double(7.5),
        Variant::StatusCode(StatusCode::Good),
        Variant::DateTime(Box::new(DateTime::now())),
        Variant::ByteString(b"AUTO".to_vec().into()),
        Variant::Variant(Box::new(Variant::from("AUTO"))),
    ] {
        let fault = read(ValueKind::Text, none.clone(), variant.clone()).unwrap_err();
        assert!(fault.ends_with("is no text: correct the tag's type or its node"), "{fault}");
    }
    let array = Array::new(VariantScalarTypeId::String, vec![Variant::from("A"), "B".into()]);
    let array = Variant::from(array.unwrap());
    assert_eq!(read(ValueKind::Text, json!({"index": 1}), array.clone()), Ok(text("B")));
    assert!(read(ValueKind::Text, none.clone(), array).unwrap_err().contains("an array of 2"));
    // A tag of another kind is not its text.
    assert_eq!(read(ValueKind::I64, none, QualifiedName::new(0, "7")), Ok(Value::I64(7)));
}

#[test]
fn a_text_that_is_cut_is_uncertain() {
    let point = point(ValueKind::Text, json!({}));
    let of = |count: usize| value_of(&point, &Variant::from("x".repeat(count))).unwrap();
    assert_eq!(of(255), (text(&"x".repeat(255)), Quality::Good));
    for count in [256, 100_000] {
        let cut = format!("{}…", "x".repeat(252));
        assert_eq!(of(count), (text(&cut), Quality::Uncertain(Reason::Configuration)), "{count}");
    }
}

#[test]
fn an_element_of_an_array_is_named() {
    let array = || {
        let values = vec![Variant::Double(1.0), Variant::Double(2.5)];
        Variant::from(Array::new(VariantScalarTypeId::Double, values).unwrap())
    };
    assert_eq!(read(ValueKind::F64, json!({"index": 1}), array()), Ok(Value::F64(2.5)));
    for (more, variant, fault) in [
        (json!({"index": 2}), array(), "the array has 2 elements"),
        (json!({}), array(), "an array of 2: name an element"),
        (json!({"index": 0}), Variant::Double(1.0), "it is no array"),
    ] {
        assert!(read(ValueKind::F64, more, variant).unwrap_err().contains(fault), "{fault}");
    }
}

#[test]
fn times_are_read_and_those_that_say_nothing_left_out() {
    // 2026-01-02T03:04:05.678Z.
    let time = UNIX_EPOCH + Duration::from_millis(1_767_323_045_678);
    let sent = DateTime::from(1_767_323_045_678 * 10_000 + TICKS_TO_1970);
    assert_eq!(time_of(&sent), Some(time));
    assert_eq!(read(ValueKind::I64, json!({}), sent), Ok(Value::I64(1_767_323_045_678)));
    for nothing in
        [DateTime::null(), DateTime::from(i64::MAX), DateTime::from(1), DateTime::endtimes()]
    {
        assert!(time_of(&nothing).is_none_or(|time| time > UNIX_EPOCH), "{nothing}");
    }
    assert_eq!(time_of(&DateTime::null()), None);
}

#[test]
fn qualities_are_those_of_the_table() {
    use Quality::{Bad, Good, Uncertain};
    for (status, quality) in [
        (StatusCode::Good, Good),
        (StatusCode::GoodLocalOverride, Uncertain(Reason::Unknown)),
        (StatusCode::GoodEdited, Uncertain(Reason::Unknown)),
        (StatusCode::Good.set_limit(StatusCodeLimit::High), Uncertain(Reason::OutOfRange)),
        (StatusCode::Good.set_limit(StatusCodeLimit::Constant), Good),
        (StatusCode::Good.set_overflow(true), Good),
        (StatusCode::UncertainLastUsableValue, Bad(Reason::Communication)),
        (StatusCode::UncertainSensorNotAccurate, Uncertain(Reason::Sensor)),
        (StatusCode::UncertainEngineeringUnitsExceeded, Uncertain(Reason::OutOfRange)),
        (StatusCode::UncertainSubNormal, Uncertain(Reason::Unknown)),
        (StatusCode::BadSensorFailure, Bad(Reason::Sensor)),
        (StatusCode::BadNoCommunication, Bad(Reason::Communication)),
        (StatusCode::BadNodeIdUnknown, Bad(Reason::Configuration)),
        (StatusCode::BadWaitingForInitialData, Bad(Reason::NotConnected)),
        (StatusCode::BadOutOfService, Bad(Reason::Unknown)),
        (StatusCode::from(0xC000_0000), Bad(Reason::Unknown)),
    ] {
        assert_eq!(quality_of(status), quality, "{status}");
    }
}

#[test]
fn origins_are_those_of_status_codes_and_historian_bits() {
    let past = SampleFlags::HISTORICAL | SampleFlags::BUFFERED;
    for (status, flags) in [
        (StatusCode::Good, SampleFlags::LIVE),
        (StatusCode::GoodLocalOverride, SampleFlags::SUBSTITUTED),
        (StatusCode::GoodLocalOverride.set_limit(StatusCodeLimit::Low), SampleFlags::SUBSTITUTED),
        (StatusCode::GoodEdited, SampleFlags::SUBSTITUTED),
        (StatusCode::GoodEdited_DependentValueChanged, SampleFlags::SUBSTITUTED),
        (StatusCode::UncertainSubstituteValue, SampleFlags::SUBSTITUTED),
        (StatusCode::UncertainTransducerInManual, SampleFlags::SUBSTITUTED),
        (StatusCode::BadEdited_OutOfRange, SampleFlags::SUBSTITUTED),
        (StatusCode::UncertainSimulatedValue, SampleFlags::SIMULATED),
        (StatusCode::UncertainSubNormal, SampleFlags::LIVE),
        // Calculated, interpolated, partial, with extra data, one of several.
        (StatusCode::from(0x0000_0401), past),
        (StatusCode::from(0x0000_0402), past),
        (StatusCode::from(0x0000_0404), past),
        (StatusCode::from(0x0000_0408), past),
        (StatusCode::from(0x0000_0410), past),
        (StatusCode::from(0x0096_0410), past | SampleFlags::SUBSTITUTED),
        (StatusCode::Good.set_overflow(true), SampleFlags::LIVE),
    ] {
        assert_eq!(origin_of(status), flags, "{status}");
    }
}

proptest! {
    #[test]
    fn no_status_is_better_than_it_says(bits in any::<u32>()) {
        let quality = quality_of(StatusCode::from(bits));
        match bits >> 30 {
            0 => prop_assert!(!matches!(quality, Quality::Bad(_))),
            1 => prop_assert!(!quality.is_good()),
            _ => prop_assert!(matches!(quality, Quality::Bad(_))),
        }
    }

    #[test]
    fn no_time_panics(ticks in any::<i64>()) {
        let _ = time_of(&DateTime::from(ticks));
    }
}
