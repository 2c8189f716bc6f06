use busbar_plugin_sdk::testing::tag_spec;
use iec61850_rs::TimeQuality;
use proptest::prelude::*;
use serde_json::json;

use super::*;
use crate::points::Points;

fn point(kind: ValueKind) -> Point {
    let address = json!({"reference": "L/M.T", "fc": "MX"});
    Points::parse(&[tag_spec(1, "t", kind, address)]).unwrap().all()[0].clone()
}

#[test]
fn data_become_values_of_their_kind_alone() {
    let (f64_of, i64_of) = (sdk::Value::F64, sdk::Value::I64);
    let of = |byte: u8| Value::BitString { unused: 6, bytes: vec![byte] };
    let on = sdk::Value::DoublePoint(DoublePoint::On);
    let kinds =
        [ValueKind::F64, ValueKind::I64, ValueKind::Bool, ValueKind::DoublePoint, ValueKind::Text];
    // All kinds that data fit, with the value of each.
    let data = [
        (Value::Float32(1.5), vec![f64_of(1.5)]),
        (Value::Float64(-2.0), vec![f64_of(-2.0)]),
        (Value::Integer(-7), vec![f64_of(-7.0), i64_of(-7), text("-7")]),
        (Value::Unsigned(7), vec![f64_of(7.0), i64_of(7), text("7")]),
        // Beyond what numbers hold.
        (Value::Unsigned(u64::MAX), vec![text("18446744073709551615")]),
        (Value::Boolean(true), vec![sdk::Value::Bool(true)]),
        (of(0x80), vec![on]),
        (Value::BitString { unused: 3, bytes: vec![0, 0] }, vec![]),
        (Value::VisibleString("1".into()), vec![text("1")]),
        (Value::VisibleString("".into()), vec![text("")]),
        (Value::MmsString("Wärme 電".into()), vec![text("Wärme 電")]),
        (Value::OctetString(b"1".to_vec()), vec![]),
        (Value::Structure(vec![Value::Integer(1)]), vec![]),
        (Value::Structure(vec![Value::VisibleString("1".into())]), vec![]),
        (Value::Other { tag: 13, constructed: false, bytes: vec![0x31] }, vec![]),
    ];
    for (data, expected) in data {
        for kind in kinds {
            let expected = expected.iter().find(|value| value.kind() == kind);
            let expected = expected.map(|value| (value.clone(), sdk::Quality::Good));
            assert_eq!(value_of(&point(kind), &data), expected, "{data:?} as {kind:?}");
        }
    }
}

fn text(text: &str) -> sdk::Value {
    sdk::Value::Text(sdk::Text::cut(text))
}

#[test]
fn texts_that_are_cut_or_no_characters_are_uncertain() {
    let doubt = sdk::Quality::Uncertain(Reason::Configuration);
    let of = |data: &Value| value_of(&point(ValueKind::Text), data).unwrap();
    let long = |count: usize| Value::VisibleString("x".repeat(count));
    assert_eq!(of(&long(255)), (text(&"x".repeat(255)), sdk::Quality::Good));
    assert_eq!(of(&long(256)), (text(&format!("{}…", "x".repeat(252))), doubt));
    // Latin-1, and UTF-8, in a VisibleString.
    let other = |tag, bytes: &[u8]| Value::Other { tag, constructed: false, bytes: bytes.into() };
    let latin = other(tag::VISIBLE_STRING, b"S\xFCd");
    assert_eq!(of(&latin), (text("S\u{fffd}d"), doubt));
    assert_eq!(
        of(&other(tag::VISIBLE_STRING, "Süd".as_bytes())),
        (text("Süd"), sdk::Quality::Good)
    );
    assert_eq!(name_of(&latin), "a text");
    assert_eq!(value_of(&point(ValueKind::I64), &latin), None);
}

/// IEC 61850-8-1, 8.1.2: 00 intermediate, 01 off, 10 on, 11 bad.
#[test]
fn positions_are_those_of_the_standard() {
    let states =
        [DoublePoint::Intermediate, DoublePoint::Off, DoublePoint::On, DoublePoint::BadState];
    for (code, state) in (0_u8..).zip(states) {
        let data = Value::BitString { unused: 6, bytes: vec![code << 6] };
        let value = value_of(&point(ValueKind::DoublePoint), &data);
        assert_eq!(value, Some((sdk::Value::DoublePoint(state), sdk::Quality::Good)));
    }
}

fn stamp(seconds: u32, quality: TimeQuality) -> Stamp {
    stamp_of(UtcTime::from_unix(seconds, 500_000_000, quality))
}

#[test]
fn times_that_cannot_be_relied_on_are_told_apart() {
    let sound = TimeQuality { leap_seconds_known: false, ..TimeQuality::SYNCHRONIZED };
    assert_eq!(stamp(1, sound), Stamp::At(UNIX_EPOCH + Duration::from_millis(1500)));
    assert_eq!(stamp(0, sound), Stamp::Untrusted);
    assert_eq!(stamp(1, TimeQuality { clock_failure: true, ..sound }), Stamp::Unusable);
    let free = TimeQuality { clock_not_synchronized: true, ..sound };
    assert_eq!(stamp(1, free), Stamp::Untrusted);
    assert_eq!(stamp(1, TimeQuality { clock_failure: true, ..free }), Stamp::Unusable);
    assert_eq!(entry_time_of(EntryTime::default()), None);
    let entry = EntryTime::from_unix_millis(1_767_323_045_678);
    let expected = UNIX_EPOCH + Duration::from_millis(1_767_323_045_678);
    assert_eq!(entry_time_of(entry), Some(expected));
}

#[test]
fn origins_are_those_of_the_quality() {
    use sdk::SampleFlags;
    let substituted = Quality { source: Source::Substituted, ..Quality::GOOD };
    assert_eq!(origin_of(Quality::GOOD), SampleFlags::LIVE);
    assert_eq!(origin_of(substituted), SampleFlags::SUBSTITUTED);
    let both = Quality { test: true, ..substituted };
    assert_eq!(origin_of(both), SampleFlags::SUBSTITUTED | SampleFlags::TEST);
}

fn rank(quality: sdk::Quality) -> u8 {
    match quality {
        sdk::Quality::Good => 0,
        sdk::Quality::Uncertain(_) => 1,
        sdk::Quality::Bad(_) => 2,
    }
}

proptest! {
    /// Bits that are set besides never make a quality better, and none but `derived` and
    /// the reserved ones leaves it good.
    #[test]
    fn no_bit_makes_a_quality_better(bits in 0_u32..1 << 14, bit in 2_u32..13) {
        let of = |bits: u32| quality_of(Quality::from_bits_msb(bits << 18));
        let (before, after) = (of(bits), of(bits | 1 << (13 - bit)));
        prop_assert!(rank(after) >= rank(before), "{before:?}, then {after:?}");
        prop_assert!(!after.is_good());
    }
}
