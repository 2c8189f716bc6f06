//! Verdicts on monitors: cases, and the silence test.

use std::collections::BTreeSet;
use std::time::Duration;

use busbar_plugin_sdk::testing::{
    AdmittedVerdicts, Drawing, InputGenerator, check_verdicts, draw_at, host, silence_cases,
};
use busbar_plugin_sdk::{Origin, Quality, Reason, Severity, Text, Value, ValueKind, Verdict};
use dga::c57_104::{self, GASES, Status};
use dga::{Concentration, Gas, Sample};

use crate::*;

/// Quiet oil of a sealed transformer, ppm, in the order of the gases.
const CALM: [f64; 9] = [14.0, 7.0, 9.0, 5.0, 0.1, 150.0, 1300.0, 2400.0, 62_000.0];

fn plugin(untelemetered: &[&str]) -> GasAnalysis {
    let monitors = serde_json::json!({ "equipment": ["T1"], "untelemetered": untelemetered });
    let monitors = Some(serde_json::from_value(monitors).expect("settings"));
    GasAnalysis::create(Settings { monitors, ..Settings::default() }, host()).expect("it is made")
}

fn binding(gas: Gas, unit: &str) -> Binding {
    Binding {
        node: 3,
        kind: ValueKind::F64,
        limit_low: None,
        limit_high: None,
        tag_id: gas.formula().into(),
        tag_name: String::new(),
        unit: unit.into(),
        node_id: "T1".into(),
        role: format!("gas_{}", gas.formula().to_lowercase()),
    }
}

fn good(value: f64) -> TagValue {
    let age = Duration::from_secs(2);
    TagValue { value: Some(Value::F64(value)), quality: Quality::Good, age, origin: Origin::LIVE }
}

fn stale(value: f64) -> TagValue {
    TagValue { quality: Quality::Bad(Reason::Stale), ..good(value) }
}

/// Draws these gases, in ppm.
fn drawn(gases: &[(Gas, TagValue)]) -> Drawing {
    let bindings = gases.iter().map(|(gas, _)| binding(*gas, "ppm")).collect();
    let values: Vec<TagValue> = gases.iter().map(|(_, value)| value.clone()).collect();
    draw_at(&mut plugin(&[]), Some(bindings), &values, 0).expect("it draws")
}

fn calm() -> Vec<(Gas, TagValue)> {
    Gas::ALL.into_iter().zip(CALM.map(good)).collect()
}

#[track_caller]
fn check(gases: &[(Gas, TagValue)], expected: Verdict, reason: &str) -> Drawing {
    let drawing = drawn(gases);
    let verdict = drawing.verdict(0).expect("a verdict");
    assert_eq!((verdict.verdict, verdict.reason.as_str()), (expected, reason));
    drawing
}

fn replaced(gas: Gas, value: TagValue) -> Vec<(Gas, TagValue)> {
    let mut gases = calm();
    gases.iter_mut().filter(|(own, _)| *own == gas).for_each(|(_, of)| *of = value.clone());
    gases
}

fn without(gases: &[Gas]) -> Vec<(Gas, TagValue)> {
    calm().into_iter().filter(|(gas, _)| !gases.contains(gas)).collect()
}

#[test]
fn a_gas_that_is_not_known_leaves_it_unknown_unless_others_decide() {
    check(&calm(), Verdict::Normal, "");
    check(&replaced(Gas::Co, stale(1.0)), Verdict::Unknown, "CO stale for 2 s");
    let mut high = replaced(Gas::C2h2, good(200.0));
    high[5].1 = stale(150.0);
    let told = "status 3 at least; not judged: CO stale for 2 s";
    let drawing = check(&high, Verdict::Abnormal, told);
    assert_eq!(drawing.verdicts[0].basis, [4], "C2H2 alone decides");
    assert_eq!(drawing.lines[0].severity, Severity::Alarm);
    // Above one table and not the other: the ratio of O2 and N2 decides.
    let breathing = replaced(Gas::H2, good(60.0));
    check(&breathing, Verdict::Normal, "");
    let mut torn = breathing;
    torn[7].1 = stale(2400.0);
    check(&torn, Verdict::Unknown, "O2 stale for 2 s");
    let calm = check(&replaced(Gas::O2, stale(1.0)), Verdict::Normal, "");
    assert_eq!(calm.verdicts[0].basis, [0, 1, 2, 3, 4, 5, 6], "both tables agree");
    assert_eq!(calm.states.len(), 8, "the state does not rest on O2");
}

