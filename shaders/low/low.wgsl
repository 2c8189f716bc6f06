// Low-quality shading for software rasterizers and remote desktops: per-vertex (Gouraud)
// lighting by one sun and a hemisphere. Colours are encoded in the shader, since a software
// rasterizer pays for sRGB encoding of every fragment.

// Linear radiance, with the division by pi taken in.
const SUN = 0.72;
const SKY = 0.46;
const GROUND = 0.21;
// By how much the sky is brighter towards each axis: tells apart two walls
// that stand in the same shade.
const SKY_SLANT = vec3<f32>(-0.20, 0.0, 0.16);
// Factor of a metal's base colour: it reflects more ground and shade than sky.
const METAL_FACTOR = 0.45;
// Emissive share of a tint: it must be legible in the shade too.
const TINT_EMISSION = 0.35;

// Bits of red and of green in a vertex colour.
const COLOR_BITS = 14u;
const COLOR_MASK = 0x3fffu;

// Encoded irradiance of a surface. A square root approximates the sRGB curve: it is
// multiplicative, and a power takes ten times as long.
fn light(normal: vec3<f32>) -> f32 {
    let lit = SUN * max(dot(normal, SUN_DIRECTION), 0.0);
    let sky = mix(GROUND, SKY, normal.y * 0.5 + 0.5) * (1.0 + dot(normal, SKY_SLANT));
    return sqrt(lit + sky);
}

// Normalizes a normal; zero normals become upward.
fn unit(v: vec3<f32>) -> vec3<f32> {
    let squared = dot(v, v);
    return select(vec3<f32>(0.0, 1.0, 0.0), v * inverseSqrt(max(squared, 1e-30)), squared > 1e-30);
}

// Single-sided opaque materials without textures or highlights.
struct PlainVaryings {
    @builtin(position) clip: vec4<f32>,
    @location(0) color: vec3<f32>,
}

@vertex
fn plain_vertex_main(vertex: VertexInput) -> PlainVaryings {
    let lit = material.encoded_color.rgb * light(unit(world_normal(vertex)));
    return PlainVaryings(clip_position(world_position(vertex)), lit);
}

// Variant with vertex colours, so that several materials share a draw.
@vertex
fn colored_vertex_main(vertex: VertexInput) -> PlainVaryings {
    let lit = vertex_color(vertex) * light(unit(world_normal(vertex)));
    return PlainVaryings(clip_position(world_position(vertex)), lit);
}

// Decodes a colour stored in place of the texture coordinate by `vertex_color` in Rust.
fn vertex_color(vertex: VertexInput) -> vec3<f32> {
    let red_green = bitcast<u32>(vertex.position_u.w);
    let parts = vec2<u32>(red_green >> COLOR_BITS, red_green) & vec2<u32>(COLOR_MASK);
    return vec3<f32>(vec2<f32>(parts) / f32(COLOR_MASK), vertex.normal_v.w);
}

@fragment
fn plain_fragment_main(
    in: PlainVaryings,
    @builtin(front_facing) front: bool,
) -> @location(0) vec4<f32> {
    discard_clipped(in.clip);
    if is_cut_face(front) {
        return vec4<f32>(encoded(hatching(in.clip)), 1.0);
    }
    return vec4<f32>(in.color, 1.0);
}

// Meshes with slender parts.
struct PlainSlenderVaryings {
    @builtin(position) clip: vec4<f32>,
    @location(0) color: vec3<f32>,
    @location(1) coverage: f32,
}

@vertex
fn plain_slender_vertex_main(vertex: VertexInput) -> PlainSlenderVaryings {
    let widened = widened_vertex(vertex);
    let lit = material.encoded_color.rgb * light(unit(shading_normal(vertex, widened)));
    return PlainSlenderVaryings(widened.clip, lit, widened.coverage);
}

// Alpha to coverage.
@fragment
fn plain_slender_fragment_main(
    in: PlainSlenderVaryings,
    @builtin(front_facing) front: bool,
) -> @location(0) vec4<f32> {
    discard_clipped(in.clip);
    let hatched = is_cut_face(front);
    return vec4<f32>(select(in.color, encoded(hatching(in.clip)), hatched), in.coverage);
}

struct Varyings {
    @builtin(position) clip: vec4<f32>,
    // Light on the front and on the back, encoded.
    @location(0) light: vec2<f32>,
    @location(1) uv: vec2<f32>,
    @location(2) @interpolate(flat) highlight: vec4<f32>,
}

fn varyings(vertex: VertexInput, highlight: vec4<f32>) -> Varyings {
    let clip = clip_position(world_position(vertex));
    let normal = unit(world_normal(vertex));
    let both = vec2<f32>(light(normal), light(-normal));
    return Varyings(clip, both, texture_coordinate(vertex), highlight);
}

@vertex
fn vertex_main(vertex: VertexInput) -> Varyings {
    return varyings(vertex, vertex.highlight);
}

// Meshes with highlighted features.
@vertex
fn feature_vertex_main(vertex: VertexInput, @builtin(vertex_index) index: u32) -> Varyings {
    return varyings(vertex, feature_highlight(vertex, index));
}

struct SlenderVaryings {
    @builtin(position) clip: vec4<f32>,
    @location(0) light: vec2<f32>,
    @location(1) uv: vec2<f32>,
    @location(2) @interpolate(flat) highlight: vec4<f32>,
    @location(3) coverage: f32,
}

@vertex
fn slender_vertex_main(
    vertex: VertexInput,
    @builtin(vertex_index) index: u32,
) -> SlenderVaryings {
    let widened = widened_vertex(vertex);
    let normal = unit(shading_normal(vertex, widened));
    let both = vec2<f32>(light(normal), light(-normal));
    let highlight = feature_highlight(vertex, index);
    return SlenderVaryings(
        widened.clip,
        both,
        texture_coordinate(vertex),
        highlight,
        widened.coverage,
    );
}

fn encoded(color: vec3<f32>) -> vec3<f32> {
    return sqrt(max(color, vec3<f32>(0.0)));
}

@fragment
fn fragment_main(in: Varyings, @builtin(front_facing) front: bool) -> @location(0) vec4<f32> {
    return surface_color(in, front);
}

// Alpha to coverage.
@fragment
fn slender_fragment_main(
    in: SlenderVaryings,
    @builtin(front_facing) front: bool,
) -> @location(0) vec4<f32> {
    let color = surface_color(Varyings(in.clip, in.light, in.uv, in.highlight), front);
    return vec4<f32>(color.rgb, tinted_coverage(in.coverage, tint_at(in.highlight, in.clip.xy)));
}

fn surface_color(in: Varyings, front: bool) -> vec4<f32> {
    let color = material_color(in.uv);
    if color.a < material.alpha_cutoff {
        discard;
    }
    discard_clipped(in.clip);
    if is_cut_face(front) {
        return vec4<f32>(encoded(hatching(in.clip)), 1.0);
    }
    let tint = tint_at(in.highlight, in.clip.xy);
    let light = select(in.light.y, in.light.x, front);
    let body = color.rgb * mix(1.0, METAL_FACTOR, material.metallic);
    let lit = encoded(mix(body, tint.rgb, tint.a)) * light + encoded(material.emissive.rgb);
    return vec4<f32>(mix(lit, encoded(tint.rgb), TINT_EMISSION * tint.a), color.a);
}
