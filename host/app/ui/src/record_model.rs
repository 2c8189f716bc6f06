//! View model of records from business and asset management systems.

use busbar_records::Kind;
use busbar_types::DefectSeverity;

/// A list as far as it is about one piece of equipment.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RecordSection {
    /// Title of the list.
    pub title: String,
    /// Kind of the list: business or asset.
    pub kind: Kind,
    /// Name of the source system.
    pub source: String,
    /// Local time at which the source's content was read; empty while unknown.
    pub as_of: String,
    /// Reason why the list may be outdated; none while it is current.
    pub uncertainty: Option<String>,
    /// Number of faulty source rows that are left out, and the fault of the first.
    pub left_out: (u64, String),
    /// Rows of the equipment, in the order in which they are to be looked at.
    pub rows: Vec<RecordRow>,
    /// Number of further rows that are not listed.
    pub more: usize,
    /// Number of open rows among all.
    pub open: usize,
}

/// A row of a list.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RecordRow {
    /// The pole or part of the equipment that it is of; none for all of it.
    pub place: Option<String>,
    /// Severity of a defect; none for other records.
    pub severity: Option<DefectSeverity>,
    /// True while the work is open.
    pub is_open: bool,
    /// Date at which it was reported or done.
    pub when: String,
    /// Names of columns with what stands in them.
    pub cells: Vec<(String, String)>,
}
