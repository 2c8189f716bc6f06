//! Capability `busbar.records/1-draft`: lists of rows about equipment, from business and asset
//! management systems.
//!
//! The plugin gives lists, their columns and rows; the host joins rows to equipment by its
//! ids and aliases. What seldom changes is JSON, as settings are; `plugins/sdk/sdk/src/records.rs`
//! has its fields. A revision tells whether anything changed, so that what did not costs
//! nothing.

use crate::{BusbarError, BusbarPlugin, BusbarStatusNumber, BusbarTextOutput};

/// Id of the capability.
pub const RECORDS_ID: &str = "busbar.records/1-draft";

/// Lists of a plugin, at most.
pub const BUSBAR_MAX_RECORD_LISTS: usize = 16;
/// Columns of a list, at most.
pub const BUSBAR_MAX_RECORD_COLUMNS: usize = 32;
/// Rows of a list, at most.
pub const BUSBAR_MAX_RECORD_ROWS: usize = 200_000;
/// Bytes of an equipment id, or of a cell, at most.
pub const BUSBAR_MAX_RECORD_TEXT: usize = 1024;
/// Bytes of all texts of all lists of a plugin, each counted with 32 more, at most.
pub const BUSBAR_MAX_RECORD_BYTES: usize = 64 << 20;
/// Bytes of a description, at most.
pub const BUSBAR_MAX_RECORD_DESCRIPTION: usize = 4 << 20;

/// Time of a row that has none.
pub const BUSBAR_RECORD_NO_TIME: i64 = i64::MIN;

/// Flag of an open row: something is still to be done.
pub const BUSBAR_RECORD_OPEN: u32 = 1;

/// Severity of the defect that a row reports.
#[repr(u32)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BusbarDefectSeverity {
    /// Severity of a row that is no defect, or of which that is not known.
    None = 0,
    /// Severity of a defect to be mended when there is occasion.
    General = 1,
    /// Severity of a defect to be mended soon, and watched until then.
    Serious = 2,
    /// Severity of a defect to be mended at once.
    Critical = 3,
}

enum_numbers! {
    /// Number of a [`BusbarDefectSeverity`] that the other side wrote.
    BusbarDefectSeverityNumber: u32 = BusbarDefectSeverity {
        BUSBAR_DEFECT_SEVERITY_NONE = None,
        BUSBAR_DEFECT_SEVERITY_GENERAL = General,
        BUSBAR_DEFECT_SEVERITY_SERIOUS = Serious,
        BUSBAR_DEFECT_SEVERITY_CRITICAL = Critical,
    }
}

/// Time, severity and flags of a row. Array element.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct BusbarRecordRow {
    /// Time at which the row was reported or done, nanoseconds since 1970-01-01 UTC, or
    /// `BUSBAR_RECORD_NO_TIME`.
    pub time_unix_nanos: i64,
    /// Severity of the defect, if the row reports one.
    pub severity: BusbarDefectSeverityNumber,
    /// Flags of the row: `BUSBAR_RECORD_OPEN`, or 0.
    pub flags: u32,
}

/// Buffers for a part of a list's rows. The caller owns them and fills in the request.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct BusbarRecordPage {
    /// Size of this struct, bytes.
    pub struct_size: u32,
    /// Index of the list described.
    pub list: u32,
    /// Number of columns in the description that the caller has.
    pub column_count: u32,
    /// Capacity of `rows`; 0 requests the revision alone, of whatever list.
    pub row_capacity: u32,
    /// Index of the first row requested.
    pub first: u64,
    /// Capacity of `text`, bytes.
    pub text_capacity: u32,
    /// Number of rows written: as many as there is room for.
    pub row_count: u32,
    /// Number of rows that the list has.
    pub total: u64,
    /// Revision of the lists, which grows with every change of the description or of any list.
    pub revision: u64,
    /// Rows of the list, in its order.
    pub rows: *mut BusbarRecordRow,
    /// End offsets of texts in `text`: `1 + column_count` a row, row by row. The first text is the
    /// equipment's id or an alias of it; a cell a column follows.
    pub ends: *mut u32,
    /// Texts of the rows in UTF-8, one after the other.
    pub text: *mut u8,
}

/// Function table of `busbar.records/1-draft`.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct BusbarRecords {
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
    /// `[serialized]` Writes rows. Fails with `BUSBAR_INVALID_ARGUMENT` when there is no such
    /// list, or its number of columns is another. Fails with `BUSBAR_BUFFER_TOO_SMALL` when not one
    /// row fits.
    pub read: Option<
        unsafe extern "C" fn(
            plugin: *const BusbarPlugin,
            page: *mut BusbarRecordPage,
            error: *mut BusbarError,
        ) -> BusbarStatusNumber,
    >,
}
