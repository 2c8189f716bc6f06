//! Verdicts by limits: cases, and the silence test.

use std::collections::BTreeSet;
use std::time::Duration;

use busbar_plugin_sdk::testing::{
    AdmittedVerdicts, DrawnVerdict, InputGenerator, check_verdicts, draw, host, silence_cases,
};
use busbar_plugin_sdk::{Origin, Overlay, Plugin, Text, Verdict};

use super::*;
use crate::PowerOverlay;

fn binding(id: &str, role: &str, kind: ValueKind, limits: [Option<f64>; 2]) -> Binding {
    Binding {
        node: 1,
        kind,
        limit_low: limits[0],
        limit_high: limits[1],
        tag_id: id.into(),
        tag_name: "Top oil".into(),
        unit: "°C".into(),
        node_id: "T1".into(),
        role: role.into(),
    }
}

fn oil() -> Binding {
    binding("T1.TopOil", "value", ValueKind::F64, [Some(10.0), Some(95.0)])
}

fn tag(value: Value, quality: Quality) -> TagValue {
    TagValue { value: Some(value), quality, age: Duration::ZERO, origin: Origin::LIVE }
}

fn good(value: f64) -> TagValue {
    tag(Value::F64(value), Quality::Good)
}

fn text(text: &str) -> Value {
    Value::Text(Text::new(text).expect("it fits"))
}

fn overlay() -> PowerOverlay {
    PowerOverlay::create(crate::Settings::default(), host()).expect("it is made")
}

/// Returns the only verdict on these values.
fn verdict(bindings: Vec<Binding>, values: &[TagValue]) -> DrawnVerdict {
    let drawing = draw(&mut overlay(), bindings, values).expect("it draws");
    let [verdict] = drawing.verdicts.as_slice() else { panic!("{drawing:?}") };
    verdict.clone()
}

#[test]
fn severity_follows_band_and_role() {
    let check = |role, value, expected| {
        let binding = binding("T", role, ValueKind::F64, [Some(10.0), Some(95.0)]);
        assert_eq!(severity(&binding, &value), expected, "{role} {value:?}");
    };
    check("value", Value::F64(95.0), Severity::Normal);
    check("value", Value::F64(95.1), Severity::Warning);
    check("value", Value::I64(9), Severity::Warning);
    check("alarm", Value::F64(120.0), Severity::Alarm);
    check("alarm", Value::Bool(true), Severity::Alarm);
    check("value", Value::Bool(true), Severity::Normal);
    check("value", Value::DoublePoint(DoublePoint::BadState), Severity::Warning);
    check("value", Value::DoublePoint(DoublePoint::Intermediate), Severity::Normal);
    check("alarm", text("120"), Severity::Normal);
}

#[test]
fn every_piece_that_bindings_name_is_described_once() {
    let mut overlay = overlay();
    let of = |id: &str| Binding { node_id: id.into(), ..oil() };
    overlay.configure(vec![of("B"), of("A"), of("B")]).expect("it takes them");
    assert_eq!(overlay.describe().equipment, ["B", "A"]);
    overlay.configure(Vec::new()).expect("it takes them");
    assert!(overlay.describe().equipment.is_empty());
}

#[test]
fn limits_decide_and_what_is_not_known_is_unknown_with_tag_and_reason() {
    let of = |value| verdict(vec![oil()], &[value]);
    assert_eq!((of(good(61.0)).verdict, of(good(61.0)).is_assumed), (Verdict::Normal, false));
    let hot = of(good(97.14));
    assert_eq!(hot.verdict, Verdict::Abnormal);
    assert_eq!(hot.reason, "T1.TopOil: 97.1 °C, above 95");
    assert_eq!(of(good(9.0)).reason, "T1.TopOil: 9.00 °C, below 10");
    let zero = Binding { limit_low: Some(-0.0), ..oil() };
    assert_eq!(verdict(vec![zero], &[good(-0.001)]).reason, "T1.TopOil: 0.00 °C, below 0");
    let none = TagValue { value: None, ..good(0.0) };
    for (value, words) in [
        (tag(Value::F64(61.0), Quality::Bad(Reason::Stale)), "stale"),
        (tag(Value::F64(99.0), Quality::Bad(Reason::Sensor)), "bad"),
        (tag(Value::F64(61.0), Quality::Uncertain(Reason::Unknown)), "uncertain"),
        (none, "no value yet"),
        (good(f64::NAN), "not a finite number"),
        (good(f64::INFINITY), "not a finite number"),
        (tag(Value::Bool(false), Quality::Good), "a value of another type than the tag's"),
        (tag(text("61"), Quality::Good), "a value of another type than the tag's"),
    ] {
        let unknown = of(value);
        assert_eq!(unknown.verdict, Verdict::Unknown, "{words}");
        assert_eq!(unknown.reason, format!("T1.TopOil: {words}"));
        assert_eq!(unknown.basis, [0]);
    }
}

