// Counts how many records go from each bin of an axis to each bin of the next one, of all
// and of those that brushes mean. Values are compared, never worked out: so the counts are
// those of any other machine (`busbar_chart::bin_pairs` is the twin).

struct DensityStep {
    records: u32,
    // Values a record.
    axes: u32,
    // Axes that are binned, and pairs of them.
    shown: u32,
    pairs: u32,
    // Brushed axes; 1 where meeting any of them is enough.
    brushes: u32,
    any: u32,
    // Words of the mask before the first of these records.
    first_word: u32,
    // Words of the first gate, and of the second: a bit a record. 0 where there is none.
    known_words: u32,
    given_words: u32,
}

const BINS = 128u;
// With the bin of records without a value.
const SIDE = 129u;
const MAX_AXES = 32u;

var<immediate> step: DensityStep;

@group(0) @binding(0) var<storage, read> values: array<f32>;
// Lower edges of the bins 1, 2 and so on, axis by axis.
@group(1) @binding(0) var<storage, read> edges: array<f32>;
// The axis of each that is binned; two places a pair; then for each brushed axis itself, its
// number of ranges, whether records without a value are brushed, and the ranges' ends.
@group(1) @binding(1) var<storage, read> plan: array<u32>;
@group(1) @binding(2) var<storage, read_write> counts: array<atomic<u32>>;
@group(1) @binding(3) var<storage, read_write> brushed_counts: array<atomic<u32>>;
@group(1) @binding(4) var<storage, read_write> mask: array<atomic<u32>>;
// A bit a record of this dispatch: whether it is counted; then whether it meets brushes that
// cannot be compared here.
@group(2) @binding(0) var<storage, read> gates: array<u32>;

fn is_missing(value: f32) -> bool {
    return (bitcast<u32>(value) & 0x7fffffffu) > 0x7f800000u;
}

fn bit(first_word: u32, record: u32) -> bool {
    return (gates[first_word + record / 32u] >> (record % 32u) & 1u) == 1u;
}

fn is_brushed(record: u32) -> bool {
    let base = record * step.axes;
    var at = step.shown + 2u * step.pairs;
    let has_given = step.given_words > 0u;
    let given = has_given && bit(step.known_words, record);
    var all = (step.brushes > 0u || has_given) && (given || !has_given);
    var any = given;
    for (var brush = 0u; brush < step.brushes; brush++) {
        let value = values[base + plan[at]];
        let ranges = plan[at + 1u];
        var met = is_missing(value) && plan[at + 2u] == 1u;
        for (var range = 0u; range < ranges; range++) {
            let low = bitcast<f32>(plan[at + 3u + 2u * range]);
            let high = bitcast<f32>(plan[at + 4u + 2u * range]);
            met = met || (!is_missing(value) && low <= value && value <= high);
        }
        all = all && met;
        any = any || met;
        at += 3u + 2u * ranges;
    }
    return select(all, any, step.any == 1u);
}

// How many edges are not above the value.
fn bin_of(value: f32, shown: u32) -> u32 {
    if is_missing(value) {
        return BINS;
    }
    var low = 0u;
    var high = BINS - 1u;
    while low < high {
        let middle = (low + high) / 2u;
        if edges[shown * (BINS - 1u) + middle] <= value {
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
    if step.known_words > 0u && !bit(0u, id.x) {
        return;
    }
    let base = id.x * step.axes;
    let brushed = is_brushed(id.x);
    if brushed {
        atomicOr(&mask[step.first_word + id.x / 32u], 1u << (id.x % 32u));
    }
    var bins: array<u32, MAX_AXES>;
    for (var shown = 0u; shown < min(step.shown, MAX_AXES); shown++) {
        bins[shown] = bin_of(values[base + plan[shown]], shown);
    }
    for (var pair = 0u; pair < step.pairs; pair++) {
        let places = step.shown + 2u * pair;
        let row = pair * SIDE + bins[plan[places]];
        let at = row * SIDE + bins[plan[places + 1u]];
        atomicAdd(&counts[at], 1u);
        if brushed {
            atomicAdd(&brushed_counts[at], 1u);
        }
    }
}
