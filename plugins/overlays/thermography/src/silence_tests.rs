//! Silence: seeded inputs with faults, judged by an oracle that tries completions of what is
//! missing. `BUSBAR_SILENCE_CASES` sets their number.

use busbar_plugin_sdk::testing::draw;
use busbar_plugin_sdk::{Quality, Reason};
use serde_json::json;

use super::tests::{binding, overlay, text, value};
use super::*;

/// Generator of pseudorandom numbers (splitmix64).
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut bits = self.0;
        bits = (bits ^ (bits >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        bits = (bits ^ (bits >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        bits ^ (bits >> 31)
    }

    fn within(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * (self.next() >> 11) as f64 / (1_u64 << 53) as f64
    }

    fn one_in(&mut self, count: u64) -> bool {
        self.next().is_multiple_of(count)
    }
}

/// Inputs of one device as the oracle knows them.
#[derive(Clone, Debug)]
struct Case {
    is_neta: bool,
    phases: Vec<Option<f64>>,
    airs: Vec<Option<f64>>,
    /// Share of the rated current; none where it is not corrected.
    load: Option<Option<f64>>,
}

/// Complete inputs: contact, peers, air, factor of the load. `slack` moves all limits by so
/// much towards a defect.
fn is_defect(
    is_neta: bool,
    hot: f64,
    peers: &[f64],
    (air, factor): (f64, f64),
    slack: f64,
) -> bool {
    let over_air = factor * (hot - air);
    if is_neta {
        let coolest = peers.iter().copied().fold(hot, f64::min);
        let compared = if peers.is_empty() { over_air } else { factor * (hot - coolest) };
        return compared >= 0.5 - slack || over_air >= 40.5 - slack;
    }
    if air + over_air > 90.0 - slack {
        return true;
    }
    let Some(coolest) = peers.iter().copied().reduce(f64::min) else {
        return over_air > 50.0 - slack;
    };
    let above = factor * (hot - coolest.clamp(air.min(hot), hot));
    over_air >= 10.0 - slack && above >= 0.35 * over_air - slack
}

/// Verdict that all completions have.
fn expected(case: &Case, own: usize, slack: f64) -> Verdict {
    let Some(hot) = case.phases[own].filter(|of| (-60.0..=300.0).contains(of)) else {
        return Verdict::Unknown;
    };
    let phases = case.phases.iter().enumerate().filter(|(place, _)| *place != own);
    let peers: Vec<Option<f64>> =
        phases.map(|(_, of)| of.filter(|of| (-60.0..=300.0).contains(of))).collect();
    let lowest = peers.iter().flatten().copied().fold(hot, f64::min);
    let mut airs: Vec<f64> = Vec::new();
    let known = |air: &Option<f64>| air.filter(|air| (-60.0..=60.0).contains(air));
    airs.extend(case.airs.iter().filter_map(known));
    if case.airs.is_empty() || case.airs.iter().any(|air| known(air).is_none()) {
        let highest = (lowest + 5.0).min(60.0);
        let steps = ((highest + 60.0) / 0.1) as i32;
        airs.extend((0..=steps).map(|step| -60.0 + 0.1 * f64::from(step)).chain([highest]));
    }
    let mut found = [false; 2];
    for air in airs {
        if hot < air - 5.0 - 1e-9 {
            return Verdict::Unknown;
        }
        let factors = match case.load {
            None => vec![1.0],
            Some(Some(share)) if share >= 0.4 => vec![share.powi(-2).max(1.0)],
            // Next to no load hides anything.
            Some(_) => {
                found[1] = true;
                vec![1.0]
            }
        };
        let believed: Vec<Option<f64>> =
            peers.iter().map(|peer| peer.filter(|peer| *peer >= air - 5.0 - 1e-9)).collect();
        let missing = believed.iter().filter(|peer| peer.is_none()).count();
        let have: Vec<f64> = believed.into_iter().flatten().collect();
        // By the rule the air is compared with where no like is known.
        let completions: &[f64] = match (missing, case.is_neta && have.is_empty()) {
            (0, _) | (_, true) => &[f64::NAN],
            _ => &[air - 5.0, air, 0.5 * (air + hot), hot, 300.0],
        };
        for completion in completions {
            let mut all = have.clone();
            all.extend(Some(*completion).filter(|of| !of.is_nan()));
            for factor in &factors {
                found[usize::from(is_defect(case.is_neta, hot, &all, (air, *factor), slack))] =
                    true;
            }
        }
    }
    match found {
        [true, false] => Verdict::Normal,
        [false, true] => Verdict::Abnormal,
        _ => Verdict::Unknown,
    }
}

/// Value of a tag with what the oracle may know of it.
fn input(random: &mut Random, celsius: f64, limit: f64) -> (TagValue, Option<f64>) {
    if random.one_in(20) {
        return (text(["", "20", "HOT"][random.next() as usize % 3]), None);
    }
    let (number, quality) = match random.next() % 20 {
        0 => (celsius, Quality::Bad(Reason::Stale)),
        1 => (celsius, Quality::Uncertain(Reason::Stale)),
        2 => (f64::NAN, Quality::Good),
        3 => (limit + random.within(1.0, 1e6), Quality::Good),
        4 => (random.within(-59.0, 10.0), Quality::Good),
        _ => (celsius, Quality::Good),
    };
    let known = Some(number).filter(|of| quality == Quality::Good && of.is_finite());
    (value(number, quality), known)
}

#[test]
fn silence_means_judged_healthy() {
    let cases = std::env::var("BUSBAR_SILENCE_CASES");
    let cases: u64 = cases.map_or(2_000, |cases| cases.parse().expect("a number"));
    let mut counts = [0_u64; 3];
    let mut compared = 0_u64;
    for number in 0..cases {
        let mut random = Random(number);
        let is_neta = random.one_in(4);
        let rated = random.one_in(3);
        let mut settings = json!({ "rule": if is_neta { "neta" } else { "dl_t_664" } });
        if rated {
            settings["rated_current"] = json!(1000.0);
        }
        let air = random.within(-20.0, 40.0);
        let base = air + random.within(0.0, 70.0);
        let mut tags = Vec::new();
        let mut case = Case { is_neta, phases: Vec::new(), airs: Vec::new(), load: None };
        let count = 1 + random.next() as usize % 3;
        settings["equipment"] = json!([]);
        for phase in 1..=count {
            let rise =
                if random.one_in(3) { random.within(0.0, 80.0) } else { random.within(0.0, 3.0) };
            let (mut tag, known) = input(&mut random, base + rise, 300.0);
            // Units of all kinds, and one that is none of temperature.
            let unit = ["°C", "°C", "°F", "K", "", "kV"][random.next() as usize % 6];
            tag.value = tag.value.map(|of| in_unit(of, unit));
            case.phases.push(known.filter(|_| unit != "kV"));
            tags.push((binding(&format!("=Q1-QB1-L{phase}"), "contact_temperature", unit), tag));
        }
        for place in 0..random.next() as usize % 3 {
            let off = if random.one_in(2) { 0.0 } else { random.within(-3.0, 3.0) };
            let (tag, known) = input(&mut random, air + off, 60.0);
            case.airs.push(known);
            tags.push((binding(&format!("=Z{place}"), "ambient", "°C"), tag));
        }
        if rated {
            let share = random.within(0.1, 1.3);
            let bad = random.one_in(4);
            let quality = if bad { Quality::Bad(Reason::Stale) } else { Quality::Good };
            case.load = Some(Some(share).filter(|_| !bad));
            tags.push((binding("=Q1", "load_current", "A"), value(1000.0 * share, quality)));
        }
        for place in (1..tags.len()).rev() {
            tags.swap(place, random.next() as usize % (place + 1));
        }
        let (bindings, values): (Vec<_>, Vec<_>) = tags.into_iter().unzip();
        let mut overlay = overlay(&settings);
        let drawing = draw(&mut overlay, bindings, &values).expect("it draws");
        let equipment = overlay.describe().equipment;
        for own in 0..count {
            let expected_verdicts = [-0.25, 0.0, 0.25].map(|slack| expected(&case, own, slack));
            if expected_verdicts.iter().any(|verdict| *verdict != expected_verdicts[1]) {
                // Too near to a limit for completions in steps.
                continue;
            }
            let id = format!("=Q1-QB1-L{}", own + 1);
            let place = equipment.iter().position(|of| *of == id).expect("it is described");
            let verdict = drawing.verdict(place).expect("a verdict");
            assert_eq!(
                verdict.verdict,
                expected_verdicts[1],
                "case {number}, L{}: {case:?}: {verdict:?}",
                own + 1
            );
            assert!(verdict.verdict != Verdict::Unknown || !verdict.reason.is_empty());
            counts[verdict.verdict as usize % 3] += 1;
            compared += 1;
        }
    }
    println!("{compared} compared, by verdict: {counts:?}");
    assert!(compared > cases, "most are compared: {compared}");
    assert!(counts.iter().all(|count| count * 20 > compared), "{counts:?}");
}

fn in_unit(value: busbar_plugin_sdk::Value, unit: &str) -> busbar_plugin_sdk::Value {
    match (value, unit) {
        (busbar_plugin_sdk::Value::F64(celsius), "°F") => {
            busbar_plugin_sdk::Value::F64(celsius * 1.8 + 32.0)
        }
        (busbar_plugin_sdk::Value::F64(celsius), "K") => {
            busbar_plugin_sdk::Value::F64(celsius + 273.15)
        }
        (other, _) => other,
    }
}
