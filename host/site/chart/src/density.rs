//! Density between neighbouring axes: how many lines go from where to where.
//!
//! The GPU counts the same in `shaders/density`; here is its twin. Values are put into bins
//! by comparing them with the bins' edges, which is exact anywhere.

use crate::brush::BrushOperator;
use crate::{AxisView, Brush, Brushes, Records};

/// Bins of an axis.
pub const BINS: usize = 128;
/// The bin of records without a value, after those of values.
pub const MISSING_BIN: usize = BINS;

/// The lower edges of the bins 1, 2 and so on of an axis that is not flipped, ascending.
pub fn bin_edges(view: &AxisView) -> [f32; BINS - 1] {
    let upright = AxisView { is_flipped: false, ..*view };
    std::array::from_fn(|edge| upright.value_at((edge + 1) as f32 / BINS as f32))
}

/// The bin of a value.
pub fn bin_index(value: f32, edges: &[f32; BINS - 1]) -> usize {
    match value.is_nan() {
        true => MISSING_BIN,
        false => edges.partition_point(|edge| *edge <= value),
    }
}

/// Counts for each pair of axes the records from each bin of the first to each of the second:
/// `(BINS + 1)²` counts a pair. `is_brushed` filters the records.
pub fn bin_pairs(
    records: &Records,
    views: &[AxisView],
    pairs: &[[usize; 2]],
    is_brushed: impl Fn(usize) -> bool,
) -> Vec<u32> {
    const SIDE: usize = BINS + 1;
    let edges: Vec<_> = views.iter().map(bin_edges).collect();
    let mut counts = vec![0; pairs.len() * SIDE * SIDE];
    let mut bins = vec![0; views.len()];
    for record in (0..records.len()).filter(|&record| is_brushed(record)) {
        let row = records.row(record);
        for (bin, (view, edges)) in bins.iter_mut().zip(views.iter().zip(&edges)) {
            *bin = bin_index(row[view.axis], edges);
        }
        for (pair, &[from, to]) in pairs.iter().enumerate() {
            counts[(pair * SIDE + bins[from]) * SIDE + bins[to]] += 1;
        }
    }
    counts
}

/// Request to count records in bins, as an operator has arranged the chart.
#[derive(Clone, Debug, PartialEq)]
pub struct DensityRequest {
    /// Axes that are shown, from the left to the right.
    pub views: Vec<AxisView>,
    /// Pairs of places between which lines are drawn.
    pub pairs: Vec<[usize; 2]>,
    /// Brushes of the chart.
    pub brushes: Brushes,
    /// The instant that is shown, nanoseconds since 1970-01-01 UTC; `None` for the present.
    pub playhead: Option<i64>,
    /// All axes, on which brushes by rise are evaluated.
    pub(crate) order: Vec<AxisView>,
}

impl DensityRequest {
    /// Reports whether another request has the same axes and pairs.
    pub fn has_same_axes(&self, other: &Self) -> bool {
        self.views == other.views && self.pairs == other.pairs
    }

    /// Reports whether another request differs at most in the instant.
    pub fn differs_only_in_time(&self, other: &Self) -> bool {
        self.has_same_axes(other) && self.brushes == other.brushes && self.order == other.order
    }

    /// Reports whether a record exists at the instant of the request.
    pub fn is_known(&self, records: &Records, record: usize) -> bool {
        self.playhead.is_none_or(|playhead| records.all()[record].unix_nanos <= playhead)
    }

    /// Reports whether there are brushes by rise, which bins cannot decide.
    pub fn has_rises(&self) -> bool {
        self.rises().next().is_some()
    }

    /// Reports whether a record meets the brushes by rise.
    pub fn meets_rises(&self, records: &Records, record: usize) -> bool {
        let mut met = self.rises().map(|brush| brush.is_met(records.row(record), &self.order));
        match self.brushes.operator {
            BrushOperator::And => met.all(|met| met),
            BrushOperator::Or => met.any(|met| met),
        }
    }

    fn rises(&self) -> impl Iterator<Item = &Brush> {
        self.brushes.list.iter().filter(|brush| matches!(brush, Brush::Rise { .. }))
    }
}
