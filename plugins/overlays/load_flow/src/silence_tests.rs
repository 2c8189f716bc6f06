//! Verdicts on flows: cases, and the silence test.

use std::collections::BTreeSet;
use std::time::Duration;

use busbar_plugin_sdk::testing::{
    AdmittedVerdicts, Drawing, DrawnQuantity, DrawnVerdict, InputGenerator, check_verdicts, draw,
    host, silence_cases,
};
use busbar_plugin_sdk::{Origin, Quality, Reason, Text, Value, ValueKind};
use serde_json::{Value as Json, json};

use super::*;

const RATING: f64 = 100.0;

fn settings() -> Json {
    let flow = json!({ "measured_at": "A", "from": "A", "to": "B", "rating_mva": RATING });
    json!({ "flows": [flow] })
}

fn line() -> Json {
    let mut settings = settings();
    settings["flows"][0]["other_end"] = json!("Z");
    settings
}

fn overlay(settings: &Json) -> LoadFlow {
    let settings = serde_json::from_value(settings.clone()).expect("settings");
    LoadFlow::create(settings, host()).expect("it is made")
}

fn binding(at: &str, role: &str, unit: &str) -> Binding {
    Binding {
        node: 7,
        kind: ValueKind::F64,
        limit_low: None,
        limit_high: None,
        tag_id: format!("{at}.{}", if role == "active_power" { "P" } else { "Q" }),
        tag_name: String::new(),
        unit: unit.into(),
        node_id: at.into(),
        role: role.into(),
    }
}

fn p(at: &str) -> Binding {
    binding(at, "active_power", "MW")
}

fn q(at: &str) -> Binding {
    binding(at, "reactive_power", "Mvar")
}

fn good(value: f64) -> TagValue {
    TagValue {
        value: Some(Value::F64(value)),
        quality: Quality::Good,
        age: Duration::ZERO,
        origin: Origin::LIVE,
    }
}

fn stale(value: f64) -> TagValue {
    TagValue { quality: Quality::Bad(Reason::Stale), ..good(value) }
}

fn drawn(settings: &Json, bindings: Vec<Binding>, values: &[TagValue]) -> Drawing {
    draw(&mut overlay(settings), bindings, values).expect("it draws")
}

fn verdict(settings: &Json, bindings: Vec<Binding>, values: &[TagValue]) -> DrawnVerdict {
    let drawing = drawn(settings, bindings, values);
    let verdict = drawing.verdict(0).expect("a verdict").clone();
    assert!(drawing.verdicts.iter().all(|other| other.verdict == verdict.verdict), "{drawing:?}");
    verdict
}

#[test]
fn apparent_power_decides_and_active_power_alone_is_assumed_to_be_it() {
    let of = |values: [f64; 2]| verdict(&settings(), vec![p("A"), q("A")], &values.map(good));
    assert_eq!((of([80.0, 59.0]).verdict, of([80.0, 59.0]).is_assumed), (Verdict::Normal, false));
    let over = of([80.0, 61.0]);
    assert_eq!((over.verdict, over.basis), (Verdict::Abnormal, vec![0, 1]));
    assert_eq!(over.reason, "A: 101 MVA, 101 % of the rating of 100 MVA");
    assert_eq!(of([101.0, 0.0]).basis, [0], "the active power alone is above it");
    assert_eq!(of([0.0, -101.0]).basis, [1]);
    let alone = verdict(&settings(), vec![p("A")], &[good(80.0)]);
    assert_eq!((alone.verdict, alone.is_assumed), (Verdict::Normal, true));
    assert_eq!(alone.reason, "assumed: reactive power is not measured");
    let of = |values: [TagValue; 2]| verdict(&settings(), vec![p("A"), q("A")], &values);
    assert_eq!(of([good(80.0), stale(1.0)]).reason, "A.Q: stale");
    assert_eq!(of([good(101.0), stale(1.0)]).verdict, Verdict::Abnormal);
    assert_eq!(of([stale(80.0), good(1.0)]).verdict, Verdict::Unknown);
    let drawing = drawn(&settings(), vec![p("A"), q("A")], &[good(-60.0), good(80.0)]);
    assert_eq!(drawing.quantities, [DrawnQuantity::Flow([0, 0, 1], -1.0)]);
    let texts: Vec<&str> = drawing.lines.iter().map(|line| line.text.as_str()).collect();
    assert_eq!(texts, ["-60.0 MW  100 %", "80.0 Mvar"]);
    let least = drawn(&settings(), vec![p("A"), q("A")], &[good(60.0), stale(80.0)]);
    assert_eq!(least.lines[0].text, "60.0 MW  ≥ 60 %");
}

