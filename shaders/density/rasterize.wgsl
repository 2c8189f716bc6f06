// Rasterizes joint histograms into a density plot: number of lines per cell between two axes.
// Integer arithmetic only, so that results are identical on every device; the reference on
// the CPU is in `host/graphics/renderer/tests/density.rs`.

struct RasterizeStep {
    pairs: u32,
}

// Bins of an axis in the histograms, including the one for missing values.
const SIDE = 129u;
// Dimensions of the plot: columns from axis to axis, and rows, one per bin, from the lane of
// missing values to the heads of the axes.
const COLUMNS = 64u;
const ROWS = 137u;
const LANE = -9;

var<immediate> step: RasterizeStep;

@group(0) @binding(0) var<storage, read> counts: array<u32>;
@group(0) @binding(1) var<storage, read> brushed_counts: array<u32>;
// Two per pair: 1 where the axis is flipped.
@group(0) @binding(2) var<storage, read> flips: array<u32>;
// Cells by pair, column from the left and row from below: first all lines, then brushed ones.
@group(0) @binding(3) var<storage, read_write> picture: array<atomic<u32>>;
// Maximum per cell of all and of brushed lines; total of all and of brushed lines.
@group(0) @binding(4) var<storage, read_write> summary: array<atomic<u32>>;

fn row_of(bin: u32, flipped: u32) -> i32 {
    if bin == SIDE - 1u {
        return LANE;
    }
    return select(i32(bin), i32(SIDE - 2u - bin), flipped == 1u);
}

@compute @workgroup_size(64)
fn rasterize_main(@builtin(global_invocation_id) id: vec3<u32>) {
    let bin = id.x % SIDE;
    let column = (id.x / SIDE) % COLUMNS;
    let pair = id.x / (SIDE * COLUMNS);
    if pair >= step.pairs {
        return;
    }
    let first = row_of(bin, flips[2u * pair]) - LANE;
    // Centre of the column, in halves of a column.
    let share = i32(2u * column + 1u);
    let rest = i32(2u * COLUMNS) - share;
    let cells = step.pairs * COLUMNS * ROWS;
    var most = vec2<u32>(0u);
    var sums = vec2<u32>(0u);
    for (var other = 0u; other < SIDE; other++) {
        let at = (pair * SIDE + bin) * SIDE + other;
        let lines = vec2<u32>(counts[at], brushed_counts[at]);
        if lines.x == 0u {
            continue;
        }
        let last = row_of(other, flips[2u * pair + 1u]) - LANE;
        let row = u32((rest * first + share * last) / i32(2u * COLUMNS));
        let cell = (pair * COLUMNS + column) * ROWS + row;
        most.x = max(most.x, atomicAdd(&picture[cell], lines.x) + lines.x);
        if lines.y > 0u {
            most.y = max(most.y, atomicAdd(&picture[cells + cell], lines.y) + lines.y);
        }
        sums += lines;
    }
    atomicMax(&summary[0], most.x);
    atomicMax(&summary[1], most.y);
    if pair == 0u && column == 0u {
        atomicAdd(&summary[2], sums.x);
        atomicAdd(&summary[3], sums.y);
    }
}
