//! Statistics of the chart in the scene.

use std::collections::BTreeMap;

use serde::Serialize;

/// A chart that stands in the scene.
#[derive(Clone, Debug, Default, Serialize)]
pub struct ChartStats {
    /// Number of all records.
    pub records: usize,
    /// Records that are known at the instant shown and that brushes mean.
    pub meant: usize,
    /// True while the brushed records are being counted.
    pub is_counting: bool,
    /// Equipment whose last known record they mean.
    pub brushed: Vec<String>,
    /// The state of each piece of equipment by its last known record; null where that is
    /// too old to speak for it.
    pub states: BTreeMap<String, Option<String>>,
    /// The axes shown that are before the camera, from the left to the right.
    pub axes: Vec<ChartAxisStats>,
    /// Equipment id that the explanation is about.
    pub explained: Option<String>,
    /// Verdict on that equipment.
    pub verdict: Option<String>,
    /// Evidence of each method.
    pub evidence: Vec<ChartEvidence>,
    /// Reason why the records may be outdated.
    pub fault: Option<String>,
}

/// An axis as the last frame had it.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ChartAxisStats {
    /// Name of the axis.
    pub name: String,
    /// Screen position of the lower end, points.
    pub foot: [f32; 2],
    /// Screen position of the upper end, points.
    pub head: [f32; 2],
    /// Values at both ends.
    pub ends: [f32; 2],
    /// True for a logarithmic axis.
    pub log: bool,
}

/// Evidence of a method on a piece of equipment.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct ChartEvidence {
    /// Name of the method.
    pub method: String,
    /// Result of the method.
    pub result: String,
    /// True if the result agrees with the verdict; null without a result.
    pub agrees: Option<bool>,
}