#[test]
fn two_flows_measured_at_one_place_are_both_shown() {
    let mut settings = settings();
    let second = json!({ "measured_at": "A", "from": "A", "to": "C", "rating_mva": 50 });
    settings["flows"].as_array_mut().expect("a list").push(second);
    let drawing = drawn(&settings, vec![p("A")], &[good(80.0)]);
    let expected = [DrawnQuantity::Flow([0, 0, 1], 0.8), DrawnQuantity::Flow([0, 0, 2], 1.6)];
    assert_eq!(drawing.quantities, expected);
    let captions: Vec<&str> = drawing.lines.iter().map(|line| line.caption.as_str()).collect();
    assert_eq!(captions, ["Active power to B", "Active power to C"]);
    let verdicts: Vec<Verdict> = drawing.verdicts.iter().map(|of| of.verdict).collect();
    use Verdict::{Abnormal, Normal};
    assert_eq!(verdicts, [Abnormal, Normal, Abnormal], "A has both, of which one is abnormal");
    // Each in a role of its own.
    settings["flows"][1]["role"] = json!("active_power_2");
    let bindings = vec![p("A"), binding("A", "active_power_2", "kW")];
    let drawing = drawn(&settings, bindings, &[good(80.0), good(25_000.0)]);
    let expected = [DrawnQuantity::Flow([0, 0, 1], 0.8), DrawnQuantity::Flow([1, 0, 2], 0.5)];
    assert_eq!(drawing.quantities, expected);
}

#[test]
fn both_ends_of_a_line_are_compared() {
    let of = |here, there| verdict(&line(), vec![p("A"), p("Z")], &[here, there]);
    for there in [96.0, -96.0, 91.0] {
        assert_eq!(of(good(96.0), good(there)).verdict, Verdict::Normal, "{there}");
    }
    let apart = of(good(96.0), good(-90.0));
    assert_eq!((apart.verdict, apart.basis), (Verdict::Abnormal, vec![0, 1]));
    assert!(apart.reason.starts_with("ends disagree: A and Z differ by 6.00 MW, more than 5.00"));
    assert!(apart.reason.contains("assumed: at most 5 % of the rating is lost"));
    // With losses and direction set, nothing of that is assumed.
    let mut exact = line();
    exact["flows"][0]["max_loss_percent"] = json!(2);
    exact["flows"][0]["other_end_counts"] = json!("against");
    let of = |there| {
        verdict(&exact, vec![p("A"), q("A"), p("Z")], &[good(50.0), good(1.0), good(there)])
    };
    assert_eq!((of(-49.0).verdict, of(-49.0).is_assumed), (Verdict::Normal, false));
    assert_eq!(of(49.0).verdict, Verdict::Abnormal, "it flows into the line from both ends");
    exact["flows"][0]["other_end_counts"] = json!("along");
    let along = verdict(&exact, vec![p("A"), p("Z")], &[good(50.0), good(49.0)]);
    assert_eq!(along.verdict, Verdict::Normal);
}

#[test]
fn one_end_stands_in_for_the_other_with_a_remark() {
    let bindings = || vec![p("A"), q("A"), p("Z"), q("Z")];
    let of = |values: [TagValue; 4]| verdict(&line(), bindings(), &values);
    let one = of([stale(1.0), good(5.0), good(50.0), good(5.0)]);
    assert_eq!((one.verdict, one.is_assumed, one.basis), (Verdict::Normal, true, vec![2, 3]));
    assert!(one.reason.contains("the other end is as this one, A.P: stale"), "{}", one.reason);
    let over = of([stale(1.0), good(5.0), good(101.0), good(5.0)]);
    assert_eq!((over.verdict, over.basis), (Verdict::Abnormal, vec![2]));
    assert_eq!(of([stale(1.0), good(5.0), good(50.0), stale(5.0)]).verdict, Verdict::Unknown);
    let above = of([stale(1.0), good(80.0), good(85.0), good(5.0)]);
    assert_eq!((above.verdict, above.basis), (Verdict::Abnormal, vec![1, 2]), "in any case");
    // An end without reactive power says nothing of the other one's.
    let of = |values: [TagValue; 3]| verdict(&line(), vec![p("A"), p("Z"), q("Z")], &values);
    assert_eq!(of([good(50.0), good(50.0), stale(5.0)]).verdict, Verdict::Unknown);
    assert_eq!(of([stale(50.0), good(50.0), good(5.0)]).verdict, Verdict::Normal);
}

