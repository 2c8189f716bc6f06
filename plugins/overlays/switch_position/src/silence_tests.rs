//! Verdicts on switches: cases, and the silence test over their histories.

use std::collections::BTreeSet;
use std::time::Duration;

use busbar_plugin_sdk::testing::{
    Drawing, DrawnQuantity, DrawnVerdict, InputGenerator, check_verdicts, draw_at, host,
    silence_cases,
};
use busbar_plugin_sdk::{DoublePoint, Origin, Quality, Reason, Text, ValueKind};
use serde_json::{Value as Json, json};

use super::*;
use DoublePoint::{BadState, Intermediate, Off, On};

const SECOND: i64 = 1_000_000_000;

fn overlay(settings: Json) -> SwitchPosition {
    let settings = serde_json::from_value(settings).expect("settings");
    SwitchPosition::create(settings, host()).expect("it is made")
}

fn disconnector(seconds: f64) -> SwitchPosition {
    overlay(json!({ "switches": [{ "equipment": "Q9", "travel_seconds": seconds }] }))
}

fn binding(id: &str, role: &str) -> Binding {
    Binding {
        node: 4,
        kind: ValueKind::DoublePoint,
        limit_low: None,
        limit_high: None,
        tag_id: id.into(),
        tag_name: String::new(),
        unit: String::new(),
        node_id: "Q9".into(),
        role: role.into(),
    }
}

fn good(point: DoublePoint) -> TagValue {
    let value = Some(Value::DoublePoint(point));
    TagValue { value, quality: Quality::Good, age: Duration::ZERO, origin: Origin::LIVE }
}

fn stale(point: DoublePoint) -> TagValue {
    TagValue { quality: Quality::Bad(Reason::Stale), ..good(point) }
}

/// Draws a switch over time, and returns its verdict at each instant.
fn verdicts(seconds: f64, seen: &[(i64, TagValue)]) -> Vec<DrawnVerdict> {
    let mut overlay = disconnector(seconds);
    let mut bindings = Some(vec![binding("P", "position")]);
    let mut at = |(second, value): &(i64, TagValue)| {
        let values = std::slice::from_ref(value);
        let drawing = draw_at(&mut overlay, bindings.take(), values, second * SECOND);
        drawing.expect("it draws").verdict(0).expect("a verdict").clone()
    };
    seen.iter().map(&mut at).collect()
}

#[track_caller]
fn last(seconds: f64, seen: &[(i64, TagValue)], expected: Verdict, reason: &str) {
    let last = verdicts(seconds, seen).pop().expect("a verdict");
    assert_eq!((last.verdict, last.reason.as_str()), (expected, reason));
}

#[test]
fn an_end_is_normal_and_both_at_once_are_not() {
    use Verdict::{Abnormal, Normal, Unknown};
    last(8.0, &[(0, good(On))], Normal, "");
    last(8.0, &[(0, good(Off))], Normal, "");
    last(8.0, &[(0, good(BadState))], Abnormal, "P: open and closed at once");
    last(8.0, &[(0, stale(On))], Unknown, "P: stale");
    last(8.0, &[(0, TagValue { value: None, ..stale(On) })], Unknown, "P: no value yet");
    let other = TagValue { value: Some(Value::Bool(true)), ..good(On) };
    last(8.0, &[(0, other)], Unknown, "P: a value of another type than the tag's");
}

#[test]
fn a_switch_that_travels_for_longer_than_it_takes_is_abnormal() {
    let too_long = "P: neither open nor closed for more than 8 s";
    let begin = [(0, good(On)), (1, good(Intermediate))];
    let then = |second, value| [&begin[..], &[(second, value)]].concat();
    last(8.0, &then(8, good(Intermediate)), Verdict::Normal, "P: travelling");
    last(8.0, &then(10, good(Intermediate)), Verdict::Abnormal, too_long);
    last(8.0, &then(9, good(Off)), Verdict::Normal, "");
    // Without a time of its own it is given half a minute, and says so.
    let assumed = "P: travelling; assumed: it travels for at most 30 s";
    last(0.0, &then(30, good(Intermediate)), Verdict::Normal, assumed);
    let too_long = "P: neither open nor closed for more than 30 s; assumed: it travels for at \
                    most 30 s";
    last(0.0, &then(32, good(Intermediate)), Verdict::Abnormal, too_long);
}

