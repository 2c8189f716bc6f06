use srad_types::payload::{DataSet, PropertySet, PropertyValue};

use super::*;

#[test]
fn types_that_are_no_values_are_named() {
    let cases = [
        (None, Some(metric::Value::IntValue(1)), "no birth told"),
        (Some(DataType::Int32), None, "without a value"),
        (None, Some(metric::Value::DatasetValue(DataSet::default())), "a data set"),
        (Some(DataType::Template), Some(metric::Value::IntValue(1)), "a template"),
        (Some(DataType::Bytes), Some(metric::Value::BytesValue(vec![1])), "bytes"),
        (Some(DataType::String), Some(metric::Value::IntValue(1)), "no value of its type"),
        (Some(DataType::Int32), Some(metric::Value::DoubleValue(1.0)), "no value of its type"),
        (Some(DataType::Float), Some(metric::Value::IntValue(1)), "no value of its type"),
        (Some(DataType::Double), Some(metric::Value::BooleanValue(true)), "no value of its type"),
        (Some(DataType::FloatArray), Some(metric::Value::DoubleValue(1.0)), "no value of its type"),
    ];
    for (data_type, value, part) in cases {
        let metric = Metric { value, ..Metric::default() };
        let what = raw_value(&metric, data_type).unwrap_err();
        assert!(what.contains(part), "{part}: {what}");
    }
}

#[test]
fn negative_numbers_are_read_in_whatever_width_they_come() {
    for (bits, data_type) in [
        (0xFB, DataType::Int8),
        (0xFFFF_FFFB, DataType::Int8),
        (0xFFFB, DataType::Int16),
        (0xFFFF_FFFB, DataType::Int32),
        (u64::MAX - 4, DataType::Int32),
        (u64::MAX - 4, DataType::Int64),
    ] {
        let metric = Metric { value: Some(metric::Value::LongValue(bits)), ..Metric::default() };
        assert_eq!(raw_value(&metric, Some(data_type)), Ok(Raw::Int(-5)), "{data_type:?}");
    }
}

#[test]
fn numbers_that_their_type_does_not_have_are_no_values() {
    for (bits, data_type) in [
        (300, DataType::UInt8),
        (0x1_0000, DataType::UInt16),
        (0x1_0000_0000, DataType::UInt32),
        (0x1FB, DataType::Int8),
        (0x1_FFFB, DataType::Int16),
        (0xFFFF_0000, DataType::Int16),
        (0x1_0000_0000, DataType::Int32),
        (2, DataType::Boolean),
    ] {
        let metric = Metric { value: Some(metric::Value::LongValue(bits)), ..Metric::default() };
        assert!(raw_value(&metric, Some(data_type)).is_err(), "{bits:x} {data_type:?}");
    }
}

#[test]
fn a_type_is_the_one_that_the_birth_told() {
    let value = Some(metric::Value::IntValue(1));
    let metric =
        |number| Metric { datatype: Some(number), value: value.clone(), ..Metric::default() };
    let of_birth = Some(DataType::UInt16);
    assert_eq!(raw_value(&metric(DataType::UInt16 as u32), of_birth), Ok(Raw::Int(1)));
    assert_eq!(raw_value(&metric(0), of_birth), Ok(Raw::Int(1)));
    let fault = raw_value(&metric(DataType::Int16 as u32), of_birth).unwrap_err();
    assert!(fault.contains("than its birth"), "{fault}");
    assert!(raw_value(&metric(999), None).unwrap_err().contains("lacks"));
}

#[test]
fn times_that_no_clock_shows_are_none() {
    assert!(instant(1_700_000_000_123).is_some());
    // Microseconds for milliseconds.
    assert_eq!(instant(1_700_000_000_123_456), None);
    assert_eq!(instant(u64::MAX), None);
}

#[test]
fn quality_is_a_property_and_one_that_nobody_can_read_is_not_good() {
    use property_value::Value;
    let property = |value| PropertyValue { value: Some(value), ..PropertyValue::default() };
    let of = |quality: Option<Value>| {
        let mut values = vec![property(Value::StringValue("kV".into()))];
        values.extend(quality.map(property));
        let keys = vec!["engUnit".into(), "Quality".into()];
        let properties = Some(PropertySet { keys, values });
        super::quality(&Metric { properties, ..Metric::default() })
    };
    assert_eq!(of(Some(Value::IntValue(192))), Quality::Good);
    assert_eq!(of(Some(Value::LongValue(500))), Quality::Bad(Reason::Communication));
    let unreadable = Quality::Uncertain(Reason::Configuration);
    assert_eq!(of(Some(Value::StringValue("Bad".into()))), unreadable);
    assert_eq!(of(Some(Value::DoubleValue(0.0))), unreadable);
    assert_eq!(of(None), unreadable, "a key without a value");
    assert_eq!(super::quality(&Metric::default()), Quality::Good);
}
