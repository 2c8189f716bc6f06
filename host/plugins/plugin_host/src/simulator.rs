//! Device simulators: capability `busbar.simulator/1-draft`.

use std::sync::Arc;
use std::time::{Duration, SystemTime, UNIX_EPOCH};

use busbar_plugin_abi as abi;
use busbar_tags::TagHandle;
use busbar_types::{FaultKind, SignalShape};
use serde::{Deserialize, Serialize};

use crate::{Instance, PluginError, TelemetryTag, telemetry, text};

/// A tag and how its value moves.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SimulatedTag {
    /// The tag, as telemetry has it.
    pub tag: TelemetryTag,
    /// Movement of its value.
    pub behavior: SimulatedBehavior,
}

/// Movement of a simulated value, measured in the tag's unit.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct SimulatedBehavior {
    /// The form of the movement.
    pub shape: SignalShape,
    /// Centre of the movement.
    pub base: f64,
    /// Amplitude around the base; not negative.
    pub amplitude: f64,
    /// Time of a wave, a level or a count; not zero.
    pub period: Duration,
}

/// Settings for all tags of a simulation.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Simulation {
    /// The same seed gives the same values and the same faults.
    pub seed: u64,
    /// Period in which changes are looked for; not zero.
    pub update: Duration,
    /// Kinds of faults that are injected.
    pub faults: Vec<FaultKind>,
    /// Period of faults, one in each; longer than `fault_length`.
    pub fault_period: Duration,
    /// Maximum duration of a fault; not zero.
    pub fault_length: Duration,
}

/// Events of one device in a scenario.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct DeviceScenario {
    /// Time at which the scenario began.
    pub begun: SystemTime,
    /// Events of its tags, in the order of time.
    pub events: Vec<SimulatedEvent>,
    /// Faults of its link, in the order of time.
    pub link_faults: Vec<SimulatedLinkFault>,
}

impl DeviceScenario {
    /// Scenario without events and faults.
    pub const NONE: Self = Self { begun: UNIX_EPOCH, events: Vec::new(), link_faults: Vec::new() };
}

/// Event of a simulated tag.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct SimulatedEvent {
    /// Handle of the tag.
    pub tag: TagHandle,
    /// Seconds since the scenario began; not negative.
    pub at_seconds: f64,
    /// The value that it goes to, in the tag's unit, and how many seconds the way takes;
    /// none where it moves by its own shape again.
    pub value: Option<(f64, f64)>,
}

/// A time in which a link fails.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct SimulatedLinkFault {
    /// Kind of the fault.
    pub kind: FaultKind,
    /// Seconds since the scenario began; not negative.
    pub at_seconds: f64,
    /// Duration in seconds; more than 0.
    pub for_seconds: f64,
}

/// Status of a running simulation.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct SimulationStatus {
    /// Endpoint on which the simulator listens.
    pub endpoint: String,
    /// The fault that holds.
    pub fault: Option<FaultKind>,
    /// Clients that are connected.
    pub clients: u32,
    /// Connections that were taken so far.
    pub connections: u64,
    /// Answers to requests, and messages without one, that were sent so far.
    pub messages: u64,
}

/// A running simulation; dropping it stops it.
pub struct Simulator {
    table: &'static abi::BusbarSimulator,
    instance: Arc<Instance>,
}

