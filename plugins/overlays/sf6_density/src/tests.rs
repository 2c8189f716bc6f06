//! Verdicts and drawings of compartments.

use std::time::Duration;

use busbar_plugin_sdk::testing::{Drawing, draw, draw_at, host};
use busbar_plugin_sdk::{Origin, Quality, Reason, Severity, Text, Value, ValueKind};
use serde_json::{Value as Json, json};

use super::*;
use crate::compartments::{AIR_PRESSURE, DENSITY_CONTACT, PRESSURE, TEMPERATURE};
use crate::outcome::{ALARM, ATTENTION, LOCK_OUT};

/// Settings with more of them over the usual ones.
pub(crate) fn settings(more: &Json) -> Json {
    let mut settings =
        json!({ "equipment": ["=Q1-QA1"], "filling": 7.0, "alarm": 6.4, "lock_out": 6.0 });
    for (name, value) in more.as_object().into_iter().flatten() {
        settings[name] = value.clone();
    }
    settings
}

pub(crate) fn overlay(more: &Json) -> Sf6Density {
    let settings = serde_json::from_value(settings(more)).expect("settings");
    Sf6Density::create(settings, host()).expect("it is made")
}

pub(crate) fn binding(node_id: &str, role: &str, unit: &str) -> Binding {
    let kind = if role == DENSITY_CONTACT { ValueKind::Bool } else { ValueKind::F64 };
    Binding {
        node: 7,
        kind,
        limit_low: None,
        limit_high: None,
        tag_id: format!("{node_id}.{role}"),
        tag_name: role.into(),
        unit: unit.into(),
        node_id: node_id.into(),
        role: role.into(),
    }
}

pub(crate) fn value(value: impl Into<Option<Value>>, quality: Quality) -> TagValue {
    TagValue { value: value.into(), quality, age: Duration::ZERO, origin: Origin::LIVE }
}

pub(crate) fn good(number: f64) -> TagValue {
    value(Value::F64(number), Quality::Good)
}

pub(crate) fn text(word: &str) -> TagValue {
    value(Text::new(word).map(Value::Text), Quality::Good)
}

pub(crate) fn bindings() -> Vec<Binding> {
    vec![binding("=Q1-QA1", PRESSURE, "bar"), binding("=Q1-QA1", TEMPERATURE, "°C")]
}

fn drawn_with(more: &Json, pressure: f64, celsius: f64) -> Drawing {
    draw(&mut overlay(more), bindings(), &[good(pressure), good(celsius)]).expect("it draws")
}

fn drawn(pressure: f64, celsius: f64) -> Drawing {
    drawn_with(&json!({}), pressure, celsius)
}

/// Entry of the legend that the first piece is shown in.
pub(crate) fn entry(drawing: &Drawing) -> Option<usize> {
    drawing.states.first().map(|state| state.entry)
}

/// Verdict on the first piece.
#[derive(Clone, Debug)]
pub(crate) struct Judged {
    pub(crate) verdict: Verdict,
    pub(crate) reason: String,
    is_assumed: bool,
    basis: Vec<usize>,
}

pub(crate) fn verdict(drawing: &Drawing) -> Judged {
    let of = drawing.verdict(0).expect("a verdict").clone();
    Judged { verdict: of.verdict, reason: of.reason, is_assumed: of.is_assumed, basis: of.basis }
}

#[test]
fn thresholds_are_those_at_20_degrees() {
    let shown = |drawing: &Drawing| drawing.states.iter().map(|of| of.entry).collect::<Vec<_>>();
    // Each rests on pressure and temperature.
    assert_eq!(shown(&drawn(6.4, 40.0)), [LOCK_OUT; 2]);
    assert_eq!(shown(&drawn(6.39, 20.0)), [ALARM; 2]);
    let calm = drawn(6.4, -10.0);
    assert!(calm.states.is_empty() && calm.lines.is_empty(), "normal states are not drawn");
    assert_eq!(verdict(&calm).verdict, Verdict::Normal);
    assert_eq!(verdict(&calm).basis, [0, 1]);
    let low = drawn(6.39, 20.0);
    assert_eq!(low.lines[0].severity, Severity::Warning);
    assert_eq!(low.lines[0].text, "6.39 bar");
    assert_eq!(drawn(5.99, 20.0).lines[0].severity, Severity::Alarm);
}

