//! Silence: seeded inputs with faults, judged by an oracle that tries every completion of
//! what is missing. `BUSBAR_SILENCE_CASES` sets their number.

use busbar_plugin_sdk::testing::draw;
use busbar_plugin_sdk::{Quality, Reason, Value};
use serde_json::json;

use super::tests::{binding, good, overlay, text, value};
use super::*;

/// Pressures at 20 °C this near to a threshold, bar, are not compared: the oracle has no
/// digits.
const MARGIN: f64 = 0.012;

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

    fn pick<'a, T>(&mut self, of: &'a [T]) -> &'a T {
        &of[self.next() as usize % of.len()]
    }

    fn one_in(&mut self, count: u64) -> bool {
        self.next().is_multiple_of(count)
    }
}

/// Input as the oracle knows it.
#[derive(Clone, Copy, Debug)]
enum Known {
    Value(f64),
    Missing,
    Absent,
}

/// Beattie and Bridgeman's equation in molar volumes, bar.
fn oracle_pressure(density: f64, kelvin: f64) -> f64 {
    let molar_mass = 146.055e-3; // kg/mol
    let volume = molar_mass / density; // m3/mol
    let gas_constant = 56.926 * molar_mass; // J/(mol K)
    let b = 2.51e-3 * molar_mass * (1.0 - 0.846e-3 * molar_mass / volume);
    let a = 74.9 * molar_mass * molar_mass * (1.0 - 0.727e-3 * molar_mass / volume);
    (gas_constant * kelvin * (volume + b) - a) / (volume * volume) / 1e5
}

/// Saturation by the points of CoolProp 8.0.0 (below -49.6 °C: of the solid), interpolated
/// in the logarithm over 1/T; bar.
fn oracle_saturation(celsius: f64) -> f64 {
    const POINTS: [[f64; 2]; 9] = [
        [-63.85, 1.01325],
        [-49.595, 2.3143],
        [-40.0, 3.40817],
        [-30.0, 4.92354],
        [-20.0, 6.89407],
        [-10.0, 9.39747],
        [0.0, 12.51689],
        [20.0, 20.97745],
        [45.0, 37.07782],
    ];
    if celsius >= 45.0 {
        return f64::INFINITY;
    }
    let after = POINTS.iter().position(|[at, _]| *at > celsius).unwrap_or(1).max(1);
    let [[from, low], [to, high]] = [POINTS[after - 1], POINTS[after]];
    let inverse = |celsius: f64| 1.0 / (celsius + 273.15);
    let share = (inverse(celsius) - inverse(from)) / (inverse(to) - inverse(from));
    (low.ln() + share * (high.ln() - low.ln())).exp()
}

/// Pressure at 20 °C, bar, by bisection; none past the vapor.
fn oracle_at_20(pressure: f64, celsius: f64) -> Option<f64> {
    let kelvin = celsius + 273.15;
    let [mut low, mut high] = [1e-9, pressure / (56.926e-5 * kelvin) * 2.2 + 1e-9];
    if oracle_pressure(high, kelvin) < pressure {
        return None;
    }
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if oracle_pressure(middle, kelvin) < pressure { low = middle } else { high = middle }
    }
    Some(oracle_pressure(low, 293.15))
}

/// Judgment on complete inputs; none for what no gas is, or what is too near to call.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Complete {
    Normal,
    Abnormal,
    Impossible,
    TooNear,
}

fn complete(pressure: f64, celsius: f64, contact: bool, is_measured: bool) -> Complete {
    if contact {
        return Complete::Abnormal;
    }
    let saturated = oracle_saturation(celsius);
    let share = pressure / saturated;
    if share > 1.0 && !is_measured {
        return Complete::Impossible;
    }
    let Some(at_20) = oracle_at_20(pressure.min(saturated), celsius) else {
        return Complete::TooNear;
    };
    if [6.4, 10.5].iter().any(|limit| (at_20 - limit).abs() < MARGIN) {
        return Complete::TooNear;
    }
    match at_20 {
        at_20 if at_20 < 6.4 => Complete::Abnormal,
        at_20 if at_20 > 10.5 => Complete::Impossible,
        _ if (share - 0.99).abs() < 0.01 || (share - 1.1).abs() < 0.01 => Complete::TooNear,
        _ if share > 1.1 => Complete::Impossible,
        _ if share > 0.99 => Complete::Abnormal,
        _ => Complete::Normal,
    }
}

