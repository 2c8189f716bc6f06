//! Verdicts and drawings of contacts.

use std::time::Duration;

use busbar_plugin_sdk::testing::{Drawing, draw, draw_at, host};
use busbar_plugin_sdk::{Origin, Reason, Text, ValueKind};
use serde_json::{Value as Json, json};

use super::*;
use crate::contacts::AMBIENT;

const PHASES: [&str; 3] = ["=Q1-QB1-L1", "=Q1-QB1-L2", "=Q1-QB1-L3"];
const ROLE: &str = "contact_temperature";
const LOAD: &str = "load_current";

pub(crate) fn binding(node_id: &str, role: &str, unit: &str) -> Binding {
    Binding {
        node: 7,
        kind: ValueKind::F64,
        limit_low: None,
        limit_high: None,
        tag_id: format!("{node_id}.{role}"),
        tag_name: node_id.into(),
        unit: unit.into(),
        node_id: node_id.into(),
        role: role.into(),
    }
}

pub(crate) fn overlay(more: &Json) -> Thermography {
    let mut settings = json!({ "equipment": PHASES });
    for (name, value) in more.as_object().into_iter().flatten() {
        settings[name] = value.clone();
    }
    let settings = serde_json::from_value(settings).expect("settings");
    Thermography::create(settings, host()).expect("it is made")
}

pub(crate) fn text(word: &str) -> TagValue {
    let word = Text::new(word).map(Value::Text);
    TagValue { value: word, ..value(0.0, Quality::Good) }
}

pub(crate) fn value(number: f64, quality: Quality) -> TagValue {
    TagValue { value: Some(Value::F64(number)), quality, age: Duration::ZERO, origin: Origin::LIVE }
}

/// A good value, or a stale one where there is none.
fn tag(number: Option<f64>) -> TagValue {
    match number {
        Some(number) => value(number, Quality::Good),
        None => value(20.0, Quality::Bad(Reason::Stale)),
    }
}

/// Three phases in air, with more settings; `None` is a bad value.
fn drawn_with(more: &Json, degrees: [Option<f64>; 3], air: Option<f64>) -> Drawing {
    let mut bindings: Vec<_> = PHASES.map(|id| binding(id, ROLE, "°C")).into();
    bindings.push(binding("=Z1", AMBIENT, "°C"));
    let mut values: Vec<_> = degrees.map(tag).into();
    values.push(tag(air));
    draw(&mut overlay(more), bindings, &values).expect("it draws")
}

fn drawn(degrees: [f64; 3], air: f64) -> Drawing {
    drawn_with(&json!({}), degrees.map(Some), Some(air))
}

/// Verdicts with the entries of the legend, in the order of the equipment.
fn shown(drawing: &Drawing) -> Vec<(Verdict, Option<usize>)> {
    let entry = |equipment| {
        let states = drawing.states.iter().filter(move |state| state.equipment == equipment);
        states.map(|state| state.entry).next()
    };
    drawing.verdicts.iter().map(|of| (of.verdict, entry(of.equipment))).collect()
}

const NORMAL: (Verdict, Option<usize>) = (Verdict::Normal, None);
const UNKNOWN: (Verdict, Option<usize>) = (Verdict::Unknown, None);

fn abnormal(entry: usize) -> (Verdict, Option<usize>) {
    (Verdict::Abnormal, Some(entry))
}

#[test]
fn a_phase_is_judged_by_the_coolest_of_its_device() {
    let drawing = drawn([45.0, 82.0, 44.0], 20.0);
    // (82 - 44) / (82 - 20) = 61 %; L1 is 1 K warmer than L3.
    assert_eq!(shown(&drawing), [NORMAL, abnormal(0), NORMAL]);
    assert_eq!(drawing.states.len(), 4, "it rests on three phases and the air");
    assert_eq!(drawing.lines.len(), 1);
    assert_eq!(drawing.lines[0].text, "82 °C, difference 61 %");
    assert_eq!(
        drawing.verdicts[1].reason.split(';').next(),
        Some("general defect: 82 °C, difference 61 %")
    );
    assert!(drawing.verdicts[0].reason.contains("no `rated_current`"), "{drawing:?}");
    assert!(drawing.verdicts.iter().all(|verdict| verdict.is_assumed));
}

#[test]
fn the_ratio_alone_is_not_critical() {
    // 30 beside 20 °C in air of 20 °C are 100 %.
    assert_eq!(shown(&drawn([30.0, 20.0, 20.0], 20.0))[0], abnormal(1));
    assert_eq!(shown(&drawn([90.0, 20.0, 20.0], 20.0))[0], abnormal(1));
    assert_eq!(shown(&drawn([91.0, 20.0, 20.0], 20.0))[0], abnormal(2));
    assert_eq!(shown(&drawn([140.0, 139.0, 138.0], 20.0)), [abnormal(2); 3]);
}