#[test]
fn a_density_below_the_alarm_is_told_in_the_heat() {
    // 6.300 bar at 20 °C are 7.064 bar at 50 °C by the reference equation (CoolProp 8.0.0).
    let hot = drawn(7.0644, 50.0);
    assert_eq!(verdict(&hot).verdict, Verdict::Abnormal, "{hot:?}");
    assert_eq!(entry(&hot), Some(ALARM));
    assert!(!verdict(&hot).is_assumed);
    let ideal = drawn_with(&json!({ "equation": "ideal" }), 7.0644, 50.0);
    assert_eq!(verdict(&ideal).verdict, Verdict::Normal, "4.9 % off is what was chosen");
    assert!(verdict(&ideal).reason.contains("ideal gas"), "and it says so: {ideal:?}");
    assert!(verdict(&ideal).is_assumed);
}

#[test]
fn a_threshold_holds_at_equality_in_the_digits_shown() {
    assert_eq!(entry(&drawn(6.4, 20.0)), Some(ALARM));
    assert_eq!(entry(&drawn(6.4049, 20.0)), Some(ALARM), "6.40 bar are shown");
    assert_eq!(entry(&drawn(6.406, 20.0)), None, "6.41 bar are shown");
    assert_eq!(entry(&drawn(6.0049, 20.0)), Some(LOCK_OUT));
    // A threshold of three digits has three shown.
    let fine = drawn_with(&json!({ "alarm": 6.405 }), 6.4052, 20.0);
    assert_eq!(fine.lines[0].text, "6.405 bar");
    assert_eq!(entry(&drawn_with(&json!({ "alarm": 6.405 }), 6.406, 20.0)), None);
}

#[test]
fn implausible_and_missing_inputs_are_unknown() {
    for (pressure, celsius, reason) in [
        (-0.1, 20.0, "negative"),
        (7.0, 120.0, "implausible"),
        (7.0, -90.0, "implausible"),
        (70.0, 20.0, "implausible"),
        (19.0, 20.0, "implausible"),
    ] {
        let drawing = drawn(pressure, celsius);
        let verdict = verdict(&drawing);
        assert_eq!(verdict.verdict, Verdict::Unknown, "{pressure} bar, {celsius} °C");
        assert!(verdict.reason.contains(reason), "{reason}: {verdict:?}");
        assert!(drawing.states.is_empty() && drawing.lines.is_empty());
    }
    let stale = [good(7.0), value(Value::F64(20.0), Quality::Bad(Reason::Stale))];
    let drawing = draw(&mut overlay(&json!({})), bindings(), &stale).expect("it draws");
    assert_eq!(verdict(&drawing).verdict, Verdict::Unknown);
    // No temperature could make 3 bar enough.
    let low = [good(3.0), stale[1].clone()];
    let drawing = draw(&mut overlay(&json!({})), bindings(), &low).expect("it draws");
    assert_eq!((verdict(&drawing).verdict, entry(&drawing)), (Verdict::Abnormal, Some(LOCK_OUT)));
    assert_eq!(verdict(&drawing).basis, [0], "it rests on the pressure alone");
}

#[test]
fn a_temperature_far_from_its_neighbors_is_not_believed() {
    let places = ["=Q1-QA1-L1", "=Q1-QA1-L2", "=Q1-QA1-L3"];
    let of_place = |id: &&str| [binding(id, PRESSURE, "bar"), binding(id, TEMPERATURE, "°C")];
    let bindings: Vec<_> = places.iter().flat_map(of_place).collect();
    let values = [7.0, 21.0, 7.0, 22.0, 7.0, -30.0].map(good);
    let mut overlay = overlay(&json!({ "equipment": places }));
    let drawing = draw(&mut overlay, bindings, &values).expect("it draws");
    let verdicts: Vec<_> = drawing.verdicts.iter().map(|verdict| verdict.verdict).collect();
    assert_eq!(verdicts[2], Verdict::Unknown);
    assert!(drawing.verdicts[2].reason.contains("beside a median of 21.0"), "{drawing:?}");
    assert_eq!(verdicts[..2], [Verdict::Normal; 2]);
}

