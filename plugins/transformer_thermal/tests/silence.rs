//! Seeded courses of load and ambient temperature with faults: bad, missing and implausible
//! values, gaps, hidden frames, reconfiguration, restarts, and a clock that is set back.
//!
//! The verdict is never normal where the true temperature, which the overlay does not see,
//! is above its limit, and never unknown where the least and the greatest plausible history
//! give one verdict. `BUSBAR_SILENCE_CASES` sets the number of cases.

mod common;

use std::path::PathBuf;
use std::time::Duration;

use busbar_plugin_sdk::testing::{Drawing, draw_at, host};
use busbar_plugin_sdk::{Binding, Plugin, Quality, Reason, TagValue, Value, ValueKind, Verdict};
use common::Random;
use transformer_thermal::{Parameters, Temperatures, TransformerThermal};

/// Cases where the environment names no other number.
const USUAL_CASES: u64 = 2_000;
/// Frames of a case at least.
const MIN_FRAMES: usize = 80;
/// Longest time between two frames that are drawn one after the other, minutes.
const MAX_STEP: usize = 4;
const NANOS_A_MINUTE: i64 = 60_000_000_000;
const START: i64 = 1_700_000_000_000_000_000;
/// Longest step between frames that counts as seen, minutes.
const LONGEST_STEP: usize = 5;
/// Plausible load and ambient temperature of all cases.
const LOAD: [f64; 2] = [0.0, 1.8];
const AMBIENT: [f64; 2] = [-25.0, 40.0];
/// Difference up to which numbers that are worked out otherwise decide alike, K.
const ROUNDING: f64 = 1e-6;

/// Column of table 4, written down a second time.
struct Kind {
    cooling: &'static str,
    restricted: bool,
    size: &'static str,
    exponents: [f64; 2],
    k: [f64; 3],
    minutes: [f64; 2],
}

const KINDS: [Kind; 7] = [
    kind("ONAN", "small", false, [0.8, 1.6], [1.0, 1.0, 2.0], [180.0, 4.0]),
    kind("ONAN", "medium", false, [0.8, 1.3], [0.5, 2.0, 2.0], [210.0, 10.0]),
    kind("ONAF", "medium", false, [0.8, 1.3], [0.5, 2.0, 2.0], [150.0, 7.0]),
    kind("OFAF", "medium", false, [1.0, 1.3], [1.0, 1.3, 1.0], [90.0, 7.0]),
    kind("ODAF", "medium", false, [1.0, 2.0], [1.0, 1.0, 1.0], [90.0, 7.0]),
    kind("ONAF", "medium", true, [0.8, 1.3], [0.5, 3.0, 2.0], [150.0, 7.0]),
    kind("OFAF", "medium", true, [1.0, 1.3], [1.0, 1.45, 1.0], [90.0, 7.0]),
];

const fn kind(
    cooling: &'static str,
    size: &'static str,
    restricted: bool,
    exponents: [f64; 2],
    k: [f64; 3],
    minutes: [f64; 2],
) -> Kind {
    Kind { cooling, restricted, size, exponents, k, minutes }
}

/// Fault of the inputs for some minutes.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Fault {
    BadLoad,
    NoLoad,
    ImplausibleLoad,
    BadAmbient,
    ImplausibleAmbient,
    /// Nobody draws.
    NoFrame,
}

const FAULTS: [Fault; 6] = [
    Fault::BadLoad,
    Fault::NoLoad,
    Fault::ImplausibleLoad,
    Fault::BadAmbient,
    Fault::ImplausibleAmbient,
    Fault::NoFrame,
];

/// Distances from the two solutions to the bounds of other plausible histories, K: the top
/// oil less the slower difference may fall with the load before it rises, so a history in
/// between may be cooler than the least load, or hotter than the greatest.
fn turning(of: &Parameters) -> [f64; 2] {
    let steady = |load: f64| {
        let losses = (1.0 + of.loss_ratio * load * load) / (1.0 + of.loss_ratio);
        let rise = of.hot_spot_factor * of.gradient * load.powf(of.winding_exponent);
        of.top_oil_rise * losses.powf(of.oil_exponent) - (of.k[1] - 1.0) * rise
    };
    let loads = (0..=180).map(|load| steady(f64::from(load) / 100.0));
    let [least, greatest] = LOAD.map(steady);
    [least - loads.fold(f64::INFINITY, f64::min), (least - greatest).max(0.0)]
}

/// A transformer, its true course by minutes, and what goes wrong.
struct Case {
    settings: String,
    parameters: Parameters,
    /// Frames in the order of their minutes.
    course: Vec<Instant>,
}