/// Verdict that all completions have; none where one is too near.
fn expected(
    [pressure, celsius, air]: [Known; 3],
    is_gauge: bool,
    contact: Option<Known>,
) -> Option<Verdict> {
    let contacts: &[bool] = match contact {
        None => &[false],
        Some(Known::Value(state)) if state > 0.5 => &[true],
        Some(Known::Value(_)) => &[false],
        Some(_) => &[false, true],
    };
    let grid = |known: Known, low: f64, high: f64, steps: i32| match known {
        Known::Value(value) => vec![value],
        _ => (0..=steps)
            .map(|step| low + (high - low) * f64::from(step) / f64::from(steps))
            .collect(),
    };
    let is_measured = matches!(celsius, Known::Value(_));
    let airs = match (is_gauge, air) {
        (false, _) => vec![0.0],
        (true, Known::Absent) => vec![1.013],
        (true, air) => grid(air, 0.5, 1.1, 60),
    };
    let Known::Value(pressure) = pressure else {
        // Without a pressure only the contact can speak.
        return Some(if contacts == [true] { Verdict::Abnormal } else { Verdict::Unknown });
    };
    let mut verdicts = Vec::new();
    for contact in contacts {
        let mut found = [false; 2];
        for air in &airs {
            for celsius in grid(celsius, -60.0, 85.0, 580) {
                if pressure + air < 0.0 && !contact {
                    continue;
                }
                match complete((pressure + air).max(0.0), celsius, *contact, is_measured) {
                    Complete::Normal => found[0] = true,
                    Complete::Abnormal => found[1] = true,
                    Complete::Impossible => {}
                    Complete::TooNear => return None,
                }
            }
        }
        verdicts.push(match found {
            [true, false] => Verdict::Normal,
            [false, true] => Verdict::Abnormal,
            _ => Verdict::Unknown,
        });
    }
    let is_agreed = verdicts.iter().all(|verdict| *verdict == verdicts[0]);
    Some(if is_agreed { verdicts[0] } else { Verdict::Unknown })
}

/// Value of a tag, with what the oracle may know of it; one in four is faulty.
fn input(random: &mut Random, number: f64, implausible: f64) -> (TagValue, Known) {
    if !random.one_in(4) {
        return (good(number), Known::Value(number));
    }
    let tag = match random.next() % 6 {
        0 => value(Value::F64(number), Quality::Bad(Reason::Stale)),
        1 => value(None, Quality::Bad(Reason::NotConnected)),
        2 => good(f64::NAN),
        4 => text(["", "7", "20"][random.next() as usize % 3]),
        3 => value(Value::F64(number), Quality::Uncertain(Reason::Stale)),
        _ => good(implausible),
    };
    (tag, Known::Missing)
}