#[test]
fn missing_roles_and_units_are_findings() {
    let mut overlay = overlay(&json!({
        "equipment": ["=Q1-QA1", "=Q2-QA1", "=Q3-QA1"], "untelemetered": ["=Q3-QA1"],
    }));
    let bindings = vec![
        binding("=Q1-QA1", PRESSURE, "furlong"),
        binding("=Q1-QA1", TEMPERATURE, "V"),
        binding("=Q4-QA1", PRESSURE, "bar"),
    ];
    let drawing = draw(&mut overlay, bindings, &[7.0; 3].map(good)).expect("it draws");
    let Description { equipment, findings, .. } = overlay.describe();
    assert_eq!(equipment, ["=Q1-QA1", "=Q2-QA1", "=Q3-QA1", "=Q4-QA1"]);
    let named = |words: &[&str]| {
        assert!(
            findings.iter().any(|finding| words.iter().all(|word| finding.contains(word))),
            "{words:?}: {findings:?}"
        );
    };
    named(&["furlong", "no unit of pressure", "; "]);
    named(&["'V'", "no unit of temperature"]);
    named(&["=Q2-QA1", PRESSURE, "untelemetered"]);
    named(&["=Q2-QA1", TEMPERATURE]);
    named(&["=Q4-QA1", TEMPERATURE]);
    assert!(!findings.iter().any(|finding| finding.contains("=Q3")), "{findings:?}");
    for equipment in 0..4 {
        let verdict = drawing.verdict(equipment).expect("a verdict each");
        assert_eq!(verdict.verdict, Verdict::Unknown, "{verdict:?}");
        assert!(!verdict.reason.is_empty());
    }
}

#[test]
fn tags_are_converted_each_by_its_unit() {
    // 6.39 bar and 20 °C in other units.
    for (unit, pressure) in [("kPa", 639.0), ("MPa", 0.639), ("psi", 92.679), ("bar(g)", 5.3767)] {
        for (degrees, celsius) in [("°F", 68.0), ("K", 293.15), ("", 20.0)] {
            let bindings =
                vec![binding("=Q1-QA1", PRESSURE, unit), binding("=Q1-QA1", TEMPERATURE, degrees)];
            let values = [good(pressure), good(celsius)];
            let mut overlay = overlay(&json!({}));
            let drawing = draw(&mut overlay, bindings, &values).expect("it draws");
            assert_eq!(drawing.lines[0].text, "6.39 bar", "{unit} {degrees}");
            let verdict = verdict(&drawing);
            assert_eq!(verdict.is_assumed, degrees.is_empty() || unit == "bar(g)", "{verdict:?}");
        }
    }
}

#[test]
fn gauges_are_read_above_the_local_air() {
    let gauge = json!({ "gauge": true, "filling": 6.0, "alarm": 5.4, "lock_out": 5.0 });
    // At sea level, at 20 °C, a gauge shows the very pressure.
    let drawing = drawn_with(&gauge, 5.4, 20.0);
    assert_eq!(drawing.lines[0].text, "5.40 bar");
    assert!(verdict(&drawing).reason.contains("air pressure of sea level"), "{drawing:?}");
    // At 2000 m the air has 79.495 kPa (ISO 2533): 21.8 kPa less than the thresholds' air.
    let mut high = gauge.clone();
    high["altitude_metres"] = json!(2000.0);
    let drawing = drawn_with(&high, 5.6, 20.0);
    assert_eq!(drawing.lines[0].text, "5.38 bar");
    assert!(!verdict(&drawing).is_assumed, "{drawing:?}");
    assert_eq!(verdict(&drawn_with(&high, 5.63, 20.0)).verdict, Verdict::Normal);
    // A tag has it.
    let mut bindings = bindings();
    bindings.push(binding("=Q1", AIR_PRESSURE, "hPa"));
    let air = |air: TagValue, pressure: f64| {
        let values = [good(pressure), good(20.0), air];
        draw(&mut overlay(&gauge), bindings.clone(), &values).expect("it draws")
    };
    let drawing = air(good(795.0), 5.6);
    assert_eq!(drawing.lines[0].text, "5.38 bar");
    assert_eq!(verdict(&drawing).basis, [0, 1, 2]);
    // Without its value the air may be thick or thin.
    let stale = value(Value::F64(795.0), Quality::Bad(Reason::Stale));
    assert_eq!(verdict(&air(stale.clone(), 5.6)).verdict, Verdict::Unknown);
    assert_eq!(verdict(&air(stale.clone(), 5.2)).verdict, Verdict::Abnormal);
    assert_eq!(verdict(&air(stale, 6.0)).verdict, Verdict::Normal);
    assert_eq!(verdict(&air(good(1.0), 5.6)).verdict, Verdict::Unknown, "1 hPa is no air");
    // A unit says that a tag is absolute.
    let absolute =
        vec![binding("=Q1-QA1", PRESSURE, "bar(a)"), binding("=Q1-QA1", TEMPERATURE, "°C")];
    let drawing = draw(&mut overlay(&gauge), absolute, &[6.4, 20.0].map(good)).expect("it draws");
    assert_eq!(drawing.lines[0].text, "5.39 bar", "6.4 less 1.013");
}

