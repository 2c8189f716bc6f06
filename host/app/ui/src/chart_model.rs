//! View model of the parallel-coordinates chart in the scene.

use busbar_chart::{Action, BrushOperator, Explanation, Layout, TextKind};
use egui::Pos2;

use crate::LegendRow;

/// A chart, as its panel shows it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ChartModel {
    /// Name of the chart.
    pub name: String,
    /// Reason why its records may be outdated; none while they are current.
    pub fault: Option<String>,
    /// Arrangement of the axes.
    pub layout: Layout,
    /// All axes from left to right.
    pub axes: Vec<ChartAxisRow>,
    /// Logical combination of brushes: all or any.
    pub join: BrushOperator,
    /// Descriptions of the brushes for the panel.
    pub brushes: Vec<String>,
    /// Records known at the instant shown.
    pub known: usize,
    /// Records that brushes mean; none where there is no brush.
    pub meant: Option<usize>,
    /// Pieces of equipment whose last record they mean.
    pub meant_equipment: Vec<String>,
    /// Density display, used when the records are too many for single lines.
    pub density: Option<DensityLegend>,
    /// The states of records.
    pub legend: Vec<LegendRow>,
    /// First and last time, nanoseconds since 1970-01-01 UTC.
    pub span: Option<[i64; 2]>,
    /// The instant shown; `None` for the present.
    pub playhead: Option<i64>,
    /// Displayed instant as text.
    pub shown_at: String,
    /// True while the playback runs.
    pub plays: bool,
    /// True if the camera moves to equipment whose record becomes abnormal.
    pub follows: bool,
    /// True if the spread of each state's records is shown.
    pub shows_clusters: bool,
}

/// Records that are too many to be lines: how many there are is shown instead.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct DensityLegend {
    /// Records counted, and all there are, while they are counted.
    pub counting: Option<[usize; 2]>,
    /// Lines where there are most.
    pub most: usize,
    /// Reason why the records cannot be counted.
    pub fault: Option<String>,
}

/// An axis of a chart.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ChartAxisRow {
    /// Axis name with its unit.
    pub name: String,
    /// True if the axis is hidden.
    pub is_hidden: bool,
    /// True if the axis is flipped: its upper end is at the bottom.
    pub is_flipped: bool,
    /// True for a logarithmic axis.
    pub log: bool,
}

/// Explanation that a chart gives for a piece of equipment.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct EquipmentExplanation {
    /// Name of the chart.
    pub chart: String,
    /// Equipment id: that of the faceplate, or what that is part of.
    pub id: String,
    /// The state of its last record.
    pub state: Option<LegendRow>,
    /// Date of that record, and its age at the instant shown.
    pub taken: String,
    /// True if the record is too old to describe the equipment.
    pub is_outdated: bool,
    /// Verdict, evidence, tables and diagrams of the record.
    pub explanation: Explanation,
}

/// Parts of a chart that are painted over the scene.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ChartOverlay {
    /// Texts with their screen positions, points.
    pub texts: Vec<(Pos2, String, TextKind)>,
    /// The axes shown, from the left to the right; those before the camera.
    pub axes: Vec<ProjectedChartAxis>,
    /// Tooltip lines of the polyline under the pointer.
    pub tooltip: Vec<String>,
}

/// An axis on the screen.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ProjectedChartAxis {
    /// Index among the visible axes.
    pub shown: usize,
    /// Index among all axes.
    pub place: usize,
    /// Screen position of the axis foot, points.
    pub foot: Pos2,
    /// Screen position of the axis head, points.
    pub head: Pos2,
    /// Brushed intervals by position: 0 at its foot, 1 at its head.
    pub brushed: Vec<[f32; 2]>,
}

/// Operator command to a chart.
#[derive(Clone, Debug, PartialEq)]
pub enum ChartCommand {
    /// To be arranged otherwise.
    Apply(Action),
    /// To brush an interval of positions on an axis shown.
    BrushAt {
        /// Index among the visible axes.
        shown: usize,
        /// Both ends of the interval, axis positions.
        positions: [f32; 2],
        /// True if the interval replaces the axis's existing brush.
        alone: bool,
    },
    /// To brush by how much lines rise from an axis shown to the next one.
    BrushRise {
        /// Place of the first among the axes shown.
        shown: usize,
        /// Least and greatest, as a share of their height.
        range: [f32; 2],
    },
    /// Let the camera follow records that become abnormal, or stop it.
    Follow(bool),
    /// Copy the brushed records to the clipboard as CSV.
    Copy,
}
