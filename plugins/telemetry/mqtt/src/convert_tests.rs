use super::*;

fn mapping(kind: ValueKind) -> Mapping {
    Mapping { kind, scale: 1.0, offset: 0.0, values: BTreeMap::new() }
}

#[test]
fn numbers_become_what_they_can_be_without_loss() {
    use ValueKind::{Bool, DoublePoint as Position, F64, I64};
    let cases = [
        (F64, Raw::Int(-3), Some(Value::F64(-3.0))),
        (F64, Raw::Float(0.25), Some(Value::F64(0.25))),
        (F64, Raw::Bool(true), None),
        (I64, Raw::Int(i64::MIN.into()), Some(Value::I64(i64::MIN))),
        (I64, Raw::Int(u64::MAX.into()), None),
        (I64, Raw::Float(5.0), Some(Value::I64(5))),
        (I64, Raw::Float(5.5), None),
        (I64, Raw::Float(9.3e18), None),
        (I64, Raw::Float(f64::NAN), None),
        (Bool, Raw::Int(1), Some(Value::Bool(true))),
        (Bool, Raw::Int(2), None),
        (Bool, Raw::Float(1.0), Some(Value::Bool(true))),
        (Bool, Raw::Float(0.5), None),
        (Bool, Raw::Text("1.0"), Some(Value::Bool(true))),
        (Bool, Raw::Text("2.0"), None),
        (I64, Raw::Text("7.0"), Some(Value::I64(7))),
        (I64, Raw::Text("7.5"), None),
        (F64, Raw::Text("seven"), None),
        (Position, Raw::Float(2.0), Some(Value::DoublePoint(DoublePoint::On))),
        (Position, Raw::Text("2.0"), Some(Value::DoublePoint(DoublePoint::On))),
        (Position, Raw::Text("on"), None),
        (Bool, Raw::Text("false"), Some(Value::Bool(false))),
        (Position, Raw::Int(2), Some(Value::DoublePoint(DoublePoint::On))),
        (Position, Raw::Int(4), None),
        (Position, Raw::Bool(true), None),
    ];
    for (kind, raw, expected) in cases {
        let found = mapping(kind).value_of(raw);
        assert_eq!(found, expected.map(|value| (value, Quality::Good)), "{kind:?} {raw:?}");
        if let Raw::Text(text) = raw {
            assert_eq!(mapping(kind).value_of(Raw::Payload(text.as_bytes())), found, "{text}");
        }
    }
}

#[test]
fn text_tags_take_texts_and_whole_numbers() {
    let long = "x".repeat(256);
    let cut = format!("{}…", "x".repeat(252));
    let uncertain = Quality::Uncertain(Reason::Configuration);
    let cases = [
        (Raw::Text("AUTO"), Some(("AUTO", Quality::Good))),
        (Raw::Text(" 0x1F "), Some((" 0x1F ", Quality::Good))),
        (Raw::Text(""), Some(("", Quality::Good))),
        (Raw::Text("true"), Some(("true", Quality::Good))),
        (Raw::Text(&long), Some((&cut, uncertain))),
        (Raw::Payload(b"AUTO\r\n"), Some(("AUTO", Quality::Good))),
        (Raw::Payload(b" 00123\0\0"), Some((" 00123", Quality::Good))),
        (Raw::Payload("Zähler".as_bytes()), Some(("Zähler", Quality::Good))),
        (Raw::Payload(b""), None),
        (Raw::Payload(b"AUTO\n\0"), Some(("AUTO", Quality::Good))),
        (Raw::Payload(b"AUT\xD6"), Some(("AUT\u{fffd}", uncertain))),
        (Raw::Payload(long.as_bytes()), Some((&cut, uncertain))),
        (Raw::Int(u64::MAX.into()), Some(("18446744073709551615", Quality::Good))),
        (Raw::Int(-7), Some(("-7", Quality::Good))),
        (Raw::Float(5.0), None),
        (Raw::Float(f64::NAN), None),
        (Raw::Bool(true), None),
    ];
    for (raw, expected) in cases {
        let expected = expected.map(|(text, quality)| (Value::Text(Text::cut(text)), quality));
        assert_eq!(mapping(ValueKind::Text).value_of(raw), expected, "{raw:?}");
    }
}

#[test]
fn words_come_before_numbers_and_are_not_scaled() {
    let values = [("closed", 2.0), ("true", 1.0), ("7", 70.0)];
    let values = values.map(|(text, value)| (text.to_owned(), Value::F64(value))).into();
    let mapping = Mapping { scale: 10.0, values, ..mapping(ValueKind::F64) };
    for (raw, expected) in [
        (Raw::Text(" closed "), Some(2.0)),
        (Raw::Payload(b" closed "), Some(2.0)),
        (Raw::Bool(true), Some(1.0)),
        (Raw::Int(7), Some(70.0)),
        (Raw::Float(7.0), Some(70.0)),
        (Raw::Int(8), Some(80.0)),
        (Raw::Text("open"), None),
    ] {
        let expected = expected.map(|number| (Value::F64(number), Quality::Good));
        assert_eq!(mapping.value_of(raw), expected, "{raw:?}");
    }
}
