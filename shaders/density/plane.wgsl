// Density plot between two axes of parallel coordinates, on a plane in world space: opacity
// by the logarithm of the number of lines, brushed lines composited over the rest.

const COLUMNS = 64u;
const ROWS = 137u;
// Rows below the feet of the axes, for missing values.
const LANE_ROWS = 9.0;
// Maximum samples along rows per pixel.
const MAX_ROW_SAMPLES = 12.0;
// Opacity of one line and of the peak: of all lines, alone and behind brushed ones, and of
// brushed lines.
const MIN_OPACITY = 0.07;
const MAX_OPACITY = 0.85;
const BEHIND_MAX_OPACITY = 0.3;
const BRUSHED_MIN_OPACITY = 0.3;
const BRUSHED_MAX_OPACITY = 0.95;

@group(1) @binding(0) var<storage, read> picture: array<u32>;

struct PlaneInput {
    // 0 on the first axis, 1 on the second; -1 below, 1 above.
    @location(0) corner: vec2<f32>,
    // World space: the foot of the first axis; the height of axes.
    @location(1) from_height: vec4<f32>,
    // The foot of the second; the number of the pair.
    @location(2) to_pair: vec4<f32>,
    // Colour in the target's encoding; maximum lines per cell.
    @location(3) color_peak: vec4<f32>,
    // Colour and maximum of brushed lines.
    @location(4) brushed_peak: vec4<f32>,
    // Number of pairs; 1 where lines may be brushed.
    @location(5) pairs: vec4<f32>,
}

struct PlaneVaryings {
    @builtin(position) clip: vec4<f32>,
    // Position in columns and rows.
    @location(0) place: vec2<f32>,
    @location(1) @interpolate(flat) color_peak: vec4<f32>,
    @location(2) @interpolate(flat) brushed_peak: vec4<f32>,
    // First cell of all lines, and of brushed ones; 1 where lines may be brushed.
    @location(3) @interpolate(flat) cells: vec3<u32>,
}

@vertex
fn plane_vertex(in: PlaneInput) -> PlaneVaryings {
    let row = select(0.0, f32(ROWS), in.corner.y > 0.0);
    let foot = mix(in.from_height.xyz, in.to_pair.xyz, in.corner.x);
    let bins = f32(ROWS) - LANE_ROWS;
    let up = vec3<f32>(0.0, in.from_height.w * (row - LANE_ROWS) / bins, 0.0);
    let first = u32(in.to_pair.w) * COLUMNS * ROWS;
    let first_brushed = u32(in.pairs.x) * COLUMNS * ROWS + first;
    let cells = vec3<u32>(first, first_brushed, u32(in.pairs.y));
    let place = vec2<f32>(in.corner.x * f32(COLUMNS), row);
    return PlaneVaryings(clip_position(foot + up), place, in.color_peak, in.brushed_peak, cells);
}

fn lines_at(first: u32, column: i32, row: i32) -> f32 {
    let last = vec2<i32>(i32(COLUMNS) - 1, i32(ROWS) - 1);
    let cell = vec2<u32>(clamp(vec2<i32>(column, row), vec2<i32>(0), last));
    return f32(picture[first + cell.x * ROWS + cell.y]);
}

// Number of lines at a position, interpolated bilinearly.
fn interpolated_lines(first: u32, place: vec2<f32>) -> f32 {
    let at = place - 0.5;
    let low = vec2<i32>(floor(at));
    let part = fract(at);
    let below = mix(lines_at(first, low.x, low.y), lines_at(first, low.x + 1, low.y), part.x);
    let above = mix(
        lines_at(first, low.x, low.y + 1), lines_at(first, low.x + 1, low.y + 1), part.x);
    return mix(below, above, part.y);
}

// Maximum of lines within a pixel's extent in rows, so that minification keeps single lines.
fn max_lines(first: u32, place: vec2<f32>, rows: f32) -> f32 {
    let samples = clamp(ceil(rows), 1.0, MAX_ROW_SAMPLES);
    var most = 0.0;
    for (var sample = 0.5; sample < samples; sample += 1.0) {
        let row = place.y + (sample / samples - 0.5) * rows;
        most = max(most, interpolated_lines(first, vec2<f32>(place.x, row)));
    }
    return most;
}

// Opacity by the logarithm of the number of lines, so that single lines stay visible.
fn opacity(lines: f32, peak: f32, min_opacity: f32, max_opacity: f32) -> f32 {
    let share = log(1.0 + lines) / log(1.0 + max(peak, 1.0));
    return min(lines, 1.0) * (min_opacity + (max_opacity - min_opacity) * share);
}

@fragment
fn plane_fragment(in: PlaneVaryings) -> @location(0) vec4<f32> {
    let brushed = in.cells.z == 1u;
    let full = select(MAX_OPACITY, BEHIND_MAX_OPACITY, brushed);
    let rows = fwidth(in.place.y);
    let back = opacity(max_lines(in.cells.x, in.place, rows), in.color_peak.w, MIN_OPACITY, full);
    if !brushed {
        return vec4<f32>(in.color_peak.rgb, back);
    }
    let lines = max_lines(in.cells.y, in.place, rows);
    let front = opacity(lines, in.brushed_peak.w, BRUSHED_MIN_OPACITY, BRUSHED_MAX_OPACITY);
    let both = front + back * (1.0 - front);
    let color = mix(in.color_peak.rgb, in.brushed_peak.rgb, front / max(both, 1e-4));
    return vec4<f32>(color, both);
}
