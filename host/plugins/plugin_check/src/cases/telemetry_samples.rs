//! Samples of a telemetry plugin, and their end after a stop.

use std::time::{Duration, Instant};

use busbar_plugin_abi as abi;

use super::telemetry::{OBSERVATION_TIME, TagSpecs, start};
use crate::environment;
use crate::finding::{Outcome, skip};
use crate::probe::Probe;

/// `start` returns at once; this is at once on a loaded machine.
const MAX_START: Duration = Duration::from_secs(1);
/// `stop` ends all threads within this.
const MAX_STOP: Duration = Duration::from_secs(2);
/// Deadline for a first sample of every tag, even a bad one.
const MAX_FIRST_SAMPLE: Duration = Duration::from_secs(5);
/// Duration over which samples are counted.
const COUNTED: Duration = Duration::from_millis(500);
/// Samples a second of one tag beyond which it is a flood.
const MAX_RATE: u64 = 10_000;

pub(crate) fn samples(probe: &Probe) -> Outcome {
    let subject = probe.subject_with(abi::TELEMETRY_ID)?;
    let tags = &probe.request.sample.tags;
    if tags.is_empty() {
        return skip("no tags to serve are known: give some in a sample (--sample)");
    }
    let instance = subject.make(probe)?;
    let begun = Instant::now();
    let started = start(probe, &instance, &TagSpecs::from_samples(tags))?;
    let took = begun.elapsed();
    let fault = format!("`start` took {} ms", took.as_millis());
    probe.expect(took <= MAX_START, fault, "connect on a thread of your own");
    let limit = probe.time_left().min(MAX_FIRST_SAMPLE);
    while started.sink.seen().tags.len() < tags.len() && begun.elapsed() < limit {
        std::thread::sleep(Duration::from_millis(10));
    }
    let silent = tags.len() - started.sink.seen().tags.len();
    probe.expect(
        silent == 0,
        format!("{silent} of {} tags had no sample within {limit:?}", tags.len()),
        "say of each tag that it is bad (communication, not connected) until it has a value",
    );
    let before = started.sink.seen().samples;
    std::thread::sleep(COUNTED);
    let came = started.sink.seen().samples - before;
    let rate = came * 1000 / COUNTED.as_millis() as u64;
    probe.expect(
        rate <= MAX_RATE * tags.len() as u64,
        format!("{rate} samples a second for {} tags are a flood", tags.len()),
        "publish changes, or poll with a period",
    );
    started.stop(probe)?;
    started.report_faults(probe);
    instance.destroy()
}

pub(crate) fn stop(probe: &Probe) -> Outcome {
    let subject = probe.subject_with(abi::TELEMETRY_ID)?;
    let instance = subject.make(probe)?;
    let tags = TagSpecs::from_samples(&probe.request.sample.tags);
    for round in 0..2 {
        let started = start(probe, &instance, &tags)?;
        // Once at work, once at the very start.
        std::thread::sleep(if round == 0 { OBSERVATION_TIME } else { Duration::ZERO });
        let begun = Instant::now();
        started.stop(probe)?;
        let took = begun.elapsed();
        let fault = format!("`stop` took {} ms", took.as_millis());
        let remedy = "let threads wait on something that `stop` can wake";
        probe.expect(took <= MAX_STOP, fault, remedy);
        std::thread::sleep(OBSERVATION_TIME);
        started.report_faults(probe);
    }
    instance.destroy()?;
    let threads = || environment::threads().len();
    probe.expect(
        environment::settle(|| threads() == 1),
        format!("{} threads are left after `stop` and `destroy`", threads() - 1),
        "join every thread in `stop`",
    );
    Ok(())
}
