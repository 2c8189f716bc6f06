//! Faults of a point list: which row and column, why, and what to do.

use std::fmt;

/// Limit of reported faults of a list; a last one counts the rest.
pub const MAX_FAULTS: usize = 1_000;

/// One fault of a point list.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ListFault {
    /// Line in the text, from 1.
    pub line: u64,
    /// Name of the column; empty for the row as a whole.
    pub column: String,
    /// Cause of the fault.
    pub cause: String,
    /// Remedy for the user.
    pub remedy: String,
}

impl ListFault {
    pub(crate) fn new(
        line: u64,
        column: &str,
        cause: impl Into<String>,
        remedy: impl Into<String>,
    ) -> Self {
        Self { line, column: column.to_owned(), cause: cause.into(), remedy: remedy.into() }
    }

    /// `file:line: error: column: cause` and the remedy.
    pub fn render(&self, file: &str) -> String {
        format!("{file}:{self}")
    }
}

impl fmt::Display for ListFault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: error: ", self.line)?;
        if !self.column.is_empty() {
            write!(f, "column '{}': ", self.column)?;
        }
        write!(f, "{}\n  remedy: {}", self.cause, self.remedy)
    }
}

impl std::error::Error for ListFault {}
