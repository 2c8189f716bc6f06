//! Density counts of the GPU, bit-equal to those of the CPU.

#![allow(clippy::unwrap_used, reason = "helpers of tests")]

mod common;

use busbar_renderer::{
    BrushedAxis, DensityInput, DensityPlane, DensitySummary, Frame, Polylines, SLICE_RECORDS,
};
use common::*;
use fastrand::Rng;
use glam::Vec3;

const BINS: usize = 128;
const SIDE: usize = BINS + 1;
const AXES: usize = 5;
/// Columns of a picture between two axes.
const COLUMNS: usize = 64;
const ROWS: usize = 137;

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

/// Counts how many lines pass each cell between axes: straight from bin to bin, a line at a time.
fn laid_out(counts: &[u32], pairs: &[[usize; 2]], flipped: &[bool]) -> Vec<u32> {
    let row_of = |bin: usize, flipped: bool| match bin {
        BINS => 0,
        bin if flipped => 9 + BINS - 1 - bin,
        bin => 9 + bin,
    };
    let mut cells = vec![0; pairs.len() * COLUMNS * ROWS];
    for (pair, [from, to]) in pairs.iter().enumerate() {
        for (a, b) in (0..SIDE).flat_map(|a| (0..SIDE).map(move |b| (a, b))) {
            let [first, last] = [row_of(a, flipped[*from]), row_of(b, flipped[*to])];
            for column in 0..COLUMNS {
                let share = 2 * column + 1;
                let row = ((2 * COLUMNS - share) * first + share * last) / (2 * COLUMNS);
                cells[(pair * COLUMNS + column) * ROWS + row] +=
                    counts[(pair * SIDE + a) * SIDE + b];
            }
        }
    }
    cells
}

#[test]
fn counts_brushed_records_and_pictures_are_those_of_a_plain_loop() {
    let shown: Vec<_> = [3, 0, 4, 1].into_iter().map(|axis| (axis, edges(axis))).collect();
    let flipped = [false, true, false, true];
    let pairs = [[0, 1], [1, 2], [2, 3], [0, 3]];
    let ranges = [[0.5, 20.0], [300.0, f32::MAX]];
    let brushes = [
        BrushedAxis { axis: 0, ranges: &ranges, with_missing: false },
        BrushedAxis { axis: 2, ranges: &ranges[..1], with_missing: true },
    ];
    let is_known = |record: usize| record % 7 != 3;
    let is_given = |record: usize| record % 5 < 2;
    with_renderer(1, |renderer| {
        // More than one chunk of the device, and no whole workgroup.
        let cases = [(1, 1000, false), (2, 600_001, false), (3, 300_000, true), (4, 0, true)];
        for (revision, count, gated) in cases {
            let values = values(count, revision, &edges(0));
            for any in [false, true] {
                let is_meant = |record: usize, row: &[f32]| {
                    let of = |brush: &BrushedAxis<'_>| {
                        let value = row[brush.axis];
                        let is_in = |[low, high]: &[f32; 2]| *low <= value && value <= *high;
                        brush.ranges.iter().any(is_in) || (brush.with_missing && value.is_nan())
                    };
                    match any {
                        true => brushes.iter().any(of) || (gated && is_given(record)),
                        false => brushes.iter().all(of) && (!gated || is_given(record)),
                    }
                };
                let mut all = vec![0; pairs.len() * SIDE * SIDE];
                let (mut brushed, mut mask) = (all.clone(), vec![0u32; count.div_ceil(32)]);
                let rows = values.chunks_exact(AXES).enumerate();
                for (record, row) in rows.filter(|(record, _)| !gated || is_known(*record)) {
                    let bins: Vec<_> = shown.iter().map(|(axis, e)| bin(row[*axis], e)).collect();
                    let is_meant = is_meant(record, row);
                    mask[record / 32] |= u32::from(is_meant) << (record % 32);
                    for (pair, [from, to]) in pairs.iter().enumerate() {
                        let at = (pair * SIDE + bins[*from]) * SIDE + bins[*to];
                        all[at] += 1;
                        brushed[at] += u32::from(is_meant);
                    }
                }
                let input = DensityInput {
                    revision,
                    arrangement: 1,
                    axes: AXES,
                    values: &values,
                    binned_axes: &shown,
                    flipped: &flipped,
                    pairs: &pairs,
                    brushes: &brushes,
                    any,
                    record_filter: if gated { Some(&is_known) } else { None },
                    brush_filter: if gated { Some(&is_given) } else { None },
                };
                let counted = renderer.count_records(&input).unwrap();
                let place = format!("{count} {any} {gated}");
                assert!(counted.all == all, "{place}: all");
                assert!(counted.brushed == brushed, "{place}: brushed");
                assert!(counted.mask == mask, "{place}: mask");
                let [of_all, of_meant] =
                    [&all, &brushed].map(|counts| laid_out(counts, &pairs, &flipped));
                assert!(counted.picture == [of_all.clone(), of_meant.clone()].concat(), "{place}");
                let most = |cells: &[u32]| cells.iter().copied().max().unwrap_or_default();
                let sum = |counts: &[u32]| counts[..SIDE * SIDE].iter().sum::<u32>();
                let expected = DensitySummary {
                    arrangement: 1,
                    pairs: 4,
                    peak: most(&of_all),
                    brushed_peak: most(&of_meant),
                    lines: sum(&all),
                    brushed: sum(&brushed),
                };
                assert_eq!(counted.summary, expected, "{place}");
            }
        }
    });
}

