//! Capability `busbar.simulator/1-draft`: simulated devices, so that a configuration can be tried
//! without its devices.
//!
//! The plugin listens where its settings say that the device is, and has every tag at
//! its address. What value a tag has at an instant follows from the seed, the tag's id,
//! its behaviour and the scenario alone (`busbar_plugin_sdk::simulation` has the formulas).

use crate::{BusbarError, BusbarPlugin, BusbarStatusNumber, BusbarTagSpec};

/// Id of the capability.
pub const SIMULATOR_ID: &str = "busbar.simulator/1-draft";

/// Capacity of the text of a [`BusbarSimulatorStatus`], bytes.
pub const BUSBAR_SIMULATOR_MESSAGE_CAPACITY: usize = 512;

/// Shape of a simulated signal.
#[repr(u32)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BusbarSignalShape {
    /// Shape of a constant at the base.
    Constant = 0,
    /// Shape of a sine about the base.
    Sine = 1,
    /// Shape of a smooth random walk about the base.
    Walk = 2,
    /// Shape of levels about the base, or positions of a switch, each held for a period.
    Steps = 3,
    /// Shape of a counter: one more each period, from the base to base and amplitude, then anew.
    Counter = 4,
}

enum_numbers! {
    /// Number of a [`BusbarSignalShape`] that the other side wrote.
    BusbarSignalShapeNumber: u32 = BusbarSignalShape {
        BUSBAR_SIGNAL_SHAPE_CONSTANT = Constant,
        BUSBAR_SIGNAL_SHAPE_SINE = Sine,
        BUSBAR_SIGNAL_SHAPE_WALK = Walk,
        BUSBAR_SIGNAL_SHAPE_STEPS = Steps,
        BUSBAR_SIGNAL_SHAPE_COUNTER = Counter,
    }
}

/// Fault of a lost link: connections end, and new ones are refused.
pub const BUSBAR_FAULT_LINK_LOSS: u32 = 1;
/// Fault of a slow device: every answer is delayed, but within the deadline.
pub const BUSBAR_FAULT_SLOW: u32 = 2;
/// Fault of half-open connections, through which no bytes come.
pub const BUSBAR_FAULT_HALF_OPEN: u32 = 4;
/// Fault of connections that are reset, again and again.
pub const BUSBAR_FAULT_RESET: u32 = 8;
/// Fault of random bytes instead of answers.
pub const BUSBAR_FAULT_GARBAGE: u32 = 16;
/// Fault of answers after the client's deadline.
pub const BUSBAR_FAULT_LATE: u32 = 32;
/// Fault of a wrong device clock.
pub const BUSBAR_FAULT_CLOCK_JUMP: u32 = 64;

/// Simulated tag. Array element.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct BusbarSimulatedTag {
    /// Specification of the tag, as for telemetry.
    pub spec: BusbarTagSpec,
    /// Shape of the signal.
    pub shape: BusbarSignalShapeNumber,
    /// Reserved; must be zero.
    pub reserved: u32,
    /// Base value of the signal, in the tag's unit; 0 or 1 for bool, 0 to 3 for double-point.
    pub base: f64,
    /// Amplitude about the base, in the tag's unit; not negative.
    pub amplitude: f64,
    /// Period of a wave, a level or a count, seconds; more than 0.
    pub period_seconds: f64,
}

/// Parameters of a simulation, for all its tags.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct BusbarSimulation {
    /// Size of this struct, bytes.
    pub struct_size: u32,
    /// Kinds of random faults, a sum of `BUSBAR_FAULT_*`; 0 for none.
    pub faults: u32,
    /// Seed of the random numbers: the same seed gives the same values and the same faults.
    pub seed: u64,
    /// Period in which changes are looked for, milliseconds; more than 0. Of no
    /// meaning to protocols whose devices only answer.
    pub update_millis: u64,
    /// Period in which one fault occurs, milliseconds; more than `fault_millis`.
    pub fault_period_millis: u64,
    /// Longest duration of a random fault, milliseconds; more than 0.
    pub fault_millis: u64,
    /// Start of the scenario, nanoseconds since 1970-01-01 UTC; a plugin that is restarted
    /// continues it.
    pub scenario_unix_nanos: i64,
    /// Number of events in `events`.
    pub event_count: u32,
    /// Number of link faults.
    pub link_fault_count: u32,
    /// Scenario events of tags, in the order of time.
    pub events: *const BusbarSimulatedEvent,
    /// Scenario faults of the link, in the order of time.
    pub link_faults: *const BusbarLinkFault,
}

