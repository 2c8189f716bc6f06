//! The C ABI between host and plugins.
//!
//! A plugin library exports one symbol, [`ENTRY_SYMBOL`], a
//! [`BusbarPluginEntry`]. From it the host gets a factory, from the factory
//! plugins, from a plugin its capabilities: tables of functions found by a
//! string id with a revision, such as `busbar.telemetry/2-draft`.
//!
//! Conventions that hold for every item here:
//! - every table and every struct passed alone starts with its size in bytes,
//!   so that fields can be added at the end; structs that are passed as arrays
//!   ([`BusbarCollapse`], [`BusbarStage`], [`BusbarSample`], [`BusbarTagSpec`],
//!   [`BusbarSimulatedTag`], [`BusbarBinding`], [`BusbarTagValue`],
//!   [`BusbarOverlayPrimitive`], [`BusbarChartRecord`], [`BusbarRecordRow`]) have a
//!   frozen layout instead;
//! - text is UTF-8 with a length ([`BusbarStr`]), without a terminating zero;
//! - what a caller passes is valid during the call only, unless said otherwise;
//!   who wants to keep it copies it. No call hands over ownership of memory:
//!   results go into buffers that the caller owns. So every call can be carried
//!   across a process border;
//! - a function that can fail returns a [`BusbarStatus`] and, when it is not
//!   [`BUSBAR_OK`], writes the reason into the caller's [`BusbarError`], unless
//!   that is null or its `struct_size` is too small for it;
//! - a pointer that is null or misaligned where this contract wants an object, a
//!   `struct_size` that is too small, or an unknown id is refused with
//!   [`BUSBAR_INVALID_ARGUMENT`] (null where a pointer is returned) and nothing
//!   is touched; `destroy` and `stop` then do nothing. So are calls out of order,
//!   such as a second `start`;
//! - no panic or exception may leave a function;
//! - the tags in brackets say from which thread and in which state a function
//!   may be called: `[serialized]` one call after the other: never two such calls
//!   at once on one instance (for calls without an instance: on one library), though
//!   not always on the same thread; `[any-thread]` any thread, also several at once;
//!   `[idle]` before `start` or after `stop`; `[active]` between them.
//!
//! # What is frozen
//!
//! Entry, factory, descriptor, plugin, host table and error are frozen: they only
//! grow at their ends, and a library built against 1.0 loads in every 1.x. A
//! capability whose id ends in `-draft` may still change with any release: rebuild
//! with the host's SDK. Once frozen it loses that ending, and a later revision
//! comes beside it under a new number.

#![no_std]

/// Declares the type of an enum's numbers in fields, and a constant for each value.
///
/// Fields that the other side writes hold any number, which a Rust enum must not. The headers
/// declare such fields by the enum.
macro_rules! enum_numbers {
    ($(#[$doc:meta])* $number:ident: $repr:ty = $name:ident {
        $($constant:ident = $value:ident),+ $(,)?
    }) => {
        $(#[$doc])*
        pub type $number = $repr;
        const _: () = assert!(size_of::<$name>() == size_of::<$number>());
        $(
            #[doc = concat!("Number of [`", stringify!($name), "::", stringify!($value), "`].")]
            pub const $constant: $number = $name::$value as $number;
        )+
    };
}

mod alarms;
mod chart;
mod command;
mod entry;
mod mesh_optimizer;
mod notify;
mod overlay;
mod records;
mod simulator;
mod telemetry;
mod values;
mod vocabulary;

pub use alarms::*;
pub use chart::*;
pub use command::*;
pub use entry::*;
pub use mesh_optimizer::*;
pub use notify::*;
pub use overlay::*;
pub use records::*;
pub use simulator::*;
pub use telemetry::*;
pub use values::*;

/// Ids of all capabilities, with the names that the headers have for ids and function tables. The
/// ids in the headers, and what the host knows of capabilities, come from this list.
///
/// cbindgen:ignore
pub const CAPABILITIES: &[CapabilityDefinition] = &[
    CapabilityDefinition::new("MESH_OPTIMIZER", MESH_OPTIMIZER_ID, "BusbarMeshOptimizer"),
    CapabilityDefinition::new("TELEMETRY", TELEMETRY_ID, "BusbarTelemetry"),
    CapabilityDefinition::new("OVERLAY", OVERLAY_ID, "BusbarOverlay"),
    CapabilityDefinition::new("SIMULATOR", SIMULATOR_ID, "BusbarSimulator"),
    CapabilityDefinition::new("COMMAND", COMMAND_ID, "BusbarCommand"),
    CapabilityDefinition::new("CHART", CHART_ID, "BusbarChart"),
    CapabilityDefinition::new("RECORDS", RECORDS_ID, "BusbarRecords"),
    CapabilityDefinition::new("ALARMS", ALARMS_ID, "BusbarAlarms"),
    CapabilityDefinition::new("NOTIFY", NOTIFY_ID, "BusbarNotify"),
];

/// Names of a capability.
///
/// cbindgen:ignore
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CapabilityDefinition {
    /// Word in the header's name of the id, `BUSBAR_NOTIFY_ID`.
    pub name: &'static str,
    /// Id of the capability.
    pub id: &'static str,
    /// Name of the function table in the header.
    pub table: &'static str,
}

impl CapabilityDefinition {
    const fn new(name: &'static str, id: &'static str, table: &'static str) -> Self {
        Self { name, id, table }
    }
}
