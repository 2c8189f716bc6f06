//! Capability `busbar.alarms/1-draft`: alarms as another system has them, shown and never
//! decided on by the host.
//!
//! The plugin says which alarms are of interest now, how each stands, and whether what it
//! says is current; `plugins/sdk/src/alarms.rs` has the fields of the JSON.

use crate::{BusbarError, BusbarPlugin, BusbarStatus, BusbarTextOutput};

/// Id of the capability.
pub const ALARMS_ID: &str = "busbar.alarms/1-draft";

/// Alarms of one report.
pub const BUSBAR_MAX_SOURCE_ALARMS: usize = 5_000;
/// Bytes of an id, a name, a source or a message.
pub const BUSBAR_MAX_SOURCE_ALARM_TEXT: usize = 512;
/// Bytes of a report.
pub const BUSBAR_MAX_ALARM_REPORT: usize = 24 << 20;

/// Table of `busbar.alarms/1-draft`.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct BusbarAlarms {
    /// Size of this struct, bytes.
    pub struct_size: u32,
    /// Zero.
    pub reserved: u32,
    /// `[main-thread]` Writes as JSON how the alarms stand. Where their revision is still
    /// the known one, or they are not known at all, the report may be without alarms; 0 is
    /// never a revision. Returns at
    /// once with what is known. Fails with `BUSBAR_BUFFER_TOO_SMALL` when it does not fit,
    /// and says in `len` what it takes.
    pub read: Option<
        unsafe extern "C" fn(
            plugin: *const BusbarPlugin,
            known_revision: u64,
            output: *mut BusbarTextOutput,
            error: *mut BusbarError,
        ) -> BusbarStatus,
    >,
}
