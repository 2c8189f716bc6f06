//! Capability `busbar.chart/1-draft`: records on axes, for parallel coordinates, and what
//! they mean for one piece of equipment.
//!
//! The plugin gives axes, records and the states that equipment is in by its latest record;
//! the host lays out, draws, brushes and marks. What seldom changes is JSON, as settings
//! are; `plugins/sdk/src/chart.rs` has its fields.

use crate::{BusbarError, BusbarPlugin, BusbarStatus, BusbarStr};

/// Id of the capability.
pub const CHART_ID: &str = "busbar.chart/1-draft";

/// Axes of a chart.
pub const BUSBAR_MAX_CHART_AXES: usize = 32;
/// Records of a chart.
pub const BUSBAR_MAX_CHART_RECORDS: usize = 10_000_000;
/// Bytes of a description, or of an explanation.
pub const BUSBAR_MAX_CHART_TEXT: usize = 16 << 20;

/// Room for a text. The caller owns it.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct BusbarTextOutput {
    /// Size of this struct, bytes.
    pub struct_size: u32,
    /// Room in `text`, bytes.
    pub capacity: u32,
    /// Bytes written; where there was too little room, bytes needed.
    pub len: u32,
    /// Zero.
    pub reserved: u32,
    /// UTF-8.
    pub text: *mut u8,
}

/// What a record is besides its values. Array element.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct BusbarChartRecord {
    /// When it was taken, nanoseconds since 1970-01-01 UTC.
    pub time_unix_nanos: i64,
    /// Index of the equipment described.
    pub equipment: u32,
    /// Index of the legend's entry.
    pub state: u32,
}

/// Room for some of the records. The caller owns it and says what it wants.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct BusbarChartPage {
    /// Size of this struct, bytes.
    pub struct_size: u32,
    /// Axes that the caller was told of: values a record.
    pub axis_count: u32,
    /// The first record wanted.
    pub first: u64,
    /// Room in `records`; 0 asks for revision and total alone.
    pub capacity: u32,
    /// Records written.
    pub count: u32,
    /// Records there are.
    pub total: u64,
    /// Grows with every change of description or records.
    pub revision: u64,
    /// The records, those of each piece of equipment in the order of time.
    pub records: *mut BusbarChartRecord,
    /// `axis_count` values a record, in its unit; NaN where there is none.
    pub values: *mut f32,
}

/// Table of `busbar.chart/1-draft`.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct BusbarChart {
    /// Size of this struct, bytes.
    pub struct_size: u32,
    /// Zero.
    pub reserved: u32,
    /// `[main-thread]` Writes the description as JSON. Fails with
    /// `BUSBAR_BUFFER_TOO_SMALL` when it does not fit, and says in `len` what it takes.
    pub describe: Option<
        unsafe extern "C" fn(
            plugin: *const BusbarPlugin,
            output: *mut BusbarTextOutput,
            error: *mut BusbarError,
        ) -> BusbarStatus,
    >,
    /// `[main-thread]` Writes records. Fails with `BUSBAR_INVALID_ARGUMENT` when the
    /// number of axes is not that of the description.
    pub read: Option<
        unsafe extern "C" fn(
            plugin: *const BusbarPlugin,
            page: *mut BusbarChartPage,
            error: *mut BusbarError,
        ) -> BusbarStatus,
    >,
    /// `[main-thread]` Writes as JSON what the last record of a piece of equipment that is
    /// not after an instant means. Fails as `describe` does.
    pub explain: Option<
        unsafe extern "C" fn(
            plugin: *const BusbarPlugin,
            equipment: BusbarStr,
            time_unix_nanos: i64,
            output: *mut BusbarTextOutput,
            error: *mut BusbarError,
        ) -> BusbarStatus,
    >,
}
