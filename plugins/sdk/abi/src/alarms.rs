//! Capability `busbar.alarms/1-draft`: alarms of another system, which decides on them; the host
//! shows them.
//!
//! The plugin says which alarms are of interest now, how each stands, and whether what it
//! says is current; `plugins/sdk/sdk/src/alarms.rs` has the fields of the JSON.

use crate::{BusbarError, BusbarPlugin, BusbarStatusNumber, BusbarTextOutput};

/// Id of the capability.
pub const ALARMS_ID: &str = "busbar.alarms/1-draft";

/// Alarms of one report, at most.
pub const BUSBAR_MAX_SOURCE_ALARMS: usize = 5_000;
/// Bytes of an id, a name, a source or a message, at most.
pub const BUSBAR_MAX_SOURCE_ALARM_TEXT: usize = 512;
/// Bytes of a report, at most.
pub const BUSBAR_MAX_ALARM_REPORT: usize = 24 << 20;

/// Function table of `busbar.alarms/1-draft`.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct BusbarAlarms {
    /// Size of this struct, bytes.
    pub struct_size: u32,
    /// Reserved; must be zero.
    pub reserved: u32,
    /// `[serialized]` Writes the state of the alarms as JSON, and returns at once. The report may
    /// be without alarms where their revision is still `known_revision`, or where they are not
    /// known at all. 0 is never a revision. Fails with `BUSBAR_BUFFER_TOO_SMALL` when the text does
    /// not fit, with the bytes needed in `len`.
    pub read: Option<
        unsafe extern "C" fn(
            plugin: *const BusbarPlugin,
            known_revision: u64,
            output: *mut BusbarTextOutput,
            error: *mut BusbarError,
        ) -> BusbarStatusNumber,
    >,
}
