use proptest::prelude::*;

use super::*;

fn wire(weight: i16, sign: u16, digits: &[u16]) -> Vec<u8> {
    let words = [digits.len() as u16, weight as u16, sign, 0].into_iter();
    words.chain(digits.iter().copied()).flat_map(u16::to_be_bytes).collect()
}

fn check(weight: i16, sign: u16, digits: &[u16], expected: Cell<'static>) {
    assert_eq!(numeric(&wire(weight, sign, digits)), Some(expected), "{weight} {digits:?}");
}

#[test]
fn numerics_are_integers_where_they_can_be() {
    check(0, NUMERIC_POSITIVE, &[], Cell::Int(0));
    check(0, NUMERIC_POSITIVE, &[42], Cell::Int(42));
    check(0, NUMERIC_NEGATIVE, &[42], Cell::Int(-42));
    check(1, NUMERIC_POSITIVE, &[1], Cell::Int(10_000));
    check(0, NUMERIC_POSITIVE, &[12, 5000], Cell::Float(12.5));
    check(-1, NUMERIC_NEGATIVE, &[5], Cell::Float(-0.0005));
    check(-2, NUMERIC_POSITIVE, &[5000], Cell::Float(0.000_05));
    let i64_min = [922, 3372, 368, 5477, 5808];
    check(4, NUMERIC_NEGATIVE, &i64_min, Cell::Int(i64::MIN));
    check(4, NUMERIC_POSITIVE, &i64_min, Cell::Float(9_223_372_036_854_775_808.0));
    check(40, NUMERIC_POSITIVE, &[1], Cell::Float(1e160));
}

#[test]
fn numerics_that_no_number_holds_are_told() {
    for sign in [NUMERIC_INFINITY, NUMERIC_NEGATIVE_INFINITY] {
        assert!(matches!(numeric(&wire(0, sign, &[])), Some(Cell::Float(f)) if f.is_infinite()));
    }
    assert!(matches!(numeric(&wire(0, NUMERIC_NAN, &[])), Some(Cell::Float(f)) if f.is_nan()));
    assert!(matches!(
        numeric(&wire(400, NUMERIC_POSITIVE, &[1])),
        Some(Cell::Unusable(what)) if what.contains("beyond the range")
    ));
    for malformed in [&wire(0, 1, &[]), &wire(0, 0, &[10_000]), &vec![0; 5], &vec![0, 9, 0, 0]] {
        assert_eq!(numeric(malformed), None, "{malformed:?}");
    }
}

#[test]
fn times_count_from_2000() {
    assert_eq!(time(0), Cell::Time(UNIX_EPOCH + Duration::from_secs(946_684_800)));
    let before = -POSTGRES_EPOCH * MICROS;
    assert_eq!(time(before), Cell::Time(UNIX_EPOCH));
    for micros in [before - 1, i64::MIN, i64::MAX] {
        assert!(matches!(time(micros), Cell::Unusable(_)), "{micros}");
    }
}

proptest! {
    #[test]
    fn integers_are_exact(value: i64) {
        let mut digits = Vec::new();
        let mut left = value.unsigned_abs();
        while left > 0 {
            digits.insert(0, (left % 10_000) as u16);
            left /= 10_000;
        }
        let sign = if value < 0 { NUMERIC_NEGATIVE } else { NUMERIC_POSITIVE };
        let weight = digits.len() as i16 - 1;
        prop_assert_eq!(numeric(&wire(weight, sign, &digits)), Some(Cell::Int(value)));
    }

    #[test]
    fn nothing_panics(bytes in proptest::collection::vec(any::<u8>(), 0..80)) {
        let _ = numeric(&bytes);
        for of in [Type::BOOL, Type::INT4, Type::FLOAT8, Type::TIMESTAMPTZ, Type::TEXT, Type::JSON] {
            let _ = Cell::from_sql(&of, &bytes);
        }
    }
}
