use super::*;

const START: u64 = 1_700_000_000_000;

fn signal(shape: SignalShape, kind: ValueKind, period_seconds: f64) -> Signal {
    let period = Duration::from_secs_f64(period_seconds);
    let behavior = Behavior::new(shape, 50.0, 10.0, period).unwrap();
    Signal::new(7, "T1.TopOil", kind, behavior).unwrap()
}

fn at(millis: u64) -> SystemTime {
    UNIX_EPOCH + Duration::from_millis(START + millis)
}

fn number(signal: &Signal, millis: u64) -> f64 {
    match signal.at(at(millis)) {
        Value::F64(value) => value,
        Value::I64(value) => value as f64,
        other => panic!("{other:?}"),
    }
}

#[test]
fn numbers_stay_in_range_and_keep_their_slope() {
    for shape in [
        SignalShape::Constant,
        SignalShape::Sine,
        SignalShape::Walk,
        SignalShape::Steps,
        SignalShape::Counter,
    ] {
        for kind in [ValueKind::F64, ValueKind::I64] {
            let signal = signal(shape, kind, 4.0);
            let (low, high) = signal.range();
            let values: Vec<_> = (0..20_000).map(|i| number(&signal, 10 * i)).collect();
            assert!(values.iter().all(|v| (low..=high).contains(v)), "{shape:?} {kind:?}");
            let (least, most) = values
                .iter()
                .fold((f64::MAX, f64::MIN), |(least, most), &v| (v.min(least), v.max(most)));
            let uses_range = most - least >= 0.8 * (high - low);
            assert!(uses_range, "{shape:?} {kind:?}: {least} to {most} of {low} to {high}");
            if let Some(slope) = signal.max_slope() {
                let steepest =
                    values.windows(2).map(|w| (w[1] - w[0]).abs() / 0.01).fold(0.0, f64::max);
                assert!(steepest <= slope + 1e-9, "{shape:?}: {steepest} of {slope}");
                assert!(steepest >= 0.5 * slope, "{shape:?}: {steepest} of {slope}");
            }
        }
    }
}

#[test]
fn seed_and_id_make_the_difference() {
    let behavior = Behavior::new(SignalShape::Walk, 0.0, 1.0, Duration::from_secs(1)).unwrap();
    let of = |seed, id| Signal::new(seed, id, ValueKind::F64, behavior).unwrap().at(at(12_345));
    assert_eq!(of(1, "a"), of(1, "a"));
    assert_ne!(of(1, "a"), of(2, "a"));
    assert_ne!(of(1, "a"), of(1, "b"));
}

/// Pins the values across releases; the numbers are those of a Python program after the same
/// formulas.
#[test]
fn values_are_those_of_the_first_release() {
    let value = |shape| number(&signal(shape, ValueKind::F64, 60.0), 0);
    let found =
        [SignalShape::Sine, SignalShape::Walk, SignalShape::Steps, SignalShape::Counter].map(value);
    let first = FIRST_RELEASE;
    for (found, first) in found.iter().zip(first) {
        assert!((found - first).abs() < 1e-9, "{found:?} {first}");
    }
}
const FIRST_RELEASE: [f64; 4] = [46.81824991058319, 46.26188967391693, 47.50435394317631, 56.0];

#[test]
fn a_counter_counts_and_begins_anew() {
    let counter = signal(SignalShape::Counter, ValueKind::I64, 1.0);
    let counts: Vec<_> = (0..30).map(|second| number(&counter, 1000 * second)).collect();
    for pair in counts.windows(2) {
        let next = if pair[0] == 60.0 { 50.0 } else { pair[0] + 1.0 };
        assert_eq!(pair[1], next, "{counts:?}");
    }
}

#[test]
fn a_switch_travels_before_it_arrives() {
    let switch = signal(SignalShape::Steps, ValueKind::DoublePoint, 10.0);
    let at = |millis| match switch.at(at(millis)) {
        Value::DoublePoint(position) => position,
        other => panic!("{other:?}"),
    };
    let (mut seen, mut changes) = (Vec::new(), 0);
    for period in 1..200 {
        let [before, begin, travelling, there, end] = [
            10_000 * period - 1,
            10_000 * period,
            10_000 * period + 1_999,
            10_000 * period + 2_000,
            10_000 * period + 9_999,
        ]
        .map(at);
        assert_eq!(there, end, "a position is held");
        assert_ne!(end, DoublePoint::BadState);
        if before == end {
            assert_eq!([begin, travelling], [end; 2]);
        } else {
            assert_eq!([begin, travelling], [DoublePoint::Intermediate; 2]);
            changes += 1;
        }
        seen.push(end);
    }
    assert!((60..140).contains(&changes), "{changes}");
    assert!(seen.contains(&DoublePoint::On) && seen.contains(&DoublePoint::Off));
}

#[test]
fn constants_are_their_base() {
    let of = |base, kind| {
        let behavior =
            Behavior::new(SignalShape::Constant, base, 0.0, Duration::from_secs(1)).unwrap();
        Signal::new(1, "a", kind, behavior).unwrap().at(at(0))
    };
    assert_eq!(of(2.0, ValueKind::DoublePoint), Value::DoublePoint(DoublePoint::On));
    assert_eq!(of(3.0, ValueKind::DoublePoint), Value::DoublePoint(DoublePoint::BadState));
    assert_eq!(of(0.0, ValueKind::Bool), Value::Bool(false));
    assert_eq!(of(1.0, ValueKind::Bool), Value::Bool(true));
    assert_eq!(of(9.4, ValueKind::I64), Value::I64(9));
}

#[test]
fn what_cannot_move_so_is_refused() {
    let second = Duration::from_secs(1);
    for (base, amplitude, period) in [
        (f64::NAN, 1.0, second),
        (0.0, -1.0, second),
        (0.0, f64::INFINITY, second),
        (0.0, 1.0, Duration::ZERO),
        (0.0, 1.0, Duration::MAX),
    ] {
        assert!(
            Behavior::new(SignalShape::Sine, base, amplitude, period).is_err(),
            "{base} {amplitude}"
        );
    }
    let sine = Behavior::new(SignalShape::Sine, 0.0, 1.0, second).unwrap();
    for kind in [ValueKind::Bool, ValueKind::DoublePoint] {
        let fault = Signal::new(1, "Q1", kind, sine).unwrap_err();
        assert!(fault.message().contains("'Q1'"), "{fault}");
    }
}
