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
        assert_eq!(mapping(kind).value_of(raw), expected, "{kind:?} {raw:?}");
    }
}

#[test]
fn words_come_before_numbers_and_are_not_scaled() {
    let values = [("closed", 2.0), ("true", 1.0), ("7", 70.0)];
    let values = values.map(|(text, value)| (text.to_owned(), Value::F64(value))).into();
    let mapping = Mapping { scale: 10.0, values, ..mapping(ValueKind::F64) };
    assert_eq!(mapping.value_of(Raw::Text(" closed ")), Some(Value::F64(2.0)));
    assert_eq!(mapping.value_of(Raw::Bool(true)), Some(Value::F64(1.0)));
    assert_eq!(mapping.value_of(Raw::Int(7)), Some(Value::F64(70.0)));
    assert_eq!(mapping.value_of(Raw::Float(7.0)), Some(Value::F64(70.0)));
    assert_eq!(mapping.value_of(Raw::Int(8)), Some(Value::F64(80.0)));
    assert_eq!(mapping.value_of(Raw::Text("open")), None);
}
