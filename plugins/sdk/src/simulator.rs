//! Capability `busbar.simulator/1-draft`.

use std::time::Duration;

use busbar_plugin_abi as abi;

use crate::border::{given, given_mut, slice};
use crate::simulation::{Behaviour, FaultKind, FaultPlan, Shape, Signal};
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

    /// How it goes; called between start and stop only.
    fn simulation_status(&self) -> SimulationStatus;
}

/// What is to be simulated.
#[derive(Clone, Debug)]
pub struct Simulation {
    /// Tags with their values.
    pub tags: Vec<SimulatedTag>,
    /// What goes wrong when, counted from the start.
    pub faults: FaultPlan,
    /// Period in which changes are looked for, where the protocol sends them by itself.
    pub update: Duration,
    /// For whatever else is left to chance.
    pub seed: u64,
}

/// A tag and its values.
#[derive(Clone, Debug)]
pub struct SimulatedTag {
    /// The tag, as telemetry has it.
    pub spec: TagSpec,
    /// Its values.
    pub signal: Signal,
}

/// How a simulation goes.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct SimulationStatus {
    /// Where it listens.
    pub endpoint: String,
    /// What goes wrong now.
    pub fault: Option<FaultKind>,
    /// Clients that are connected.
    pub clients: u32,
    /// Connections that were taken so far.
    pub connections: u64,
    /// Answers to requests, and messages without one, that were sent so far.
    pub messages: u64,
}

impl Simulation {
    /// The specs alone, to read addresses as telemetry does.
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
        unsafe { (given(simulation, "start: the simulation")?, slice(tags, count)?) };
    let kinds = FaultKind::from_abi(simulation.faults)
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
    let mut tags = Vec::with_capacity(raw.len());
    for tag in raw {
        // SAFETY: the host's texts are valid for the call.
        tags.push(unsafe { read_tag(tag, simulation.seed)? });
    }
    Ok(Simulation {
        tags,
        faults: faults.map_err(|error| Error::argument(error.message()))?,
        update: millis(simulation.update_millis),
        seed: simulation.seed,
    })
}

/// # Safety
/// The texts are valid for the call.
unsafe fn read_tag(raw: &abi::BusbarSimulatedTag, seed: u64) -> Result<SimulatedTag, Error> {
    // SAFETY: the caller vouches for the texts.
    let spec = unsafe { read_spec(&raw.spec)? };
    let at = |what: String| Error::argument(format!("tag '{}': {what}", spec.id));
    let shape =
        Shape::from_abi(raw.shape).ok_or_else(|| at(format!("unknown shape {}", raw.shape)))?;
    let period = Duration::try_from_secs_f64(raw.period_seconds)
        .map_err(|_| at(format!("a period of {} s", raw.period_seconds)))?;
    let behaviour = Behaviour::new(shape, raw.base, raw.amplitude, period)
        .map_err(|error| at(error.message().to_owned()))?;
    let signal = Signal::new(seed, &spec.id, spec.kind, behaviour)
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
    let into = unsafe { given_mut(into, "status: the status")? };
    let len = status.endpoint.floor_char_boundary(into.message.len());
    into.message[..len].copy_from_slice(&status.endpoint.as_bytes()[..len]);
    into.message_len = len as u32;
    into.fault = status.fault.map_or(0, FaultKind::to_abi);
    into.clients = status.clients;
    into.connections = status.connections;
    into.messages = status.messages;
    Ok(())
}
