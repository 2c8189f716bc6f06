//! Arguments of simulators that break the header's rules.

use busbar_plugin_abi as abi;

use super::arguments::{MisalignedCopy, short};
use super::plugin_instance::required;
use super::simulator::{SimulatedTags, simulation};
use super::telemetry::TagSpecs;
use crate::finding::Outcome;
use crate::probe::Probe;
use crate::text;

const OK: abi::BusbarStatusNumber = abi::BUSBAR_OK;
const ARGUMENT: abi::BusbarStatusNumber = abi::BUSBAR_INVALID_ARGUMENT;
const SETTINGS: abi::BusbarStatusNumber = abi::BUSBAR_INVALID_SETTINGS;

pub(crate) fn refused(probe: &Probe) -> Outcome {
    let subject = probe.subject_with(abi::SIMULATOR_ID)?;
    let instance = subject.make(probe)?;
    let table: &abi::BusbarSimulator = instance.capability(abi::SIMULATOR_ID)?;
    let (start, stop) = (required(table.start, "start")?, required(table.stop, "stop")?);
    let status = required(table.status, "status")?;
    let plugin = instance.as_ptr();
    // SAFETY: the instance lives.
    let mut odd_plugin = MisalignedCopy::from_value(unsafe { &*plugin });
    let odd_plugin = odd_plugin.as_mut_ptr::<abi::BusbarPlugin>().cast_const();
    let good = SimulatedTags::from_sample(probe);
    let one = || SimulatedTags::new(TagSpecs::new([(abi::BUSBAR_VALUE_KIND_F64, "{}".to_owned())]));
    let first = one();
    let mut odd_tag = MisalignedCopy::from_value(&first.raw[0]);
    let with = |change: fn(&mut abi::BusbarSimulatedTag)| {
        let mut tags = one();
        change(&mut tags.raw[0]);
        tags
    };
    let kind = with(|tag| tag.spec.kind = 99);
    let id = with(|tag| tag.spec.id = text::of_bytes(&[0xff; 4]));
    let shape = with(|tag| tag.shape = 99);
    let base = with(|tag| tag.base = f64::NAN);
    let period = with(|tag| tag.period_seconds = 0.0);
    let usual = simulation();
    let mut odd = MisalignedCopy::from_value(&usual);
    let small = short(&usual, 8);
    let unknown = abi::BusbarSimulation { faults: 1 << 30, ..usual };
    let no_update = abi::BusbarSimulation { update_millis: 0, ..usual };
    let no_rest = abi::BusbarSimulation { fault_period_millis: 1000, ..usual };
    let no_events = abi::BusbarSimulation { event_count: 2, ..usual };
    let no_link_faults = abi::BusbarSimulation { link_fault_count: 2, ..usual };
    let stranger = abi::BusbarSimulatedEvent {
        tag: u32::MAX,
        kind: abi::BUSBAR_SIMULATED_EVENT_KIND_VALUE,
        at_seconds: 0.0,
        over_seconds: 0.0,
        value: 0.0,
    };
    let strange_event = abi::BusbarSimulation { event_count: 1, events: &stranger, ..usual };
    let strike =
        abi::BusbarLinkFault { fault: 1 << 30, reserved: 0, at_seconds: 0.0, for_seconds: 1.0 };
    let strange_link_fault =
        abi::BusbarSimulation { link_fault_count: 1, link_faults: &strike, ..usual };
    let (refused, texts) = ([ARGUMENT], [ARGUMENT, SETTINGS, OK]);
    let values = [ARGUMENT, SETTINGS];
    let (tags, all) = (good.as_parts(), &raw const usual);
    for (what, plugin, tags, simulation, allowed) in [
        ("a plugin that is null", std::ptr::null(), tags, all, &refused[..]),
        ("a plugin that is misaligned", odd_plugin, tags, all, &refused),
        ("tags that are null", plugin, (std::ptr::null(), 2), all, &refused),
        ("tags that are misaligned", plugin, (odd_tag.as_ptr(), 1), all, &refused),
        ("a simulation that is null", plugin, tags, std::ptr::null(), &refused),
        ("a simulation that is misaligned", plugin, tags, odd.as_ptr(), &refused),
        ("a simulation that is too small", plugin, tags, &raw const small, &refused),
        ("an unknown fault", plugin, tags, &raw const unknown, &refused),
        ("no update period", plugin, tags, &raw const no_update, &refused),
        ("faults without a rest", plugin, tags, &raw const no_rest, &refused),
        ("events that are null", plugin, tags, &raw const no_events, &refused),
        ("link faults that are null", plugin, tags, &raw const no_link_faults, &refused),
        ("an event of an unknown tag", plugin, tags, &raw const strange_event, &refused),
        ("an unknown link fault", plugin, tags, &raw const strange_link_fault, &refused),
        ("an unknown value kind", plugin, kind.as_parts(), all, &values),
        ("a tag id that is not UTF-8", plugin, id.as_parts(), all, &texts),
        ("an unknown shape", plugin, shape.as_parts(), all, &values),
        ("a base that is no number", plugin, base.as_parts(), all, &values),
        ("a period of 0", plugin, period.as_parts(), all, &values),
    ] {
        let mut error = abi::BusbarError::empty();
        let code = probe.simulate(start, plugin, tags, simulation, &mut error);
        probe.expect_status(&format!("simulator start with {what}"), code, &error, allowed);
        if code == OK {
            probe.stop_simulation(stop, plugin);
        }
    }
    let mut into = abi::BusbarSimulatorStatus::empty();
    let mut odd_into = MisalignedCopy::from_value(&into);
    let mut small_into = short(&into, 8);
    let null = std::ptr::null();
    for (what, plugin, into) in [
        ("a plugin that is null", null, &raw mut into),
        ("a plugin that is misaligned", odd_plugin, &raw mut into),
        ("a status that is null", plugin, std::ptr::null_mut()),
        ("a status that is misaligned", plugin, odd_into.as_mut_ptr()),
        ("a status that is too small", plugin, &raw mut small_into),
    ] {
        let mut error = abi::BusbarError::empty();
        let code = probe.simulation_status(status, plugin, into, &mut error);
        probe.expect_refused(&format!("simulator status with {what}"), code, &error, &refused);
    }
    probe.stop_simulation(stop, null);
    probe.stop_simulation(stop, odd_plugin);
    instance.destroy()
}
