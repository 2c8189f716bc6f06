//! Capability `busbar.simulator/1-draft`: a plugin that speaks a protocol also serves
//! it, so that a configuration can be tried without its devices.
//!
//! The plugin listens where its settings say that the device is, and has every tag at
//! its address. What value a tag has at an instant follows from the seed, the tag's id,
//! its behaviour and the scenario alone (`busbar_plugin_sdk::simulation` has the formulas).

use crate::{BusbarError, BusbarPlugin, BusbarStatus, BusbarTagSpec};

/// Id of the capability.
pub const SIMULATOR_ID: &str = "busbar.simulator/1-draft";

/// Shape: the base, always.
pub const BUSBAR_SHAPE_CONSTANT: u32 = 0;
/// Shape: a sine about the base.
pub const BUSBAR_SHAPE_SINE: u32 = 1;
/// Shape: a smooth random walk about the base.
pub const BUSBAR_SHAPE_WALK: u32 = 2;
/// Shape: levels about the base, or positions of a switch, each held for a period.
pub const BUSBAR_SHAPE_STEPS: u32 = 3;
/// Shape: one more each period, from the base to base and amplitude, then anew.
pub const BUSBAR_SHAPE_COUNTER: u32 = 4;

/// Fault: connections end, and new ones are turned away.
pub const BUSBAR_FAULT_LINK_LOSS: u32 = 1;
/// Fault: every answer takes a while, but comes in time.
pub const BUSBAR_FAULT_SLOW: u32 = 2;
/// Fault: connections stay, and nothing comes through them.
pub const BUSBAR_FAULT_HALF_OPEN: u32 = 4;
/// Fault: connections are reset, again and again.
pub const BUSBAR_FAULT_RESET: u32 = 8;
/// Fault: random bytes come instead of answers.
pub const BUSBAR_FAULT_GARBAGE: u32 = 16;
/// Fault: answers come after the client's deadline.
pub const BUSBAR_FAULT_LATE: u32 = 32;
/// Fault: the device's clock is wrong.
pub const BUSBAR_FAULT_CLOCK_JUMP: u32 = 64;

/// Bytes of the text of a [`BusbarSimulatorStatus`].
pub const BUSBAR_SIMULATOR_MESSAGE_CAPACITY: usize = 512;

/// One tag that is simulated. Array element.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct BusbarSimulatedTag {
    /// The tag, as telemetry has it.
    pub spec: BusbarTagSpec,
    /// `BUSBAR_SHAPE_*`.
    pub shape: u32,
    /// Zero.
    pub reserved: u32,
    /// What it is about, in the tag's unit; 0 or 1 for bool, 0 to 3 for double-point.
    pub base: f64,
    /// How far it goes from that; not negative.
    pub amplitude: f64,
    /// Time of a wave, a level or a count, seconds; more than 0.
    pub period_seconds: f64,
}

/// What holds for all tags of a simulation.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct BusbarSimulation {
    /// Size of this struct, bytes.
    pub struct_size: u32,
    /// Sum of the `BUSBAR_FAULT_*` that strike; 0 for none.
    pub faults: u32,
    /// The same seed gives the same values and the same faults.
    pub seed: u64,
    /// Period in which changes are looked for, milliseconds; more than 0. Of no
    /// meaning to protocols whose devices only answer.
    pub update_millis: u64,
    /// In each of these periods one fault strikes, milliseconds; more than
    /// `fault_millis`.
    pub fault_period_millis: u64,
    /// How long a fault holds at most, milliseconds; more than 0.
    pub fault_millis: u64,
    /// When the scenario began, nanoseconds since 1970-01-01 UTC; a plugin that is started
    /// again goes on with it.
    pub scenario_unix_nanos: i64,
    /// Number of events.
    pub event_count: u32,
    /// Number of link faults.
    pub link_fault_count: u32,
    /// What happens to tags, in the order of time.
    pub events: *const BusbarSimulatedEvent,
    /// What happens to the link, in the order of time.
    pub link_faults: *const BusbarLinkFault,
}

/// Event: the tag goes to a value and stays there.
pub const BUSBAR_EVENT_VALUE: u32 = 0;
/// Event: the tag moves by its own shape again.
pub const BUSBAR_EVENT_RELEASE: u32 = 1;

/// Something that happens to a simulated tag. Array element.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct BusbarSimulatedEvent {
    /// Handle of the tag.
    pub tag: u32,
    /// `BUSBAR_EVENT_*`.
    pub kind: u32,
    /// When, seconds since the scenario began; not negative.
    pub at_seconds: f64,
    /// How long the way to the value takes, seconds; not negative, 0 for bool and
    /// double-point.
    pub over_seconds: f64,
    /// The value in the tag's unit; 0 or 1 for bool, 0 to 3 for double-point.
    pub value: f64,
}

/// A time in which the link fails. Array element.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct BusbarLinkFault {
    /// `BUSBAR_FAULT_*`, one of them.
    pub fault: u32,
    /// Zero.
    pub reserved: u32,
    /// When it begins, seconds since the scenario began; not negative.
    pub at_seconds: f64,
    /// How long it holds, seconds; more than 0.
    pub for_seconds: f64,
}

/// How a simulation goes.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct BusbarSimulatorStatus {
    /// Size of this struct, bytes.
    pub struct_size: u32,
    /// The `BUSBAR_FAULT_*` that holds; 0 for none.
    pub fault: u32,
    /// Clients that are connected.
    pub clients: u32,
    /// Used bytes of `message`.
    pub message_len: u32,
    /// Connections that were taken so far.
    pub connections: u64,
    /// Answers to requests, and messages without one, that were sent so far.
    pub messages: u64,
    /// Where it listens, UTF-8.
    pub message: [u8; BUSBAR_SIMULATOR_MESSAGE_CAPACITY],
}

impl BusbarSimulatorStatus {
    /// A status to be filled in.
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

/// Table of `busbar.simulator/1-draft`. Whether the plugin also serves tags by
/// `busbar.telemetry/1-draft` is of no concern to it.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct BusbarSimulator {
    /// Size of this struct, bytes.
    pub struct_size: u32,
    /// Zero.
    pub reserved: u32,
    /// `[main-thread & idle]` Listens, serves tags on threads of the plugin's own, and
    /// returns at once. Tags and simulation are valid during the call. Fails with
    /// `BUSBAR_INVALID_SETTINGS` when an address is wrong or cannot hold the values of
    /// its tag, naming every tag at fault that the message has room for; with
    /// `BUSBAR_FAILED` when it cannot listen. The plugin is then idle.
    pub start: Option<
        unsafe extern "C" fn(
            plugin: *const BusbarPlugin,
            tags: *const BusbarSimulatedTag,
            tag_count: usize,
            simulation: *const BusbarSimulation,
            error: *mut BusbarError,
        ) -> BusbarStatus,
    >,
    /// `[main-thread & active]` Ends all connections and threads within two seconds,
    /// and listens no more.
    pub stop: Option<unsafe extern "C" fn(plugin: *const BusbarPlugin)>,
    /// `[main-thread & active]` Fills in how it goes.
    pub status: Option<
        unsafe extern "C" fn(
            plugin: *const BusbarPlugin,
            status: *mut BusbarSimulatorStatus,
            error: *mut BusbarError,
        ) -> BusbarStatus,
    >,
}
