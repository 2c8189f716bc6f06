use std::time::UNIX_EPOCH;

use super::*;
use crate::simulation::{Behavior, Signal, SignalShape};
use crate::{DoublePoint, Value, ValueKind};

const BEGUN: u64 = 1_000_000;

fn seconds(seconds: u64) -> Duration {
    Duration::from_secs(seconds)
}

fn scenario(events: &[(u64, ScenarioEvent)]) -> Scenario {
    let mut scenario = Scenario::new(UNIX_EPOCH + seconds(BEGUN));
    for &(at, event) in events {
        scenario.push(seconds(at), event).expect("in order");
    }
    scenario
}

fn to(value: f64, over: u64) -> ScenarioEvent {
    ScenarioEvent::Value { value, over: seconds(over) }
}

fn signal(kind: ValueKind, base: f64) -> Signal {
    let behavior = Behavior::new(SignalShape::Constant, base, 0.0, seconds(1)).expect("measures");
    Signal::new(1, "tag", kind, behavior).expect("a signal")
}

#[test]
fn a_value_goes_its_way_from_where_it_is() {
    let events = [(10, to(100.0, 20)), (20, to(0.0, 5)), (40, ScenarioEvent::Release)];
    let signal = signal(ValueKind::F64, 50.0).with_scenario(scenario(&events)).expect("fits");
    let at = |since: u64| signal.at(UNIX_EPOCH + seconds(BEGUN + since));
    // Half of the way to 100 is 75; from there it goes to 0 in 5 s, 15 a second.
    for (since, value) in [
        (0, 50.0),
        (10, 50.0),
        (14, 60.0),
        (20, 75.0),
        (21, 60.0),
        (25, 0.0),
        (39, 0.0),
        (40, 50.0),
    ] {
        assert_eq!(at(since), Value::F64(value), "after {since} s");
    }
    assert_eq!(signal.at(UNIX_EPOCH), Value::F64(50.0), "before it began");
    assert_eq!(signal.range(), (0.0, 100.0));
}

#[test]
fn states_jump() {
    let events = [(1, to(0.0, 0)), (2, to(1.0, 0)), (3, ScenarioEvent::Release)];
    let signal =
        signal(ValueKind::DoublePoint, 2.0).with_scenario(scenario(&events)).expect("fits");
    let at = |since: u64| signal.at(UNIX_EPOCH + seconds(BEGUN + since));
    let [on, between, off] = [DoublePoint::On, DoublePoint::Intermediate, DoublePoint::Off];
    for (since, point) in [(0, on), (1, between), (2, off), (3, on)] {
        assert_eq!(at(since), Value::DoublePoint(point), "after {since} s");
    }
}

#[test]
fn what_cannot_be_is_refused() {
    let refused = |kind, event| signal(kind, 0.0).with_scenario(scenario(&[(1, event)])).is_err();
    assert!(refused(ValueKind::Bool, to(2.0, 0)));
    assert!(refused(ValueKind::Bool, to(1.0, 3)));
    assert!(refused(ValueKind::DoublePoint, to(4.0, 0)));
    assert!(refused(ValueKind::DoublePoint, to(0.5, 0)));
    assert!(!refused(ValueKind::DoublePoint, to(3.0, 0)));
    let mut late = scenario(&[(5, to(1.0, 0))]);
    assert!(late.push(seconds(4), to(1.0, 0)).is_err());
}
