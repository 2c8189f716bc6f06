//! Capability `busbar.telemetry/1-draft`: samples from devices into the tag table.
//!
//! Adapters are read-only: nothing here lets Busbar command equipment.

use core::ffi::c_void;

use crate::{BusbarError, BusbarPlugin, BusbarStatus, BusbarStr};

/// Id of the capability.
pub const TELEMETRY_ID: &str = "busbar.telemetry/1-draft";

/// Value kind: none; the sample says something about quality only.
pub const BUSBAR_VALUE_NONE: u8 = 0;
/// Value kind: IEEE 754 double, its bits in `value`.
pub const BUSBAR_VALUE_F64: u8 = 1;
/// Value kind: two's complement 64-bit integer.
pub const BUSBAR_VALUE_I64: u8 = 2;
/// Value kind: 0 or 1.
pub const BUSBAR_VALUE_BOOL: u8 = 3;
/// Value kind: double-point, 0 intermediate, 1 off, 2 on, 3 bad state
/// (IEC 60870-5-101, 7.2.6.2).
pub const BUSBAR_VALUE_DOUBLE_POINT: u8 = 4;

/// Quality: usable.
pub const BUSBAR_QUALITY_GOOD: u8 = 0;
/// Quality: doubtful.
pub const BUSBAR_QUALITY_UNCERTAIN: u8 = 1;
/// Quality: not usable.
pub const BUSBAR_QUALITY_BAD: u8 = 2;

/// Reason: none given.
pub const BUSBAR_REASON_NONE: u8 = 0;
/// Reason: the link to the device is down.
pub const BUSBAR_REASON_COMMUNICATION: u8 = 1;
/// Reason: the device says that its sensor failed.
pub const BUSBAR_REASON_SENSOR: u8 = 2;
/// Reason: outside the measuring range.
pub const BUSBAR_REASON_OUT_OF_RANGE: u8 = 3;
/// Reason: the device refused the address, or its answer does not fit.
pub const BUSBAR_REASON_CONFIGURATION: u8 = 4;
/// Reason: not connected yet.
pub const BUSBAR_REASON_NOT_CONNECTED: u8 = 5;
/// Reason: not a finite number.
pub const BUSBAR_REASON_NOT_FINITE: u8 = 6;
/// Reason: past its freshness limit. Only the host gives it.
pub const BUSBAR_REASON_STALE: u8 = 7;

/// Reason: the time that the source gave is missing where one is promised,
/// unreadable, in the future or impossible.
pub const BUSBAR_REASON_SOURCE_TIME: u8 = 8;

/// Sample flag: the sample comes out of a buffer (buffered report, stored or
/// historical value). Source time orders such samples; all others count in the
/// order of their arrival, whatever their source time.
pub const BUSBAR_SAMPLE_BUFFERED: u8 = 1 << 0;
/// Sample flag: settings or protocol promise a source time, and this sample's
/// is missing or unreadable. A good value becomes uncertain (source time).
pub const BUSBAR_SAMPLE_TIME_UNUSABLE: u8 = 1 << 1;
/// Origin: a person or program put the value in place of the measured one.
pub const BUSBAR_ORIGIN_SUBSTITUTED: u8 = 1 << 2;
/// Origin: the device is under test.
pub const BUSBAR_ORIGIN_TEST: u8 = 1 << 3;
/// Origin: a simulator made the value.
pub const BUSBAR_ORIGIN_SIMULATED: u8 = 1 << 4;
/// Origin: the value is replayed from a recording.
pub const BUSBAR_ORIGIN_RECORDED: u8 = 1 << 5;
/// Origin: the source says that the value is of the past.
pub const BUSBAR_ORIGIN_HISTORICAL: u8 = 1 << 6;

/// `source_time` of a sample whose source gives no time.
pub const BUSBAR_NO_TIME: i64 = i64::MIN;

