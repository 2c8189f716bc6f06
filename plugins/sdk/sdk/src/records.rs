//! Capability `busbar.records/1-draft`: lists of rows about equipment.

use busbar_plugin_abi as abi;
use serde::Serialize;

use crate::boundary::{checked_mut, copy_out, write_json};
use crate::{DefectSeverity, Error, Plugin};

/// Lists of a plugin, at most.
pub const MAX_RECORD_LISTS: usize = abi::BUSBAR_MAX_RECORD_LISTS;
/// Columns of a list, at most.
pub const MAX_RECORD_COLUMNS: usize = abi::BUSBAR_MAX_RECORD_COLUMNS;
/// Rows of a list, at most.
pub const MAX_RECORD_ROWS: usize = abi::BUSBAR_MAX_RECORD_ROWS;
/// Bytes of an equipment id, or of a cell, at most.
pub const MAX_RECORD_TEXT: usize = abi::BUSBAR_MAX_RECORD_TEXT;
/// Bytes of all rows of all lists of a plugin, as [`Record::bytes`] counts them, at most.
pub const MAX_RECORD_BYTES: usize = abi::BUSBAR_MAX_RECORD_BYTES;
/// Bytes that a text counts beside its own.
const TEXT_OVERHEAD: usize = 32;

/// Lists of rows about equipment, from business and asset management systems.
pub trait Records: Plugin {
    /// Returns all lists as they are now. The host calls it repeatedly: work that takes long
    /// belongs on a [`crate::Worker`].
    ///
    /// # Errors
    /// What keeps all of them from being known. What is wrong with the source of one list is
    /// said in [`RecordList::fault`].
    fn records(&mut self) -> Result<RecordSet<'_>, Error>;
}

/// All lists of a plugin.
#[derive(Clone, Copy, Debug, Default)]
pub struct RecordSet<'a> {
    /// Revision of the lists, which grows with every change of any of them.
    pub revision: u64,
    /// Lists, at most [`MAX_RECORD_LISTS`], of at most [`MAX_RECORD_BYTES`] in all.
    pub lists: &'a [RecordList],
}

/// Subject of a list.
#[derive(
    Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, serde::Deserialize, schemars::JsonSchema,
)]
#[serde(rename_all = "snake_case")]
pub enum RecordKind {
    /// Past and planned work on equipment: work orders, inspections, defects (IEC 61968-6).
    #[default]
    Business,
    /// Properties of equipment: an asset register with maker, year, rating, criticality (IEC
    /// 61968-4).
    Asset,
}

/// List of rows about equipment.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct RecordList {
    /// Title of the list, such as `Work orders`.
    pub title: String,
    /// Subject of the list.
    pub kind: RecordKind,
    /// Name of the source, such as of a file.
    pub source: String,
    /// Columns of the list, 1 to [`MAX_RECORD_COLUMNS`].
    pub columns: Vec<RecordColumn>,
    /// Instant of the source's state, nanoseconds since 1970-01-01 UTC; `None` before it was read.
    pub as_of_unix_nanos: Option<i64>,
    /// Time for which rows count as current after that instant, seconds; 0 for ever. Beyond, the
    /// host marks them as old.
    pub valid_seconds: u64,
    /// Reason for which the source cannot be read now; rows stay as they last were.
    pub fault: Option<String>,
    /// Number of rows of the source that are left out.
    pub left_out: u64,
    /// Faults of the first rows left out, at most 100.
    pub faults: Vec<RecordRowFault>,
    /// Rows of the list, at most [`MAX_RECORD_ROWS`].
    #[serde(skip)]
    pub rows: Vec<Record>,
}

/// Fault of a row that is left out.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct RecordRowFault {
    /// Line of a file, or row of a result; the first is 1.
    pub row: u64,
    /// Fault of the row, in one line.
    pub reason: String,
}

/// Column of a list.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub struct RecordColumn {
    /// Name of the column.
    pub name: String,
    /// Type of the column's cells.
    #[serde(rename = "type")]
    pub column_type: RecordColumnType,
    /// Unit of the column; empty for none.
    pub unit: String,
}

/// Type of a column's cells; an empty cell fits all.
#[derive(
    Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, serde::Deserialize, schemars::JsonSchema,
)]
#[serde(rename_all = "snake_case")]
pub enum RecordColumnType {
    /// Text without a fixed form.
    #[default]
    Text,
    /// Number with `.` before its fraction.
    Number,
    /// Date of ISO 8601, `2026-11-23`; a time may follow.
    Date,
}

