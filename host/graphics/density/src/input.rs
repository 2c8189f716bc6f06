//! Input and result of density counting.

use std::ops::Range;

use busbar_gpu::GpuError;
use busbar_shaders::DENSITY_BINS;

use crate::DensityError;

/// Values that one record may have.
pub const MAX_DENSITY_AXES: usize = 32;
/// Bytes of values that stay on the device: ten million records of twelve values.
pub const MAX_DENSITY_BYTES: usize = 480_000_000;
/// Records of a mask word.
pub(crate) const WORD: usize = 32;
/// Bins of an axis with that of records without a value.
pub(crate) const SIDE: usize = DENSITY_BINS as usize + 1;

/// Says of a record, by its number, whether something holds.
type RecordPredicate<'a> = Option<&'a dyn Fn(usize) -> bool>;

/// Records, axes and brushes to count.
#[derive(Clone, Copy)]
pub struct DensityInput<'a> {
    /// Revision of the values: the same revision is not uploaded again.
    pub revision: u64,
    /// Revision of everything else that changes the count.
    pub arrangement: u64,
    /// Values a record; at most [`MAX_DENSITY_AXES`].
    pub axes: usize,
    /// The values, record by record; NaN where there is none, no subnormals. At most
    /// [`MAX_DENSITY_BYTES`].
    pub values: &'a [f32],
    /// Binned axes: index of each, and the lower edges of its bins 1 and up, ascending.
    pub binned_axes: &'a [(usize, [f32; DENSITY_BINS as usize - 1])],
    /// Direction of each binned axis: whether it is drawn upside down.
    pub flipped: &'a [bool],
    /// Pairs of binned axes, by their positions.
    pub pairs: &'a [[usize; 2]],
    /// Brushes that select records; empty without brushes.
    pub brushes: &'a [BrushedAxis<'a>],
    /// Combination of brushes: whether matching any of them is enough.
    pub any: bool,
    /// Filter of the records that are counted; `None` counts all.
    pub record_filter: RecordPredicate<'a>,
    /// Additional condition of brushed records, evaluated on the CPU.
    pub brush_filter: RecordPredicate<'a>,
}

/// A condition on the value of one axis.
#[derive(Clone, Copy, Debug)]
pub struct BrushedAxis<'a> {
    /// Index of the axis.
    pub axis: usize,
    /// Ranges that the value may lie in, ends included.
    pub ranges: &'a [[f32; 2]],
    /// Missing values: whether records without a value are selected too.
    pub with_missing: bool,
}

/// Result of counting records.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct DensityCounts {
    /// For each pair, from each bin of the first to each of the second: 129 times 129 counts;
    /// the last bin is that of records without a value.
    pub all: Vec<u32>,
    /// Counts of the brushed records, in the same order.
    pub brushed: Vec<u32>,
    /// Brush mask: one bit a record.
    pub mask: Vec<u32>,
    /// Density picture of each pair, 64 columns of 137 cells from below: lines through each cell,
    /// first of all records, then of brushed ones.
    pub picture: Vec<u32>,
    /// All of that in few numbers.
    pub summary: DensitySummary,
}

/// Summary of a density picture.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct DensitySummary {
    /// Arrangement that was counted.
    pub arrangement: u64,
    /// Number of pairs of axes.
    pub pairs: u32,
    /// Maximum number of lines in a cell.
    pub peak: u32,
    /// Maximum number of brushed lines in a cell.
    pub brushed_peak: u32,
    /// Records that were counted.
    pub lines: u32,
    /// Number of brushed records among those counted.
    pub brushed: u32,
}

/// Progress of the count under way.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct DensityProgress {
    /// Records that were handed to the device.
    pub counted: usize,
    /// Number of records there are.
    pub of: usize,
    /// Summary of the picture that can be drawn; it may be of an earlier arrangement.
    pub shown: Option<DensitySummary>,
}

pub(crate) fn check(input: &DensityInput<'_>) -> Result<(), DensityError> {
    let DensityInput { axes, values, binned_axes, flipped, pairs, brushes, .. } = *input;
    let too_many = |what, asked: usize, limit: usize| {
        Err(DensityError::TooMany { what, asked: asked as u64, limit: limit as u64 })
    };
    let most = axes.max(binned_axes.len());
    if most > MAX_DENSITY_AXES {
        return too_many("axes of records", most, MAX_DENSITY_AXES);
    }
    if size_of_val(values) > MAX_DENSITY_BYTES {
        return too_many("bytes of values", size_of_val(values), MAX_DENSITY_BYTES);
    }
    let names =
        binned_axes.iter().map(|(axis, _)| *axis).chain(brushes.iter().map(|brush| brush.axis));
    let fits = axes > 0
        && values.len() % axes == 0
        && flipped.len() == binned_axes.len()
        && names.into_iter().all(|axis| axis < axes)
        && pairs.iter().flatten().all(|place| *place < binned_axes.len());
    if fits { Ok(()) } else { Err(GpuError::Misuse("records that do not fit their axes").into()) }
}

/// Packs the shader's plan: axes, pairs and brushes.
pub(crate) fn plan(input: &DensityInput<'_>) -> Vec<u32> {
    let binned_axes = input.binned_axes.iter().map(|(axis, _)| *axis as u32);
    let pairs = input.pairs.iter().flatten().map(|place| *place as u32);
    let brushes = input.brushes.iter().flat_map(|brush| {
        let head = [brush.axis as u32, brush.ranges.len() as u32, u32::from(brush.with_missing)];
        head.into_iter().chain(brush.ranges.iter().flatten().map(|end| end.to_bits()))
    });
    let mut plan: Vec<u32> = binned_axes.chain(pairs).chain(brushes).collect();
    if plan.is_empty() {
        plan.push(0);
    }
    plan
}

/// Packs the axes' directions, two a pair: 1 where the axis is upside down.
pub(crate) fn flips(input: &DensityInput<'_>) -> Vec<u32> {
    let flips = input.pairs.iter().flatten().map(|place| u32::from(input.flipped[*place]));
    let mut flips: Vec<u32> = flips.collect();
    if flips.is_empty() {
        flips.push(0);
    }
    flips
}

/// Packs the gate bits of some records: whether each is counted, then whether it matches `brush_filter`.
/// Returns the words with the length of each of the two.
pub(crate) fn gates(input: &DensityInput<'_>, records: Range<usize>) -> (Vec<u32>, u32, u32) {
    let words = records.len().div_ceil(WORD);
    let mut gates = Vec::new();
    let mut add = |of: RecordPredicate<'_>| {
        let Some(holds) = of else { return 0 };
        let first = gates.len();
        gates.resize(first + words, 0);
        for (at, record) in records.clone().enumerate() {
            gates[first + at / WORD] |= u32::from(holds(record)) << (at % WORD);
        }
        words as u32
    };
    let (record_words, brush_words) = (add(input.record_filter), add(input.brush_filter));
    if gates.is_empty() {
        gates.push(0);
    }
    (gates, record_words, brush_words)
}