#[test]
fn a_way_whose_beginning_nobody_saw_is_unknown_until_it_is_too_long() {
    let unknown = "P: neither open nor closed, and nobody saw since when";
    last(8.0, &[(0, good(Intermediate))], Verdict::Unknown, unknown);
    let seen = [(0, good(Intermediate)), (9, good(Intermediate))];
    last(8.0, &seen, Verdict::Abnormal, "P: neither open nor closed for more than 8 s");
    // A gap in which it may have left long ago, or just now.
    let gap = [(0, good(On)), (5, stale(On)), (100, good(Intermediate))];
    last(8.0, &gap, Verdict::Unknown, unknown);
    let short = [(0, good(On)), (2, stale(On)), (7, good(Intermediate))];
    last(8.0, &short, Verdict::Normal, "P: travelling");
    // It may have arrived within the gap, and left again.
    let gap = [(0, good(Intermediate)), (9, stale(On)), (10, good(Intermediate))];
    last(8.0, &gap, Verdict::Unknown, unknown);
    // The clock was set back: nobody knows for how long it has been on its way.
    let back = [(50, good(On)), (51, good(Intermediate)), (20, good(Intermediate))];
    last(8.0, &back, Verdict::Unknown, unknown);
}

#[test]
fn a_reload_forgets_nothing_and_another_tag_all() {
    let mut overlay = disconnector(8.0);
    let mut at = |second: i64, id: Option<&str>, point| {
        let bindings = id.map(|id| vec![binding(id, "position")]);
        let drawing = draw_at(&mut overlay, bindings, &[good(point)], second * SECOND);
        drawing.expect("it draws").verdict(0).expect("a verdict").verdict
    };
    assert_eq!(at(0, Some("P"), On), Verdict::Normal);
    assert_eq!(at(2, None, Intermediate), Verdict::Normal);
    assert_eq!(at(11, Some("P"), Intermediate), Verdict::Abnormal);
    assert_eq!(at(12, Some("P2"), Intermediate), Verdict::Unknown);
}

#[test]
fn mechanisms_of_one_switch_are_judged_together() {
    let mut overlay = overlay(json!({ "switches": [
        { "equipment": "Q9", "mechanism": "blade" },
        { "equipment": "Q9", "mechanism": "earth", "role": "earth_switch" },
    ] }));
    let bindings = vec![binding("P", "position"), binding("E", "earth_switch")];
    let mut of = |values: [TagValue; 2]| -> Drawing {
        draw_at(&mut overlay, Some(bindings.clone()), &values, 0).expect("it draws")
    };
    let drawing = of([good(On), good(Off)]);
    assert_eq!(drawing.verdicts.len(), 1, "one verdict a piece");
    assert_eq!(drawing.verdicts[0].basis, [0, 1]);
    assert_eq!(of([good(On), stale(Off)]).verdicts[0].reason, "E: stale");
    let torn = of([stale(On), good(BadState)]);
    assert_eq!((torn.verdicts[0].verdict, &*torn.verdicts[0].basis), (Verdict::Abnormal, &[1][..]));
}

#[test]
fn what_bindings_lack_is_a_finding_unless_it_is_declared() {
    let switches = json!([{ "equipment": "Q9" }, { "equipment": "Q8" }, { "equipment": "Q7" }]);
    let mut overlay = overlay(json!({ "switches": switches, "untelemetered": ["Q7"] }));
    let number = Binding { kind: ValueKind::Bool, ..binding("P", "position") };
    let value = TagValue { value: Some(Value::Bool(true)), ..good(On) };
    let drawing = draw_at(&mut overlay, Some(vec![number]), &[value], 0).expect("it draws");
    let reasons: Vec<_> = drawing.verdicts.iter().map(|of| (of.verdict, &*of.reason)).collect();
    let expected = [
        (Verdict::Unknown, "P: no double-point"),
        (Verdict::Unknown, "no tag has the role 'position'"),
        (Verdict::Unknown, "declared untelemetered"),
    ];
    assert_eq!(reasons, expected);
    let findings = overlay.describe().findings;
    let [kind, missing] = &findings[..] else { panic!("{findings:?}") };
    assert!(kind.contains("'P' in the role 'position' at 'Q9' is no double-point; "), "{kind}");
    assert!(missing.starts_with("no tag at 'Q8' has the role 'position'; "), "{missing}");
    let twice = vec![binding("P1", "position"), binding("P2", "position")];
    let values = [good(On), good(Off)];
    let drawing = draw_at(&mut overlay, Some(twice), &values, 0).expect("it draws");
    assert_eq!(drawing.verdicts[0].reason, "'P1' and 'P2' are both its position");
    assert!(overlay.describe().findings[0].contains("both in the role 'position' at 'Q9'; "));
}