#[test]
fn a_contact_without_good_peers_is_not_silent() {
    let drawing = drawn_with(&json!({}), [None, Some(82.0), None], Some(20.0));
    assert_eq!(shown(&drawing), [UNKNOWN; 3]);
    assert!(drawing.verdicts[1].reason.contains("82 °C"), "{drawing:?}");
    assert!(drawing.verdicts[1].reason.contains("=Q1-QB1-L1"), "it names what is missing");
    // One peer is enough for a defect, not for health.
    let drawing = drawn_with(&json!({}), [None, Some(82.0), Some(44.0)], Some(20.0));
    assert_eq!(shown(&drawing), [UNKNOWN, abnormal(0), UNKNOWN]);
    // At 5 K over the air no peer could make a defect of it.
    let drawing = drawn_with(&json!({}), [None, Some(25.0), None], Some(20.0));
    assert_eq!(shown(&drawing), [UNKNOWN, NORMAL, UNKNOWN]);
    assert_eq!(drawing.verdicts[1].basis, [1, 3], "it rests on itself and the air");
    let drawing = drawn_with(&json!({}), [None, Some(140.0), None], Some(20.0));
    assert_eq!(shown(&drawing), [UNKNOWN, abnormal(2), UNKNOWN]);
    assert_eq!(drawing.verdicts[1].basis, [1], "heat alone is enough");
}

#[test]
fn heat_is_judged_without_the_air() {
    let more = json!({ "equipment": ["=Q1-QB1-L1"] });
    let mut overlay_of_one = overlay(&more);
    let one = vec![binding("=Q1-QB1-L1", ROLE, "°C")];
    for (degrees, expected) in [(140.0, abnormal(2)), (95.0, abnormal(1)), (70.0, UNKNOWN)] {
        let drawing = draw(&mut overlay_of_one, one.clone(), &[tag(Some(degrees))]);
        assert_eq!(shown(&drawing.expect("it draws")), [expected], "{degrees} °C");
    }
    let findings = overlay_of_one.describe().findings;
    assert!(findings.len() == 1 && findings[0].contains("'ambient'"), "{findings:?}");
    let known = json!({ "equipment": ["=Q1-QB1-L1"], "ambient_untelemetered": true });
    let mut overlay = overlay(&known);
    draw(&mut overlay, one, &[tag(Some(70.0))]).expect("it draws");
    assert!(overlay.describe().findings.is_empty());
    // Of three phases some verdicts need no air.
    let drawing = drawn_with(&json!({}), [Some(45.0), Some(45.5), Some(46.0)], None);
    assert_eq!(shown(&drawing), [NORMAL; 3], "no air makes 1 K 35 % of 10");
    assert_eq!(drawing.verdicts[0].basis, [0, 1, 2]);
    let drawing = drawn_with(&json!({}), [Some(45.0), Some(82.0), Some(44.0)], None);
    assert_eq!(shown(&drawing)[1], UNKNOWN, "38 K are 27 % in air of -60 °C, and 100 % of 44");
    assert_eq!(
        shown(&drawn_with(&json!({}), [Some(82.0), Some(10.0), Some(9.0)], None))[0].0,
        Verdict::Abnormal
    );
}

#[test]
fn an_implausible_peer_is_left_out() {
    // A peer of -40 °C made 340 % of it.
    let drawing = drawn([45.0, -40.0, 44.0], 20.0);
    assert_eq!(shown(&drawing), [UNKNOWN; 3]);
    assert!(drawing.verdicts[0].reason.contains("left out"), "{drawing:?}");
    let drawing = drawn([82.0, -40.0, 44.0], 20.0);
    assert_eq!(shown(&drawing)[0], abnormal(0));
    assert_eq!(drawing.lines[0].text, "82 °C, difference 61 %");
    for wild in [1e9, -1e9, 301.0, f64::NAN, f64::INFINITY] {
        let drawing = drawn([82.0, wild, 44.0], 20.0);
        assert_eq!(shown(&drawing)[..2], [abnormal(0), UNKNOWN], "{wild} °C");
    }
    assert_eq!(shown(&drawn([45.0, 45.0, 45.0], 99.0)), [NORMAL; 3], "99 °C is no air");
}

