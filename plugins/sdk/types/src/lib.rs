//! Shared vocabulary of host, protocol, plugins and SDK: values and their quality, alarms, verdicts,
//! patterns, faults of simulated devices.
//!
//! One type stands for one idea in all crates. Numbers ([`ValueKind::code`] and so on) are those
//! of the C ABI; `busbar_plugin_abi` asserts at compile time that its constants equal them.
//!
//! - feature `serde`: words in JSON as configurations, audit logs and plugins write them;
//! - feature `schemars`: JSON Schema, with the doc comments as descriptions.
//!
//! Invariant: no dependency without a feature, no I/O; plain data alone, and texts whose clones
//! share their bytes.

#![no_std]

extern crate alloc;

mod alarm_state;
mod code;
mod double_point;
mod origin;
mod overlay;
mod priority;
mod quality;
mod simulation;
mod text;
mod value;

pub use alarm_state::{AlarmAction, AlarmState};
pub use double_point::DoublePoint;
pub use origin::Origin;
pub use overlay::{DefectSeverity, Pattern, Severity, Verdict, VerdictSeverity};
pub use priority::{Limit, Priority};
pub use quality::{Quality, QualityLevel, Reason};
pub use simulation::{FaultKind, SignalShape};
pub use text::{MAX_TEXT_BYTES, Text};
pub use value::{Value, ValueKind};