#[test]
fn a_text_is_no_position_and_is_told() {
    for word in ["", "on", "CLOSED", "2"] {
        let word = Some(Value::Text(Text::new(word).expect("it fits")));
        let word = TagValue { value: word, ..good(On) };
        let reason = "P: a value of another type than the tag's";
        last(8.0, &[(0, good(On)), (1, word.clone())], Verdict::Unknown, reason);
        let text = Binding { kind: ValueKind::Text, ..binding("P", "position") };
        let mut overlay = disconnector(8.0);
        let drawing = draw_at(&mut overlay, Some(vec![text]), &[word], 0).expect("it draws");
        assert_eq!(drawing.quantities, [DrawnQuantity::Position([0, 0, 0], None)]);
        assert_eq!(drawing.verdicts[0].verdict, Verdict::Unknown);
        assert_eq!(drawing.verdicts[0].reason, "P: no double-point");
        let findings = overlay.describe().findings;
        let [finding] = findings.as_slice() else { panic!("{findings:?}") };
        assert!(finding.contains("'P' in the role 'position' at 'Q9' is no double-point; "));
    }
}

/// Returns the expected verdict at the last instant, by all ways that a switch may have moved
/// between observations.
fn expected(history: &[(i64, Option<DoublePoint>)], travel: i64) -> Verdict {
    let (now, last) = history[history.len() - 1];
    match last {
        None => return Verdict::Unknown,
        Some(On | Off) => return Verdict::Normal,
        Some(BadState) => return Verdict::Abnormal,
        Some(Intermediate) => {}
    }
    let is_intermediate = |(_, point): &&(i64, Option<DoublePoint>)| *point == Some(Intermediate);
    let run = history.iter().rev().take_while(is_intermediate).last();
    let elsewhere =
        history.iter().rev().find(|(_, point)| point.is_some_and(|p| p != Intermediate));
    let at_least = run.map_or(0, |(since, _)| now - since);
    let at_most = elsewhere.map_or(i64::MAX, |(since, _)| now - since);
    match () {
        () if at_least > travel => Verdict::Abnormal,
        () if at_most <= travel => Verdict::Normal,
        () => Verdict::Unknown,
    }
}

#[test]
fn verdicts_are_never_silent() {
    let mut met = BTreeSet::new();
    for case in 0..silence_cases() {
        let mut inputs = InputGenerator::new(case);
        let travel = 1 + inputs.below(8) as i64;
        let mut overlay = disconnector(travel as f64);
        let mut bindings = Some(vec![binding("P", "position")]);
        let (mut history, mut second) = (Vec::new(), 0);
        for step in 0..1 + inputs.below(8) {
            let pace = inputs.choice(&[1, 1, 1, 2, 2, 5, 1000, -7]);
            second += pace;
            if pace < 0 {
                // The clock was set back: what was seen before is of another time.
                history.clear();
            }
            if inputs.one_in(8) {
                bindings = Some(vec![binding("P", "position")]);
            }
            let point =
                inputs.choice(&[Intermediate, Intermediate, Intermediate, Off, On, BadState]);
            let (value, fault) = inputs.input(Value::DoublePoint(point));
            history.push((second, Some(point).filter(|_| fault.is_none())));
            let values = [value];
            let drawing = draw_at(&mut overlay, bindings.take(), &values, second * SECOND);
            let (drawing, story) = (drawing.expect("it draws"), format!("case {case}.{step}"));
            check_verdicts(&drawing, 1, &values, &story);
            let verdict = drawing.verdicts[0].verdict;
            assert_eq!(verdict, expected(&history, travel), "{story}: {travel} s, {history:?}");
            met.insert(verdict);
        }
    }
    assert_eq!(met.len(), 3, "each verdict is met: {met:?}");
}
