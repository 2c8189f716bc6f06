//! Verdicts on monitored equipment: cases, and the silence test.

use std::collections::BTreeSet;
use std::time::Duration;

use busbar_plugin_sdk::testing::{
    AdmittedVerdicts, Drawing, InputGenerator, check_verdicts, draw, host, silence_cases,
};
use busbar_plugin_sdk::{Origin, Reason, Text, Value, ValueKind, Verdict};
use serde_json::{Value as Json, json};

use super::*;

fn overlay(settings: &Json) -> Condition {
    let settings = serde_json::from_value(settings.clone()).expect("settings");
    Condition::create(settings, host()).expect("it is made")
}

fn core_current() -> Json {
    json!({
        "quantities": [{
            "name": "Core current", "role": "core", "unit": "mA", "attention": 100, "alarm": 300,
        }],
        "equipment": ["T1"],
    })
}

fn binding(node_id: &str, role: &str, unit: &str) -> Binding {
    Binding {
        node: 7,
        kind: ValueKind::F64,
        limit_low: None,
        limit_high: None,
        tag_id: format!("{node_id}.{role}"),
        tag_name: String::new(),
        unit: unit.into(),
        node_id: node_id.into(),
        role: role.into(),
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

fn drawn(settings: &Json, bindings: Vec<Binding>, values: &[TagValue]) -> Drawing {
    draw(&mut overlay(settings), bindings, values).expect("it draws")
}

#[test]
fn units_of_tags_are_converted_to_that_of_the_thresholds() {
    for (unit, value, expected, is_assumed) in [
        ("A", 0.0999, Verdict::Normal, false),
        ("A", 0.1, Verdict::Abnormal, false),
        ("mA", 99.0, Verdict::Normal, false),
        ("kA", 0.001, Verdict::Abnormal, false),
        ("", 99.0, Verdict::Normal, true),
    ] {
        let drawing = drawn(&core_current(), vec![binding("T1", "core", unit)], &[good(value)]);
        let verdict = drawing.verdict(0).expect("a verdict");
        assert_eq!((verdict.verdict, verdict.is_assumed), (expected, is_assumed), "{value} {unit}");
    }
    let hot = drawn(&core_current(), vec![binding("T1", "core", "A")], &[good(0.35)]);
    assert_eq!(hot.lines[0].text, "350.00 mA");
    assert_eq!(hot.verdicts[0].reason, "Core current: 350.00 mA, alarm from 300");
}

#[test]
fn what_cannot_be_judged_is_a_finding_and_unknown() {
    let mut settings = core_current();
    settings["equipment"] = json!(["T1", "T2", "T3"]);
    settings["untelemetered"] = json!(["T3"]);
    let mut overlay = overlay(&settings);
    let bindings = vec![binding("T1", "core", "bar"), binding("T9", "core", "A")];
    let drawing = draw(&mut overlay, bindings, &[good(1.0), good(0.01)]).expect("it draws");
    let description = overlay.describe();
    assert_eq!(description.equipment, ["T1", "T2", "T3", "T9"]);
    let reasons: Vec<_> = drawing.verdicts.iter().map(|of| (of.verdict, &*of.reason)).collect();
    let expected = [
        (Verdict::Unknown, "T1.core: its unit cannot be converted"),
        (Verdict::Unknown, "no tag has the role of a quantity"),
        (Verdict::Unknown, "declared untelemetered"),
        (Verdict::Normal, ""),
    ];
    assert_eq!(reasons, expected);
    let [unit, silent] = &description.findings[..] else { panic!("{description:?}") };
    assert!(unit.contains("'bar', which cannot be converted to 'mA'; "), "{unit}");
    assert!(silent.starts_with("no tag at 'T2'"), "{silent}");
}

#[test]
fn a_role_without_tags_and_tags_in_several_units_are_findings() {
    let mut overlay = overlay(&core_current());
    overlay.configure(Vec::new()).expect("it takes them");
    assert!(overlay.describe().findings[0].starts_with("no tag has the role 'core'"));
    let mut settings = core_current();
    settings["quantities"][0]["unit"] = json!(null);
    settings["equipment"] = json!(["T1", "T2"]);
    let bindings = || vec![binding("T1", "core", "mA"), binding("T2", "core", "A")];
    let drawing = drawn(&settings, bindings(), &[good(1.0), good(1.0)]);
    assert!(drawing.verdicts.iter().all(|of| of.verdict == Verdict::Unknown), "{drawing:?}");
    let mut torn = self::overlay(&settings);
    torn.configure(bindings()).expect("it takes them");
    assert!(torn.describe().findings[0].contains("in 'mA' and in 'A'; give it the setting `unit`"));
    // Gauge against absolute pressure is no conversion.
    let mut pressure = core_current();
    pressure["quantities"][0]["unit"] = json!("bar(g)");
    let of = |unit| drawn(&pressure, vec![binding("T1", "core", unit)], &[good(1.0)]).verdicts;
    assert_eq!(of("bar(a)")[0].verdict, Verdict::Unknown);
    assert_eq!((of("bar")[0].verdict, of("bar")[0].is_assumed), (Verdict::Normal, true));
    assert_eq!((of("MPa(g)")[0].verdict, of("bar(g)")[0].is_assumed), (Verdict::Normal, false));
}

#[test]
fn a_good_alarm_stands_beside_what_is_not_known_and_zero_has_no_sign() {
    let mut settings = core_current();
    settings["quantities"][0] =
        json!({ "name": "Q", "role": "core", "attention": -0.001, "alarm": 300 });
    let bindings = vec![binding("T1", "core", "mA"), binding("T1", "core", "mA")];
    let stale = TagValue { quality: Quality::Bad(Reason::Stale), ..good(1.0) };
    let drawing = drawn(&settings, bindings, &[stale, good(-0.0009)]);
    assert_eq!(drawing.lines[0].text, "0.00 mA");
    let verdict = drawing.verdict(0).expect("a verdict");
    assert_eq!((verdict.verdict, verdict.basis.as_slice()), (Verdict::Abnormal, &[1][..]));
}

#[test]
fn two_quantities_of_one_role_are_both_judged() {
    let mut settings = core_current();
    let strict =
        json!({ "name": "Strict", "role": "core", "unit": "mA", "attention": 1, "alarm": 2 });
    settings["quantities"].as_array_mut().expect("a list").push(strict);
    let drawing = drawn(&settings, vec![binding("T1", "core", "mA")], &[good(1.5)]);
    assert_eq!(drawing.verdicts[0].reason, "Strict: 1.50 mA, attention from 1");
}

#[test]
fn a_text_is_no_quantity_and_is_told() {
    for word in ["", "20", "LOW"] {
        let word = Some(Value::Text(Text::new(word).expect("it fits")));
        let word = TagValue { value: word, ..good(0.0) };
        for kind in [ValueKind::F64, ValueKind::Text] {
            let text = Binding { kind, ..binding("T1", "core", "mA") };
            let mut overlay = overlay(&core_current());
            let values = std::slice::from_ref(&word);
            let drawing = draw(&mut overlay, vec![text], values).expect("it draws");
            let verdict = &drawing.verdicts[0];
            assert_eq!(
                (verdict.verdict, &*verdict.reason),
                (Verdict::Unknown, "T1.core: no number")
            );
            assert!(drawing.lines.is_empty() && drawing.states.is_empty());
            let findings = overlay.describe().findings;
            assert_eq!(findings.len(), usize::from(kind == ValueKind::Text));
            let is_it =
                |of: &String| of.starts_with("the tag 'T1.core' in the role 'core' at 'T1'");
            assert!(findings.iter().all(is_it), "{findings:?}");
        }
    }
}

/// Units of a tag with the factor to mA; none where there is no conversion.
const UNITS: [(&str, Option<f64>); 5] =
    [("mA", Some(1.0)), ("A", Some(1e3)), ("kA", Some(1e6)), ("", Some(1.0)), ("°C", None)];

#[test]
fn verdicts_are_never_silent() {
    let values = [-1.0, 0.0, 0.05, 0.1, 0.2, 99.0, 100.0, 250.0, 1e9];
    let mut seen = BTreeSet::new();
    for case in 0..silence_cases() {
        let mut inputs = InputGenerator::new(case);
        let (mut bindings, mut given, mut completions) = (Vec::new(), Vec::new(), vec![false]);
        for _ in 0..inputs.below(4) {
            let (unit, factor) = inputs.choice(&UNITS);
            let value = inputs.choice(&values);
            let (tag, fault) = inputs.input(Value::F64(value));
            bindings.push(binding("T1", "core", unit));
            given.push(tag);
            let possible: Vec<bool> = match factor.filter(|_| fault.is_none()) {
                Some(factor) => vec![value * factor >= 100.0],
                None => vec![false, true],
            };
            completions = completions
                .iter()
                .flat_map(|before| possible.iter().map(move |one| before | one))
                .collect();
        }
        let mut admitted = AdmittedVerdicts::default();
        completions.into_iter().for_each(|one| admitted.add(one));
        let drawing = drawn(&core_current(), bindings, &given);
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
