//! Seeded courses of load and ambient temperature with faults: bad, missing and implausible
//! values, gaps, hidden frames, reconfiguration, restarts, and a clock that is set back.
//!
//! The verdict is never normal where the true temperature, which the overlay does not see,
//! is above its limit, and never unknown where the least and the greatest plausible history
//! give one verdict. `BUSBAR_SILENCE_CASES` sets the number of cases.

mod case;
#[path = "../common/mod.rs"]
mod common;
mod oracle;

use busbar_plugin_sdk::testing::{Drawing, draw_at};
use busbar_plugin_sdk::{Binding, ValueKind, Verdict};
use case::{Case, Fault, Instant, LOAD, LONGEST_STEP, case};
use common::Random;
use oracle::{Oracle, turning};
use transformer_thermal::Temperatures;

/// Cases where the environment names no other number.
const USUAL_CASES: u64 = 2_000;

const NANOS_A_MINUTE: i64 = 60_000_000_000;
const START: i64 = 1_700_000_000_000_000_000;

/// Load limit of normal cyclic loading for small and medium transformers, per unit (table 2).
const LOAD_LIMIT: f64 = 1.5;

/// Difference up to which numbers that are worked out otherwise decide alike, K.
const ROUNDING: f64 = 1e-6;

/// Counts of verdicts over all cases.
#[derive(Default, Debug)]
struct Counts {
    normal: u64,
    abnormal: u64,
    unknown: u64,
    /// Frames in which the truth was abnormal.
    truly_abnormal: u64,
}

fn bindings(has_sensor: bool) -> Vec<Binding> {
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
    let mut bindings = vec![binding("load", "%"), binding("ambient", "°C")];
    bindings.extend(has_sensor.then(|| binding("top_oil", "°C")));
    bindings
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
    let mut to_bind = Some(bindings(case.has_sensor));
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
                to_bind = Some(bindings(case.has_sensor));
                is_resumed = true;
            }
            1 => {
                drop(overlay);
                overlay = case.overlay(file.as_ref());
                to_bind = Some(bindings(case.has_sensor));
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
        let values = &instant.values(truth[frame - 1].top_oil)[..2 + usize::from(case.has_sensor)];
        let now = START + instant.minute as i64 * NANOS_A_MINUTE;
        let drawing = draw_at(&mut overlay, to_bind.take(), values, now).expect("it draws");
        let solutions = (!was_set_back).then_some(&oracle.solutions);
        let load = (instant.inputs[0], is_seen[0]);
        check(&drawing, &truth[frame - 1], solutions, (load, margins), counts)
            .map_err(|fault| format!("minute {}, {:?}: {fault}", instant.minute, instant.fault))?;
    }
    Ok(())
}

fn check(
    drawing: &Drawing,
    truth: &Temperatures,
    oracle: Option<&[Temperatures; 2]>,
    ((load, is_load_seen), margins): ((f64, bool), [f64; 2]),
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
    let is_overloaded = load > LOAD_LIMIT;
    if judgment.verdict == Verdict::Normal && (is_overloaded || !is_load_seen) {
        return Err(format!("normal, and the load may be above its limit: {what}"));
    }
    if judgment.verdict == Verdict::Abnormal && !is_hot(truth, -1e-9) && !is_overloaded {
        return Err(format!("abnormal, and not too hot in truth: {what}"));
    }
    if judgment.verdict == Verdict::Unknown && judgment.reason.is_empty() {
        return Err(format!("unknown without a reason: {what}"));
    }
    let Some([least, greatest]) = oracle else { return Ok(()) };
    let [below, above] = margins.map(|margin| margin + ROUNDING);
    let share_normal = !is_hot(greatest, -above) && is_load_seen;
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