/// Kind of a scenario event.
#[repr(u32)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BusbarSimulatedEventKind {
    /// Event of a tag that moves to a value and stays there.
    Value = 0,
    /// Event of a tag that follows its own shape again.
    Release = 1,
}

enum_numbers! {
    /// Number of a [`BusbarSimulatedEventKind`] that the other side wrote.
    BusbarSimulatedEventKindNumber: u32 = BusbarSimulatedEventKind {
        BUSBAR_SIMULATED_EVENT_KIND_VALUE = Value,
        BUSBAR_SIMULATED_EVENT_KIND_RELEASE = Release,
    }
}

/// Scenario event of a simulated tag. Array element.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct BusbarSimulatedEvent {
    /// Handle of the tag.
    pub tag: u32,
    /// Kind of the event.
    pub kind: BusbarSimulatedEventKindNumber,
    /// Time of the event, seconds since the scenario began; not negative.
    pub at_seconds: f64,
    /// Duration of the ramp to the value, seconds; not negative, 0 for bool and double-point.
    pub over_seconds: f64,
    /// Target value in the tag's unit; 0 or 1 for bool, 0 to 3 for double-point.
    pub value: f64,
}

/// Interval in which the link has a fault. Array element.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct BusbarLinkFault {
    /// Kind of the fault, one of `BUSBAR_FAULT_*`.
    pub fault: u32,
    /// Reserved; must be zero.
    pub reserved: u32,
    /// Begin of the fault, seconds since the scenario began; not negative.
    pub at_seconds: f64,
    /// Duration of the fault, seconds; more than 0.
    pub for_seconds: f64,
}

/// Status of a simulation.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct BusbarSimulatorStatus {
    /// Size of this struct, bytes.
    pub struct_size: u32,
    /// Present fault, one of `BUSBAR_FAULT_*`; 0 for none.
    pub fault: u32,
    /// Number of clients that are connected.
    pub clients: u32,
    /// Used bytes of `message`.
    pub message_len: u32,
    /// Number of connections accepted so far.
    pub connections: u64,
    /// Number of messages sent so far: answers to requests, and unsolicited ones.
    pub messages: u64,
    /// Address that the simulator listens at, UTF-8.
    pub message: [u8; BUSBAR_SIMULATOR_MESSAGE_CAPACITY],
}

impl BusbarSimulatorStatus {
    /// Creates a status to be filled in.
    pub const fn empty() -> Self {
        Self {
            struct_size: size_of::<Self>() as u32,
            fault: 0,
            clients: 0,
            message_len: 0,
            connections: 0,
            messages: 0,
            message: [0; BUSBAR_SIMULATOR_MESSAGE_CAPACITY],
        }
    }
}

/// Function table of `busbar.simulator/1-draft`. It is independent of `busbar.telemetry/2-draft`,
/// which the plugin may also have.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct BusbarSimulator {
    /// Size of this struct, bytes.
    pub struct_size: u32,
    /// Reserved; must be zero.
    pub reserved: u32,
    /// `[serialized & idle]` Listens, serves tags on threads of the plugin's own, and returns at
    /// once. Tags and simulation are valid during the call. Fails with `BUSBAR_INVALID_SETTINGS`
    /// when an address is wrong or cannot hold the values of its tag. The message names every tag
    /// at fault that it has room for. Fails with `BUSBAR_FAILED` when the plugin cannot listen. The
    /// plugin is then idle.
    pub start: Option<
        unsafe extern "C" fn(
            plugin: *const BusbarPlugin,
            tags: *const BusbarSimulatedTag,
            tag_count: usize,
            simulation: *const BusbarSimulation,
            error: *mut BusbarError,
        ) -> BusbarStatusNumber,
    >,
    /// `[serialized & active]` Ends all connections and threads within two seconds,
    /// and listens no more.
    pub stop: Option<unsafe extern "C" fn(plugin: *const BusbarPlugin)>,
    /// `[serialized & active]` Fills in the status of the simulation.
    pub status: Option<
        unsafe extern "C" fn(
            plugin: *const BusbarPlugin,
            status: *mut BusbarSimulatorStatus,
            error: *mut BusbarError,
        ) -> BusbarStatusNumber,
    >,
}