#[test]
fn slices_are_counted_beside_the_frames_and_shown_when_all_are() {
    let shown = [(0, edges(0)), (1, edges(0))];
    let count = 2 * SLICE_RECORDS + 5;
    // All lines go from the middle of one axis to the middle of the other.
    let middle = edges(0)[BINS / 2] * 1.01;
    let values = vec![middle; 2 * count];
    let input = DensityInput {
        revision: 1,
        arrangement: 7,
        axes: 2,
        values: &values,
        binned_axes: &shown,
        flipped: &[false; 2],
        pairs: &[[0, 1]],
        brushes: &[],
        any: false,
        record_filter: None,
        brush_filter: None,
    };
    let plane = DensityPlane {
        from: Vec3::new(-0.6, -0.5, 0.0),
        to: Vec3::new(0.6, -0.5, 0.0),
        height: 1.0,
        color: [255, 0, 0],
        brushed: None,
    };
    with_renderer(1, |renderer| {
        let mut last = 0;
        let mut steps = 0;
        let shown = loop {
            let progress = renderer.advance_density(&input, false).unwrap();
            assert!(progress.of == count && progress.counted <= last + SLICE_RECORDS);
            assert!(progress.counted >= last);
            (last, steps) = (progress.counted, steps + 1);
            if let Some(shown) = progress.shown {
                break shown;
            }
            std::thread::sleep(std::time::Duration::from_millis(1));
        };
        assert!(steps > 3, "it took {steps} calls");
        assert_eq!((shown.lines, shown.peak, shown.brushed), (count as u32, count as u32, 0));
        let mut reds = |planes: &[DensityPlane], revision| -> Vec<usize> {
            let polylines = Some(Polylines { revision, faces: &[], planes, strokes: &[] });
            let pixels = picture(renderer, &Frame { polylines, ..frame(&[]) }).rgba8;
            let pixels = pixels.chunks_exact(4).enumerate();
            pixels.filter(|(_, p)| p[0] > 200).map(|(at, _)| at).collect()
        };
        let [width, height] = SIZE.map(|pixels| pixels as usize);
        let drawn = reds(&[plane], 1);
        assert!(!drawn.is_empty());
        let rows: Vec<usize> = drawn.iter().map(|at| at / width).collect();
        let off = rows.iter().map(|row| row.abs_diff(height / 2)).max().unwrap();
        assert!(off <= height / 20, "a level line in the middle, {off} pixels off");
        assert_eq!(reds(&[], 2), [0; 0]);
        assert_eq!(reds(&[plane; 2], 3), [0; 0], "not what was counted");
    });
}

#[test]
fn what_does_not_fit_is_refused() {
    with_renderer(1, |renderer| {
        let shown = [(0, edges(0)), (1, edges(1))];
        let input = DensityInput {
            revision: 1,
            arrangement: 1,
            axes: 2,
            values: &[1.0, 2.0, 3.0, 4.0],
            binned_axes: &shown,
            flipped: &[false; 2],
            pairs: &[[0, 1]],
            brushes: &[],
            any: false,
            record_filter: None,
            brush_filter: None,
        };
        assert!(renderer.count_records(&input).is_ok());
        let odd = DensityInput { values: &[1.0; 3], ..input };
        let beyond = DensityInput { pairs: &[[0, 2]], ..input };
        let none = DensityInput { axes: 0, ..input };
        let many = DensityInput { axes: 33, values: &[1.0; 33], ..input };
        let unturned = DensityInput { flipped: &[], ..input };
        for wrong in [odd, beyond, none, many, unturned] {
            assert!(renderer.count_records(&wrong).is_err());
        }
    });
}
