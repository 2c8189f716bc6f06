//! Verdicts by the band: cases, and the silence test.

use std::collections::BTreeSet;
use std::time::Duration;

use busbar_plugin_sdk::testing::{
    AdmittedVerdicts, Drawing, DrawnQuantity, InputGenerator, check_verdicts, draw, host,
    silence_cases,
};
use busbar_plugin_sdk::{Origin, Quality, Reason, Text, Value, ValueKind, Verdict};
use serde_json::{Value as Json, json};

use super::*;

fn settings() -> Json {
    json!({
        "name": "Contacts", "unit": "°C", "role": "contact", "equipment": ["A"],
        "reach_metres": 6, "low": -30, "high": 70, "step": 10,
    })
}

fn overlay(settings: &Json) -> Contour {
    let settings = serde_json::from_value(settings.clone()).expect("settings");
    Contour::create(settings, host()).expect("it is made")
}

fn binding(unit: &str) -> Binding {
    Binding {
        node: 7,
        kind: ValueKind::F64,
        limit_low: None,
        limit_high: None,
        tag_id: "A.T".into(),
        tag_name: String::new(),
        unit: unit.into(),
        node_id: "A".into(),
        role: "contact".into(),
    }
}

fn good(value: f64) -> TagValue {
    TagValue {
        value: Some(Value::F64(value)),
        quality: Quality::Good,
        age: Duration::ZERO,
        origin: Origin::LIVE,
    }
}

fn drawn(bindings: Vec<Binding>, values: &[TagValue]) -> Drawing {
    draw(&mut overlay(&settings()), bindings, values).expect("it draws")
}

#[track_caller]
fn check(unit: &str, value: TagValue, expected: (Verdict, bool), reason: &str) -> Drawing {
    let drawing = drawn(vec![binding(unit)], &[value]);
    let verdict = drawing.verdict(0).expect("a verdict");
    assert_eq!((verdict.verdict, verdict.is_assumed), expected, "{verdict:?}");
    assert_eq!(verdict.reason, reason);
    drawing
}

#[test]
fn levels_are_converted_and_judged_by_the_band() {
    use Verdict::{Abnormal, Normal};
    check("°C", good(70.0), (Normal, false), "");
    check("°C", good(70.1), (Abnormal, false), "A.T: 70.10 °C, above 70");
    let drawing = check("°F", good(162.5), (Abnormal, false), "A.T: 72.50 °C, above 70");
    let [DrawnQuantity::Level([0, 0], level)] = drawing.quantities[..] else { panic!() };
    assert!((level - 72.5).abs() < 1e-9, "{level}");
    check("°F", good(100.0), (Normal, false), "");
    check("K", good(240.0), (Abnormal, false), "A.T: -33.15 °C, below -30");
    check("", good(20.0), (Normal, true), "assumed: A.T is in °C");
}

#[test]
fn what_is_no_level_is_unknown_and_not_drawn_as_zero() {
    let unknown = (Verdict::Unknown, false);
    let drawing = check("°C", good(f64::NAN), unknown, "A.T: not a finite number");
    assert!(drawing.quantities.is_empty(), "a good zero would be a lie");
    let drawing = check("bar", good(20.0), unknown, "A.T: its unit cannot be converted");
    assert!(drawing.quantities.is_empty());
    let stale = TagValue { quality: Quality::Bad(Reason::Stale), ..good(20.0) };
    assert_eq!(check("°C", stale, unknown, "A.T: stale").quantities.len(), 1, "the host marks it");
}

#[test]
fn what_bindings_lack_is_a_finding_unless_it_is_declared() {
    let mut settings = settings();
    settings["equipment"] = json!(["A", "B", "C", "B"]);
    settings["untelemetered"] = json!(["C"]);
    let mut overlay = overlay(&settings);
    let drawing = draw(&mut overlay, vec![binding("bar")], &[good(1.0)]).expect("it draws");
    let description = overlay.describe();
    assert_eq!(description.equipment, ["A", "B", "C"]);
    let [unit, role] = &description.findings[..] else { panic!("{description:?}") };
    assert!(unit.contains("'bar', which cannot be converted to '°C'; "), "{unit}");
    assert!(role.starts_with("no tag at 'B' has the role 'contact'; "), "{role}");
    let reasons: Vec<&str> = drawing.verdicts.iter().map(|of| of.reason.as_str()).collect();
    assert_eq!(reasons[1..], ["no tag has the role 'contact'", "declared untelemetered"]);
    assert!(drawing.verdicts.iter().all(|of| of.verdict == Verdict::Unknown));
}

#[test]
fn a_text_is_no_level_and_is_told() {
    let unknown = (Verdict::Unknown, false);
    for word in ["", "20", "LOW"] {
        let word = Some(Value::Text(Text::new(word).expect("it fits")));
        let word = TagValue { value: word, ..good(0.0) };
        let drawing = check("°C", word.clone(), unknown, "A.T: no number");
        assert!(drawing.quantities.is_empty() && drawing.lines.is_empty());
        let text = Binding { kind: ValueKind::Text, ..binding("") };
        let mut overlay = overlay(&settings());
        let drawing = draw(&mut overlay, vec![text], &[word]).expect("it draws");
        assert_eq!(drawing.verdicts[0].verdict, Verdict::Unknown);
        assert_eq!(drawing.verdicts[0].reason, "A.T: no number");
        assert!(drawing.quantities.is_empty(), "a good zero would be a lie");
        let findings = overlay.describe().findings;
        let [finding] = findings.as_slice() else { panic!("{findings:?}") };
        assert!(finding.starts_with("the tag 'A.T' in the role 'contact' at 'A' is no number; "));
    }
}

/// Conversion of a unit to °C; none where there is none.
type Conversion = Option<fn(f64) -> f64>;

const UNITS: [(&str, Conversion); 5] = [
    ("°C", Some(|value| value)),
    ("°F", Some(|value| (value - 32.0) / 1.8)),
    ("K", Some(|value| value - 273.15)),
    ("", Some(|value| value)),
    ("kPa", None),
];

#[test]
fn verdicts_are_never_silent() {
    let values = [-1e9, -31.0, -1.0, -0.0, 20.0, 69.0, 71.0, 200.0, 300.0, 400.0];
    let mut seen = BTreeSet::new();
    for case in 0..silence_cases() {
        let mut inputs = InputGenerator::new(case);
        let (mut bindings, mut given, mut completions) = (Vec::new(), Vec::new(), vec![false]);
        for _ in 0..inputs.below(4) {
            let (unit, convert) = inputs.choice(&UNITS);
            let value = inputs.choice(&values);
            let (tag, fault) = inputs.input(Value::F64(value));
            bindings.push(binding(unit));
            given.push(tag);
            let possible: Vec<bool> = match convert.filter(|_| fault.is_none()) {
                Some(convert) => vec![!(-30.0..=70.0).contains(&convert(value))],
                None => vec![false, true],
            };
            completions = completions
                .iter()
                .flat_map(|before| possible.iter().map(move |one| before | one))
                .collect();
        }
        let mut admitted = AdmittedVerdicts::default();
        completions.into_iter().for_each(|one| admitted.add(one));
        let drawing = drawn(bindings, &given);
        let story = format!("case {case}");
        check_verdicts(&drawing, 1, &given, &story);
        if given.is_empty() {
            assert_eq!(drawing.verdicts[0].verdict, Verdict::Unknown, "{story}");
        } else {
            admitted.check(&drawing, 0, &story);
        }
        seen.insert(drawing.verdicts[0].verdict);
    }
    assert_eq!(seen.len(), 3, "each verdict is met: {seen:?}");
}
