//! Counts of the GPU against those of the CPU: equal to the last one.

#![allow(clippy::unwrap_used, reason = "helpers of tests")]

mod common;

use busbar_renderer::{BrushedAxis, DensityInput};
use common::*;
use fastrand::Rng;

const BINS: usize = 128;
const SIDE: usize = BINS + 1;
const AXES: usize = 5;

/// Values over eight decades, some missing, some negative, some on the edges themselves.
fn values(count: usize, seed: u64, edges: &[f32; BINS - 1]) -> Vec<f32> {
    let mut random = Rng::with_seed(seed);
    (0..count * AXES)
        .map(|_| match random.u8(..10) {
            0 => f32::NAN,
            1 => -random.f32(),
            2 => edges[random.usize(..edges.len())],
            3 => 0.0,
            _ => 10f32.powf(random.f32() * 8.0 - 4.0),
        })
        .collect()
}

fn edges(axis: usize) -> [f32; BINS - 1] {
    std::array::from_fn(|edge| 10f32.powf((edge as f32 + 1.0) / 16.0 - 4.0 + axis as f32 * 0.1))
}

fn bin(value: f32, edges: &[f32; BINS - 1]) -> usize {
    if value.is_nan() { BINS } else { edges.iter().filter(|edge| **edge <= value).count() }
}

#[test]
fn counts_and_brushed_records_are_those_of_a_plain_loop() {
    let shown: Vec<_> = [3, 0, 4, 1].into_iter().map(|axis| (axis, edges(axis))).collect();
    let pairs = [[0, 1], [1, 2], [2, 3], [0, 3]];
    let ranges = [[0.5, 20.0], [300.0, f32::MAX]];
    let brushes = [
        BrushedAxis { axis: 0, ranges: &ranges, with_missing: false },
        BrushedAxis { axis: 2, ranges: &ranges[..1], with_missing: true },
    ];
    with_renderer(1, |renderer| {
        // More than one chunk of the device, and no whole workgroup.
        for (revision, count) in [(1, 1000), (2, 1_100_001), (3, 0)] {
            let values = values(count, revision, &edges(0));
            for any in [false, true] {
                let is_meant = |row: &[f32]| {
                    let of = |brush: &BrushedAxis<'_>| {
                        let value = row[brush.axis];
                        let is_in = |[low, high]: &[f32; 2]| *low <= value && value <= *high;
                        brush.ranges.iter().any(is_in) || (brush.with_missing && value.is_nan())
                    };
                    if any { brushes.iter().any(of) } else { brushes.iter().all(of) }
                };
                let mut all = vec![0; pairs.len() * SIDE * SIDE];
                let (mut meant, mut mask) = (all.clone(), vec![0u32; count.div_ceil(32)]);
                for (record, row) in values.chunks_exact(AXES).enumerate() {
                    let bins: Vec<_> = shown.iter().map(|(axis, e)| bin(row[*axis], e)).collect();
                    let is_meant = is_meant(row);
                    mask[record / 32] |= u32::from(is_meant) << (record % 32);
                    for (pair, [from, to]) in pairs.iter().enumerate() {
                        let at = (pair * SIDE + bins[*from]) * SIDE + bins[*to];
                        all[at] += 1;
                        meant[at] += u32::from(is_meant);
                    }
                }
                let input = DensityInput {
                    revision,
                    axes: AXES,
                    values: &values,
                    shown: &shown,
                    pairs: &pairs,
                    brushes: &brushes,
                    any,
                };
                let counted = renderer.count_records(&input).unwrap();
                assert!(counted.all == all, "{count} {any}: all");
                assert!(counted.meant == meant, "{count} {any}: meant");
                assert!(counted.mask == mask, "{count} {any}: mask");
            }
        }
    });
}

#[test]
fn what_does_not_fit_is_refused() {
    with_renderer(1, |renderer| {
        let shown = [(0, edges(0)), (1, edges(1))];
        let input = DensityInput {
            revision: 1,
            axes: 2,
            values: &[1.0, 2.0, 3.0, 4.0],
            shown: &shown,
            pairs: &[[0, 1]],
            brushes: &[],
            any: false,
        };
        assert!(renderer.count_records(&input).is_ok());
        let odd = DensityInput { values: &[1.0; 3], ..input };
        let beyond = DensityInput { pairs: &[[0, 2]], ..input };
        let none = DensityInput { axes: 0, ..input };
        let many = DensityInput { axes: 33, values: &[1.0; 33], ..input };
        for wrong in [odd, beyond, none, many] {
            assert!(renderer.count_records(&wrong).is_err());
        }
    });
}