#[test]
fn condensed_gas_is_told_and_its_alarm_stands() {
    // 7 bar at 20 °C condense at -26 °C; at -40 °C 3.408 bar are left (CoolProp 8.0.0).
    let cold = drawn(3.408, -40.0);
    assert_eq!(entry(&cold), Some(LOCK_OUT));
    assert!(verdict(&cold).reason.contains("condenses"), "{cold:?}");
    assert!(cold.lines[0].text.contains("condensing"));
    // On the line, and still dense enough.
    let at_line = drawn(6.32, -22.4);
    assert_eq!(verdict(&at_line).verdict, Verdict::Abnormal, "{at_line:?}");
    assert_eq!(entry(&at_line), Some(ATTENTION));
    // Far above it no gas is.
    assert_eq!(verdict(&drawn(9.8, -20.0)).verdict, Verdict::Unknown);
}

#[test]
fn a_density_contact_that_disagrees_is_told() {
    let mut bindings = bindings();
    bindings.push(binding("=Q1-QA1", DENSITY_CONTACT, ""));
    let judged = |pressure: TagValue, contact: TagValue| {
        let values = [pressure, good(20.0), contact];
        let drawing = draw(&mut overlay(&json!({})), bindings.clone(), &values).expect("it draws");
        (verdict(&drawing), entry(&drawing))
    };
    let contact = |alarm| value(Value::Bool(alarm), Quality::Good);
    let bad = value(None, Quality::Bad(Reason::NotConnected));
    let (agreed, _) = judged(good(7.0), contact(false));
    assert_eq!((agreed.verdict, agreed.basis.as_slice()), (Verdict::Normal, &[0, 1, 2][..]));
    let (alarm, shown) = judged(good(7.0), contact(true));
    assert_eq!((alarm.verdict, shown), (Verdict::Abnormal, Some(ALARM)));
    assert!(alarm.reason.contains("contact reports an alarm; 7.00 bar calculated"), "{alarm:?}");
    assert_eq!(alarm.basis, [2], "it stays whatever the pressure is");
    let (calm, shown) = judged(good(6.3), contact(false));
    assert_eq!((calm.verdict, shown), (Verdict::Abnormal, Some(ALARM)));
    assert!(calm.reason.contains("contact reports no alarm"), "{calm:?}");
    assert_eq!(judged(bad.clone(), contact(true)).0.verdict, Verdict::Abnormal);
    assert_eq!(judged(bad.clone(), contact(false)).0.verdict, Verdict::Unknown);
    assert_eq!(judged(good(7.0), bad.clone()).0.verdict, Verdict::Unknown, "it may report one");
    assert_eq!(judged(good(6.3), bad).0.verdict, Verdict::Abnormal);
}

