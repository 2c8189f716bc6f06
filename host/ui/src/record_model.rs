//! What business and management systems have of a piece of equipment.

use busbar_records::{Kind, Severity};

/// A list as far as it is about one piece of equipment.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RecordSection {
    /// What it is called.
    pub title: String,
    /// What it is about.
    pub kind: Kind,
    /// Where it comes from.
    pub source: String,
    /// When it was so there, by the local clock; empty where that is not known.
    pub as_of: String,
    /// Why it may not be as the source has it now, if it may not.
    pub doubt: Option<String>,
    /// Rows of the source that are left out since something is wrong with them, and the first
    /// of them in words.
    pub left_out: (u64, String),
    /// Rows of the equipment, in the order in which they are to be looked at.
    pub rows: Vec<RecordRow>,
    /// Rows beyond those.
    pub more: usize,
    /// How many of all are open.
    pub open: usize,
}

/// A row of a list.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RecordRow {
    /// The pole or part of the equipment that it is of; none for all of it.
    pub place: Option<String>,
    /// How bad it is, where it is a defect.
    pub severity: Option<Severity>,
    /// Whether something is to be done still.
    pub is_open: bool,
    /// When it was reported or done.
    pub when: String,
    /// Names of columns with what stands in them.
    pub cells: Vec<(String, String)>,
}
