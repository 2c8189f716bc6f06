//! Capability `busbar.simulator/1-draft`: simulated devices.

use std::collections::HashMap;
use std::time::{Duration, SystemTime, UNIX_EPOCH};

use busbar_plugin_abi as abi;

use crate::boundary::{checked_mut, checked_ref, slice};
use crate::simulation::{
    Behavior, FaultKind, FaultPlan, LinkFault, Scenario, ScenarioEvent, Signal, SignalShape,
    fault_kinds,
};
use crate::telemetry::read_spec;
use crate::{Error, Plugin, TagSpec};

/// Serves the protocol that [`crate::Telemetry`] reads, so that a configuration can be
/// tried without its devices. `busbar simulate` starts it.
pub trait Simulator: Plugin {
    /// Listens where the settings say that the device is, has every tag at its address,
    /// and returns.
    ///
    /// # Errors
    /// [`Error::settings`] for addresses that can never work or cannot hold the values
    /// of their tag's [`Signal::range`]; [`Error::failed`] when it cannot listen.
    fn start_simulation(&mut self, simulation: Simulation) -> Result<(), Error>;

    /// Ends all connections and threads within two seconds, and listens no more.
    fn stop_simulation(&mut self);

    /// Returns the status of the simulation; called between start and stop only.
    fn simulation_status(&self) -> SimulationStatus;
}

/// Parameters of a simulation.
#[derive(Clone, Debug)]
pub struct Simulation {
    /// Tags with their signals.
    pub tags: Vec<SimulatedTag>,
    /// Plan of the faults, counted from the start.
    pub faults: FaultPlan,
    /// Period of changes, where the protocol sends them unsolicited.
    pub update: Duration,
    /// Seed for all other random choices.
    pub seed: u64,
}

/// Tag with its signal.
#[derive(Clone, Debug)]
pub struct SimulatedTag {
    /// Specification of the tag, as for telemetry.
    pub spec: TagSpec,
    /// Signal of the tag's values.
    pub signal: Signal,
}

/// Status of a simulation.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct SimulationStatus {
    /// Address that the simulator listens at.
    pub endpoint: String,
    /// Fault that holds now.
    pub fault: Option<FaultKind>,
    /// Number of clients that are connected.
    pub clients: u32,
    /// Number of connections accepted so far.
    pub connections: u64,
    /// Number of messages sent so far: answers to requests, and unsolicited ones.
    pub messages: u64,
}

impl Simulation {
    /// Returns the specifications alone, to read addresses as telemetry does.
    pub fn specs(&self) -> Vec<TagSpec> {
        self.tags.iter().map(|tag| tag.spec.clone()).collect()
    }
}

/// # Safety
/// Pointers are null or valid as the ABI's `start` demands.
pub(crate) unsafe fn read_simulation(
    tags: *const abi::BusbarSimulatedTag,
    count: usize,
    simulation: *const abi::BusbarSimulation,
) -> Result<Simulation, Error> {
    // SAFETY: the host gives a simulation and `count` elements.
    let (simulation, raw) =
        unsafe { (checked_ref(simulation, "start: the simulation")?, slice(tags, count)?) };
    let kinds = fault_kinds(simulation.faults)
        .ok_or_else(|| Error::argument(format!("unknown faults {:#x}", simulation.faults)))?;
    let millis = Duration::from_millis;
    let faults = FaultPlan::new(
        simulation.seed,
        &kinds,
        millis(simulation.fault_period_millis),
        millis(simulation.fault_millis),
    );
    if simulation.update_millis == 0 {
        return Err(Error::argument("the update period is 0"));
    }
    let faults = faults.map_err(|error| Error::argument(error.message()))?;
    // SAFETY: the host gives as many elements as it says.
    let (events, link_faults) = unsafe {
        let link_faults = slice(simulation.link_faults, simulation.link_fault_count as usize)?;
        (slice(simulation.events, simulation.event_count as usize)?, link_faults)
    };
    let nanos = u64::try_from(simulation.scenario_unix_nanos).unwrap_or_default();
    let begun = UNIX_EPOCH + Duration::from_nanos(nanos);
    let mut scenarios = scenarios(begun, events)?;
    let mut tags = Vec::with_capacity(raw.len());
    for tag in raw {
        // SAFETY: the host's texts are valid for the call.
        let mut tag = unsafe { read_tag(tag, simulation.seed)? };
        if let Some(scenario) = scenarios.remove(&tag.spec.tag) {
            tag.signal = tag.signal.with_scenario(scenario)?;
        }
        tags.push(tag);
    }
    if let Some(tag) = scenarios.keys().next() {
        return Err(Error::argument(format!("an event of the unknown tag {tag}")));
    }
    Ok(Simulation {
        tags,
        faults: faults.with_link_faults(since(begun), read_link_faults(link_faults)?),
        update: millis(simulation.update_millis),
        seed: simulation.seed,
    })
}

