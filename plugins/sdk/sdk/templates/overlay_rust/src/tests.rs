//! Lines, tints and verdicts drawn for values.

use std::time::Duration;

use busbar_plugin_sdk::testing::{draw, host};
use busbar_plugin_sdk::{Origin, Quality, Reason, ValueKind, Verdict};

use super::*;

fn binding() -> Binding {
    Binding {
        node: 7,
        kind: ValueKind::F64,
        limit_low: Some(0.0),
        limit_high: Some(95.0),
        tag_id: "T1.Oil".into(),
        tag_name: "Oil".into(),
        unit: "°C".into(),
        node_id: "T1".into(),
        role: "value".into(),
    }
}

/// Returns the text, and the severity of the tint, for a value.
fn drawn(value: Option<f64>) -> (String, Option<Severity>) {
    let mut overlay = MyPlugin::create(Settings::default(), host()).unwrap();
    let value = value.map(Value::F64);
    let state =
        TagValue { value, quality: Quality::Good, age: Duration::ZERO, origin: Origin::LIVE };
    let drawing = draw(&mut overlay, vec![binding()], &[state]).unwrap();
    let [line] = drawing.lines.as_slice() else { panic!("{drawing:?}") };
    assert_eq!((line.node, line.caption.as_str()), (7, "Oil"));
    let tint = drawing.tints.first();
    (line.text.clone(), tint.map(|(_, severity)| *severity))
}

#[test]
fn values_are_shown_and_the_abnormal_is_coloured() {
    assert_eq!(drawn(Some(61.52)), ("61.5 °C".into(), None));
    assert_eq!(drawn(Some(95.1)), ("95.1 °C".into(), Some(Severity::Warning)));
    assert_eq!(drawn(Some(-0.01)), ("0.0 °C".into(), Some(Severity::Warning)));
    assert_eq!(drawn(None), ("–".into(), None));
}

/// Returns the verdict on the equipment, and its reason.
fn verdict(value: Option<f64>, quality: Quality, limit_high: Option<f64>) -> (Verdict, String) {
    let mut overlay = MyPlugin::create(Settings::default(), host()).unwrap();
    let state = TagValue {
        value: value.map(Value::F64),
        quality,
        age: Duration::ZERO,
        origin: Origin::LIVE,
    };
    let bindings = vec![Binding { limit_low: None, limit_high, ..binding() }];
    let drawing = draw(&mut overlay, bindings, &[state]).unwrap();
    let verdict = drawing.verdict(0).unwrap();
    (verdict.verdict, verdict.reason.clone())
}

#[test]
fn silence_is_never_taken_for_health() {
    let (good, stale) = (Quality::Good, Quality::Bad(Reason::Stale));
    let limit = Some(95.0);
    assert_eq!(verdict(Some(61.0), good, limit), (Verdict::Normal, String::new()));
    assert_eq!(verdict(Some(96.0), good, limit).0, Verdict::Abnormal);
    assert_eq!(verdict(Some(61.0), stale, limit), (Verdict::Unknown, "T1.Oil is not good".into()));
    assert_eq!(verdict(None, stale, limit).0, Verdict::Unknown);
    assert_eq!(verdict(Some(f64::NAN), good, limit).0, Verdict::Unknown);
    let assumed = "assumed: no limits are configured";
    assert_eq!(verdict(Some(61.0), good, None), (Verdict::Normal, assumed.into()));
}
