//! Words of the vocabulary in JSON, as configurations, audit logs and plugins write them.
#![cfg(feature = "serde")]

use busbar_types::{
    AlarmState, DoublePoint, FaultKind, Pattern, Priority, Quality, QualityLevel, Reason, Severity,
    SignalShape, Text, Value, ValueKind,
};
use serde::Serialize;
use serde::de::DeserializeOwned;

#[track_caller]
fn check<T: Serialize + DeserializeOwned + PartialEq + std::fmt::Debug>(value: T, expected: &str) {
    let text = serde_json::to_string(&value).expect("it is JSON");
    assert_eq!(text, expected);
    assert_eq!(serde_json::from_str::<T>(&text).expect("it can be read"), value);
}

#[test]
fn audit_logs_have_values_by_the_names_of_their_types() {
    check(Value::F64(1.5), r#"{"F64":1.5}"#);
    check(Value::I64(-2), r#"{"I64":-2}"#);
    check(Value::Bool(true), r#"{"Bool":true}"#);
    check(Value::DoublePoint(DoublePoint::BadState), r#"{"DoublePoint":"BadState"}"#);
    check(Value::Text(Text::new("AUTO").unwrap()), r#"{"Text":"AUTO"}"#);
    let long = format!(r#"{{"Text":"{}"}}"#, "x".repeat(256));
    assert!(serde_json::from_str::<Value>(&long).unwrap_err().to_string().contains("255 bytes"));
    check(AlarmState::ReturnedUnacknowledged, r#""D""#);
    check(Quality::Bad(Reason::OutOfRange), r#"{"Bad":"OutOfRange"}"#);
}

#[test]
fn configurations_and_plugins_have_words_in_lower_case() {
    for kind in
        [ValueKind::F64, ValueKind::I64, ValueKind::Bool, ValueKind::DoublePoint, ValueKind::Text]
    {
        check(kind, &format!("\"{}\"", kind.name()));
    }
    check(ValueKind::DoublePoint, r#""double_point""#);
    for priority in Priority::ALL {
        check(priority, &format!("\"{}\"", priority.name()));
    }
    for fault in FaultKind::ALL {
        check(fault, &format!("\"{}\"", fault.name()));
    }
    check(FaultKind::HalfOpen, r#""half-open""#);
    check(QualityLevel::Uncertain, r#""uncertain""#);
    check(Pattern::Crossed, r#""crossed""#);
    check(Severity::Warning, r#""warning""#);
    check(SignalShape::Walk, r#""walk""#);
}

#[test]
fn words_of_positions_are_those_of_settings() {
    let words = ["intermediate", "off", "on", "bad_state"];
    let positions = words.map(DoublePoint::from_name);
    assert_eq!(positions.map(|position| position.map(DoublePoint::bits)), [0, 1, 2, 3].map(Some));
    assert_eq!(DoublePoint::from_name("On"), None);
}
