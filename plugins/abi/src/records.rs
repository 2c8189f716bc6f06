//! Capability `busbar.records/1-draft`: what business and management systems have of
//! equipment, as lists of rows that each belong to a piece of it.
//!
//! The plugin gives lists, their columns and rows; the host joins rows to equipment by its
//! ids and aliases. What seldom changes is JSON, as settings are; `plugins/sdk/src/records.rs`
//! has its fields. A revision tells whether anything changed, so that what did not costs
//! nothing.

use crate::{BusbarError, BusbarPlugin, BusbarStatus, BusbarTextOutput};

/// Id of the capability.
pub const RECORDS_ID: &str = "busbar.records/1-draft";

/// Lists of a plugin.
pub const BUSBAR_MAX_RECORD_LISTS: usize = 16;
/// Columns of a list.
pub const BUSBAR_MAX_RECORD_COLUMNS: usize = 32;
/// Rows of a list.
pub const BUSBAR_MAX_RECORD_ROWS: usize = 200_000;
/// Bytes of an equipment id, or of a cell.
pub const BUSBAR_MAX_RECORD_TEXT: usize = 1024;
/// Bytes of all texts of all lists of a plugin, each counted with 32 more.
pub const BUSBAR_MAX_RECORD_BYTES: usize = 64 << 20;
/// Bytes of a description.
pub const BUSBAR_MAX_RECORD_DESCRIPTION: usize = 4 << 20;

/// The time of a row that has none.
pub const BUSBAR_RECORD_NO_TIME: i64 = i64::MIN;

/// Severity of a row that is no defect, or of which that is not known.
pub const BUSBAR_RECORD_NO_SEVERITY: u32 = 0;
/// Severity of a defect: to be mended when there is occasion.
pub const BUSBAR_RECORD_GENERAL: u32 = 1;
/// Severity of a defect: to be mended soon, and watched until then.
pub const BUSBAR_RECORD_SERIOUS: u32 = 2;
/// Severity of a defect: to be mended at once.
pub const BUSBAR_RECORD_CRITICAL: u32 = 3;

/// Flag of a row: it is open, so that something is to be done still.
pub const BUSBAR_RECORD_OPEN: u32 = 1;

/// What a row is besides its texts. Array element.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct BusbarRecordRow {
    /// When it was reported or done, nanoseconds since 1970-01-01 UTC, or
    /// `BUSBAR_RECORD_NO_TIME`.
    pub time_unix_nanos: i64,
    /// `BUSBAR_RECORD_*` of severities.
    pub severity: u32,
    /// `BUSBAR_RECORD_OPEN`, or 0.
    pub flags: u32,
}

/// Room for some of the rows of a list. The caller owns it and says what it wants.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct BusbarRecordPage {
    /// Size of this struct, bytes.
    pub struct_size: u32,
    /// Index of the list described.
    pub list: u32,
    /// Columns that the caller was told of.
    pub column_count: u32,
    /// Room in `rows`; 0 asks for the revision alone, of whatever list.
    pub row_capacity: u32,
    /// The first row wanted.
    pub first: u64,
    /// Room in `text`, bytes.
    pub text_capacity: u32,
    /// Rows written: as many as there is room for.
    pub row_count: u32,
    /// Rows that the list has.
    pub total: u64,
    /// Grows with every change of the description or of any list.
    pub revision: u64,
    /// The rows.
    pub rows: *mut BusbarRecordRow,
    /// Where texts end in `text`: `1 + column_count` a row, row by row. The first is the id
    /// of the equipment, or any alias of it; then comes a cell a column.
    pub ends: *mut u32,
    /// UTF-8.
    pub text: *mut u8,
}

/// Table of `busbar.records/1-draft`.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct BusbarRecords {
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
    /// `[main-thread]` Writes rows. Fails with `BUSBAR_INVALID_ARGUMENT` when there is no
    /// such list, or its columns are more or fewer; with `BUSBAR_BUFFER_TOO_SMALL` when not
    /// one row fits.
    pub read: Option<
        unsafe extern "C" fn(
            plugin: *const BusbarPlugin,
            page: *mut BusbarRecordPage,
            error: *mut BusbarError,
        ) -> BusbarStatus,
    >,
}
