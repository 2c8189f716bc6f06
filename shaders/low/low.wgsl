// The cheap picture, for software rasterisers and remote desktops: one sun and a
// hemisphere, worked out at vertices. Colours are as the picture's bytes keep
// them, since a rasteriser in software encodes each fragment at a cost.

// Linear radiance, with the division by pi taken in.
const SUN = 0.72;
const SKY = 0.46;
const GROUND = 0.21;
// By how much the sky is brighter towards each axis: tells apart two walls
// that stand in the same shade.
const SKY_SLANT = vec3<f32>(-0.20, 0.0, 0.16);
// What a metal keeps of its colour: it mirrors more ground and shade than sky.
const METAL = 0.45;
// Of a tint, what shines by itself: it must be seen in the shade too.
const TINT_SHINE = 0.35;

// Of red and green in a vertex's colour.
const COLOR_BITS = 14u;
const COLOR_MASK = 0x3fffu;

// What reaches a surface, encoded. A square root stands in for the sRGB curve: that
// of a product is the product of its factors', and a power takes ten times as long.
fn light(normal: vec3<f32>) -> f32 {
    let lit = SUN * max(dot(normal, SUN_DIRECTION), 0.0);
    let sky = mix(GROUND, SKY, normal.y * 0.5 + 0.5) * (1.0 + dot(normal, SKY_SLANT));
    return sqrt(lit + sky);
}

// A mesh may hold a zero normal; then it looks up.
fn unit(v: vec3<f32>) -> vec3<f32> {
    let squared = dot(v, v);
    return select(vec3<f32>(0.0, 1.0, 0.0), v * inverseSqrt(max(squared, 1e-30)), squared > 1e-30);
}

// For opaque materials without textures, seen from their front alone, where
// nothing is highlighted.
struct PlainVaryings {
    @builtin(position) clip: vec4<f32>,
    @location(0) color: vec3<f32>,
}

@vertex
fn plain_vertex_main(vertex: VertexInput) -> PlainVaryings {
    let lit = material.encoded_color.rgb * light(unit(world_normal(vertex)));
    return PlainVaryings(clip_position(world_position(vertex)), lit);
}

// The same where vertices bring their material's colour, so that materials are drawn together.
@vertex
fn colored_vertex_main(vertex: VertexInput) -> PlainVaryings {
    let lit = vertex_color(vertex) * light(unit(world_normal(vertex)));
    return PlainVaryings(clip_position(world_position(vertex)), lit);
}

// In place of a texture coordinate: `vertex_color` of the Rust side.
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
    cut_away(in.clip);
    if is_cut_face(front) {
        return vec4<f32>(encoded(hatching(in.clip)), 1.0);
    }
    return vec4<f32>(in.color, 1.0);
}

// For meshes that hold slender things.
struct PlainSlenderVaryings {
    @builtin(position) clip: vec4<f32>,
    @location(0) color: vec3<f32>,
    @location(1) coverage: f32,
}

@vertex
fn plain_slender_vertex_main(vertex: VertexInput) -> PlainSlenderVaryings {
    let place = placed(vertex);
    let lit = material.encoded_color.rgb * light(unit(lit_normal(vertex, place)));
    return PlainSlenderVaryings(place.clip, lit, place.coverage);
}

// Alpha becomes coverage.
@fragment
fn plain_slender_fragment_main(
    in: PlainSlenderVaryings,
    @builtin(front_facing) front: bool,
) -> @location(0) vec4<f32> {
    cut_away(in.clip);
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

// For meshes of which some feature is highlighted.
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
    let place = placed(vertex);
    let normal = unit(lit_normal(vertex, place));
    let both = vec2<f32>(light(normal), light(-normal));
    let highlight = feature_highlight(vertex, index);
    return SlenderVaryings(place.clip, both, texture_coordinate(vertex), highlight, place.coverage);
}

fn encoded(color: vec3<f32>) -> vec3<f32> {
    return sqrt(max(color, vec3<f32>(0.0)));
}

@fragment
fn fragment_main(in: Varyings, @builtin(front_facing) front: bool) -> @location(0) vec4<f32> {
    return shown(in, front);
}

// Alpha becomes coverage.
@fragment
fn slender_fragment_main(
    in: SlenderVaryings,
    @builtin(front_facing) front: bool,
) -> @location(0) vec4<f32> {
    let color = shown(Varyings(in.clip, in.light, in.uv, in.highlight), front);
    return vec4<f32>(color.rgb, covered(in.coverage, tint_at(in.highlight, in.clip.xy)));
}

fn shown(in: Varyings, front: bool) -> vec4<f32> {
    let color = material_color(in.uv);
    if color.a < material.alpha_cutoff {
        discard;
    }
    cut_away(in.clip);
    if is_cut_face(front) {
        return vec4<f32>(encoded(hatching(in.clip)), 1.0);
    }
    let tint = tint_at(in.highlight, in.clip.xy);
    let light = select(in.light.y, in.light.x, front);
    let body = color.rgb * mix(1.0, METAL, material.metallic);
    let lit = encoded(mix(body, tint.rgb, tint.a)) * light + encoded(material.emissive.rgb);
    return vec4<f32>(mix(lit, encoded(tint.rgb), TINT_SHINE * tint.a), color.a);
}