#[test]
fn a_text_in_place_of_a_number_or_a_contact_is_told() {
    let gauge = json!({ "gauge": true, "filling": 6.0, "alarm": 5.4, "lock_out": 5.0 });
    let mut bindings = bindings();
    bindings.push(binding("=Q1", AIR_PRESSURE, "hPa"));
    bindings.push(binding("=Q1-QA1", DENSITY_CONTACT, ""));
    let calm = [good(5.8), good(20.0), good(1013.0), value(Value::Bool(false), Quality::Good)];
    let drawing = draw(&mut overlay(&gauge), bindings.clone(), &calm).expect("it draws");
    assert_eq!((verdict(&drawing).verdict, verdict(&drawing).is_assumed), (Verdict::Normal, false));
    for word in ["", "0", "1", "off", "NORMAL"] {
        for place in 0..bindings.len() {
            let (mut bindings, mut values) = (bindings.clone(), calm.clone());
            values[place] = text(word);
            let mut overlay = overlay(&gauge);
            let drawing = draw(&mut overlay, bindings.clone(), &values).expect("it draws");
            assert_eq!(verdict(&drawing).verdict, Verdict::Unknown, "{place} {word}: {drawing:?}");
            bindings[place].kind = ValueKind::Text;
            let Binding { tag_id, role, .. } = bindings[place].clone();
            let drawing = draw(&mut overlay, bindings, &values).expect("it draws");
            let judged = verdict(&drawing);
            // Without a tag of the air that of the sea level is assumed, which is told.
            let expected = if place == 2 { Verdict::Normal } else { Verdict::Unknown };
            assert_eq!(judged.verdict, expected, "{judged:?}");
            assert!(place != 2 || judged.is_assumed, "{judged:?}");
            let findings = overlay.describe().findings;
            let [finding] = findings.as_slice() else { panic!("{findings:?}") };
            assert!(finding.starts_with(&format!("the tag '{tag_id}' in the role '{role}' at ")));
            assert!(finding.contains("; bind one of the kind "), "{finding}");
        }
    }
}

/// Isochores of an ideal gas of 6, 6.4 and 7 bar at 20 °C, and a dew line.
fn mixture(composition: Json) -> Json {
    let isochore = |at_20: f64| {
        let point = |celsius: f64| json!([celsius, at_20 * (celsius + 273.15) / 293.15]);
        Json::from([-40.0, -10.0, 20.0, 60.0].map(point).to_vec())
    };
    json!({ "mixture": {
        "composition": composition,
        "isochores": [isochore(6.0), isochore(6.4), isochore(7.0)],
        "dew_line": [[-40.0, 4.5], [-25.0, 6.2], [-10.0, 8.0]],
    } })
}

#[test]
fn mixtures_go_by_their_isochores() {
    let nitrogen = mixture(json!({ "SF6": 30, "N2": 70 }));
    // 6.3 bar at 20 °C are 6.945 bar at 50 °C, between two isochores.
    let hot = drawn_with(&nitrogen, 6.3 * 323.15 / 293.15, 50.0);
    assert_eq!(hot.lines[0].text, "6.30 bar");
    assert_eq!(verdict(&drawn_with(&nitrogen, 6.8, 20.0)).verdict, Verdict::Normal);
    assert_eq!(entry(&drawn_with(&nitrogen, 2.0, 0.0)), Some(LOCK_OUT), "below the lowest");
    assert_eq!(
        verdict(&drawn_with(&nitrogen, 6.8, 70.0)).verdict,
        Verdict::Unknown,
        "the isochores end at 60 °C"
    );
    let cold = drawn_with(&nitrogen, 4.6, -39.0);
    assert!(verdict(&cold).reason.contains("condenses"), "{cold:?}");
    assert_eq!(verdict(&cold).verdict, Verdict::Abnormal);
    let fluoronitrile = mixture(json!({ "C4-FN": 5, "CO2": 95 }));
    let cold = drawn_with(&fluoronitrile, 4.6, -39.0);
    assert_eq!(verdict(&cold).verdict, Verdict::Unknown, "{cold:?}");
    assert!(verdict(&cold).reason.contains("condenses"), "{cold:?}");
}

