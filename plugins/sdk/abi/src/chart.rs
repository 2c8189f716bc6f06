//! Capability `busbar.chart/1-draft`: records for parallel coordinates, and explanations of one
//! piece of equipment's records.
//!
//! The plugin gives axes, records and the states that equipment is in by its latest record;
//! the host lays out, draws, brushes and marks. What seldom changes is JSON, as settings
//! are; `plugins/sdk/sdk/src/chart.rs` has its fields.

use crate::{BusbarError, BusbarPlugin, BusbarStatusNumber, BusbarStr, BusbarTextOutput};

/// Id of the capability.
pub const CHART_ID: &str = "busbar.chart/1-draft";

/// Axes of a chart, at most.
pub const BUSBAR_MAX_CHART_AXES: usize = 32;
/// Records of a chart, at most.
pub const BUSBAR_MAX_CHART_RECORDS: usize = 10_000_000;
/// Bytes of a description, or of an explanation, at most.
pub const BUSBAR_MAX_CHART_TEXT: usize = 16 << 20;

/// Time, equipment and state of a record. Array element.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct BusbarChartRecord {
    /// Time at which the record was taken, nanoseconds since 1970-01-01 UTC.
    pub time_unix_nanos: i64,
    /// Index of the equipment described.
    pub equipment: u32,
    /// Index of the legend's entry.
    pub state: u32,
}

/// Buffers for a part of the records. The caller owns them and fills in the request.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct BusbarChartPage {
    /// Size of this struct, bytes.
    pub struct_size: u32,
    /// Number of axes in the description that the caller has: values a record.
    pub axis_count: u32,
    /// Index of the first record requested.
    pub first: u64,
    /// Capacity of `records`; 0 requests revision and total alone.
    pub capacity: u32,
    /// Number of records written.
    pub count: u32,
    /// Number of records in all.
    pub total: u64,
    /// Revision of the chart, which grows with every change of description or records.
    pub revision: u64,
    /// The records, those of each piece of equipment in the order of time.
    pub records: *mut BusbarChartRecord,
    /// Values of the records, `axis_count` a record, each in the unit of its axis; NaN where there
    /// is none.
    pub values: *mut f32,
}

/// Function table of `busbar.chart/1-draft`.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct BusbarChart {
    /// Size of this struct, bytes.
    pub struct_size: u32,
    /// Reserved; must be zero.
    pub reserved: u32,
    /// `[serialized]` Writes the description as JSON. Fails with `BUSBAR_BUFFER_TOO_SMALL` when
    /// the text does not fit, with the bytes needed in `len`.
    pub describe: Option<
        unsafe extern "C" fn(
            plugin: *const BusbarPlugin,
            output: *mut BusbarTextOutput,
            error: *mut BusbarError,
        ) -> BusbarStatusNumber,
    >,
    /// `[serialized]` Writes records. Fails with `BUSBAR_INVALID_ARGUMENT` when the
    /// number of axes is not that of the description.
    pub read: Option<
        unsafe extern "C" fn(
            plugin: *const BusbarPlugin,
            page: *mut BusbarChartPage,
            error: *mut BusbarError,
        ) -> BusbarStatusNumber,
    >,
    /// `[serialized]` Writes an explanation as JSON: of a piece of equipment's last record that is
    /// not after an instant. Fails as `describe` does.
    pub explain: Option<
        unsafe extern "C" fn(
            plugin: *const BusbarPlugin,
            equipment: BusbarStr,
            time_unix_nanos: i64,
            output: *mut BusbarTextOutput,
            error: *mut BusbarError,
        ) -> BusbarStatusNumber,
    >,
}
