//! Quantile bands: spread of the records of each state, from axis to axis.

use crate::{AxisView, Records};

/// Shares of the records below a band, and below its upper edge.
const QUANTILES: [f32; 2] = [0.1, 0.9];
/// Records that bands are made of; of more, as many evenly among them.
const MAX_COUNTED: usize = 20_000;
/// Least number of records for a band.
const MIN_RECORDS: usize = 3;

/// Computes the band of each state with enough records: the first and last decile of its
/// positions on each axis.
pub(crate) fn bands(
    records: &Records,
    views: &[AxisView],
    states: usize,
    is_known: impl Fn(usize) -> bool,
) -> Vec<(usize, Vec<Option<[f32; 2]>>)> {
    let mut members = vec![Vec::new(); states];
    let step = records.len().div_ceil(MAX_COUNTED).max(1);
    let taken = records.all().iter().enumerate().step_by(step);
    for (index, record) in taken.filter(|(index, _)| is_known(*index)) {
        members[record.state as usize].push(index);
    }
    let enough = members.into_iter().enumerate().filter(|(_, own)| own.len() >= MIN_RECORDS);
    enough
        .map(|(state, own)| {
            let on = |view: &AxisView| {
                let places =
                    own.iter().filter_map(|&index| view.position(records.row(index)[view.axis]));
                quantiles(places.collect())
            };
            (state, views.iter().map(on).collect())
        })
        .collect()
}

fn quantiles(mut places: Vec<f32>) -> Option<[f32; 2]> {
    if places.len() < MIN_RECORDS {
        return None;
    }
    places.sort_by(f32::total_cmp);
    let last = (places.len() - 1) as f32;
    Some(QUANTILES.map(|share| places[(share * last).round() as usize]))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tenth_lies_outside_on_each_side() {
        let places: Vec<f32> = (0..=100).rev().map(|i| i as f32 / 100.0).collect();
        assert_eq!(quantiles(places), Some([0.1, 0.9]));
        assert_eq!(quantiles(vec![0.3, 0.4]), None);
    }
}