/// Instant of a frame, and what was so since the frame before.
#[derive(Clone, Copy)]
struct Instant {
    minute: usize,
    /// Load per unit and ambient temperature.
    inputs: [f64; 2],
    fault: Option<Fault>,
}

/// Counts of verdicts over all cases.
#[derive(Default, Debug)]
struct Counts {
    normal: u64,
    abnormal: u64,
    unknown: u64,
    /// Frames in which the truth was abnormal.
    truly_abnormal: u64,
}

fn case(random: &mut Random) -> Case {
    let kind = &KINDS[random.below(KINDS.len())];
    let [top_oil_rise, gradient] = [random.between(30.0, 60.0), random.between(8.0, 22.0)];
    let hot_spot_factor = random.between(1.0, 1.5);
    let loss_ratio = random.between(1.0, 12.0);
    let parameters = Parameters {
        oil_minutes: kind.minutes[0],
        winding_minutes: kind.minutes[1],
        top_oil_rise,
        gradient,
        hot_spot_factor,
        loss_ratio,
        oil_exponent: kind.exponents[0],
        winding_exponent: kind.exponents[1],
        k: kind.k,
    };
    let settings = format!(
        r#""equipment": "=T1", "cooling": "{}", "size": "{}", "restricted_oil_flow": {}, "top_oil_rise": {top_oil_rise},
           "gradient": {gradient}, "hot_spot_factor": {hot_spot_factor},
           "loss_ratio": {loss_ratio}, "plausible_load": [{}, {}]"#,
        kind.cooling, kind.size, kind.restricted, LOAD[0], LOAD[1],
    );
    Case { settings, parameters, course: course(random) }
}

fn course(random: &mut Random) -> Vec<Instant> {
    let frames = MIN_FRAMES + random.below(200);
    let mut load = random.between(0.0, 1.2);
    let mut ambient = random.between(-5.0, 35.0);
    let mut minute = 0;
    let mut course = Vec::with_capacity(frames);
    for _ in 0..frames {
        if random.one_in(25) {
            let range = if random.one_in(3) { [1.2, LOAD[1]] } else { [0.0, 1.2] };
            load = random.between(range[0], range[1]);
        }
        ambient = (ambient + random.between(-0.4, 0.4)).clamp(AMBIENT[0], AMBIENT[1]);
        minute += 1 + random.below(MAX_STEP);
        course.push(Instant { minute, inputs: [load, ambient], fault: None });
    }
    for _ in 0..random.below(5) {
        let fault = FAULTS[random.below(FAULTS.len())];
        let from = random.below(frames);
        // A gap without a frame is longer than a step that counts as seen.
        let to = frames.min(from + LONGEST_STEP + 1 + random.below(80));
        let hidden = random.one_in(2).then(|| random.between(LOAD[0], LOAD[1]));
        if course[from..to].iter().any(|instant| instant.fault.is_some()) {
            continue;
        }
        for instant in &mut course[from..to] {
            instant.fault = Some(fault);
            instant.inputs[0] = hidden.unwrap_or(instant.inputs[0]);
        }
    }
    course
}