/// Row of a list.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Record {
    /// Id of the equipment, or an alias of it.
    pub equipment: String,
    /// Cells, one for each column, at most [`MAX_RECORD_TEXT`] bytes each.
    pub cells: Vec<String>,
    /// Time at which the row was reported or done, nanoseconds since 1970-01-01 UTC.
    pub unix_nanos: Option<i64>,
    /// Severity, where the row is a defect.
    pub severity: Option<DefectSeverity>,
    /// Reports whether something is still to be done.
    pub is_open: bool,
}

impl Record {
    /// Returns the bytes that the row counts.
    pub fn bytes(&self) -> usize {
        self.texts().map(|text| text.len() + TEXT_OVERHEAD).sum()
    }

    fn texts(&self) -> impl Iterator<Item = &String> {
        std::iter::once(&self.equipment).chain(&self.cells)
    }
}

#[derive(Serialize)]
struct Description<'a> {
    lists: &'a [RecordList],
}

/// # Safety
/// Pointers are null or valid as the ABI's `describe` demands.
pub(crate) unsafe fn describe<P: Records>(
    plugin: &mut P,
    output: *mut abi::BusbarTextOutput,
) -> Result<(), Error> {
    let lists = plugin.records()?.lists;
    // SAFETY: the caller vouches for the pointer.
    unsafe { write_json(&Description { lists }, output) }
}

/// # Safety
/// `page` is null or valid as the ABI's `read` demands.
pub(crate) unsafe fn read<P: Records>(
    plugin: &mut P,
    page: *mut abi::BusbarRecordPage,
) -> Result<(), Error> {
    // SAFETY: the caller vouches for the pointer.
    let page = unsafe { checked_mut(page, "read: the page")? };
    let set = plugin.records()?;
    page.revision = set.revision;
    (page.row_count, page.total) = (0, 0);
    if page.row_capacity == 0 {
        return Ok(());
    }
    let index = page.list;
    let list = set.lists.get(index as usize);
    let list = list.ok_or_else(|| Error::argument(format!("read: there is no list {index}")))?;
    let (columns, told) = (list.columns.len(), page.column_count);
    if told as usize != columns {
        let text = format!("read: rows of {told} columns asked for, where there are {columns}");
        return Err(Error::argument(text));
    }
    page.total = list.rows.len() as u64;
    let first = usize::try_from(page.first).unwrap_or(usize::MAX).min(list.rows.len());
    let wanted = list.rows[first..].iter().take(page.row_capacity as usize);
    let written = WrittenRows::fit(wanted, columns, page.text_capacity as usize)?;
    page.row_count = written.rows.len() as u32;
    // SAFETY: the host gives room for `row_capacity` rows, as many ends of their texts, and
    // `text_capacity` bytes, which `WrittenRows` keeps to.
    unsafe {
        copy_out(&written.rows, page.rows)?;
        copy_out(&written.ends, page.ends)?;
        copy_out(written.text.as_bytes(), page.text)
    }
}

/// Rows as the buffers of a page hold them.
#[derive(Default)]
struct WrittenRows {
    rows: Vec<abi::BusbarRecordRow>,
    ends: Vec<u32>,
    text: String,
}

impl WrittenRows {
    /// Writes as many of the rows as fit.
    fn fit<'r>(
        rows: impl Iterator<Item = &'r Record>,
        columns: usize,
        max_bytes: usize,
    ) -> Result<Self, Error> {
        let mut written = Self::default();
        for row in rows {
            if row.cells.len() != columns {
                let cells = row.cells.len();
                let text = format!("read: a row has {cells} cells for {columns} columns");
                return Err(Error::internal(text));
            }
            let bytes: usize = row.texts().map(String::len).sum();
            if written.text.len() + bytes > max_bytes {
                if written.rows.is_empty() {
                    return Err(Error::buffer(format!("a row takes {bytes} bytes")));
                }
                break;
            }
            for text in row.texts() {
                written.text.push_str(text);
                written.ends.push(written.text.len() as u32);
            }
            written.rows.push(abi::BusbarRecordRow {
                time_unix_nanos: row.unix_nanos.unwrap_or(abi::BUSBAR_RECORD_NO_TIME),
                severity: row
                    .severity
                    .map_or(abi::BUSBAR_DEFECT_SEVERITY_NONE, |severity| severity.code().into()),
                flags: if row.is_open { abi::BUSBAR_RECORD_OPEN } else { 0 },
            });
        }
        Ok(written)
    }
}