#[test]
fn what_is_abnormal_for_sure_stands_beside_what_is_not_known() {
    let alarm = binding("T1.Buchholz", "alarm", ValueKind::Bool, [None; 2]);
    let stale = tag(Value::F64(61.0), Quality::Bad(Reason::Stale));
    let tripped = tag(Value::Bool(true), Quality::Good);
    let of = verdict(vec![oil(), alarm.clone()], &[stale, tripped.clone()]);
    assert_eq!((of.verdict, of.basis), (Verdict::Abnormal, vec![1]));
    assert_eq!(of.reason, "T1.Buchholz: on");
    let of = verdict(vec![oil(), alarm.clone()], &[good(96.0), tripped]);
    assert_eq!((of.basis, of.reason.ends_with(", and 1 more")), (vec![0, 1], true));
    let of = verdict(vec![oil(), alarm], &[good(61.0), tag(Value::Bool(false), Quality::Good)]);
    assert_eq!((of.verdict, of.basis), (Verdict::Normal, vec![0, 1]));
}

#[test]
fn silence_of_limits_is_no_health() {
    let plain = || binding("T1.Tap", "tap", ValueKind::I64, [None; 2]);
    let of = verdict(vec![plain()], &[tag(Value::I64(7), Quality::Good)]);
    assert_eq!((of.verdict, of.is_assumed), (Verdict::Normal, true));
    assert_eq!(of.reason, "assumed: no limits are configured");
    let of = verdict(vec![plain()], &[tag(Value::I64(7), Quality::Bad(Reason::Stale))]);
    assert_eq!((of.verdict, of.reason.as_str()), (Verdict::Unknown, "T1.Tap: stale"));
    // A value without limits is not needed where another has some.
    let stale = tag(Value::I64(7), Quality::Bad(Reason::Stale));
    let of = verdict(vec![plain(), oil()], &[stale, good(61.0)]);
    assert_eq!((of.verdict, of.is_assumed, of.basis), (Verdict::Normal, false, vec![1]));
}

/// Returns a binding with a criterion of its own, a value, and all values that it may have.
fn random_tag(inputs: &mut InputGenerator) -> (Binding, Value, Vec<Value>) {
    let texts = ["", "120", "on", "AUTO"].map(text);
    let numbers = [-50.0, -0.001, 0.0, 10.0, 10.5, 95.0, 95.5, 1e300].map(Value::F64);
    let bools = [false, true].map(Value::Bool);
    let points = [0, 1, 2, 3].map(|bits| Value::DoublePoint(DoublePoint::from_bits(bits)));
    let (kind, all) = match inputs.below(4) {
        0 => (ValueKind::F64, numbers.to_vec()),
        1 => (ValueKind::Bool, bools.to_vec()),
        2 => (ValueKind::DoublePoint, points.to_vec()),
        _ => (ValueKind::Text, texts.to_vec()),
    };
    let role = inputs.choice(&["value", "alarm"]);
    let limits = [inputs.choice(&[None, Some(10.0)]), inputs.choice(&[None, Some(95.0)])];
    let value = all[inputs.below(all.len())].clone();
    (binding("T", role, kind, limits), value, all)
}

/// Reference rule: a tag is abnormal outside its limits, on as an alarm, or in a bad state. A text
/// never is, and what it says as an alarm is not known.
fn is_abnormal(binding: &Binding, value: &Value) -> [bool; 2] {
    let low = binding.limit_low.unwrap_or(f64::NEG_INFINITY);
    let high = binding.limit_high.unwrap_or(f64::INFINITY);
    let is_abnormal = match value {
        Value::F64(value) => !(low..=high).contains(value),
        Value::I64(_) => unreachable!("none is made"),
        Value::Bool(value) => *value && binding.role == "alarm",
        Value::DoublePoint(point) => *point == DoublePoint::BadState,
        Value::Text(_) => return [false, binding.role == "alarm"],
    };
    [is_abnormal; 2]
}

#[test]
fn verdicts_are_never_silent() {
    let mut seen = BTreeSet::new();
    for case in 0..silence_cases() {
        let mut inputs = InputGenerator::new(case);
        let count = 1 + inputs.below(4);
        let tags: Vec<_> = (0..count).map(|_| random_tag(&mut inputs)).collect();
        let (mut values, mut completions) = (Vec::new(), vec![false]);
        let mut is_any_known = false;
        for (binding, value, all) in &tags {
            let (given, fault) = inputs.input(value.clone());
            is_any_known |= fault.is_none();
            let possible = if fault.is_none() { std::slice::from_ref(value) } else { all };
            let of_tag: Vec<bool> =
                possible.iter().flat_map(|one| is_abnormal(binding, one)).collect();
            completions = completions
                .iter()
                .flat_map(|before| of_tag.iter().map(move |one| before | one))
                .collect();
            values.push(given);
        }
        let mut admitted = AdmittedVerdicts::default();
        completions.into_iter().for_each(|one| admitted.add(one));
        let bindings: Vec<Binding> = tags.into_iter().map(|(binding, ..)| binding).collect();
        let has_limits = bindings.iter().any(has_criterion);
        let drawing = draw(&mut overlay(), bindings, &values).expect("it draws");
        let story = format!("case {case}");
        check_verdicts(&drawing, 1, &values, &story);
        if has_limits || is_any_known {
            admitted.check(&drawing, 0, &story);
        } else {
            // Nothing at all is known of it.
            assert_eq!(drawing.verdicts[0].verdict, Verdict::Unknown, "{story}");
        }
        assert_eq!(drawing.verdicts[0].is_assumed, !has_limits && is_any_known, "{story}");
        seen.insert(drawing.verdicts[0].verdict);
    }
    assert_eq!(seen.len(), 3, "each verdict is met: {seen:?}");
}