/// Name, pascals or kelvins of one, and offset of a unit.
type Unit = (&'static str, f64, f64);

const PRESSURES: [Unit; 6] = [
    ("bar", 1.0, 0.0),
    ("kPa", 0.01, 0.0),
    ("MPa", 10.0, 0.0),
    ("psi", 0.068_947_572_9, 0.0),
    ("", 1.0, 0.0),
    ("km", 1.0, 0.0),
];
const TEMPERATURES: [Unit; 5] = [
    ("°C", 1.0, 0.0),
    ("°F", 5.0 / 9.0, -160.0 / 9.0),
    ("K", 1.0, -273.15),
    ("", 1.0, 0.0),
    ("kW", 1.0, 0.0),
];

#[test]
fn silence_means_judged_healthy() {
    let cases = std::env::var("BUSBAR_SILENCE_CASES");
    let cases: u64 = cases.map_or(2_000, |cases| cases.parse().expect("a number"));
    let mut compared = 0_u64;
    let mut counts = [0_u64; 4];
    for case in 0..cases {
        let mut random = Random(case);
        let is_gauge = random.one_in(3);
        let offset = if is_gauge { 1.013 } else { 0.0 };
        let settings = json!({
            "gauge": is_gauge, "filling": 7.0 - offset, "alarm": 6.4 - offset,
            "lock_out": 6.0 - offset,
        });
        let celsius = random.within(-45.0, 60.0);
        let density = random.within(5.0, 60.0);
        let physical = oracle_pressure(density, celsius + 273.15).min(oracle_saturation(celsius));
        let noise = random.within(0.98, 1.02);
        let wild = random.within(-2.0, 30.0);
        let bar = if random.one_in(10) { wild } else { physical * noise - offset };
        let (unit, factor, _) = *random.pick(&PRESSURES);
        let mut tags = Vec::new();
        let (mut pressure_tag, mut pressure) = input(&mut random, bar, -3.0);
        pressure_tag.value = pressure_tag.value.map(|of| scaled(of, |bar| bar / factor));
        if unit == "km" {
            pressure = Known::Missing;
        }
        tags.push((binding("=Q1-QA1", "sf6_pressure", unit), pressure_tag));
        let mut temperature = Known::Absent;
        if !random.one_in(8) {
            let (unit, factor, offset) = *random.pick(&TEMPERATURES);
            // Implausible by itself, or beside its neighbors.
            let wild = *random.pick(&[-85.0, 300.0, celsius.clamp(-30.0, 40.0) + 40.0]);
            let (mut tag, known) = input(&mut random, celsius, wild);
            tag.value = tag.value.map(|of| scaled(of, |celsius| (celsius - offset) / factor));
            temperature = if unit == "kW" { Known::Missing } else { known };
            tags.push((binding("=Q1-QA1", "sf6_temperature", unit), tag));
            // Neighbors that are as warm, for the most part.
            for id in ["=Q2-QA1", "=Q3-QA1", "=Q4-QA1"] {
                let near = celsius.clamp(-30.0, 40.0) + random.within(-5.0, 5.0);
                tags.push((binding(id, "sf6_temperature", "°C"), good(near)));
            }
            // Too near to the distance from neighbors that is believed.
            if (celsius - celsius.clamp(-30.0, 40.0)).abs() > 19.0 {
                continue;
            }
        }
        let mut air = Known::Absent;
        if random.one_in(3) {
            let here = random.within(0.7, 1.05);
            let (mut tag, known) = input(&mut random, here, 3.0);
            tag.value = tag.value.map(|of| scaled(of, |bar| bar * 1000.0));
            air = known;
            tags.push((binding("=Q1", "air_pressure", "hPa"), tag));
        }
        let mut contact = None;
        if random.one_in(3) {
            let state = random.one_in(4);
            let bad = random.one_in(4);
            let quality = if bad { Quality::Bad(Reason::Stale) } else { Quality::Good };
            contact = Some(if bad { Known::Missing } else { Known::Value(f64::from(state)) });
            let tag = match bad && random.one_in(2) {
                true => text(["", "0", "off"][random.next() as usize % 3]),
                false => value(Value::Bool(state), quality),
            };
            tags.push((binding("=Q1-QA1", "density_contact", ""), tag));
        }
        // Bindings come in any order.
        for place in (1..tags.len()).rev() {
            tags.swap(place, random.next() as usize % (place + 1));
        }
        let (bindings, values): (Vec<_>, Vec<_>) = tags.into_iter().unzip();
        let Some(expected) = expected([pressure, temperature, air], is_gauge, contact) else {
            counts[3] += 1;
            continue;
        };
        let mut overlay = overlay(&settings);
        for _ in 0..2 {
            // The second time it is reloaded.
            let drawing = draw(&mut overlay, bindings.clone(), &values).expect("it draws");
            let verdict = drawing.verdict(0).expect("a verdict");
            let about = format!(
                "case {case}: {bar} bar {pressure:?}, {celsius} °C {temperature:?}, air {air:?}, \
                 gauge {is_gauge}, contact {contact:?}: {verdict:?}"
            );
            assert_eq!(verdict.verdict, expected, "{about}");
            assert_eq!(verdict.reason.is_empty(), verdict.reason.trim().is_empty(), "{about}");
            assert!(verdict.verdict != Verdict::Unknown || !verdict.reason.is_empty(), "{about}");
            assert_eq!(drawing.verdicts.len(), overlay.describe().equipment.len(), "{about}");
        }
        counts[expected as usize % 3] += 1;
        compared += 1;
    }
    println!("{compared} compared; by verdict, and too near: {counts:?}");
    assert!(compared * 10 > cases * 6, "most are compared: {counts:?}");
    assert!(counts[..3].iter().all(|count| count * 20 > compared), "{counts:?}");
}

fn scaled(value: Value, scale: impl Fn(f64) -> f64) -> Value {
    match value {
        Value::F64(number) => Value::F64(scale(number)),
        other => other,
    }
}
