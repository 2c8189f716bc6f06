//! Description of a plugin's record lists, with its limits.

use serde::{Deserialize, Serialize};

use crate::{RecordError, is_line};

/// Lists of a plugin.
const MAX_LISTS: usize = 16;
/// Columns of a list.
const MAX_COLUMNS: usize = 32;
/// Bytes of a title, of a source, of a column's name and of a unit.
const MAX_NAME_BYTES: usize = 256;
/// Bytes of a reason.
const MAX_REASON_BYTES: usize = 512;
/// Limit of rejected rows that are reported one by one.
const MAX_ROW_FAULTS: usize = 100;

/// The lists of a plugin.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Description {
    /// Lists, in the order in which they are shown.
    pub lists: Vec<ListInfo>,
}

/// Subject of a list.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Kind {
    /// Events and tasks: work orders, inspections, defects.
    #[default]
    Business,
    /// Properties of equipment: maker, year, rating, criticality.
    Asset,
}

/// A list without its rows.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ListInfo {
    /// Title shown to people.
    pub title: String,
    /// Subject of the list.
    pub kind: Kind,
    /// Origin of the rows, such as the name of a file.
    pub source: String,
    /// Columns of the list.
    pub columns: Vec<Column>,
    /// Time at which the source had these rows, nanoseconds since 1970-01-01 UTC; `None` where it
    /// was never read.
    pub as_of_unix_nanos: Option<i64>,
    /// Duration for which rows count as current, seconds; 0 for ever.
    pub valid_seconds: u64,
    /// Reason why the source cannot be read now; the rows are the last ones read.
    pub fault: Option<String>,
    /// Rows of the source that are left out.
    pub left_out: u64,
    /// The first of them, and why.
    pub faults: Vec<RowError>,
}

/// Error of a rejected row.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct RowError {
    /// The line of a file, or the row of a result; the first is 1.
    pub row: u64,
    /// Explanation of the error.
    pub reason: String,
}

/// Column of a list.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Column {
    /// Name shown to people.
    pub name: String,
    /// Type of its cells.
    #[serde(rename = "type")]
    pub column_type: ColumnType,
    /// Unit; empty for none.
    pub unit: String,
}

/// Type of a column's cells; an empty cell fits all.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ColumnType {
    /// Text of any form.
    #[default]
    Text,
    /// A number with `.` before its fraction.
    Number,
    /// A date of ISO 8601, `2026-11-23`; a time may follow.
    Date,
}

impl Description {
    /// Validates the description against the limits.
    ///
    /// # Errors
    /// The rule that it breaks.
    pub fn check(&self) -> Result<(), RecordError> {
        if self.lists.len() > MAX_LISTS {
            let count = self.lists.len();
            return Err(RecordError::new(format!("it has {count} lists of records")));
        }
        self.lists.iter().enumerate().try_for_each(|(index, list)| {
            list.check().map_err(|what| RecordError(format!("list {index} of records: {what}")))
        })
    }
}

impl ListInfo {
    fn check(&self) -> Result<(), &'static str> {
        let name = |text: &str| !text.is_empty() && is_line(text, MAX_NAME_BYTES);
        if !name(&self.title) || !name(&self.source) {
            return Err("its title or source is empty, too long or not one line");
        }
        if self.columns.is_empty() || self.columns.len() > MAX_COLUMNS {
            return Err("it has no column, or more than 32");
        }
        let fits = |column: &Column| name(&column.name) && is_line(&column.unit, MAX_NAME_BYTES);
        if !self.columns.iter().all(fits) {
            return Err("the name or unit of a column is empty, too long or not one line");
        }
        let reason = |text: &str| !text.is_empty() && is_line(text, MAX_REASON_BYTES);
        if self.fault.as_deref().is_some_and(|fault| !reason(fault)) {
            return Err("its fault is empty, too long or not one line");
        }
        if self.faults.len() > MAX_ROW_FAULTS || self.faults.len() as u64 > self.left_out {
            return Err("it tells of more rows left out than there are, or of more than 100");
        }
        if !self.faults.iter().all(|fault| reason(&fault.reason)) {
            return Err("why a row is left out is empty, too long or not one line");
        }
        Ok(())
    }
}