#[test]
fn gases_that_nobody_measures_are_no_health() {
    let only_hydrogen = [(Gas::H2, good(14.0))];
    let missing = "CH4, C2H6, C2H4, C2H2 not measured";
    let drawing = check(&only_hydrogen, Verdict::Unknown, missing);
    assert_eq!(drawing.states[0].entry, crate::verdict::NOT_JUDGED as usize);
    let high = drawn(&[(Gas::H2, good(300.0))]);
    assert_eq!(high.verdicts[0].verdict, Verdict::Abnormal);
    let oxides = without(&[Gas::Co, Gas::Co2]);
    check(&oxides, Verdict::Normal, "assumed: CO and CO2 not measured, as in healthy oil");
    check(&without(&[Gas::O2, Gas::N2]), Verdict::Normal, "");
    let mut torn = without(&[Gas::O2, Gas::N2]);
    torn[0].1 = good(60.0);
    let told = "O2 and N2 are not measured, and either table may hold";
    check(&torn, Verdict::Unknown, told);
    check(&[], Verdict::Unknown, "no tag has the role of a gas");
}

#[test]
fn what_bindings_lack_is_a_finding_unless_it_is_declared() {
    let findings = |untelemetered: &[&str], bindings: Vec<Binding>| {
        let mut plugin = plugin(untelemetered);
        plugin.configure(bindings).expect("it takes them");
        plugin.describe().findings
    };
    let of = findings(&[], vec![binding(Gas::H2, "ppm")]);
    assert_eq!(of.len(), 1);
    let words = "no tag at 'T1' has the role 'gas_ch4', 'gas_c2h6', 'gas_c2h4', 'gas_c2h2'; ";
    assert!(of[0].starts_with(words), "{of:?}");
    assert!(findings(&["T1"], vec![binding(Gas::H2, "ppm")]).is_empty());
    let all = |unit| Gas::ALL.into_iter().map(|gas| binding(gas, unit)).collect::<Vec<_>>();
    assert!(findings(&[], all("µL/L")).is_empty());
    let of = findings(&[], all("°C"));
    assert!(of[0].contains("'H2'") && of[0].contains("no unit of concentration; "), "{of:?}");
    let mut twice = all("ppm");
    twice.push(binding(Gas::H2, "ppm"));
    assert!(findings(&[], twice)[0].contains("are both in the role 'gas_h2' at 'T1'; "));
    let mut declared = plugin(&["T1"]);
    let drawing = draw_at(&mut declared, Some(Vec::new()), &[], 0).expect("it draws");
    assert_eq!(drawing.verdicts[0].reason, "declared untelemetered");
}

#[test]
fn units_of_gases_and_of_what_comes_besides_are_converted() {
    let mut bindings: Vec<Binding> = Gas::ALL.into_iter().map(|gas| binding(gas, "%")).collect();
    let extra = |role: &str, unit: &str| Binding { role: role.into(), ..binding(Gas::H2, unit) };
    bindings.extend([extra("gas_top_oil", "°F"), extra("gas_load", "%")]);
    let mut values: Vec<TagValue> = CALM.iter().map(|ppm| good(ppm / 1e4)).collect();
    values.extend([good(212.0), good(80.0)]);
    let mut plugin = plugin(&[]);
    let drawing = draw_at(&mut plugin, Some(bindings), &values, 0).expect("it draws");
    assert_eq!(drawing.verdicts[0].verdict, Verdict::Normal, "{drawing:?}");
    assert!(plugin.describe().findings.is_empty(), "{:?}", plugin.describe().findings);
    let records = plugin.chart_records().expect("they are read");
    let has = |wanted: f32| records.values.iter().any(|value| (value - wanted).abs() < 1e-3);
    assert!(has(14.0) && has(100.0) && has(0.8), "{:?}", records.values);
    let mut none: Vec<Binding> = Gas::ALL.into_iter().map(|gas| binding(gas, "ppm")).collect();
    none[2].unit = String::new();
    let drawing = draw_at(&mut plugin, Some(none), &CALM.map(good), 0).expect("it draws");
    assert_eq!(drawing.verdicts[0].reason, "assumed: C2H6 is in ppm");
}