#[test]
fn what_bindings_lack_is_a_finding_unless_it_is_declared() {
    let findings = |settings: &Json, bindings: Vec<Binding>| {
        let mut overlay = overlay(settings);
        overlay.configure(bindings).expect("it takes them");
        overlay.describe().findings
    };
    let none = findings(&line(), Vec::new());
    assert_eq!(none.len(), 2);
    assert!(none[1].starts_with("no tag at 'Z' has the role 'active_power'; "), "{none:?}");
    let mut declared = line();
    declared["untelemetered"] = json!(["A", "Z"]);
    assert!(findings(&declared, Vec::new()).is_empty());
    let unknown = verdict(&declared, Vec::new(), &[]);
    assert_eq!(unknown.reason, "A: declared untelemetered");
    let amperes = findings(&settings(), vec![binding("A", "active_power", "A")]);
    assert!(amperes[0].contains("'A', which is no unit of active power; "), "{amperes:?}");
    let torn = verdict(&settings(), vec![binding("A", "active_power", "A")], &[good(1.0)]);
    assert_eq!(torn.reason, "A.P: its unit cannot be converted");
    let none =
        verdict(&settings(), vec![binding("A", "active_power", ""), q("A")], &[1.0; 2].map(good));
    assert_eq!((none.verdict, &*none.reason), (Verdict::Normal, "assumed: A.P is in MW"));
    let described = overlay(&line()).describe().equipment;
    assert_eq!(described, ["A", "B", "Z"], "each once");
}

#[test]
fn a_zero_has_no_sign_and_a_value_that_is_none_no_arrow() {
    let of = |value| drawn(&settings(), vec![p("A"), q("A")], &[good(value), good(value)]);
    for value in [-0.0, -0.001, -1e-300, 0.001] {
        let drawing = of(value);
        assert_eq!(drawing.lines[0].text, "0.00 MW  0 %", "{value}");
        assert_eq!(drawing.lines[1].text, "0.00 Mvar");
    }
    let none = of(f64::NAN);
    assert!(none.quantities.is_empty(), "a good zero would be a lie");
    assert_eq!(none.lines[0].text, "–");
    assert_eq!(none.verdicts[0].verdict, Verdict::Unknown);
    let huge = of(1e308);
    assert_eq!(huge.verdicts[0].verdict, Verdict::Abnormal);
}

#[test]
fn settings_that_make_no_sense_are_told() {
    for (key, value, words) in [
        ("other_end", json!("A"), "its other end is itself; name"),
        ("max_loss_percent", json!(101), "losses of 101 %"),
        ("reactive_role", json!("active_power"), "the role of both powers"),
    ] {
        let mut settings = settings();
        settings["flows"][0][key] = value;
        let settings = serde_json::from_value(settings).expect("settings");
        let fault = LoadFlow::create(settings, host()).err().expect("a fault").to_string();
        assert!(fault.contains(words), "{fault}");
    }
}

#[test]
fn a_text_is_no_power_and_is_told() {
    for word in ["", "80", "HIGH"] {
        let word = Some(Value::Text(Text::new(word).expect("it fits")));
        let word = TagValue { value: word, ..good(0.0) };
        let of = |values: [TagValue; 2]| verdict(&settings(), vec![p("A"), q("A")], &values);
        assert_eq!(of([word.clone(), good(1.0)]).reason, "A.P: no number");
        assert_eq!(of([good(80.0), word.clone()]).reason, "A.Q: no number");
        for (place, role) in [(0, "active_power"), (1, "reactive_power")] {
            let mut bindings = vec![p("A"), q("A")];
            bindings[place].kind = ValueKind::Text;
            let mut values = [good(80.0), good(1.0)];
            values[place] = word.clone();
            let mut overlay = overlay(&settings());
            let drawing = draw(&mut overlay, bindings, &values).expect("it draws");
            assert_eq!(drawing.verdicts[0].verdict, Verdict::Unknown, "{role}");
            assert!(drawing.verdicts[0].reason.ends_with(": no number"), "{drawing:?}");
            assert_eq!(drawing.lines[place].text, "–", "a text is no power");
            let findings = overlay.describe().findings;
            let [finding] = findings.as_slice() else { panic!("{findings:?}") };
            assert!(finding.contains(&format!("in the role '{role}' at 'A' is no number; ")));
        }
    }
}

