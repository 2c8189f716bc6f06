// Mask of outlined objects for the outline pass: 0 for none, else the kind, with the flag
// HIDDEN where the object is occluded.

const HIDDEN = 4u;
// Depth bias of the occlusion test: a share of the distance, and a factor of the depth slope
// between pixels, since both depths are sampled at different positions.
const DEPTH_BIAS = 0.002;
const SLOPE_BIAS = 1.5;

@group(3) @binding(0) var scene_depth: texture_2d<f32>;

struct Varyings {
    @builtin(position) clip: vec4<f32>,
    @location(0) uv: vec2<f32>,
    @location(1) @interpolate(flat) kind: u32,
}

// The kind is passed in the highlight.
@vertex
fn vertex_main(vertex: VertexInput, @builtin(vertex_index) index: u32) -> Varyings {
    return Varyings(widened_vertex(vertex).clip, texture_coordinate(vertex), u32(feature_highlight(vertex, index).r));
}

@fragment
fn fragment_main(in: Varyings) -> @location(0) u32 {
    let slope = fwidth(in.clip.z);
    if in.kind == 0u || material_color(in.uv).a < material.alpha_cutoff {
        discard;
    }
    discard_clipped(in.clip);
    let size = vec2<i32>(textureDimensions(scene_depth));
    let pixel = clamp(vec2<i32>(in.clip.xy), vec2<i32>(0), size - 1);
    let depth = textureLoad(scene_depth, pixel, 0).r;
    let is_hidden = depth > in.clip.z * (1.0 + DEPTH_BIAS) + SLOPE_BIAS * slope;
    return in.kind | select(0u, HIDDEN, is_hidden);
}
