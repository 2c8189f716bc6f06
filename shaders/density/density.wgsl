// Joint histograms of neighbouring axes: number of records per pair of bins, for all records
// and for the brushed ones. Values are only compared, so the counts are identical on every
// device (`busbar_chart::bin_pairs` is the reference on the CPU).

struct DensityStep {
    records: u32,
    // Values per record.
    axes: u32,
    // Number of binned axes, and of pairs of them.
    binned_axes: u32,
    pairs: u32,
    // Number of brushed axes; 1 where any matching brush is enough.
    brushes: u32,
    any: u32,
    // Offset of this dispatch in the mask, words.
    first_word: u32,
    // Lengths of the first and the second gate, one bit per record, words. 0 without a gate.
    record_filter_words: u32,
    brush_filter_words: u32,
}

const BINS = 128u;
// Bins including the one for missing values.
const SIDE = 129u;
const MAX_AXES = 32u;

var<immediate> step: DensityStep;

@group(0) @binding(0) var<storage, read> values: array<f32>;
// Lower edges of bins 1 and up, axis by axis.
@group(1) @binding(0) var<storage, read> edges: array<f32>;
// Index of each binned axis; two positions per pair; then for each brushed axis its index, its
// number of ranges, whether missing values are brushed, and the bounds of the ranges.
@group(1) @binding(1) var<storage, read> plan: array<u32>;
@group(1) @binding(2) var<storage, read_write> counts: array<atomic<u32>>;
@group(1) @binding(3) var<storage, read_write> brushed_counts: array<atomic<u32>>;
@group(1) @binding(4) var<storage, read_write> mask: array<atomic<u32>>;
// One bit per record of this dispatch: whether it is counted; then whether it matches the
// brushes that were evaluated on the CPU.
@group(2) @binding(0) var<storage, read> gates: array<u32>;

fn is_missing(value: f32) -> bool {
    return (bitcast<u32>(value) & 0x7fffffffu) > 0x7f800000u;
}

fn bit(first_word: u32, record: u32) -> bool {
    return (gates[first_word + record / 32u] >> (record % 32u) & 1u) == 1u;
}

fn is_brushed(record: u32) -> bool {
    let base = record * step.axes;
    var at = step.binned_axes + 2u * step.pairs;
    let has_brush_filter = step.brush_filter_words > 0u;
    let filtered = has_brush_filter && bit(step.record_filter_words, record);
    var all = (step.brushes > 0u || has_brush_filter) && (filtered || !has_brush_filter);
    var any = filtered;
    for (var brush = 0u; brush < step.brushes; brush++) {
        let value = values[base + plan[at]];
        let ranges = plan[at + 1u];
        var matches = is_missing(value) && plan[at + 2u] == 1u;
        for (var range = 0u; range < ranges; range++) {
            let low = bitcast<f32>(plan[at + 3u + 2u * range]);
            let high = bitcast<f32>(plan[at + 4u + 2u * range]);
            matches = matches || (!is_missing(value) && low <= value && value <= high);
        }
        all = all && matches;
        any = any || matches;
        at += 3u + 2u * ranges;
    }
    return select(all, any, step.any == 1u);
}

// Bin of a value, by binary search of the edges.
fn bin_of(value: f32, axis: u32) -> u32 {
    if is_missing(value) {
        return BINS;
    }
    var low = 0u;
    var high = BINS - 1u;
    while low < high {
        let middle = (low + high) / 2u;
        if edges[axis * (BINS - 1u) + middle] <= value {
            low = middle + 1u;
        } else {
            high = middle;
        }
    }
    return low;
}

@compute @workgroup_size(64)
fn count_main(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x >= step.records {
        return;
    }
    if step.record_filter_words > 0u && !bit(0u, id.x) {
        return;
    }
    let base = id.x * step.axes;
    let brushed = is_brushed(id.x);
    if brushed {
        atomicOr(&mask[step.first_word + id.x / 32u], 1u << (id.x % 32u));
    }
    var bins: array<u32, MAX_AXES>;
    for (var axis = 0u; axis < min(step.binned_axes, MAX_AXES); axis++) {
        bins[axis] = bin_of(values[base + plan[axis]], axis);
    }
    for (var pair = 0u; pair < step.pairs; pair++) {
        let places = step.binned_axes + 2u * pair;
        let row = pair * SIDE + bins[plan[places]];
        let at = row * SIDE + bins[plan[places + 1u]];
        atomicAdd(&counts[at], 1u);
        if brushed {
            atomicAdd(&brushed_counts[at], 1u);
        }
    }
}