/// Powers that a tag may have: all completions of its input.
type Possible = Vec<f64>;

/// Powers on both sides of the rating, of the losses, and of the sum of two.
const POWERS: [f64; 7] = [-250.0, -80.0, -3.0, 0.0, 78.0, 85.0, 120.0];

/// Judges one completion of an end's powers, or of both ends'.
fn is_abnormal(ends: &[[f64; 2]]) -> bool {
    let is_over = |[active, reactive]: &[f64; 2]| active * active + reactive * reactive > 1e4;
    let is_apart = matches!(ends, [[a, _], [b, _]] if (a.abs() - b.abs()).abs() > 5.0);
    ends.iter().any(is_over) || is_apart
}

fn completions(ends: &[[Possible; 2]]) -> Vec<Vec<[f64; 2]>> {
    let mut all = vec![Vec::new()];
    for [active, reactive] in ends {
        let of_end = active.iter().flat_map(|a| reactive.iter().map(move |r| [*a, *r]));
        let of_end: Vec<[f64; 2]> = of_end.collect();
        let with = |before: &Vec<[f64; 2]>| -> Vec<Vec<[f64; 2]>> {
            of_end.iter().map(|one| [before.as_slice(), &[*one]].concat()).collect()
        };
        all = all.iter().flat_map(with).collect();
    }
    all
}

#[test]
fn verdicts_are_never_silent() {
    let mut seen = BTreeSet::new();
    for case in 0..silence_cases() {
        let mut inputs = InputGenerator::new(case);
        let is_line = inputs.one_in(2);
        let (mut bindings, mut given, mut ends) = (Vec::new(), Vec::new(), Vec::new());
        for at in ["A", "Z"].into_iter().take(if is_line { 2 } else { 1 }) {
            let mut end = [vec![], vec![0.0]];
            for (slot, units) in
                [["MW", "kW", "", "V"], ["Mvar", "kvar", "", "MW"]].iter().enumerate()
            {
                if slot == 1 && inputs.one_in(3) {
                    continue;
                }
                let [usual, kilo, none, wrong] = *units;
                let unit = inputs.choice(&[usual, usual, usual, kilo, none, wrong]);
                let factor = if unit.starts_with('k') { 1e3 } else { 1.0 };
                let power = inputs.choice(&POWERS);
                let (tag, fault) = inputs.input(Value::F64(power * factor));
                let role = ["active_power", "reactive_power"][slot];
                bindings.push(binding(at, role, unit));
                given.push(tag);
                let is_known = fault.is_none() && unit != wrong;
                end[slot] = if is_known { vec![power] } else { POWERS.to_vec() };
            }
            ends.push(end);
        }
        let mut admitted = AdmittedVerdicts::default();
        completions(&ends).iter().for_each(|one| admitted.add(is_abnormal(one)));
        // An end that is known stands in for the other, if it knows as much.
        let is_known = |end: &[Possible; 2]| end.iter().all(|possible| possible.len() == 1);
        let mut is_assumed = false;
        if is_line && admitted.verdict() == Verdict::Unknown {
            let has_reactive =
                |at: &str| bindings.iter().any(|b: &Binding| b.tag_id == format!("{at}.Q"));
            for (known, other, at, other_at) in [(0, 1, "A", "Z"), (1, 0, "Z", "A")] {
                if is_known(&ends[known]) && (has_reactive(at) || !has_reactive(other_at)) {
                    let stand_in = [ends[known].clone(), ends[known].clone()];
                    assert!(!is_known(&ends[other]));
                    admitted = AdmittedVerdicts::default();
                    completions(&stand_in).iter().for_each(|one| admitted.add(is_abnormal(one)));
                    is_assumed = true;
                }
            }
        }
        let settings = if is_line { line() } else { settings() };
        let drawing = drawn(&settings, bindings, &given);
        let story = format!("case {case}: {ends:?}");
        check_verdicts(&drawing, if is_line { 3 } else { 2 }, &given, &story);
        admitted.check(&drawing, 0, &story);
        let verdict = drawing.verdict(0).expect("a verdict");
        assert!(!is_assumed || verdict.is_assumed, "{story}: {verdict:?}");
        seen.insert(verdict.verdict);
    }
    assert_eq!(seen.len(), 3, "each verdict is met: {seen:?}");
}
