//! Explanation of a record: verdict, tables, evidence and diagrams.

use busbar_types::Severity;
use serde::{Deserialize, Serialize};

use crate::ChartError;

/// Tables, pieces of evidence, diagrams.
const MAX_PARTS: usize = 32;
/// Columns of a table, zones of a diagram, marks in it.
const MAX_COLUMNS: usize = 16;
/// Rows of a table.
const MAX_ROWS: usize = 64;
/// Corners of a zone, and places of a trail.
const MAX_POINTS: usize = 512;
/// Bytes of a text.
const MAX_TEXT_BYTES: usize = 1024;

/// Explanation of a record.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Explanation {
    /// The record's time, nanoseconds since 1970-01-01 UTC.
    pub unix_nanos: i64,
    /// Index of the legend's entry.
    pub state: u32,
    /// Verdict in a sentence.
    pub verdict: String,
    /// Tables of numbers against limits.
    pub tables: Vec<Table>,
    /// Results of each method.
    pub evidence: Vec<Evidence>,
    /// Places in planes with zones.
    pub diagrams: Vec<Diagram>,
}

/// Table of numbers against limits.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Table {
    /// Title of the table.
    pub title: String,
    /// Heads of the columns.
    pub columns: Vec<String>,
    /// Rows of the table.
    pub rows: Vec<TableRow>,
}

/// A row of a table.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct TableRow {
    /// Cells of the row, one for each column.
    pub cells: Vec<String>,
    /// Severity of the row.
    pub severity: Severity,
}

/// Result of a method.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Evidence {
    /// Name of the method.
    pub method: String,
    /// Result of the method as text.
    pub result: String,
    /// The rule that gave it.
    pub reason: String,
    /// True where the result agrees with the verdict; `None` where it decides nothing.
    pub agrees: Option<bool>,
}

/// A plane with zones and a place in it.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Diagram {
    /// Title of the diagram.
    pub title: String,
    /// Zones; x to the right, y up, in any unit.
    pub zones: Vec<DiagramZone>,
    /// Labels with their positions.
    pub marks: Vec<(String, [f32; 2])>,
    /// Positions of earlier records, the oldest first, with the explained one at the end.
    pub trail: Vec<[f32; 2]>,
}

/// A zone of a plane.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct DiagramZone {
    /// Short name of the zone.
    pub name: String,
    /// Corners of its outline.
    pub outline: Vec<[f32; 2]>,
    /// True where the record belongs to the zone.
    pub is_hit: bool,
}

impl Explanation {
    /// Validates the explanation for a legend of so many states.
    ///
    /// # Errors
    /// The rule that it breaks.
    pub fn check(&self, states: usize) -> Result<(), ChartError> {
        let holds = [
            (self.state as usize) < states,
            [self.tables.len(), self.evidence.len(), self.diagrams.len()]
                .iter()
                .all(|count| *count <= MAX_PARTS),
            self.tables.iter().all(Table::fits),
            self.diagrams.iter().all(Diagram::fits),
            self.texts().all(|text| text.len() <= MAX_TEXT_BYTES),
        ];
        let rules = [
            "an explanation names a state that the legend has not",
            "an explanation has more than 32 parts of a kind",
            "a table has more than 16 columns or 64 rows, or a row of another width",
            "a diagram has too many zones or places, or one that is not finite",
            "a text of an explanation is longer than 1024 bytes",
        ];
        match holds.iter().position(|holds| !holds) {
            None => Ok(()),
            Some(broken) => Err(ChartError::new(rules[broken])),
        }
    }

    fn texts(&self) -> impl Iterator<Item = &String> {
        let tables = self.tables.iter().flat_map(|table| {
            let cells = table.rows.iter().flat_map(|row| &row.cells);
            [&table.title].into_iter().chain(&table.columns).chain(cells)
        });
        let evidence = self.evidence.iter().flat_map(|e| [&e.method, &e.result, &e.reason]);
        let diagrams = self.diagrams.iter().flat_map(|diagram| {
            let names = diagram.zones.iter().map(|zone| &zone.name);
            let marks = diagram.marks.iter().map(|(name, _)| name);
            [&diagram.title].into_iter().chain(names).chain(marks)
        });
        [&self.verdict].into_iter().chain(tables).chain(evidence).chain(diagrams)
    }
}

impl Table {
    fn fits(&self) -> bool {
        let width = self.columns.len();
        let is_wide = |row: &TableRow| row.cells.len() == width;
        width <= MAX_COLUMNS && self.rows.len() <= MAX_ROWS && self.rows.iter().all(is_wide)
    }
}

impl Diagram {
    fn fits(&self) -> bool {
        let is_place = |[x, y]: &[f32; 2]| x.is_finite() && y.is_finite();
        let is_line =
            |places: &Vec<[f32; 2]>| places.len() <= MAX_POINTS && places.iter().all(is_place);
        self.zones.len() <= MAX_COLUMNS
            && self.marks.len() <= MAX_COLUMNS
            && self.zones.iter().all(|zone| is_line(&zone.outline))
            && self.marks.iter().all(|(_, place)| is_place(place))
            && is_line(&self.trail)
    }
}
