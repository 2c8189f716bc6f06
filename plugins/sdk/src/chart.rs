//! Capability `busbar.chart/1-draft`.

use busbar_plugin_abi as abi;
use serde::Serialize;

use crate::border::{copy_out, given_mut, text, write_json};
use crate::{Error, Pattern, Plugin, Severity};

/// Records on axes, and what they mean for a piece of equipment.
pub trait Chart: Plugin {
    /// Axes, legend and equipment; asked for again after each new revision.
    ///
    /// # Errors
    /// What keeps it from being known, in words.
    fn describe_chart(&mut self) -> Result<ChartDescription, Error>;

    /// The records, and the revision that they are of.
    ///
    /// # Errors
    /// What keeps them from being known, in words.
    fn chart_records(&mut self) -> Result<ChartRecords<'_>, Error>;

    /// What the last record of a piece of equipment that is not after an instant
    /// (nanoseconds since 1970-01-01 UTC) means.
    ///
    /// # Errors
    /// That there is none, in words.
    fn explain(&mut self, equipment: &str, unix_nanos: i64) -> Result<Explanation, Error>;
}

/// All records of a chart.
#[derive(Clone, Copy, Debug, Default)]
pub struct ChartRecords<'a> {
    /// Grows with every change of description or records.
    pub revision: u64,
    /// Those of each piece of equipment in the order of time.
    pub records: &'a [ChartRecord],
    /// A value an axis for each record, record by record; NaN where there is none.
    pub values: &'a [f32],
}

/// What a record is besides its values.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ChartRecord {
    /// When it was taken, nanoseconds since 1970-01-01 UTC.
    pub unix_nanos: i64,
    /// Index of the equipment described.
    pub equipment: u32,
    /// Index of the legend's entry.
    pub state: u32,
}

/// What a chart shows.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct ChartDescription {
    /// What it is called.
    pub name: String,
    /// Its axes; 2 to 32.
    pub axes: Vec<ChartAxis>,
    /// The states that records are in, the least urgent first; at most 64.
    pub legend: Vec<ChartState>,
    /// Ids of the equipment that records are of; at most 100,000.
    pub equipment: Vec<String>,
    /// How long a record speaks for its equipment, seconds; beyond, the host shows the
    /// state as not known.
    pub valid_seconds: u64,
}

/// An axis.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct ChartAxis {
    /// What it is called.
    pub name: String,
    /// Unit; empty for none.
    pub unit: String,
    /// Whether it is logarithmic.
    pub log: bool,
    /// Its lower end; greater than 0 on a logarithmic axis.
    pub low: f32,
    /// Its upper end.
    pub high: f32,
    /// Below this nothing can be measured; `None` where that does not matter.
    pub detection_limit: Option<f32>,
    /// Limits.
    pub bands: Vec<ChartBand>,
}

/// What lies between two limits of an axis.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct ChartBand {
    /// What is said of it, with its source.
    pub name: String,
    /// Where it begins; `None` for the lower end of the axis.
    pub from: Option<f32>,
    /// Where it ends; `None` for the upper one.
    pub to: Option<f32>,
    /// Whether what lies in it is outside the normal.
    pub is_abnormal: bool,
}

/// A state of records.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ChartState {
    /// What it says, for people; at most 64 bytes.
    pub name: String,
    /// sRGB.
    pub color: [u8; 3],
    /// Tells states apart where colours do not.
    #[serde(serialize_with = "pattern_word")]
    pub pattern: Pattern,
    /// Whether it is outside the normal.
    pub is_abnormal: bool,
}

/// What a record means.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Explanation {
    /// The record's time, nanoseconds since 1970-01-01 UTC.
    pub unix_nanos: i64,
    /// Index of the legend's entry.
    pub state: u32,
    /// What is the matter, in a sentence or two.
    pub verdict: String,
    /// Numbers against limits.
    pub tables: Vec<ExplainedTable>,
    /// What each method says.
    pub evidence: Vec<Evidence>,
    /// Places in planes with zones.
    pub diagrams: Vec<Diagram>,
}

/// Numbers against limits.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct ExplainedTable {
    /// What it is of.
    pub title: String,
    /// Heads of the columns; at most 16.
    pub columns: Vec<String>,
    /// Rows; at most 64.
    pub rows: Vec<ExplainedRow>,
}