impl Simulator {
    /// Starts an instance as the device of its tags.
    ///
    /// # Errors
    /// [`PluginError::WrongCapability`], or what the plugin says of addresses and of the
    /// place where it is to listen.
    pub fn start(
        instance: Arc<Instance>,
        tags: &[SimulatedTag],
        simulation: &Simulation,
        scenario: &DeviceScenario,
    ) -> Result<Self, PluginError> {
        let table: &abi::BusbarSimulator = instance.capability(abi::SIMULATOR_ID)?;
        let (Some(start), Some(_), Some(_)) = (table.start, table.stop, table.status) else {
            return Err(instance.violation("`start`, `stop` or `status` is null"));
        };
        let raw: Vec<_> = tags.iter().map(to_abi).collect();
        let millis = |duration: Duration| u64::try_from(duration.as_millis()).unwrap_or(u64::MAX);
        let events: Vec<_> = scenario.events.iter().map(event_to_abi).collect();
        let link_faults: Vec<_> = scenario.link_faults.iter().map(link_fault_to_abi).collect();
        let begun = scenario.begun.duration_since(UNIX_EPOCH).unwrap_or_default();
        let simulation = abi::BusbarSimulation {
            struct_size: size_of::<abi::BusbarSimulation>() as u32,
            faults: simulation.faults.iter().fold(0, |sum, fault| sum | fault.bit()),
            seed: simulation.seed,
            update_millis: millis(simulation.update),
            fault_period_millis: millis(simulation.fault_period),
            fault_millis: millis(simulation.fault_length),
            scenario_unix_nanos: i64::try_from(begun.as_nanos()).unwrap_or(i64::MAX),
            event_count: events.len() as u32,
            link_fault_count: link_faults.len() as u32,
            events: events.as_ptr(),
            link_faults: link_faults.as_ptr(),
        };
        let mut error = abi::BusbarError::empty();
        let serial = instance.serialize_calls();
        // SAFETY: tags, simulation, its arrays and error live for the call.
        let status =
            unsafe { start(instance.as_ptr(), raw.as_ptr(), raw.len(), &simulation, &mut error) };
        drop(serial);
        instance.outcome(status, &error)?;
        Ok(Self { table, instance })
    }

    /// Returns the plugin instance of the simulator.
    pub fn instance(&self) -> &Instance {
        &self.instance
    }

    /// Asks the plugin for the status of its simulation.
    ///
    /// # Errors
    /// What the plugin says, or the rule that it breaks.
    pub fn status(&self) -> Result<SimulationStatus, PluginError> {
        let Some(status) = self.table.status else { return Ok(SimulationStatus::default()) };
        let mut raw = abi::BusbarSimulatorStatus::empty();
        let mut error = abi::BusbarError::empty();
        let serial = self.instance.serialize_calls();
        // SAFETY: it was started; status and error live for the call.
        let code = unsafe { status(self.instance.as_ptr(), &mut raw, &mut error) };
        drop(serial);
        self.instance.outcome(code, &error)?;
        let length = (raw.message_len as usize).min(raw.message.len());
        let endpoint = String::from_utf8_lossy(&raw.message[..length]);
        Ok(SimulationStatus {
            endpoint: text::shown(&endpoint, abi::BUSBAR_SIMULATOR_MESSAGE_CAPACITY),
            fault: FaultKind::ALL.into_iter().find(|fault| fault.bit() == raw.fault),
            clients: raw.clients,
            connections: raw.connections,
            messages: raw.messages,
        })
    }
}

impl Drop for Simulator {
    fn drop(&mut self) {
        if let Some(stop) = self.table.stop {
            let _serial = self.instance.serialize_calls();
            // SAFETY: it was started.
            unsafe { stop(self.instance.as_ptr()) }
        }
    }
}

fn to_abi(tag: &SimulatedTag) -> abi::BusbarSimulatedTag {
    let SimulatedBehavior { shape, base, amplitude, period } = tag.behavior;
    abi::BusbarSimulatedTag {
        spec: telemetry::to_abi(&tag.tag),
        shape: shape.code().into(),
        reserved: 0,
        base,
        amplitude,
        period_seconds: period.as_secs_f64(),
    }
}

fn event_to_abi(event: &SimulatedEvent) -> abi::BusbarSimulatedEvent {
    let (value, over_seconds) = event.value.unwrap_or_default();
    abi::BusbarSimulatedEvent {
        tag: event.tag.0,
        kind: match event.value {
            Some(_) => abi::BUSBAR_SIMULATED_EVENT_KIND_VALUE,
            None => abi::BUSBAR_SIMULATED_EVENT_KIND_RELEASE,
        },
        at_seconds: event.at_seconds,
        over_seconds,
        value,
    }
}

fn link_fault_to_abi(fault: &SimulatedLinkFault) -> abi::BusbarLinkFault {
    abi::BusbarLinkFault {
        fault: fault.kind.bit(),
        reserved: 0,
        at_seconds: fault.at_seconds,
        for_seconds: fault.for_seconds,
    }
}