#[test]
fn a_lonely_contact_is_judged_by_heat_and_rise() {
    let bindings = vec![binding("=Q2-QB1-L1", ROLE, "°C"), binding("=Z1", AMBIENT, "°C")];
    for (degrees, expected) in [(60.0, NORMAL), (75.0, abnormal(0)), (91.0, abnormal(1))] {
        let mut overlay = overlay(&json!({ "equipment": [] }));
        let values = [tag(Some(degrees)), tag(Some(20.0))];
        let drawing = draw(&mut overlay, bindings.clone(), &values).expect("it draws");
        assert_eq!(shown(&drawing), [expected], "{degrees} °C");
        assert!(drawing.verdicts[0].reason.contains("no other phase"), "{drawing:?}");
    }
}

#[test]
fn the_air_is_that_of_the_area() {
    let hall = ["=Q1-QB1-L1", "=Q1-QB1-L2"];
    let yard = ["=Q2-QB1-L1", "=Q2-QB1-L2"];
    let airs = ["=Q1-B1", "=Q2-B1"];
    let mut bindings: Vec<_> = airs.iter().map(|id| binding(id, AMBIENT, "°C")).collect();
    bindings.extend(hall.iter().chain(&yard).map(|id| binding(id, ROLE, "°C")));
    // 45 beside 41 °C: 80 % in a hall of 40 °C is too little a rise, 16 % in a yard of 20 °C.
    let values = [40.0, 20.0, 45.0, 41.0, 45.0, 32.0].map(|of| tag(Some(of)));
    let judged = |more: &Json| {
        let mut overlay = overlay(more);
        let drawing = draw(&mut overlay, bindings.clone(), &values).expect("it draws");
        (shown(&drawing), drawing, overlay.describe().findings)
    };
    let places = [hall, yard].concat();
    let all = json!({ "equipment": places });
    let (found, drawing, _) = judged(&all);
    // (45 - 32) / (45 - 20) = 52 %.
    assert_eq!(found, [NORMAL, NORMAL, abnormal(0), NORMAL], "by the nearest id");
    assert!(drawing.verdicts[0].reason.contains("nearest"), "it says so: {drawing:?}");
    // Settings say otherwise: all is in the hall's air.
    let mut areas = all.clone();
    areas["areas"] = json!([{ "ambient": "=Q1-B1", "equipment": ["=Q1", "=Q2"] }]);
    let (found, drawing, findings) = judged(&areas);
    assert_eq!(found[2], NORMAL, "5 K over the hall's air: {drawing:?}");
    assert!(findings.is_empty() && !drawing.verdicts[0].reason.contains("nearest"));
    areas["areas"] = json!([{ "ambient": "=Q9-B1", "equipment": ["=Q1"] }]);
    assert!(judged(&areas).2[0].contains("areas[0]: '=Q9-B1'"));
}

#[test]
fn neta_is_a_choice() {
    let neta = json!({ "rule": "neta" });
    let drawing = drawn_with(&neta, [Some(45.0), Some(61.0), Some(44.8)], Some(20.0));
    assert_eq!(shown(&drawing), [NORMAL, abnormal(3), NORMAL]);
    assert_eq!(drawing.lines[0].text, "61 °C, 16 K above its like, 41 K above the air");
    let drawing = drawn_with(&neta, [None, Some(45.0), None], Some(20.0));
    assert_eq!(shown(&drawing)[1], abnormal(2), "25 K over the air");
    assert_eq!(overlay(&neta).describe().legend.len(), 4);
}

#[test]
fn rises_are_corrected_by_the_load() {
    let rated = json!({ "rated_current": 2000.0 });
    let mut bindings: Vec<_> = PHASES.map(|id| binding(id, ROLE, "°C")).into();
    bindings.push(binding("=Z1", AMBIENT, "°C"));
    bindings.push(binding("=Q1", LOAD, "kA"));
    let judged = |degrees: [f64; 3], load: Option<f64>| {
        let mut values: Vec<_> = degrees.map(|of| tag(Some(of))).into();
        values.extend([tag(Some(20.0)), tag(load)]);
        draw(&mut overlay(&rated), bindings.clone(), &values).expect("it draws")
    };
    let full = judged([45.0, 45.5, 45.0], Some(2.0));
    assert_eq!(shown(&full), [NORMAL; 3]);
    assert!(!full.verdicts[0].is_assumed, "{full:?}");
    assert!(full.verdicts[0].basis.contains(&4), "it rests on the load");
    let half = judged([45.0, 45.5, 45.0], Some(-1.0));
    assert_eq!(shown(&half), [abnormal(1); 3], "25 K are 100 K at the rated load");
    assert!(half.lines[0].text.contains("120 °C at the rated load"), "{half:?}");
    assert_eq!(shown(&judged([21.0, 21.0, 21.0], Some(0.1))), [UNKNOWN; 3], "5 % of the load");
    assert_eq!(shown(&judged([21.0, 21.0, 21.0], None)), [UNKNOWN; 3]);
    assert_eq!(shown(&judged([140.0, 21.0, 21.0], None))[0], abnormal(2));
    let mut overlay = overlay(&rated);
    overlay.configure(bindings[..4].to_vec()).expect("it takes them");
    let findings = overlay.describe().findings;
    assert!(findings.len() == 1 && findings[0].contains(LOAD), "{findings:?}");
}

