use super::*;
use crate::codec::{Asdu, Body};

fn point(kind: ValueKind, object_type: ObjectType, bit: Option<u8>) -> Point {
    Point {
        tag: 0,
        id: "t".into(),
        kind,
        object_type,
        scale: 2.0,
        offset: 1.0,
        bit,
        common_address: 1,
        object_address: 1,
    }
}

#[test]
fn every_value_goes_where_it_fits_and_nowhere_else() {
    use ObjectType::{Bitstring, Counter, Double, Measured, Single, Step};
    let counter =
        codec::Value::Counter { count: -5, sequence: 3, is_carried: true, is_adjusted: true };
    let step = codec::Value::Step { position: -3, is_transient: false };
    let (f64_of, i64_of) = (|v| Some(Value::F64(v)), |v| Some(Value::I64(v)));
    // As bool, as bit 1, as double point, as f64 (twice the value and one), as i64.
    let cases = [
        (codec::Value::Single(true), Single, [Some(Value::Bool(true)), None, None, None, None]),
        (
            codec::Value::Double(2),
            Double,
            [None, None, Some(Value::DoublePoint(DoublePoint::On)), None, None],
        ),
        (step, Step, [None, None, None, f64_of(-5.0), i64_of(-3)]),
        (codec::Value::Normalized(-16384), Measured, [None, None, None, f64_of(0.0), None]),
        (codec::Value::Scaled(-7), Measured, [None, None, None, f64_of(-13.0), i64_of(-7)]),
        (codec::Value::Float(0.5), Measured, [None, None, None, f64_of(2.0), None]),
        (counter, Counter, [None, None, None, f64_of(-9.0), i64_of(-5)]),
        (
            codec::Value::Bits(0x8000_0002),
            Bitstring,
            [None, Some(Value::Bool(true)), None, None, i64_of(0x8000_0002)],
        ),
    ];
    let kinds = [
        (ValueKind::Bool, None),
        (ValueKind::Bool, Some(1)),
        (ValueKind::DoublePoint, None),
        (ValueKind::F64, None),
        (ValueKind::I64, None),
    ];
    let types = [Single, Double, Measured, Step, Counter, Bitstring];
    for (value, own_type, expected) in cases {
        for ((kind, bit), expected) in kinds.into_iter().zip(expected) {
            let converted = |object_type| value_of(&point(kind, object_type, bit), value);
            assert_eq!(converted(ObjectType::Any), expected, "{value:?} as {kind:?}");
            assert_eq!(converted(own_type), expected, "{value:?} as {kind:?}");
            let text = point(ValueKind::Text, ObjectType::Any, bit);
            assert_eq!(value_of(&text, value), None, "{value:?} as a text");
            for other in types.into_iter().filter(|other| *other != own_type) {
                assert_eq!(converted(other), None, "{value:?} as {other:?}");
            }
        }
    }
}

fn quality(type_id: u8, element: &[u8]) -> Quality {
    let bytes = [&[type_id, 1, 3, 0, 1, 0, 1, 0, 0], element].concat();
    match Asdu::parse(&bytes).unwrap().body {
        Body::Objects(mut objects) => quality_of(&objects.next().unwrap()),
        other => panic!("{other:?}"),
    }
}

#[test]
fn quality_is_the_worst_that_the_station_says() {
    let (bad, uncertain) = (Quality::Bad, Quality::Uncertain);
    let cases = [
        (0x00, Quality::Good),
        (0x01, uncertain(Reason::OutOfRange)),
        (0x10, uncertain(Reason::Unknown)),
        (0x20, uncertain(Reason::Unknown)),
        (0x40, bad(Reason::Communication)),
        (0x80, bad(Reason::Sensor)),
        (0xF1, bad(Reason::Sensor)),
        (0x71, bad(Reason::Communication)),
        (0x31, uncertain(Reason::OutOfRange)),
        // Reserved bits say nothing.
        (0x0E, Quality::Good),
    ];
    for (qds, expected) in cases {
        assert_eq!(quality(11, &[0, 0, qds]), expected, "{qds:02X}");
    }
    assert_eq!(quality(5, &[0x80, 0]), uncertain(Reason::Unknown), "it moves");
    // Carry and adjustment leave a counter usable; EI concerns no value.
    assert_eq!(quality(15, &[0, 0, 0, 0, 0x7F]), Quality::Good);
    assert_eq!(quality(15, &[0, 0, 0, 0, 0x80]), bad(Reason::Sensor));
    assert_eq!(quality(38, &[0x0A, 0, 0, 0, 0, 0, 0, 0, 0, 0]), Quality::Good);
}
