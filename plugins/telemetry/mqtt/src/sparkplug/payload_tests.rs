use srad_types::payload::Payload as Outgoing;

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

/// Returns the outcome, name and alias of each metric of a payload.
fn entries(bytes: &[u8]) -> Vec<(&'static str, Option<String>, Option<u64>)> {
    let mut found = Vec::new();
    Payload::parse(bytes).unwrap().each_metric(|entry| {
        found.push(match entry {
            Entry::Metric(metric) => ("whole", metric.name.clone(), metric.alias),
            Entry::TooLong(metric) => ("too long", metric.name.clone(), metric.alias),
            Entry::Malformed => ("malformed", None, None),
        });
    });
    found
}

#[test]
fn of_a_metric_that_is_too_long_its_name_is_read() {
    let text = || Some(metric::Value::StringValue("x".repeat(MAX_METRIC_BYTES)));
    let name = |name: &str| Some(name.to_owned());
    let metric =
        |name: Option<String>, alias, value| Metric { name, alias, value, ..Metric::default() };
    let bytes = encode(vec![
        metric(name("long"), Some(5), text()),
        metric(None, Some(6), text()),
        metric(None, None, text()),
        metric(Some("x".repeat(MAX_METRIC_BYTES + 1)), Some(7), None),
        metric(name("short"), None, None),
    ]);
    let expected = [
        ("too long", name("long"), Some(5)),
        ("too long", None, Some(6)),
        ("malformed", None, None),
        ("malformed", None, None),
        ("whole", name("short"), None),
    ];
    assert_eq!(entries(&bytes), expected);
}

#[test]
fn a_name_that_is_not_utf_8_and_a_metric_cut_short_spoil_no_other() {
    let bytes = [&[0x12, 3, 0x0A, 1, 0xFF][..], &[0x12, 2, 0x0A, 9], &[0x12, 3, 0x0A, 1, b'a']];
    let expected =
        [("malformed", None, None), ("malformed", None, None), ("whole", Some("a".into()), None)];
    assert_eq!(entries(&bytes.concat()), expected);
}

#[test]
fn a_compressed_payload_is_none_that_can_be_read() {
    let uuid = Some("SPBV1.0_COMPRESSED".to_owned());
    let bytes = Outgoing { uuid, body: Some(vec![1, 2]), ..Outgoing::default() }.encode_to_vec();
    assert_eq!(Payload::parse(&bytes).unwrap_err(), PayloadFault::Compressed);
}