#[test]
fn missing_roles_and_units_are_findings() {
    let mut overlay = overlay(&json!({ "untelemetered": ["=Q1-QB1-L3"] }));
    let bindings = vec![
        binding("=Q1-QB1-L1", ROLE, "kV"),
        binding("=Q7-QB1-L1", ROLE, "°F"),
        binding("=Z1", AMBIENT, "K"),
    ];
    let values = [45.0, 104.0, 293.15].map(|of| tag(Some(of)));
    let drawing = draw(&mut overlay, bindings, &values).expect("it draws");
    let Description { equipment, findings, .. } = overlay.describe();
    assert_eq!(equipment, [PHASES[0], PHASES[1], PHASES[2], "=Q7-QB1-L1"]);
    assert_eq!(findings.len(), 2, "{findings:?}");
    assert!(findings[0].contains("'kV'") && findings[0].contains("; "));
    assert!(findings[1].contains("=Q1-QB1-L2") && findings[1].contains("untelemetered"));
    let mut by_equipment = drawing.verdicts.clone();
    by_equipment.sort_by_key(|verdict| verdict.equipment);
    let verdicts: Vec<_> = by_equipment.iter().map(|verdict| verdict.verdict).collect();
    assert_eq!(verdicts[..3], [Verdict::Unknown; 3]);
    assert_eq!(verdicts[3], Verdict::Normal, "104 °F are 40 °C: 20 K over the air");
    assert!(by_equipment[2].reason.contains("untelemetered"));
}

#[test]
fn a_text_is_no_temperature_and_is_told() {
    let rated = json!({ "rated_current": 2000.0 });
    let mut bindings: Vec<_> = PHASES.map(|id| binding(id, ROLE, "°C")).into();
    bindings.push(binding("=Z1", AMBIENT, "°C"));
    bindings.push(binding("=Q1", LOAD, "kA"));
    let calm = [45.0, 45.5, 45.0, 20.0, 2.0].map(|of| tag(Some(of)));
    for word in ["", "45", "HOT"] {
        for place in 0..bindings.len() {
            for kind in [ValueKind::F64, ValueKind::Text] {
                let (mut bindings, mut values) = (bindings.clone(), calm.clone());
                bindings[place].kind = kind;
                values[place] = text(word);
                let tag_id = bindings[place].tag_id.clone();
                let mut overlay = overlay(&rated);
                let drawing = draw(&mut overlay, bindings, &values).expect("it draws");
                // Without the air the phases tell enough, as they do where it is bad.
                let own = place.min(2);
                let expected = if place == 3 { NORMAL } else { UNKNOWN };
                assert_eq!(shown(&drawing)[own], expected, "{tag_id}: {drawing:?}");
                assert!(
                    drawing.verdicts[own].verdict != Verdict::Unknown
                        || drawing.verdicts[own].reason.contains(&tag_id),
                    "{drawing:?}"
                );
                assert!(!drawing.verdicts[own].basis.contains(&place), "{drawing:?}");
                let findings = overlay.describe().findings;
                assert_eq!(findings.len(), usize::from(kind == ValueKind::Text), "{findings:?}");
                let is_it = |of: &String| of.contains(&tag_id) && of.contains("is no number; ");
                assert!(findings.iter().all(is_it), "{findings:?}");
            }
        }
    }
}

