// Wireframe with hidden lines removed: a light fill that occludes, and dark lines drawn with
// a depth bias towards the eye.

const LINE_COLOR = vec3<f32>(0.05, 0.06, 0.08);
const FILL_COLOR = vec3<f32>(0.80, 0.82, 0.84);
// Depth bias of lines, as a share of the distance to the eye.
const LINE_DEPTH_BIAS = 0.0008;

struct Varyings {
    @builtin(position) clip: vec4<f32>,
    @location(0) @interpolate(flat) highlight: vec4<f32>,
    @location(1) normal: vec3<f32>,
}

fn varyings(vertex: VertexInput, index: u32) -> Varyings {
    var out: Varyings;
    out.clip = clip_position(world_position(vertex));
    out.highlight = feature_highlight(vertex, index);
    out.normal = world_normal(vertex);
    return out;
}

@vertex
fn fill_vertex(vertex: VertexInput, @builtin(vertex_index) index: u32) -> Varyings {
    return varyings(vertex, index);
}

@vertex
fn line_vertex(vertex: VertexInput, @builtin(vertex_index) index: u32) -> Varyings {
    var out = varyings(vertex, index);
    // Reverse-Z: nearer is larger.
    out.clip.z *= 1.0 + LINE_DEPTH_BIAS;
    return out;
}

@fragment
fn fill_fragment(in: Varyings) -> @location(0) vec4<f32> {
    discard_clipped(in.clip);
    let view = view_direction(in.clip.xy);
    let normal = in.normal * inverseSqrt(max(dot(in.normal, in.normal), 1e-30));
    let shade = mix(0.72, 1.0, abs(dot(normal, view)));
    let tint = tint_at(in.highlight, in.clip.xy);
    return vec4<f32>(mix(FILL_COLOR, tint.rgb, tint.a) * shade, 1.0);
}

@fragment
fn line_fragment(in: Varyings) -> @location(0) vec4<f32> {
    discard_clipped(in.clip);
    let tint = tint_at(in.highlight, in.clip.xy);
    return vec4<f32>(mix(LINE_COLOR, tint.rgb * 0.35, tint.a), 1.0);
}
