//! Capability `busbar.notify/1-draft`: changes of alarms for plugins that tell people who are not in
//! the room.
//!
//! The host hands over changes with growing numbers, again and again until the plugin has taken
//! them; `plugins/sdk/sdk/src/notify.rs` has the fields of the JSON.

use crate::{BusbarError, BusbarPlugin, BusbarStatusNumber, BusbarStr, BusbarTextOutput};

/// Id of the capability.
pub const NOTIFY_ID: &str = "busbar.notify/1-draft";

/// Changes of one batch, at most.
pub const BUSBAR_MAX_NOTIFY_CHANGES: usize = 256;
/// Alarms of one list of standing alarms, at most.
pub const BUSBAR_MAX_NOTIFY_STANDING: usize = 2_000;
/// Bytes of the sentence in a report, at most.
pub const BUSBAR_MAX_NOTIFY_MESSAGE: usize = 1_024;
/// Bytes of a report, at most.
pub const BUSBAR_MAX_NOTIFY_REPORT: usize = 64 << 10;

/// Function table of `busbar.notify/1-draft`.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct BusbarNotify {
    /// Size of this struct, bytes.
    pub struct_size: u32,
    /// Reserved; must be zero.
    pub reserved: u32,
    /// `[serialized]` Takes a batch of changes as JSON, writes a report as JSON, and returns
    /// without waiting for any receiver. Changes that were taken before may come again and count
    /// once. Fails with `BUSBAR_BUFFER_TOO_SMALL` when the report does not fit, with the bytes
    /// needed in `len`; the batch comes again then.
    pub notify: Option<
        unsafe extern "C" fn(
            plugin: *const BusbarPlugin,
            batch: BusbarStr,
            output: *mut BusbarTextOutput,
            error: *mut BusbarError,
        ) -> BusbarStatusNumber,
    >,
}
