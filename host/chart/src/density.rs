//! Density between neighbouring axes: how many lines go from where to where.
//!
//! The GPU counts the same in `shaders/density`; here is its twin. Values are put into bins
//! by comparing them with the bins' edges, which is exact anywhere.

use crate::{AxisView, Records};

/// Bins of an axis.
pub const BINS: usize = 128;
/// The bin of records without a value, after those of values.
pub const MISSING_BIN: usize = BINS;

/// The lower edges of the bins 1, 2 and so on of an axis that is not flipped, ascending.
pub fn edges_of(view: &AxisView) -> [f32; BINS - 1] {
    let upright = AxisView { is_flipped: false, ..*view };
    std::array::from_fn(|edge| upright.value_at((edge + 1) as f32 / BINS as f32))
}

/// The bin of a value.
pub fn bin_of(value: f32, edges: &[f32; BINS - 1]) -> usize {
    match value.is_nan() {
        true => MISSING_BIN,
        false => edges.partition_point(|edge| *edge <= value),
    }
}

/// For each pair of axes how many records go from each bin of the first to each of the
/// second: `BINS + 1` times `BINS + 1` counts a pair. `is_meant` leaves records out.
pub fn bin_pairs(
    records: &Records,
    views: &[AxisView],
    pairs: &[[usize; 2]],
    is_meant: impl Fn(usize) -> bool,
) -> Vec<u32> {
    const SIDE: usize = BINS + 1;
    let edges: Vec<_> = views.iter().map(edges_of).collect();
    let mut counts = vec![0; pairs.len() * SIDE * SIDE];
    let mut bins = vec![0; views.len()];
    for record in (0..records.len()).filter(|&record| is_meant(record)) {
        let row = records.row(record);
        for (bin, (view, edges)) in bins.iter_mut().zip(views.iter().zip(&edges)) {
            *bin = bin_of(row[view.axis], edges);
        }
        for (pair, &[from, to]) in pairs.iter().enumerate() {
            counts[(pair * SIDE + bins[from]) * SIDE + bins[to]] += 1;
        }
    }
    counts
}