#[test]
fn a_text_is_no_gas_and_is_told() {
    let text = |word| Value::Text(Text::new(word).expect("it fits"));
    for word in ["", "14", "NORMAL"] {
        let word = TagValue { value: Some(text(word)), ..good(0.0) };
        check(&replaced(Gas::H2, word.clone()), Verdict::Unknown, "H2 is no finite number");
        let mut bindings: Vec<Binding> = Gas::ALL.map(|gas| binding(gas, "ppm")).into();
        bindings[0].kind = ValueKind::Text;
        let mut plugin = plugin(&[]);
        let mut values = CALM.map(good);
        values[0] = word;
        let drawing = draw_at(&mut plugin, Some(bindings), &values, 0).expect("it draws");
        assert_eq!(drawing.verdicts[0].verdict, Verdict::Unknown);
        assert_eq!(drawing.verdicts[0].reason, "H2 is no number");
        let findings = plugin.describe().findings;
        let [finding] = findings.as_slice() else { panic!("{findings:?}") };
        assert!(finding.starts_with("the tag 'H2' in the role 'gas_h2' at 'T1' is no number; "));
    }
}

/// Concentrations on both sides of the limits of every gas, ppm.
fn concentration(inputs: &mut InputGenerator, gas: Gas) -> f64 {
    match gas {
        Gas::O2 => inputs.choice(&[2400.0, 30_000.0]),
        Gas::N2 => 62_000.0,
        Gas::Co => inputs.choice(&[150.0, 150.0, 700.0, 2000.0]),
        Gas::Co2 => inputs.choice(&[1300.0, 1300.0, 8000.0, 20_000.0]),
        Gas::C2h2 => inputs.choice(&[0.1, 0.1, 0.1, 1.5, 50.0]),
        _ => inputs.choice(&[5.0, 5.0, 5.0, 45.0, 60.0, 500.0]),
    }
}

/// Adds the verdicts on all samples that these gases may be.
fn admitted(possible: &[(Gas, Vec<f64>)], ratios: &[[f64; 2]]) -> AdmittedVerdicts {
    let of = |ppm| Concentration::measured(ppm).expect("a concentration");
    let mut samples: Vec<Sample> = ratios
        .iter()
        .map(|[o2, n2]| Sample::new().with(Gas::O2, of(*o2)).with(Gas::N2, of(*n2)))
        .collect();
    for (gas, ppm) in possible {
        let with = |sample: &Sample| -> Vec<Sample> {
            ppm.iter().map(|ppm| sample.with(*gas, of(*ppm))).collect()
        };
        samples = samples.iter().flat_map(with).collect();
    }
    let mut admitted = AdmittedVerdicts::default();
    for sample in samples {
        let status = c57_104::status(&sample, c57_104::Age::Unknown);
        admitted.add(status.expect("a status") > Status::One);
    }
    admitted
}

#[test]
fn verdicts_are_never_silent() {
    let mut seen = BTreeSet::new();
    for case in 0..silence_cases() {
        let mut inputs = InputGenerator::new(case);
        let (mut bindings, mut values) = (Vec::new(), Vec::new());
        let (mut possible, mut ratio) = (Vec::new(), [None; 2]);
        let spares = inputs.one_in(2);
        for gas in Gas::ALL {
            let is_bound = !inputs.one_in(12);
            let (unit, factor) =
                inputs.choice(&[("ppm", 1.0), ("ppm", 1.0), ("%", 1e-4), ("bar", 1.0)]);
            let unit = if spares && unit == "bar" { "ppm" } else { unit };
            let ppm = concentration(&mut inputs, gas);
            let (mut value, mut fault) = inputs.input(Value::F64(ppm * factor));
            if spares && !inputs.one_in(6) {
                (value, fault) = (good(ppm * factor), None);
            }
            if is_bound {
                bindings.push(binding(gas, unit));
                values.push(value);
            }
            let is_known = is_bound && fault.is_none() && unit != "bar";
            let all = match gas {
                _ if is_known => vec![ppm],
                // Taken to be as in healthy oil where nobody measures it.
                Gas::Co | Gas::Co2 if !is_bound => vec![0.0],
                _ => vec![0.0, 1e6],
            };
            match gas {
                Gas::O2 => ratio[0] = is_known.then_some(ppm),
                Gas::N2 => ratio[1] = is_known.then_some(ppm),
                _ => possible.push((gas, all)),
            }
        }
        assert_eq!(possible.len(), GASES.len());
        let ratios = match ratio {
            [Some(o2), Some(n2)] => vec![[o2, n2]],
            _ => vec![[1.0, 100.0], [1.0, 1.0]],
        };
        let drawing = draw_at(&mut plugin(&[]), Some(bindings), &values, 0).expect("it draws");
        let story = format!("case {case}: {possible:?}, {ratios:?}");
        check_verdicts(&drawing, 1, &values, &story);
        admitted(&possible, &ratios).check(&drawing, 0, &story);
        seen.insert(drawing.verdicts[0].verdict);
    }
    assert_eq!(seen.len(), 3, "each verdict is met: {seen:?}");
}
