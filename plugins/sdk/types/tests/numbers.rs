//! Numbers and bits of the vocabulary, in both directions.

use busbar_types::{
    AlarmState, DefectSeverity, DoublePoint, FaultKind, Origin, Pattern, Quality, QualityLevel,
    Reason, Severity, SignalShape, Text, Value, ValueKind, Verdict,
};

/// Asserts that exactly these numbers have a variant, and that each variant gives its number back.
macro_rules! assert_numbers {
    ($name:ident: $numbers:expr) => {
        for number in 0_u32..1000 {
            let found = $name::from_code(number);
            assert_eq!(found.is_some(), $numbers.contains(&number), "{number}");
            assert_eq!(found.map(|found| u32::from(found.code())), found.map(|_| number));
        }
    };
}

#[test]
fn every_number_names_one_variant_and_others_name_none() {
    assert_numbers!(ValueKind: 1..=5);
    assert_numbers!(QualityLevel: 0..=2);
    assert_numbers!(Reason: 0..=8);
    assert_numbers!(Verdict: 1..=3);
    assert_numbers!(Severity: 0..=2);
    assert_numbers!(DefectSeverity: 1..=3);
    assert_numbers!(Pattern: 0..=3);
    assert_numbers!(SignalShape: 0..=4);
    assert_eq!(FaultKind::ALL.map(FaultKind::bit), [1, 2, 4, 8, 16, 32, 64]);
}

#[test]
fn a_value_comes_back_from_its_bits() {
    let positions = [DoublePoint::Intermediate, DoublePoint::Off, DoublePoint::On];
    let positions = positions.into_iter().chain([DoublePoint::BadState]).map(Value::DoublePoint);
    let numbers = [Value::F64(-0.1), Value::F64(f64::INFINITY), Value::I64(i64::MIN)];
    let states = [Value::Bool(false), Value::Bool(true)];
    for value in positions.chain(numbers).chain(states) {
        let bits = value.bits().unwrap();
        assert_eq!(Value::from_bits(value.kind(), bits), Some(value));
    }
    assert_eq!(Value::from_bits(ValueKind::Bool, 2), Some(Value::Bool(true)));
    let position = Value::from_bits(ValueKind::DoublePoint, 6);
    assert_eq!(position, Some(Value::DoublePoint(DoublePoint::On)));
    let nan = 0x7ff8_0000_0000_1234;
    assert_eq!(Value::from_bits(ValueKind::F64, nan).and_then(|value| value.bits()), Some(nan));
    assert_eq!(Value::from_bits(ValueKind::Text, 0), None);
    assert_eq!(Value::Text(Text::new("AUTO").unwrap()).bits(), None);
}

#[test]
fn a_quality_is_its_level_and_its_reason() {
    for level in 0..4 {
        for reason in 0..10 {
            let Some(quality) = Quality::from_codes(level, reason) else {
                assert!(level > 2 || reason > 8, "{level}, {reason}");
                continue;
            };
            let expected = if level == 0 { (0, 0) } else { (level, reason) };
            assert_eq!(quality.codes(), expected);
            assert_eq!(quality.is_good(), level == 0);
            assert_eq!(quality.name(), ["good", "uncertain", "bad"][usize::from(level)]);
        }
    }
    let [first, second] = [Reason::Sensor, Reason::Stale].map(Quality::Uncertain);
    assert_eq!(first.worst(second), first, "of two alike, the first");
    assert_eq!(first.worst(Quality::Bad(Reason::Stale)), Quality::Bad(Reason::Stale));
    assert_eq!(Quality::Good.worst(first), first);
}

#[test]
fn origins_are_named_and_no_other_bit_is_set() {
    for bits in 0..=u8::MAX {
        let origin = Origin::from_bits(bits);
        assert_eq!(origin.bits(), bits & 0b1_1111);
        let named = origin.names().filter_map(Origin::from_name);
        assert_eq!(named.fold(Origin::LIVE, |all, one| all | one), origin);
    }
    assert_eq!(Origin::from_name("live"), None);
}

#[test]
fn states_have_the_letters_of_the_standard() {
    let letters: String = AlarmState::ALL.map(AlarmState::letter).iter().collect();
    assert_eq!(letters, "ABCDEFGHI");
    for state in AlarmState::ALL {
        assert_eq!(AlarmState::from_letter(state.letter()), Some(state));
    }
    assert!(['@', 'J', 'a'].into_iter().all(|letter| AlarmState::from_letter(letter).is_none()));
}