impl Case {
    /// Overlay of the case; with a file it keeps its state.
    fn overlay(&self, file: Option<&PathBuf>) -> TransformerThermal {
        let file =
            file.map_or(String::new(), |file| format!(r#", "state_file": "{}""#, file.display()));
        let text = format!(r#"{{ "transformers": [{{ {} }}] {file} }}"#, self.settings);
        TransformerThermal::create(serde_json::from_str(&text).expect("it is JSON"), host())
            .unwrap_or_else(|error| panic!("{error}"))
    }
}

impl Instant {
    fn values(&self) -> [TagValue; 2] {
        let [load, ambient] = self.inputs;
        let mut values = [load * 100.0, ambient].map(|number| TagValue {
            value: Some(Value::F64(number)),
            quality: Quality::Good,
            age: Duration::ZERO,
        });
        match self.fault {
            Some(Fault::BadLoad) => values[0].quality = Quality::Bad(Reason::Stale),
            Some(Fault::NoLoad) => values[0].value = None,
            Some(Fault::ImplausibleLoad) => values[0].value = Some(Value::F64(-5.0)),
            Some(Fault::BadAmbient) => values[1].quality = Quality::Bad(Reason::Stale),
            Some(Fault::ImplausibleAmbient) => values[1].value = Some(Value::F64(850.0)),
            Some(Fault::NoFrame) | None => {}
        }
        values
    }

    /// Reports of load and ambient temperature whether they are seen.
    fn is_seen(&self) -> [bool; 2] {
        let hides_load = [Fault::BadLoad, Fault::NoLoad, Fault::ImplausibleLoad];
        let hides_ambient = [Fault::BadAmbient, Fault::ImplausibleAmbient];
        let is_hidden = |of: &[Fault]| self.fault.is_some_and(|fault| of.contains(&fault));
        [!is_hidden(&hides_load), !is_hidden(&hides_ambient)]
    }
}

fn bindings() -> Vec<Binding> {
    let binding = |role: &str, unit: &str| Binding {
        node: 1,
        kind: ValueKind::F64,
        limit_low: None,
        limit_high: None,
        tag_id: role.into(),
        tag_name: role.into(),
        unit: unit.into(),
        node_id: "=T1".into(),
        role: role.into(),
    };
    vec![binding("load", "%"), binding("ambient", "°C")]
}

/// Least and greatest plausible history, by the exact model.
struct Oracle<'a> {
    parameters: &'a Parameters,
    solutions: [Temperatures; 2],
    /// Faults of the frame before.
    before: [bool; 2],
}

impl Oracle<'_> {
    fn steady(parameters: &Parameters) -> [Temperatures; 2] {
        [0, 1].map(|end| Temperatures::steady(parameters, LOAD[end], AMBIENT[end]))
    }

    /// Moves both on; what is not seen is at its end.
    fn step(&mut self, minutes: f64, [load, ambient]: [f64; 2], is_seen: [bool; 2]) {
        let [sees_load, sees_ambient] = [0, 1].map(|of| is_seen[of] && self.before[of]);
        self.before = is_seen;
        for end in [0, 1] {
            let load = if sees_load { load } else { LOAD[end] };
            let ambient = if sees_ambient { ambient } else { AMBIENT[end] };
            self.solutions[end] =
                self.solutions[end].after(self.parameters, minutes, load, ambient);
        }
    }
}

fn bounds(text: &str) -> [f64; 2] {
    let text = text.trim_end_matches(" °C").trim_start_matches("between ");
    let (low, high) = text.split_once(" and ").unwrap_or((text, text));
    [low, high].map(|number| number.parse().expect("it is a number"))
}

/// Reports whether temperatures are above the limits of normal cyclic loading.
fn is_hot(of: &Temperatures, margin: f64) -> bool {
    of.top_oil > 105.0 + margin || of.hot_spot() > 120.0 + margin
}

/// Runs a case; what goes wrong between frames is drawn from `random`.
fn run(case: &Case, random: &mut Random, counts: &mut Counts) -> Result<(), String> {
    let folder = random.one_in(25).then(|| tempfile::tempdir().expect("there is a folder"));
    let file = folder.as_ref().map(|folder| folder.path().join("states.json"));
    let mut overlay = case.overlay(file.as_ref());
    let mut to_bind = Some(bindings());
    let first_load = random.between(LOAD[0], LOAD[1]);
    let first_ambient = random.between(-5.0, 35.0);
    let mut truth = Temperatures::steady(&case.parameters, first_load, first_ambient);
    let mut minute = 0;
    let mut after = |instant: &Instant| {
        let [load, ambient] = instant.inputs;
        let minutes = (instant.minute - std::mem::replace(&mut minute, instant.minute)) as f64;
        truth = truth.after(&case.parameters, minutes, load, ambient);
        truth
    };
    let truth: Vec<_> = case.course.iter().map(&mut after).collect();
    let mut oracle = Oracle {
        parameters: &case.parameters,
        solutions: Oracle::steady(&case.parameters),
        before: [true; 2],
    };
    let margins = turning(&case.parameters);
    let mut drawn: Option<usize> = None;
    let mut is_resumed = true;
    // The oracle knows nothing of a state before a clock that was set back.
    let mut was_set_back = false;
    let mut frame = 0;
    while frame < case.course.len() {
        match random.below(200) {
            0 => {
                to_bind = Some(bindings());
                is_resumed = true;
            }
            1 => {
                drop(overlay);
                overlay = case.overlay(file.as_ref());
                to_bind = Some(bindings());
                is_resumed = true;
                if file.is_none() {
                    drawn = None;
                }
            }
            2 if !was_set_back && drawn.is_some() => {
                was_set_back = true;
                frame -= random.below(frame.min(30) + 1);
            }
            _ => {}
        }
        let instant = case.course[frame];
        frame += 1;
        if instant.fault == Some(Fault::NoFrame) {
            continue;
        }
        let is_seen = instant.is_seen();
        if let Some(before) = drawn {
            let minutes = instant.minute.saturating_sub(before);
            let is_known = !is_resumed && minutes <= LONGEST_STEP;
            oracle.step(minutes as f64, instant.inputs, is_seen.map(|is_seen| is_seen && is_known));
        } else {
            oracle.solutions = Oracle::steady(&case.parameters);
        }
        oracle.before = is_seen;
        is_resumed = false;
        drawn = Some(instant.minute);
        let now = START + instant.minute as i64 * NANOS_A_MINUTE;
        let drawing =
            draw_at(&mut overlay, to_bind.take(), &instant.values(), now).expect("it draws");
        let solutions = (!was_set_back).then_some(&oracle.solutions);
        check(&drawing, &truth[frame - 1], solutions, (instant.inputs[0], margins), counts)
            .map_err(|fault| format!("minute {}, {:?}: {fault}", instant.minute, instant.fault))?;
    }
    Ok(())
}

fn check(
    drawing: &Drawing,
    truth: &Temperatures,
    oracle: Option<&[Temperatures; 2]>,
    (load, margins): (f64, [f64; 2]),
    counts: &mut Counts,
) -> Result<(), String> {
    let judgment = drawing.verdict(0).ok_or("no verdict")?;
    let what =
        format!("{judgment:?}, lines {:?}, truth {truth:?}, oracle {oracle:?}", drawing.lines);
    // A tenth of a kelvin for the digits shown, half of one where a value stands for both.
    for (line, true_value) in drawing.lines.iter().zip([truth.top_oil, truth.hot_spot()]) {
        let [low, high] = bounds(&line.text);
        let room = if low == high { 0.56 } else { 0.06 };
        if true_value < low - room || true_value > high + room {
            return Err(format!("the truth is outside: {what}"));
        }
    }
    counts.truly_abnormal += u64::from(is_hot(truth, 0.0));
    match judgment.verdict {
        Verdict::Normal => counts.normal += 1,
        Verdict::Abnormal => counts.abnormal += 1,
        Verdict::Unknown => counts.unknown += 1,
    }
    if judgment.verdict == Verdict::Normal && is_hot(truth, 1e-9) {
        return Err(format!("normal, and too hot in truth: {what}"));
    }
    let is_overloaded = load > 1.5;
    if judgment.verdict == Verdict::Abnormal && !is_hot(truth, -1e-9) && !is_overloaded {
        return Err(format!("abnormal, and not too hot in truth: {what}"));
    }
    if judgment.verdict == Verdict::Unknown && judgment.reason.is_empty() {
        return Err(format!("unknown without a reason: {what}"));
    }
    let Some([least, greatest]) = oracle else { return Ok(()) };
    let [below, above] = margins.map(|margin| margin + ROUNDING);
    let share_normal = !is_hot(greatest, -above);
    let share_abnormal = is_hot(least, below);
    if judgment.verdict == Verdict::Unknown && (share_normal || share_abnormal) {
        return Err(format!("unknown, and both solutions decide: {what}"));
    }
    Ok(())
}

#[test]
fn silence_means_judged_healthy() {
    let cases = std::env::var("BUSBAR_SILENCE_CASES").ok();
    let cases = cases.map_or(USUAL_CASES, |cases| cases.parse().expect("it is a number"));
    let workers = std::thread::available_parallelism().map_or(1, |count| count.get() as u64).min(8);
    let work = |worker: u64| {
        let mut counts = Counts::default();
        for seed in (0..cases).filter(|seed| seed % workers == worker) {
            let mut random = Random::new(seed);
            let case = case(&mut random);
            if let Err(fault) = run(&case, &mut random, &mut counts) {
                panic!("seed {seed}, {}: {fault}", case.settings);
            }
        }
        counts
    };
    let counts = std::thread::scope(|scope| {
        let threads: Vec<_> =
            (0..workers).map(|worker| scope.spawn(move || work(worker))).collect();
        threads.into_iter().map(|thread| thread.join().unwrap()).reduce(Counts::add)
    });
    let counts = counts.unwrap();
    println!("{cases} cases: {counts:?}");
    // The generator reaches each kind of verdict, and what must not be silent.
    let least = counts.normal.min(counts.abnormal).min(counts.unknown).min(counts.truly_abnormal);
    assert!(least > cases, "{counts:?}");
}

impl Counts {
    fn add(self, other: Self) -> Self {
        Self {
            normal: self.normal + other.normal,
            abnormal: self.abnormal + other.abnormal,
            unknown: self.unknown + other.unknown,
            truly_abnormal: self.truly_abnormal + other.truly_abnormal,
        }
    }
}