#[test]
fn several_sensors_of_a_contact_make_one_verdict() {
    let sensor = |name: &str, id| Binding { tag_id: name.into(), ..binding(id, ROLE, "°C") };
    let mut bindings: Vec<_> = PHASES.iter().map(|id| sensor(id, id)).collect();
    bindings.extend(["a", "b", "c"].map(|name| sensor(name, PHASES[0])));
    bindings.push(binding("=Z1", AMBIENT, "°C"));
    let judged = |degrees: [f64; 6]| {
        let values: Vec<_> = degrees.iter().chain(&[20.0]).map(|of| tag(Some(*of))).collect();
        let drawing = draw(&mut overlay(&json!({})), bindings.clone(), &values);
        let drawing = drawing.expect("it draws");
        assert_eq!(drawing.verdicts.len(), 3, "one each");
        drawing.verdict(0).expect("a verdict").clone().verdict
    };
    assert_eq!(judged([45.0, 45.0, 45.0, 45.5, 45.2, 45.1]), Verdict::Normal);
    assert_eq!(judged([45.0, 45.0, 45.0, 45.5, 85.0, 45.1]), Verdict::Abnormal);
    assert_eq!(judged([45.0, 45.0, 45.0, 45.5, f64::NAN, 45.1]), Verdict::Unknown);
}

#[test]
fn judgments_follow_values_and_bindings() {
    let mut bindings: Vec<_> = PHASES.map(|id| binding(id, ROLE, "°C")).into();
    bindings.push(binding("=Z1", AMBIENT, "°C"));
    let values = |hot, air| [hot, Some(45.0), Some(45.0), air].map(tag);
    let mut overlay = overlay(&json!({}));
    let mut judged = |bindings: Option<Vec<Binding>>, values: &[TagValue]| {
        let drawing = draw_at(&mut overlay, bindings, values, 0).expect("it draws");
        drawing.verdict(0).expect("a verdict").verdict
    };
    let calm = values(Some(45.0), Some(20.0));
    assert_eq!(judged(Some(bindings.clone()), &calm), Verdict::Normal);
    assert_eq!(judged(None, &calm), Verdict::Normal);
    assert_eq!(judged(None, &values(None, Some(20.0))), Verdict::Unknown, "its quality changed");
    assert_eq!(judged(None, &values(Some(85.0), Some(20.0))), Verdict::Abnormal);
    bindings[0].unit = "K".into();
    assert_eq!(judged(Some(bindings), &calm), Verdict::Unknown, "45 K are no contact's");
}

/// Wild values of every kind, on bindings of every kind, must not upset a frame.
#[test]
fn hostile_inputs_are_judged() {
    let numbers = [0.0, -0.0, f64::NAN, f64::INFINITY, f64::MIN, f64::MAX, 5e-324, 45.0, 299.0];
    let roles = [ROLE, AMBIENT, LOAD, "other", ""];
    let units = ["°C", "", "°F", "A", "Pa", "\u{0}", "μμ"];
    let ids = ["=Q1-QB1-L1", "=Q1-QB1-L2", "", "-L1", "ü=Ω-L3"];
    use ValueKind::{Bool, DoublePoint, F64, I64};
    let kinds = [F64, Bool, I64, DoublePoint, ValueKind::Text];
    let mut overlays = [
        overlay(&json!({ "equipment": ["=Q1-QB1-L1", "=Q1-QB1-L1", ""] })),
        overlay(&json!({ "rule": "neta", "rated_current": 1.0, "phases": ["", "-L1", "ü"] })),
        overlay(&json!({ "areas": [{ "ambient": "", "equipment": ["", "="] }] })),
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
            let mut of = binding(ids[pick(5)], roles[pick(5)], units[pick(7)]);
            of.kind = kinds[pick(5)];
            bindings.push(of);
            values.push(match pick(4) {
                0 => text(["", "45", "on"][pick(3)]),
                _ => tag(Some(numbers[pick(9)])),
            });
        }
        for overlay in &mut overlays {
            let drawing = draw(overlay, bindings.clone(), &values).expect("it draws");
            let equipment = overlay.describe().equipment.len();
            let mut judged: Vec<_> = drawing.verdicts.iter().map(|of| of.equipment).collect();
            judged.sort_unstable();
            assert_eq!(judged, (0..equipment).collect::<Vec<_>>(), "round {round}");
        }
    }
}

#[test]
fn settings_that_make_no_sense_are_refused() {
    for (more, words) in [
        (json!({ "phases": ["-L1"] }), "phases"),
        (json!({ "least_rise": 0.0 }), "least_rise is 0"),
        (json!({ "rated_current": -5.0 }), "rated_current"),
        (json!({ "areas": [{ "ambient": "=Z1", "equipment": [] }] }), "areas[0]"),
    ] {
        let mut settings = json!({ "equipment": PHASES });
        for (name, value) in more.as_object().into_iter().flatten() {
            settings[name] = value.clone();
        }
        let settings = serde_json::from_value(settings).expect("settings");
        let fault = Thermography::create(settings, host()).err().expect("a fault").to_string();
        assert!(fault.contains(words), "{fault}");
    }
}
