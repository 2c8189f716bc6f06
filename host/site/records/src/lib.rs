//! Business and asset records of equipment: work orders, inspections and defects (IEC 61968-6),
//! and an asset register (IEC 61968-4).
//!
//! A plugin has [lists](ListInfo) of [rows](Record), each of a piece of equipment. A
//! [`List`] holds checked rows and finds those of a piece of equipment.
//!
//! Invariant: no I/O and no clock; what a list holds keeps its limits.

mod description;
mod list;
mod record;

pub use description::{Column, ColumnType, Description, Kind, ListInfo, RowError};
pub use list::{List, MAX_BYTES, MAX_ROWS};
pub use record::{MAX_TEXT_BYTES, Record};

/// Rule that records break, in words.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct RecordError(pub(crate) String);

impl RecordError {
    /// A rule, as a sentence about the plugin.
    pub fn new(what: impl Into<String>) -> Self {
        Self(what.into())
    }
}

/// Reports whether a text is one line of at most `max_bytes` bytes.
fn is_line(text: &str, max_bytes: usize) -> bool {
    text.len() <= max_bytes && !text.chars().any(char::is_control)
}
