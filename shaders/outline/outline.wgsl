// Outlines of hovered and selected objects, by distance to the mask: a light line with a dark
// one around it, legible over any colour, dashed where the object is occluded. A tile pass
// first finds the tiles near edges of the mask.

const HOVERED = 1u;
const KIND = 3u;
const HIDDEN = 4u;
// Widths in points: of the light line, and of the dark one.
const SELECTED_LIGHT = 2.25;
const HOVERED_LIGHT = 1.25;
const DARK = 1.5;
// Side of a tile and maximum reach of outlines, pixels.
const TILE = 4;
const MAX_REACH = 8;
// Flags of a tile: any pixel is masked, all are, and any is of a selected object.
const ANY = 1u;
const ALL = 2u;
const WIDE = 4u;
// Length of a dash, and of the gap after it, points; opacity of hidden outlines.
const DASH = 8.0;
const HIDDEN_OPACITY = 0.55;
const LIGHT_COLOR = vec3<f32>(1.0, 1.0, 1.0);
const DARK_COLOR = vec3<f32>(0.008, 0.009, 0.012);

@group(1) @binding(0) var mask: texture_2d<u32>;
// Flags of each tile; for outline_main, its search radius.
@group(2) @binding(0) var tiles: texture_2d<u32>;

fn mask_at(pixel: vec2<i32>) -> u32 {
    let size = vec2<i32>(textureDimensions(mask));
    return textureLoad(mask, clamp(pixel, vec2<i32>(0), size - 1), 0).r;
}

// Antialiased coverage of a pixel at distance `at` by a line that ends at `to`.
fn edge_coverage(at: f32, to: f32) -> f32 {
    return clamp(to - at + 0.5, 0.0, 1.0);
}

// Reach of an outline whose light line has a width in points, pixels.
fn reach_of(light: f32) -> i32 {
    return min(i32(ceil((light + DARK) * frame.sizes.y)), MAX_REACH);
}

// Flags of a tile.
@fragment
fn tile_main(@builtin(position) at: vec4<f32>) -> @location(0) u32 {
    let corner = vec2<i32>(at.xy) * TILE;
    var found = ALL;
    for (var i = 0; i < TILE * TILE; i += 1) {
        let kind = mask_at(corner + vec2<i32>(i % TILE, i / TILE)) & KIND;
        found |= select(ANY, 0u, kind == 0u) | select(WIDE, 0u, kind <= HOVERED);
        found &= select(~0u, ~ALL, kind == 0u);
    }
    return found;
}

// Search radius around a tile for edges of the mask, pixels; 0 where there is none.
@fragment
fn edge_main(@builtin(position) at: vec4<f32>) -> @location(0) u32 {
    let last = vec2<i32>(textureDimensions(tiles)) - 1;
    let tile = vec2<i32>(at.xy);
    let around = (reach_of(SELECTED_LIGHT) + TILE - 1) / TILE;
    var found = 0u;
    var all = ALL;
    for (var y = -around; y <= around; y += 1) {
        for (var x = -around; x <= around; x += 1) {
            let beside = clamp(tile + vec2<i32>(x, y), vec2<i32>(0), last);
            let there = textureLoad(tiles, beside, 0).r;
            found |= there;
            all &= there;
        }
    }
    let reach = select(reach_of(HOVERED_LIGHT), reach_of(SELECTED_LIGHT), (found & WIDE) != 0u);
    return select(0u, u32(reach), (found & ANY) != 0u && all == 0u);
}

@fragment
fn outline_main(@builtin(position) at: vec4<f32>) -> @location(0) vec4<f32> {
    let pixel = vec2<i32>(at.xy);
    let scale = frame.sizes.y;
    let search_radius = i32(textureLoad(tiles, pixel / TILE, 0).r);
    // Empty far from all edges; a software rasterizer runs the loops of discarded fragments
    // too.
    let reach = select(-1, search_radius, search_radius > 0 && mask_at(pixel) == 0u);
    // Nearest masked pixel.
    var nearest = 1e9;
    var found = 0u;
    for (var y = -reach; y <= reach; y += 1) {
        for (var x = -reach; x <= reach; x += 1) {
            let there = mask_at(pixel + vec2<i32>(x, y));
            let squared = f32(x * x + y * y);
            if there != 0u && squared < nearest {
                nearest = squared;
                found = there;
            }
        }
    }
    if found == 0u {
        discard;
    }
    // Distance from its edge.
    let distance = sqrt(nearest) - 0.5;
    let light_width = select(SELECTED_LIGHT, HOVERED_LIGHT, (found & KIND) == HOVERED) * scale;
    let light = edge_coverage(distance, light_width);
    var opacity = edge_coverage(distance, light_width + DARK * scale);
    if (found & HIDDEN) != 0u {
        let gap = fract((at.x + at.y) / (2.0 * DASH * scale)) > 0.5;
        opacity *= select(HIDDEN_OPACITY, 0.0, gap);
    }
    return vec4<f32>(mix(DARK_COLOR, LIGHT_COLOR, light), opacity);
}