/// One update of one tag, 24 bytes. Array element.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BusbarSample {
    /// Handle from [`BusbarTagSpec`].
    pub tag: u32,
    /// `BUSBAR_VALUE_*`.
    pub kind: u8,
    /// `BUSBAR_QUALITY_*`.
    pub quality: u8,
    /// `BUSBAR_REASON_*`.
    pub reason: u8,
    /// `BUSBAR_SAMPLE_*` and `BUSBAR_ORIGIN_*`, or'ed; 0 for a live value.
    pub flags: u8,
    /// Bits of the value, after `kind`.
    pub value: u64,
    /// Time at the source, nanoseconds since 1970-01-01 UTC, or
    /// [`BUSBAR_NO_TIME`].
    pub source_time_unix_nanos: i64,
}

/// One tag that a telemetry plugin is to serve. Array element.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct BusbarTagSpec {
    /// Names the tag in samples.
    pub tag: u32,
    /// `BUSBAR_VALUE_*` that the host wants.
    pub kind: u32,
    /// Freshness limit: a value older than this is stale, milliseconds.
    pub freshness_millis: u64,
    /// Tag id, for messages.
    pub id: BusbarStr,
    /// The tag's address for this plugin: JSON, as the configuration has it.
    pub address_json: BusbarStr,
}

/// State of the plugin's link: not tried yet.
pub const BUSBAR_LINK_IDLE: u32 = 0;
/// State of the plugin's link: connecting or waiting to try again.
pub const BUSBAR_LINK_CONNECTING: u32 = 1;
/// State of the plugin's link: up.
pub const BUSBAR_LINK_UP: u32 = 2;
/// State of the plugin's link: down.
pub const BUSBAR_LINK_DOWN: u32 = 3;

/// Where samples go. Valid from `start` until `stop` returns.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct BusbarSampleSink {
    /// Size of this struct, bytes.
    pub struct_size: u32,
    /// Zero.
    pub reserved: u32,
    /// Passed back in every call.
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
    /// `[any-thread & active]` Tells operators how the link is:
    /// `BUSBAR_LINK_*` and a sentence.
    pub report_link:
        Option<unsafe extern "C" fn(context: *mut c_void, state: u32, message: BusbarStr)>,
    /// `[any-thread & active]` Tells the time that the values published from
    /// here on are of, nanoseconds since 1970-01-01 UTC, where that is not now:
    /// a recording's. Overlays then calculate by that time.
    /// [`BUSBAR_NO_TIME`] goes back to the wall clock. Null in older hosts.
    pub report_scene_time:
        Option<unsafe extern "C" fn(context: *mut c_void, scene_time_unix_nanos: i64)>,
}

/// Table of `busbar.telemetry/1-draft`.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct BusbarTelemetry {
    /// Size of this struct, bytes.
    pub struct_size: u32,
    /// `BUSBAR_ORIGIN_*`, or'ed, of all samples of this plugin; 0 where they
    /// are live.
    pub origin: u32,
    /// `[main-thread & idle]` Whether these tags could be served: reads
    /// addresses, connects to nothing. Everything is borrowed for the call.
    /// Fails like `start`. May be null.
    pub check: Option<
        unsafe extern "C" fn(
            plugin: *const BusbarPlugin,
            tags: *const BusbarTagSpec,
            tag_count: usize,
            error: *mut BusbarError,
        ) -> BusbarStatus,
    >,
    /// `[main-thread & idle]` Starts to serve tags on threads of the plugin's
    /// own and returns at once; a device that does not answer is no failure
    /// but Bad quality. The specs are valid during the call, `sink` until
    /// `stop` returns. Fails with `BUSBAR_INVALID_SETTINGS` when an address is
    /// wrong, naming every tag at fault that the message has room for; the
    /// plugin is then idle, and no call to the sink may follow.
    pub start: Option<
        unsafe extern "C" fn(
            plugin: *const BusbarPlugin,
            tags: *const BusbarTagSpec,
            tag_count: usize,
            sink: *const BusbarSampleSink,
            error: *mut BusbarError,
        ) -> BusbarStatus,
    >,
    /// `[main-thread & active]` Ends all threads within two seconds. No call
    /// to the sink may follow.
    pub stop: Option<unsafe extern "C" fn(plugin: *const BusbarPlugin)>,
}
