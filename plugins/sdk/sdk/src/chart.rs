//! Capability `busbar.chart/1-draft`: records on axes, with explanations.

use busbar_plugin_abi as abi;
use serde::Serialize;

use crate::boundary::{checked_mut, copy_out, text, write_json};
use crate::{Error, Pattern, Plugin, Severity};

/// Chart of records on axes, with explanations for pieces of equipment.
pub trait Chart: Plugin {
    /// Describes axes, legend and equipment. The host asks again after each new revision.
    ///
    /// # Errors
    /// What keeps it from being known, in words.
    fn describe_chart(&mut self) -> Result<ChartDescription, Error>;

    /// Returns the records and their revision.
    ///
    /// # Errors
    /// What keeps them from being known, in words.
    fn chart_records(&mut self) -> Result<ChartRecords<'_>, Error>;

    /// Explains the last record of a piece of equipment that is not after an instant, nanoseconds
    /// since 1970-01-01 UTC.
    ///
    /// # Errors
    /// That there is none, in words.
    fn explain(&mut self, equipment: &str, unix_nanos: i64) -> Result<Explanation, Error>;
}

/// All records of a chart.
#[derive(Clone, Copy, Debug, Default)]
pub struct ChartRecords<'a> {
    /// Revision of the chart, which grows with every change of description or records.
    pub revision: u64,
    /// Records, those of each piece of equipment in the order of time.
    pub records: &'a [ChartRecord],
    /// Values of the records, record by record, one for each axis; NaN where there is none.
    pub values: &'a [f32],
}

/// Time, equipment and state of a record.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ChartRecord {
    /// Time at which the record was taken, nanoseconds since 1970-01-01 UTC.
    pub unix_nanos: i64,
    /// Index of the equipment described.
    pub equipment: u32,
    /// Index of the legend's entry.
    pub state: u32,
}

/// Description of a chart: axes, legend, equipment.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct ChartDescription {
    /// Name of the chart.
    pub name: String,
    /// Axes of the chart; 2 to 32.
    pub axes: Vec<ChartAxis>,
    /// States of records, the least urgent first; at most 64.
    pub legend: Vec<ChartState>,
    /// Ids of the equipment that records are of; at most 100,000.
    pub equipment: Vec<String>,
    /// Validity of a record for its equipment, seconds; beyond, the host shows the state as
    /// unknown.
    pub valid_seconds: u64,
}

/// Axis of a chart.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct ChartAxis {
    /// Name of the axis.
    pub name: String,
    /// Unit of the axis; empty for none.
    pub unit: String,
    /// Reports whether the axis is logarithmic.
    pub log: bool,
    /// Lower end of the axis; greater than 0 on a logarithmic one.
    pub low: f32,
    /// Upper end of the axis.
    pub high: f32,
    /// Detection limit, in the axis's unit; `None` where there is none.
    pub detection_limit: Option<f32>,
    /// Limit bands along the axis.
    pub bands: Vec<ChartBand>,
}

/// Band between two limits of an axis.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct ChartBand {
    /// Label of the band, with the source of its limits.
    pub name: String,
    /// Lower limit; `None` for the lower end of the axis.
    pub from: Option<f32>,
    /// Upper limit; `None` for the upper end of the axis.
    pub to: Option<f32>,
    /// Reports whether values in the band are outside the normal.
    pub is_abnormal: bool,
}

/// State of records in the legend.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ChartState {
    /// Display name of the state; at most 64 bytes.
    pub name: String,
    /// Colour of the state, sRGB.
    pub color: [u8; 3],
    /// Pattern that distinguishes the state where colours do not.
    pub pattern: Pattern,
    /// Reports whether the state is outside the normal.
    pub is_abnormal: bool,
}

/// Explanation of a record.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Explanation {
    /// Time of the record, nanoseconds since 1970-01-01 UTC.
    pub unix_nanos: i64,
    /// Index of the legend's entry.
    pub state: u32,
    /// Verdict in a sentence or two.
    pub verdict: String,
    /// Tables of values against limits.
    pub tables: Vec<ExplainedTable>,
    /// Results of the methods applied.
    pub evidence: Vec<Evidence>,
    /// Diagrams with zones, such as Duval triangles.
    pub diagrams: Vec<Diagram>,
}

/// Table of values against limits.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct ExplainedTable {
    /// Title of the table.
    pub title: String,
    /// Column headings; at most 16.
    pub columns: Vec<String>,
    /// Rows of the table; at most 64.
    pub rows: Vec<ExplainedRow>,
}

/// Row of a table.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ExplainedRow {
    /// Cells of the row, as many as there are columns.
    pub cells: Vec<String>,
    /// Severity of the row.
    pub severity: Severity,
}

/// Result of one method.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Evidence {
    /// Name of the method, with its standard.
    pub method: String,
    /// Result of the method.
    pub result: String,
    /// Rule that gave the result.
    pub reason: String,
    /// Reports whether the result agrees with the verdict; `None` where the method says nothing.
    pub agrees: Option<bool>,
}

/// Plane with zones, and the positions of records in it.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Diagram {
    /// Title of the diagram, with its source.
    pub title: String,
    /// Zones of the plane; x to the right, y up, in any unit.
    pub zones: Vec<DiagramZone>,
    /// Labels at positions, such as of corners.
    pub marks: Vec<(String, [f32; 2])>,
    /// Positions of earlier records, the oldest first, and of this one at the end.
    pub trail: Vec<[f32; 2]>,
}

/// Zone of a plane.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct DiagramZone {
    /// Short name of the zone.
    pub name: String,
    /// Corners of the zone's outline.
    pub outline: Vec<[f32; 2]>,
    /// Reports whether the record lies in the zone.
    pub is_hit: bool,
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
    let page = unsafe { checked_mut(page, "read: the page")? };
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
