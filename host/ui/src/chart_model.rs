//! What is shown of a chart that stands in the scene.

use busbar_chart::{Action, BrushOperator, Explanation, Layout, TextKind};
use egui::Pos2;

use crate::LegendRow;

/// A chart, as its panel shows it.
#[derive(Clone, Debug, Default)]
pub struct ChartModel {
    /// What it is called.
    pub name: String,
    /// Why its records may be out of date, if they may.
    pub fault: Option<String>,
    /// How its axes stand.
    pub layout: Layout,
    /// All axes, from the left to the right.
    pub axes: Vec<ChartAxisRow>,
    /// How brushes come together.
    pub join: BrushOperator,
    /// Brushes in words.
    pub brushes: Vec<String>,
    /// Records known at the instant shown.
    pub known: usize,
    /// Records that brushes mean; none where there is no brush.
    pub meant: Option<usize>,
    /// Pieces of equipment whose last record they mean.
    pub meant_equipment: Vec<String>,
    /// Of records that are too many to be lines.
    pub density: Option<DensityLegend>,
    /// The states of records.
    pub legend: Vec<LegendRow>,
    /// First and last time, nanoseconds since 1970-01-01 UTC.
    pub span: Option<[i64; 2]>,
    /// The instant shown; `None` for the present.
    pub playhead: Option<i64>,
    /// The instant shown, in words.
    pub shown_at: String,
    /// Whether time goes by in it.
    pub plays: bool,
    /// Whether the camera goes where a record becomes abnormal.
    pub follows: bool,
    /// Whether it shows how the records of each state spread.
    pub shows_clusters: bool,
}

/// Records that are too many to be lines: how many there are is shown instead.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct DensityLegend {
    /// Records counted, and all there are, while they are counted.
    pub counting: Option<[usize; 2]>,
    /// Lines where there are most.
    pub most: usize,
    /// Why they cannot be counted.
    pub fault: Option<String>,
}

/// An axis of a chart.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ChartAxisRow {
    /// Name and unit.
    pub name: String,
    /// Whether it is left out.
    pub is_hidden: bool,
    /// Whether its upper end is below.
    pub is_flipped: bool,
    /// Whether it is logarithmic.
    pub log: bool,
}

/// What a chart says of a piece of equipment.
#[derive(Clone, Debug, Default)]
pub struct EquipmentExplanation {
    /// What the chart is called.
    pub chart: String,
    /// Equipment id: that of the faceplate, or what that is part of.
    pub id: String,
    /// The state of its last record.
    pub state: Option<LegendRow>,
    /// When that was taken, and how long before the instant shown.
    pub taken: String,
    /// Whether it is too old to speak for the equipment.
    pub is_outdated: bool,
    /// What it means.
    pub explanation: Explanation,
}

/// What of a chart lies over the scene.
#[derive(Clone, Debug, Default)]
pub struct ChartOverlay {
    /// Words with their places on the screen, points.
    pub texts: Vec<(Pos2, String, TextKind)>,
    /// The axes shown, from the left to the right; those before the camera.
    pub axes: Vec<ProjectedChartAxis>,
    /// What is said of the line under the pointer.
    pub tooltip: Vec<String>,
}

/// An axis on the screen.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ProjectedChartAxis {
    /// Its place among the axes shown.
    pub shown: usize,
    /// Its place among all axes.
    pub place: usize,
    /// Its foot, points.
    pub foot: Pos2,
    /// Its head.
    pub head: Pos2,
    /// Brushed intervals by position: 0 at its foot, 1 at its head.
    pub brushed: Vec<[f32; 2]>,
}

/// What an operator asks of a chart.
#[derive(Clone, Debug, PartialEq)]
pub enum ChartCommand {
    /// To be arranged otherwise.
    Apply(Action),
    /// To brush an interval of positions on an axis shown.
    BrushAt {
        /// Its place among the axes shown.
        shown: usize,
        /// From where to where.
        positions: [f32; 2],
        /// Whether it replaces what is brushed on the axis.
        alone: bool,
    },
    /// To brush by how much lines rise from an axis shown to the next one.
    BrushRise {
        /// Place of the first among the axes shown.
        shown: usize,
        /// Least and greatest, as a share of their height.
        range: [f32; 2],
    },
    /// Whether the camera goes where a record becomes abnormal.
    Follow(bool),
    /// To copy what is brushed as CSV.
    Copy,
}
