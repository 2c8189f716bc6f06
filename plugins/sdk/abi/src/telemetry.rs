//! Capability `busbar.telemetry/2-draft`: samples from devices into the tag table.
//!
//! Adapters are read-only: nothing here lets Busbar command equipment.

use core::ffi::c_void;

use crate::{
    BusbarError, BusbarPlugin, BusbarQualityNumber, BusbarReasonNumber, BusbarStatusNumber,
    BusbarStr, BusbarValueKindNumber,
};

/// Id of the capability.
pub const TELEMETRY_ID: &str = "busbar.telemetry/2-draft";

/// Sample flag of a buffered sample: a buffered report, a stored or a historical value. Source time
/// orders such samples; all others count in the order of their arrival, whatever their source time.
pub const BUSBAR_SAMPLE_BUFFERED: u8 = 1 << 0;
/// Sample flag of a promised source time that is missing or unreadable. A good value becomes
/// uncertain (source time).
pub const BUSBAR_SAMPLE_TIME_UNUSABLE: u8 = 1 << 1;

/// Source timestamp of a sample whose source gives none.
pub const BUSBAR_NO_TIME: i64 = i64::MIN;

/// Update of one tag. Array element.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct BusbarSample {
    /// Handle of the tag, from [`BusbarTagSpec`].
    pub tag: u32,
    /// Kind of the value.
    pub kind: BusbarValueKindNumber,
    /// Quality of the value.
    pub quality: BusbarQualityNumber,
    /// Reason of the quality.
    pub reason: BusbarReasonNumber,
    /// Flags, `BUSBAR_SAMPLE_*` and `BUSBAR_ORIGIN_*` or'ed; 0 for a live value.
    pub flags: u8,
    /// Value of kind `BUSBAR_VALUE_KIND_F64`; of no meaning for others.
    pub number: f64,
    /// Value of kind `BUSBAR_VALUE_KIND_I64`, `BUSBAR_VALUE_KIND_BOOL` or
    /// `BUSBAR_VALUE_KIND_DOUBLE_POINT`; of no meaning for others.
    pub integer: i64,
    /// Source timestamp, nanoseconds since 1970-01-01 UTC, or [`BUSBAR_NO_TIME`].
    pub source_time_unix_nanos: i64,
    /// Value of kind `BUSBAR_VALUE_KIND_TEXT`, valid during the call; of no meaning for others. Text
    /// that is too long or no UTF-8 is taken as far as it is, and is uncertain.
    pub text: BusbarStr,
}

/// Tag that a telemetry plugin is to serve. Array element.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct BusbarTagSpec {
    /// Handle that names the tag in samples.
    pub tag: u32,
    /// Kind of value that the host expects.
    pub kind: BusbarValueKindNumber,
    /// Reserved; must be zero.
    pub reserved: [u8; 3],
    /// Freshness limit, milliseconds: an older value is stale.
    pub freshness_millis: u64,
    /// Id of the tag, for messages.
    pub id: BusbarStr,
    /// Address of the tag for this plugin: JSON, as the configuration has it.
    pub address_json: BusbarStr,
    /// Unit that samples must have, such as `kV`; empty where the tag has none, or where the host
    /// scales samples to it. A plugin whose source names another unit converts or refuses.
    pub unit: BusbarStr,
}

/// State of the link to the device.
#[repr(u32)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BusbarLinkState {
    /// Link state of a plugin that has not tried to connect yet.
    Idle = 0,
    /// Link state of a plugin that connects or waits to try again.
    Connecting = 1,
    /// Link state of a connected plugin.
    Up = 2,
    /// Link state of a plugin whose link is down.
    Down = 3,
}

enum_numbers! {
    /// Number of a [`BusbarLinkState`] that the other side wrote.
    BusbarLinkStateNumber: u32 = BusbarLinkState {
        BUSBAR_LINK_STATE_IDLE = Idle,
        BUSBAR_LINK_STATE_CONNECTING = Connecting,
        BUSBAR_LINK_STATE_UP = Up,
        BUSBAR_LINK_STATE_DOWN = Down,
    }
}

/// Sink for samples and link reports. Valid from `start` until `stop` returns.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct BusbarSampleSink {
    /// Size of this struct, bytes.
    pub struct_size: u32,
    /// Reserved; must be zero.
    pub reserved: u32,
    /// Context that is passed back in every call.
    pub context: *mut c_void,
    /// `[any-thread & active]` Takes a batch, copying it, without blocking.
    /// Returns how many samples were taken. When the queue is full, the
    /// oldest in it are dropped and counted.
    pub publish: Option<
        unsafe extern "C" fn(
            context: *mut c_void,
            samples: *const BusbarSample,
            count: usize,
        ) -> usize,
    >,
    /// `[any-thread & active]` Reports the state of the link to operators, with a sentence.
    pub report_link: Option<
        unsafe extern "C" fn(
            context: *mut c_void,
            state: BusbarLinkStateNumber,
            message: BusbarStr,
        ),
    >,
    /// `[any-thread & active]` Sets the scene time of the values published from now on, nanoseconds
    /// since 1970-01-01 UTC. For recordings, whose time is not now; overlays then calculate by that
    /// time. [`BUSBAR_NO_TIME`] returns to the wall clock. Null in older hosts.
    pub report_scene_time:
        Option<unsafe extern "C" fn(context: *mut c_void, scene_time_unix_nanos: i64)>,
}

/// Function table of `busbar.telemetry/2-draft`.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct BusbarTelemetry {
    /// Size of this struct, bytes.
    pub struct_size: u32,
    /// Origin of all samples of this plugin, `BUSBAR_ORIGIN_*` or'ed; 0 where they are live.
    pub origin: u32,
    /// `[serialized & idle]` Checks whether these tags could be served: reads addresses, connects
    /// to nothing. All arguments are borrowed for the call. Fails like `start`. May be null.
    pub check: Option<
        unsafe extern "C" fn(
            plugin: *const BusbarPlugin,
            tags: *const BusbarTagSpec,
            tag_count: usize,
            error: *mut BusbarError,
        ) -> BusbarStatusNumber,
    >,
    /// `[serialized & idle]` Starts to serve tags on threads of the plugin's own and returns at
    /// once. A device that does not answer is no failure but Bad quality. The specs are valid
    /// during the call, `sink` until `stop` returns. Fails with `BUSBAR_INVALID_SETTINGS` when an
    /// address is wrong. The message names every tag at fault that it has room for. The plugin is
    /// then idle, and no call to the sink may follow.
    pub start: Option<
        unsafe extern "C" fn(
            plugin: *const BusbarPlugin,
            tags: *const BusbarTagSpec,
            tag_count: usize,
            sink: *const BusbarSampleSink,
            error: *mut BusbarError,
        ) -> BusbarStatusNumber,
    >,
    /// `[serialized & active]` Ends all threads within two seconds. No call
    /// to the sink may follow.
    pub stop: Option<unsafe extern "C" fn(plugin: *const BusbarPlugin)>,
}
