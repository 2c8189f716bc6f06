// What is outlined, for the pass that draws the outlines: 0 for nothing, else the kind,
// and HIDDEN beside it where something lies before it.

const HIDDEN = 4u;
// By how much something must lie nearer to hide: a share of the distance, and of what
// the depth changes by from pixel to pixel, since both are sampled at other places.
const NEARER_SHARE = 0.002;
const NEARER_SLOPE = 1.5;

@group(3) @binding(0) var scene_depth: texture_2d<f32>;

struct Varyings {
    @builtin(position) clip: vec4<f32>,
    @location(0) uv: vec2<f32>,
    @location(1) @interpolate(flat) kind: u32,
}

// The kind comes in place of the highlight.
@vertex
fn vertex_main(vertex: VertexInput, @builtin(vertex_index) index: u32) -> Varyings {
    return Varyings(placed(vertex).clip, texture_coordinate(vertex), u32(feature_highlight(vertex, index).r));
}

@fragment
fn fragment_main(in: Varyings) -> @location(0) u32 {
    let slope = fwidth(in.clip.z);
    if in.kind == 0u || material_color(in.uv).a < material.alpha_cutoff {
        discard;
    }
    cut_away(in.clip);
    let size = vec2<i32>(textureDimensions(scene_depth));
    let pixel = clamp(vec2<i32>(in.clip.xy), vec2<i32>(0), size - 1);
    let shown = textureLoad(scene_depth, pixel, 0).r;
    let is_hidden = shown > in.clip.z * (1.0 + NEARER_SHARE) + NEARER_SLOPE * slope;
    return in.kind | select(0u, HIDDEN, is_hidden);
}