/// Returns the time since an instant; zero where the clock was set back.
fn since(begun: SystemTime) -> Duration {
    SystemTime::now().duration_since(begun).unwrap_or_default()
}

/// Groups the scenario events by tag.
fn scenarios(
    begun: SystemTime,
    events: &[abi::BusbarSimulatedEvent],
) -> Result<HashMap<u32, Scenario>, Error> {
    let mut scenarios: HashMap<u32, Scenario> = HashMap::new();
    for event in events {
        let at = seconds(event.at_seconds)?;
        let happening = match event.kind {
            abi::BUSBAR_SIMULATED_EVENT_KIND_VALUE if event.value.is_finite() => {
                ScenarioEvent::Value { value: event.value, over: seconds(event.over_seconds)? }
            }
            abi::BUSBAR_SIMULATED_EVENT_KIND_RELEASE => ScenarioEvent::Release,
            _ => {
                let (kind, value) = (event.kind, event.value);
                return Err(Error::argument(format!("an event of kind {kind} to {value}")));
            }
        };
        scenarios.entry(event.tag).or_insert_with(|| Scenario::new(begun)).push(at, happening)?;
    }
    Ok(scenarios)
}

fn read_link_faults(raw: &[abi::BusbarLinkFault]) -> Result<Vec<LinkFault>, Error> {
    let read = |fault: &abi::BusbarLinkFault| {
        let kinds = fault_kinds(fault.fault);
        let [kind] = kinds.as_deref().unwrap_or_default() else {
            return Err(Error::argument(format!("unknown link fault {:#x}", fault.fault)));
        };
        let (begins, length) = (seconds(fault.at_seconds)?, seconds(fault.for_seconds)?);
        Ok(LinkFault { kind: *kind, begins, ends: begins.saturating_add(length) })
    };
    raw.iter().map(read).collect()
}

fn seconds(seconds: f64) -> Result<Duration, Error> {
    let wrong = |_| Error::argument(format!("a time of {seconds} s"));
    Duration::try_from_secs_f64(seconds).map_err(wrong)
}

/// # Safety
/// The texts are valid for the call.
unsafe fn read_tag(raw: &abi::BusbarSimulatedTag, seed: u64) -> Result<SimulatedTag, Error> {
    // SAFETY: the caller vouches for the texts.
    let spec = unsafe { read_spec(&raw.spec)? };
    let at = |what: String| Error::argument(format!("tag '{}': {what}", spec.id));
    let shape = SignalShape::from_code(raw.shape)
        .ok_or_else(|| at(format!("unknown shape {}", raw.shape)))?;
    let period = Duration::try_from_secs_f64(raw.period_seconds)
        .map_err(|_| at(format!("a period of {} s", raw.period_seconds)))?;
    let behavior = Behavior::new(shape, raw.base, raw.amplitude, period)
        .map_err(|error| at(error.message().to_owned()))?;
    let signal = Signal::new(seed, &spec.id, spec.kind, behavior)
        .map_err(|error| Error::argument(error.message()))?;
    Ok(SimulatedTag { spec, signal })
}

/// # Safety
/// `into` is null or may be written.
pub(crate) unsafe fn write_status(
    status: &SimulationStatus,
    into: *mut abi::BusbarSimulatorStatus,
) -> Result<(), Error> {
    // SAFETY: the caller vouches for the pointer.
    let into = unsafe { checked_mut(into, "status: the status")? };
    let len = status.endpoint.floor_char_boundary(into.message.len());
    into.message[..len].copy_from_slice(&status.endpoint.as_bytes()[..len]);
    into.message_len = len as u32;
    into.fault = status.fault.map_or(0, FaultKind::bit);
    into.clients = status.clients;
    into.connections = status.connections;
    into.messages = status.messages;
    Ok(())
}
