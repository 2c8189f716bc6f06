use srad_types::payload::{DataSet, Payload as Outgoing, PropertySet, PropertyValue};

use super::*;

fn encode(metrics: Vec<Metric>) -> Vec<u8> {
    let (timestamp, seq) = (Some(1_700_000_000_000), Some(3));
    Outgoing { timestamp, metrics, seq, ..Outgoing::default() }.encode_to_vec()
}

#[test]
fn the_head_is_found_wherever_its_fields_are() {
    let bytes = encode(vec![Metric::default(), Metric::default()]);
    let head = Head { timestamp: Some(1_700_000_000_000), sequence: Some(3), metrics: 2 };
    assert_eq!(Payload::parse(&bytes).unwrap().head, head);
    let reversed = [&[0x18, 3][..], &[0x12, 0], &[0x12, 0], &bytes[..7]].concat();
    assert_eq!(Payload::parse(&reversed).unwrap().head, head);
}

#[test]
fn what_is_cut_short_or_endless_is_refused() {
    let bytes = encode(vec![Metric { name: Some("load".into()), ..Metric::default() }]);
    for end in 0..bytes.len() {
        let whole =
            Payload::parse(&bytes[..end]).is_ok_and(|payload| payload.head.sequence.is_some());
        assert!(!whole, "{end}");
    }
    for bad in [&[0x0B][..], &[0x12, 0xFF, 0xFF, 0xFF, 0xFF, 0x0F], &[0x80; 11], b"hello"] {
        assert!(Payload::parse(bad).is_err(), "{bad:?}");
    }
    let many: Vec<u8> = [0x12, 0].repeat(MAX_METRICS + 1);
    assert_eq!(Payload::parse(&many).unwrap_err(), PayloadFault::TooManyMetrics);
}

#[test]
fn a_metric_that_is_too_long_is_counted_and_not_read() {
    let long = Metric { name: Some("x".repeat(MAX_METRIC_BYTES + 1)), ..Metric::default() };
    let short = Metric { name: Some("short".into()), ..Metric::default() };
    let bytes = encode(vec![long, short]);
    let mut names = Vec::new();
    let payload = Payload::parse(&bytes).unwrap();
    let too_long = payload.each_metric(|metric| names.extend(metric.name.clone())).unwrap();
    assert_eq!((too_long, names), (1, vec!["short".to_owned()]));
}

#[test]
fn types_that_are_no_values_are_named() {
    let cases = [
        (None, Some(metric::Value::IntValue(1)), "no birth told"),
        (Some(DataType::Int32), None, "without a value"),
        (None, Some(metric::Value::DatasetValue(DataSet::default())), "a data set"),
        (Some(DataType::Template), Some(metric::Value::IntValue(1)), "a template"),
        (Some(DataType::Bytes), Some(metric::Value::BytesValue(vec![1])), "bytes"),
        (Some(DataType::String), Some(metric::Value::IntValue(1)), "its type does not have"),
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
fn quality_is_a_property() {
    let property = |value| PropertyValue { value: Some(value), ..PropertyValue::default() };
    let properties = PropertySet {
        keys: vec!["engUnit".into(), "Quality".into()],
        values: vec![
            property(property_value::Value::StringValue("kV".into())),
            property(property_value::Value::IntValue(500)),
        ],
    };
    let mut metric = Metric { properties: Some(properties), ..Metric::default() };
    assert_eq!(quality_code(&metric), Some(500));
    metric.properties.as_mut().unwrap().values.pop();
    assert_eq!(quality_code(&metric), None);
}
