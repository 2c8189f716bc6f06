//! A row of a list.

use busbar_types::DefectSeverity;
use serde::{Deserialize, Serialize};

use crate::{RecordError, is_line};

/// Bytes of an equipment id, or of a cell.
pub const MAX_TEXT_BYTES: usize = 1024;
/// Bytes counted for a text besides its own.
const TEXT_OVERHEAD: usize = 32;

/// A row of a list.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Record {
    /// The equipment, by its id or an alias.
    pub equipment: String,
    /// A text a column.
    pub cells: Vec<String>,
    /// Time of the report or of the work, nanoseconds since 1970-01-01 UTC.
    pub unix_nanos: Option<i64>,
    /// Severity of a defect; none for other records.
    pub severity: Option<DefectSeverity>,
    /// True while something is still to be done.
    pub is_open: bool,
}

impl Record {
    /// Bytes that it counts.
    pub fn bytes(&self) -> usize {
        let texts = std::iter::once(&self.equipment).chain(&self.cells);
        texts.map(|text| text.len() + TEXT_OVERHEAD).sum()
    }

    /// Validates the record for a list with so many columns.
    ///
    /// # Errors
    /// The rule that it breaks.
    pub fn check(&self, columns: usize) -> Result<(), RecordError> {
        if self.cells.len() != columns {
            let count = self.cells.len();
            return Err(RecordError(format!("a row has {count} cells for {columns} columns")));
        }
        if self.equipment.is_empty() || !is_line(&self.equipment, MAX_TEXT_BYTES) {
            let what = "the equipment of a row is empty, too long or not one line";
            return Err(RecordError::new(what));
        }
        if self.cells.iter().any(|cell| cell.len() > MAX_TEXT_BYTES) {
            return Err(RecordError(format!("a cell has more than {MAX_TEXT_BYTES} bytes")));
        }
        Ok(())
    }

    /// Sort key of urgency: open records first, of these the newest, of the same time the
    /// severest. Records without a time come last of their group.
    pub(crate) fn urgency(&self) -> impl Ord + use<> {
        std::cmp::Reverse((self.is_open, self.unix_nanos, self.severity))
    }
}