#[test]
fn several_sensors_of_a_compartment_make_one_verdict() {
    let sensor =
        |name: &str, role, unit| Binding { tag_id: name.into(), ..binding("=Q1-QA1", role, unit) };
    let mut bindings: Vec<_> = ["a", "b", "c"].map(|name| sensor(name, PRESSURE, "bar")).into();
    bindings.push(sensor("t", TEMPERATURE, "°C"));
    let judged = |pressures: [f64; 3]| {
        let values: Vec<_> = pressures.iter().chain(&[20.0]).map(|of| good(*of)).collect();
        let drawing = draw(&mut overlay(&json!({})), bindings.clone(), &values);
        let drawing = drawing.expect("it draws");
        assert_eq!(drawing.verdicts.len(), 1, "one for all");
        (verdict(&drawing).verdict, verdict(&drawing).basis)
    };
    assert_eq!(judged([7.0, 7.0, 7.1]), (Verdict::Normal, vec![0, 3, 1, 3, 2, 3]));
    assert_eq!(judged([7.0, 6.3, 7.1]), (Verdict::Abnormal, vec![1, 3]));
    assert_eq!(judged([7.0, -6.3, 7.1]).0, Verdict::Unknown);
}

/// Wild values of every kind, on bindings of every kind, must not upset a frame.
#[test]
fn hostile_inputs_are_judged() {
    let numbers = [0.0, -0.0, f64::NAN, f64::INFINITY, f64::MIN, f64::MAX, 5e-324, 7.0, 1e9];
    let roles = [PRESSURE, TEMPERATURE, AIR_PRESSURE, DENSITY_CONTACT, "other", ""];
    let units = ["bar", "", "°F", "bar(g)", "Pa", "\u{0}", "μμ"];
    let ids = ["=Q1-QA1", "", "=", "ü=Ω-1", "=Q2"];
    use ValueKind::{Bool, DoublePoint, F64, I64};
    let kinds = [F64, Bool, I64, DoublePoint, ValueKind::Text];
    let mut overlays = [
        overlay(&json!({ "equipment": ["=Q1-QA1", "=Q1-QA1", ""] })),
        overlay(&json!({ "gauge": true, "altitude_metres": 9000.0, "equation": "ideal" })),
        overlay(&mixture(json!({ "SF6": 30, "CF4": 70 }))),
    ];
    let mut seed = 1_u64;
    let mut pick = |count: usize| {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (seed >> 33) as usize % count
    };
    for round in 0..400 {
        let mut bindings = Vec::new();
        let mut values = Vec::new();
        for _ in 0..pick(12) {
            let mut of = binding(ids[pick(5)], roles[pick(6)], units[pick(7)]);
            of.kind = kinds[pick(5)];
            bindings.push(of);
            values.push(match pick(4) {
                0 => text(["", "7", "on"][pick(3)]),
                _ => good(numbers[pick(9)]),
            });
        }
        let at = [0, i64::MIN, i64::MAX, 1][pick(4)];
        for overlay in &mut overlays {
            let drawing = draw_at(overlay, Some(bindings.clone()), &values, at).expect("it draws");
            let equipment = overlay.describe().equipment.len();
            let mut judged: Vec<_> = drawing.verdicts.iter().map(|of| of.equipment).collect();
            judged.sort_unstable();
            assert_eq!(judged, (0..equipment).collect::<Vec<_>>(), "round {round}");
        }
    }
}

#[test]
fn settings_that_make_no_sense_are_refused() {
    let refused = |more: &Json, words: &str| {
        let settings = serde_json::from_value(settings(more)).expect("settings");
        let fault = Sf6Density::create(settings, host()).err().expect("a fault").to_string();
        assert!(fault.contains(words), "{fault}");
    };
    refused(&json!({ "filling": 6.0 }), "rise in this order");
    refused(&json!({ "temperature_range": [40, -40] }), "temperature_range");
    refused(&json!({ "leak_limit": 0.0 }), "leak_limit is 0");
    refused(&json!({ "altitude_metres": 90_000.0 }), "altitude_metres");
    refused(&mixture(json!({ "SF6": 30, "N2": 60 })), "90 %");
    let mut dewless = mixture(json!({ "C4-FN": 5, "CO2": 95 }));
    dewless["mixture"]["dew_line"] = json!([]);
    refused(&dewless, "dew line");
    dewless["mixture"]["dew_line"] = json!([[-40.0, 3.0], [-20.0, 5.0]]);
    refused(&dewless, "ends below the filling");
    let mut flat = mixture(json!({ "SF6": 30, "N2": 70 }));
    flat["mixture"]["isochores"][1] = json!([[-40.0, 5.0], [-50.0, 6.0]]);
    refused(&flat, "mixture.isochores[1]");
}
