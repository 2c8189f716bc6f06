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
    let kinds = [ValueKind::F64, ValueKind::I64, ValueKind::Bool, ValueKind::DoublePoint];
    let data = [
        (Value::Float32(1.5), [Some(sdk::Value::F64(1.5)), None, None, None]),
        (Value::Float64(-2.0), [Some(sdk::Value::F64(-2.0)), None, None, None]),
        (Value::Integer(-7), [Some(sdk::Value::F64(-7.0)), Some(sdk::Value::I64(-7)), None, None]),
        (Value::Unsigned(7), [Some(sdk::Value::F64(7.0)), Some(sdk::Value::I64(7)), None, None]),
        // Beyond what either holds.
        (Value::Unsigned(u64::MAX), [None, None, None, None]),
        (Value::Boolean(true), [None, None, Some(sdk::Value::Bool(true)), None]),
        (
            Value::BitString { unused: 6, bytes: vec![0x80] },
            [None, None, None, Some(sdk::Value::DoublePoint(DoublePoint::On))],
        ),
        (Value::BitString { unused: 3, bytes: vec![0, 0] }, [None; 4]),
        (Value::VisibleString("1".into()), [None; 4]),
        (Value::Structure(vec![Value::Integer(1)]), [None; 4]),
    ];
    for (data, expected) in data {
        for (kind, expected) in kinds.into_iter().zip(expected) {
            assert_eq!(value_of(&point(kind), &data), expected, "{data:?} as {kind:?}");
        }
    }
}

/// IEC 61850-8-1, 8.1.2: 00 intermediate, 01 off, 10 on, 11 bad.
#[test]
fn positions_are_those_of_the_standard() {
    let states =
        [DoublePoint::Intermediate, DoublePoint::Off, DoublePoint::On, DoublePoint::BadState];
    for (code, state) in (0_u8..).zip(states) {
        let data = Value::BitString { unused: 6, bytes: vec![code << 6] };
        let value = value_of(&point(ValueKind::DoublePoint), &data);
        assert_eq!(value, Some(sdk::Value::DoublePoint(state)));
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
