//! Simulators: arguments, every order, and that they end and free their place.

use std::time::{Duration, Instant};

use busbar_plugin_abi as abi;

use super::plugin_instance::{Instance, required};
use super::telemetry::{OBSERVATION_TIME, TagSpecs};
use crate::environment;
use crate::finding::{Finding, Outcome, Stop, skip};
use crate::probe::Probe;
use crate::text;

/// `stop` ends all threads within this.
const MAX_STOP: Duration = Duration::from_secs(2);
/// `start` returns at once; this is at once on a loaded machine.
const MAX_START: Duration = Duration::from_secs(1);

/// Tags of the sample that rest in the middle of what any address can hold.
pub(crate) struct SimulatedTags {
    pub(crate) raw: Vec<abi::BusbarSimulatedTag>,
    _tags: TagSpecs,
}

impl SimulatedTags {
    pub(crate) fn new(tags: TagSpecs) -> Self {
        let raw = tags.raw.iter().map(|&spec| abi::BusbarSimulatedTag {
            spec,
            shape: abi::BUSBAR_SIGNAL_SHAPE_CONSTANT,
            reserved: 0,
            base: 1.0,
            amplitude: 0.0,
            period_seconds: 1.0,
        });
        Self { raw: raw.collect(), _tags: tags }
    }

    pub(crate) fn from_sample(probe: &Probe) -> Self {
        Self::new(TagSpecs::from_samples(&probe.request.sample.tags))
    }

    pub(crate) fn as_parts(&self) -> (*const abi::BusbarSimulatedTag, usize) {
        (self.raw.as_ptr(), self.raw.len())
    }
}

/// A simulation without faults.
pub(crate) fn simulation() -> abi::BusbarSimulation {
    abi::BusbarSimulation {
        struct_size: size_of::<abi::BusbarSimulation>() as u32,
        faults: 0,
        seed: 1,
        update_millis: 100,
        fault_period_millis: 10_000,
        fault_millis: 1000,
        scenario_unix_nanos: 0,
        event_count: 0,
        link_fault_count: 0,
        events: std::ptr::null(),
        link_faults: std::ptr::null(),
    }
}

/// Starts the simulation of tags that must be served. Skips where no endpoint is free, and where
/// the plugin cannot simulate them.
fn start(probe: &Probe, instance: &Instance<'_>, tags: &SimulatedTags) -> Outcome {
    let table: &abi::BusbarSimulator = instance.capability(abi::SIMULATOR_ID)?;
    let start = required(table.start, "start")?;
    let (mut error, simulation) = (abi::BusbarError::empty(), simulation());
    let status = probe.simulate(start, instance.as_ptr(), tags.as_parts(), &simulation, &mut error);
    if status == abi::BUSBAR_FAILED {
        probe.expect_message("simulator start", &error);
        return skip("it cannot listen: name this machine and a free port in a sample (--sample)");
    }
    // A plugin need not simulate all that it can read, but it must say so.
    let words = text::message_of(&error).unwrap_or_default();
    if status == abi::BUSBAR_INVALID_SETTINGS && !words.trim().is_empty() {
        return skip(format!("it does not simulate this sample: {words}"));
    }
    probe.expect_ok("simulator start", status, &error)
}

fn stop(probe: &Probe, instance: &Instance<'_>) -> Outcome {
    let table: &abi::BusbarSimulator = instance.capability(abi::SIMULATOR_ID)?;
    probe.stop_simulation(required(table.stop, "stop")?, instance.as_ptr());
    Ok(())
}

fn status(probe: &Probe, instance: &Instance<'_>) -> Outcome {
    let table: &abi::BusbarSimulator = instance.capability(abi::SIMULATOR_ID)?;
    let status = required(table.status, "status")?;
    let (mut error, mut into) = (abi::BusbarError::empty(), abi::BusbarSimulatorStatus::empty());
    let code = probe.simulation_status(status, instance.as_ptr(), &mut into, &mut error);
    probe.expect_ok("simulator status", code, &error)?;
    validate_status(probe, &into);
    Ok(())
}