#[test]
fn an_abnormal_verdict_is_a_warning_only_where_no_alarm_can_be() {
    use busbar_plugin_sdk::VerdictSeverity::{Alarm, PerhapsAlarm, Warning};
    let trip = || binding("T1.Trip", ALARM_ROLE, ValueKind::Bool, [None; 2]);
    let bad = Quality::Bad(Reason::Communication);
    for (tripped, quality, expected) in [
        (false, Quality::Good, Warning),
        (true, bad, PerhapsAlarm),
        (false, bad, PerhapsAlarm),
        (true, Quality::Good, Alarm),
    ] {
        let values = [good(96.0), tag(Value::Bool(tripped), quality)];
        let found = verdict(vec![oil(), trip()], &values);
        assert_eq!((found.verdict, found.severity), (Verdict::Abnormal, expected), "{found:?}");
    }
}

#[test]
fn a_text_is_a_line_of_its_label_and_decides_nothing() {
    let mode = || binding("T1.Mode", "mode", ValueKind::Text, [Some(10.0), Some(95.0)]);
    let drawn = |value: TagValue| draw(&mut overlay(), vec![mode()], &[value]).expect("it draws");
    for word in ["AUTO", "120", "on"] {
        let drawing = drawn(tag(text(word), Quality::Good));
        let [line] = drawing.lines.as_slice() else { panic!("{drawing:?}") };
        assert_eq!((line.node, line.severity), (1, Severity::Normal));
        assert_eq!((line.caption.as_str(), line.text.as_str()), ("Top oil", word), "without unit");
        assert!(drawing.tints.is_empty());
        let verdict = &drawing.verdicts[0];
        assert_eq!((verdict.verdict, verdict.is_assumed), (Verdict::Normal, true));
    }
    // The last text stays: the host marks it.
    let stale = drawn(tag(text("AUTO"), Quality::Bad(Reason::Stale)));
    assert_eq!(stale.lines[0].text, "AUTO");
    assert_eq!(stale.verdicts[0].reason, "T1.Mode: stale");
    assert_eq!(drawn(TagValue { value: None, ..good(0.0) }).lines[0].text, "–");
    let number = drawn(good(99.0));
    assert_eq!(number.verdicts[0].reason, "T1.Mode: a value of another type than the tag's");
    assert_eq!(number.lines[0].severity, Severity::Normal, "a text has no limits");
    // The longest text is not cut.
    let longest = "é".repeat(127);
    assert_eq!(drawn(tag(text(&longest), Quality::Good)).lines[0].text, longest);
    let both = verdict(vec![mode(), oil()], &[tag(text("AUTO"), Quality::Good), good(96.0)]);
    assert_eq!((both.verdict, both.basis), (Verdict::Abnormal, vec![1]));
}

#[test]
fn an_alarm_in_words_is_told() {
    let alarm = || binding("T1.Last", ALARM_ROLE, ValueKind::Text, [None; 2]);
    let mut overlay = overlay();
    let values = [good(61.0), tag(text("no alarm"), Quality::Good)];
    let drawing = draw(&mut overlay, vec![oil(), alarm()], &values).expect("it draws");
    let verdict = &drawing.verdicts[0];
    assert_eq!((verdict.verdict, &*verdict.basis), (Verdict::Unknown, &[1][..]));
    assert_eq!(verdict.reason, "T1.Last: a text, which is neither on nor off");
    let findings = overlay.describe().findings;
    let [finding] = findings.as_slice() else { panic!("{findings:?}") };
    assert!(finding.starts_with("the tag 'T1.Last' in the role 'alarm' at 'T1' is a text"));
    assert!(finding.ends_with("; bind it in another role"), "{finding}");
    let values = [good(96.0), tag(text(""), Quality::Good)];
    let hot = draw(&mut overlay, vec![oil(), alarm()], &values).expect("it draws");
    let severity = hot.verdicts[0].severity;
    assert_eq!(severity, VerdictSeverity::PerhapsAlarm, "an alarm is not excluded");
    overlay.configure(vec![oil()]).expect("it takes them");
    assert!(overlay.describe().findings.is_empty());
}