/// A row of a table.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ExplainedRow {
    /// As many as there are columns.
    pub cells: Vec<String>,
    /// How much it needs somebody.
    #[serde(serialize_with = "severity_word")]
    pub severity: Severity,
}

/// What a method says.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Evidence {
    /// The method, with its standard.
    pub method: String,
    /// Its result.
    pub result: String,
    /// The rule that gave it.
    pub reason: String,
    /// Whether that agrees with the verdict; `None` where it says nothing.
    pub agrees: Option<bool>,
}

/// A plane with zones and a place in it.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Diagram {
    /// What it is called, with its source.
    pub title: String,
    /// Zones; x to the right, y up, in any unit.
    pub zones: Vec<DiagramZone>,
    /// Names at places, such as of corners.
    pub marks: Vec<(String, [f32; 2])>,
    /// Where the records before this one were, the oldest first, and this one at the end.
    pub trail: Vec<[f32; 2]>,
}

/// A zone of a plane.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct DiagramZone {
    /// Its short name.
    pub name: String,
    /// Its corners.
    pub outline: Vec<[f32; 2]>,
    /// Whether the record is in it.
    pub is_hit: bool,
}

fn pattern_word<S: serde::Serializer>(pattern: &Pattern, to: S) -> Result<S::Ok, S::Error> {
    to.serialize_str(match pattern {
        Pattern::Solid => "solid",
        Pattern::Striped => "striped",
        Pattern::Crossed => "crossed",
        Pattern::Dotted => "dotted",
    })
}

fn severity_word<S: serde::Serializer>(severity: &Severity, to: S) -> Result<S::Ok, S::Error> {
    to.serialize_str(match severity {
        Severity::Normal => "normal",
        Severity::Warning => "warning",
        Severity::Alarm => "alarm",
    })
}

/// # Safety
/// Pointers are null or valid as the ABI's `describe` demands.
pub(crate) unsafe fn describe<P: Chart>(
    plugin: &mut P,
    output: *mut abi::BusbarTextOutput,
) -> Result<(), Error> {
    // SAFETY: the caller vouches for the pointer.
    unsafe { write_json(&plugin.describe_chart()?, output) }
}

/// # Safety
/// Pointers are null or valid as the ABI's `explain` demands.
pub(crate) unsafe fn explain<P: Chart>(
    plugin: &mut P,
    equipment: abi::BusbarStr,
    unix_nanos: i64,
    output: *mut abi::BusbarTextOutput,
) -> Result<(), Error> {
    // SAFETY: the host's text is valid for the call.
    let equipment = unsafe { text(equipment)? };
    // SAFETY: the caller vouches for the pointer.
    unsafe { write_json(&plugin.explain(equipment, unix_nanos)?, output) }
}

/// # Safety
/// `page` is null or valid as the ABI's `read` demands.
pub(crate) unsafe fn read<P: Chart>(
    plugin: &mut P,
    page: *mut abi::BusbarChartPage,
) -> Result<(), Error> {
    // SAFETY: the caller vouches for the pointer.
    let page = unsafe { given_mut(page, "read: the page")? };
    let axes = page.axis_count as usize;
    let ChartRecords { revision, records, values } = plugin.chart_records()?;
    if page.capacity > 0 && values.len() != records.len() * axes {
        let (has, wants) = (values.len(), records.len());
        return Err(Error::argument(format!(
            "read: {wants} records of {axes} axes asked for, where there are {has} values"
        )));
    }
    let first = usize::try_from(page.first).unwrap_or(usize::MAX).min(records.len());
    let end = first.saturating_add(page.capacity as usize).min(records.len());
    (page.count, page.total, page.revision) =
        ((end - first) as u32, records.len() as u64, revision);
    let raw: Vec<_> = records[first..end]
        .iter()
        .map(|record| abi::BusbarChartRecord {
            time_unix_nanos: record.unix_nanos,
            equipment: record.equipment,
            state: record.state,
        })
        .collect();
    // SAFETY: the host gives room for `capacity` records and their values.
    unsafe {
        copy_out(&raw, page.records)?;
        copy_out(&values[first * axes..end * axes], page.values)
    }
}