fn validate_status(probe: &Probe, status: &abi::BusbarSimulatorStatus) {
    let length = status.message_len as usize;
    let fault = format!("`status` says that its text has {length} bytes");
    probe.expect(length <= status.message.len(), fault, "cut it to the room that there is");
    let text = status.message.get(..length).map(std::str::from_utf8);
    let is_text = text.is_none_or(|text| text.is_ok());
    probe.expect(is_text, "the text of `status` is not UTF-8", "cut it at a character");
    let known = abi::BUSBAR_FAULT_CLOCK_JUMP;
    let is_known = status.fault == 0 || (status.fault.is_power_of_two() && status.fault <= known);
    let fault = format!("`status` has the unknown fault {}", status.fault);
    probe.expect(is_known, fault, "give one BUSBAR_FAULT_*, or 0");
}

/// Starts with the sample's tags and stops.
pub(crate) fn use_briefly(probe: &Probe, instance: &Instance<'_>) -> Outcome {
    let tags = SimulatedTags::from_sample(probe);
    match start(probe, instance, &tags) {
        // What cannot be tried here is said by the cases of simulators.
        Err(Stop::Skip(_)) => Ok(()),
        Err(other) => Err(other),
        Ok(()) => {
            status(probe, instance)?;
            stop(probe, instance)
        }
    }
}

pub(crate) fn order(probe: &Probe) -> Outcome {
    let subject = probe.subject_with(abi::SIMULATOR_ID)?;
    let tags = SimulatedTags::from_sample(probe);
    let instance = subject.make(probe)?;
    let table: &abi::BusbarSimulator = instance.capability(abi::SIMULATOR_ID)?;
    stop(probe, &instance)?;
    let (mut error, mut into) = (abi::BusbarError::empty(), abi::BusbarSimulatorStatus::empty());
    let early = required(table.status, "status")?;
    let code = probe.simulation_status(early, instance.as_ptr(), &mut into, &mut error);
    probe.expect_refused("status before start", code, &error, &[abi::BUSBAR_INVALID_ARGUMENT]);
    start(probe, &instance, &tags)?;
    let again = required(table.start, "start")?;
    let (mut error, simulation) = (abi::BusbarError::empty(), simulation());
    let code = probe.simulate(again, instance.as_ptr(), tags.as_parts(), &simulation, &mut error);
    probe.expect_refused("start after start", code, &error, &[abi::BUSBAR_INVALID_ARGUMENT]);
    status(probe, &instance)?;
    stop(probe, &instance)?;
    stop(probe, &instance)?;
    // Without a tag, and destroyed while it is active.
    start(probe, &instance, &SimulatedTags::new(TagSpecs::from_samples(&[])))?;
    status(probe, &instance)?;
    instance.destroy()?;
    let instance = subject.make(probe)?;
    start(probe, &instance, &tags)?;
    instance.destroy()
}

pub(crate) fn ends(probe: &Probe) -> Outcome {
    let subject = probe.subject_with(abi::SIMULATOR_ID)?;
    let instance = subject.make(probe)?;
    let tags = SimulatedTags::from_sample(probe);
    for round in 0..2 {
        let begun = Instant::now();
        start(probe, &instance, &tags)?;
        let took = begun.elapsed();
        let fault = format!("`start` took {} ms", took.as_millis());
        probe.expect(took <= MAX_START, fault, "serve on a thread of your own");
        // Once at work, once at the very start.
        std::thread::sleep(if round == 0 { OBSERVATION_TIME } else { Duration::ZERO });
        let begun = Instant::now();
        stop(probe, &instance)?;
        let took = begun.elapsed();
        let fault = format!("`stop` took {} ms", took.as_millis());
        let remedy = "let threads wait on something that `stop` can wake";
        probe.expect(took <= MAX_STOP, fault, remedy);
    }
    instance.destroy()?;
    let threads = || environment::threads().len();
    if !environment::settle(|| threads() == 1) {
        let what = format!("{} threads are left after `stop` and `destroy`", threads() - 1);
        probe.find(Finding::new(what, "join every thread in `stop`"));
    }
    Ok(())
}
