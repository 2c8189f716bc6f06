// Physically based shading: metallic-roughness materials (glTF 2.0, appendix B) under one
// sun, hemisphere lighting by sky and ground, and a weak fill light from the viewer, so that
// shape stays readable from every side.

// Linear radiance, with the division by pi taken in.
const SUN_COLOR = vec3<f32>(0.80, 0.785, 0.755);
const SKY_COLOR = vec3<f32>(0.40, 0.42, 0.45);
const GROUND_COLOR = vec3<f32>(0.15, 0.148, 0.145);
const FILL_STRENGTH = 0.16;
// By how much the sky is brighter towards each axis: tells apart two walls
// that stand in the same shade.
const SKY_SLANT = vec3<f32>(-0.20, 0.0, 0.16);
// Reflectance of dielectrics at normal incidence.
const DIELECTRIC_REFLECTANCE = 0.04;
// Minimum roughness: a sharper specular highlight is smaller than a pixel and flickers.
const MIN_ROUGHNESS = 0.12;
// Radiance above which the tone curve bends.
const TONE_KNEE = 0.72;

struct Varyings {
    @builtin(position) clip: vec4<f32>,
    @location(0) normal: vec3<f32>,
    @location(1) uv: vec2<f32>,
    @location(2) @interpolate(flat) highlight: vec4<f32>,
}

fn varyings(vertex: VertexInput, highlight: vec4<f32>) -> Varyings {
    let clip = clip_position(world_position(vertex));
    return Varyings(clip, world_normal(vertex), texture_coordinate(vertex), highlight);
}

@vertex
fn vertex_main(vertex: VertexInput) -> Varyings {
    return varyings(vertex, vertex.highlight);
}

// Meshes with highlighted features.
@vertex
fn feature_vertex_main(
    vertex: VertexInput,
    @builtin(vertex_index) index: u32,
) -> Varyings {
    return varyings(vertex, feature_highlight(vertex, index));
}

// Varyings of plain materials without highlights.
struct PlainVaryings {
    @builtin(position) clip: vec4<f32>,
    @location(0) normal: vec3<f32>,
}

@vertex
fn plain_vertex_main(vertex: VertexInput) -> PlainVaryings {
    return PlainVaryings(clip_position(world_position(vertex)), world_normal(vertex));
}

// Meshes with slender parts.
struct SlenderVaryings {
    @builtin(position) clip: vec4<f32>,
    @location(0) normal: vec3<f32>,
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
    let highlight = feature_highlight(vertex, index);
    let uv = texture_coordinate(vertex);
    return SlenderVaryings(
        widened.clip,
        shading_normal(vertex, widened),
        uv,
        highlight,
        widened.coverage,
    );
}

struct PlainSlenderVaryings {
    @builtin(position) clip: vec4<f32>,
    @location(0) normal: vec3<f32>,
    @location(1) coverage: f32,
}

@vertex
fn plain_slender_vertex_main(vertex: VertexInput) -> PlainSlenderVaryings {
    let widened = widened_vertex(vertex);
    return PlainSlenderVaryings(widened.clip, shading_normal(vertex, widened), widened.coverage);
}

// Normalizes a vector; zero normals become the fallback.
fn unit_or(v: vec3<f32>, fallback: vec3<f32>) -> vec3<f32> {
    let squared = dot(v, v);
    return select(fallback, v * inverseSqrt(max(squared, 1e-30)), squared > 1e-30);
}

fn pow5(x: f32) -> f32 {
    let squared = x * x;
    return squared * squared * x;
}

// Environment radiance in a direction: sky over ground, blurred by roughness.
fn environment(direction: vec3<f32>, roughness: f32) -> vec3<f32> {
    let blur = mix(0.12, 1.0, roughness);
    return mix(GROUND_COLOR, SKY_COLOR, smoothstep(-blur, blur, direction.y));
}

// Specular lobe: GGX distribution times Schlick-Smith visibility.
fn specular_lobe(roughness: f32, nl: f32, nv: f32, nh: f32) -> f32 {
    let alpha = roughness * roughness;
    let alpha_squared = alpha * alpha;
    let spread = nh * nh * (alpha_squared - 1.0) + 1.0;
    let k = alpha * 0.5;
    let visibility = 0.25 / ((nl * (1.0 - k) + k) * (nv * (1.0 - k) + k));
    return alpha_squared / (spread * spread) * visibility;
}

// Tone mapping: identity below the knee, exponential compression above it, by the maximum
// channel so that hues are preserved.
fn tone_map(radiance: vec3<f32>) -> vec3<f32> {
    let peak = max(max(radiance.r, radiance.g), radiance.b);
    let room = 1.0 - TONE_KNEE;
    let compressed = 1.0 - room * exp(-(peak - TONE_KNEE) / room);
    return radiance * select(1.0, compressed / max(peak, 1e-6), peak > TONE_KNEE);
}

// Blends a colour towards the background by distance to the eye; tinted fragments carry
// information and are exempt. The fragment's position holds one over the distance.
fn apply_fog(color: vec3<f32>, inverse_distance: f32, tint: f32) -> vec3<f32> {
    let thickness = frame.fog.w / max(inverse_distance * inverse_distance, 1e-20);
    return mix(color, frame.fog.rgb, (1.0 - tint) * thickness / (1.0 + thickness));
}

// Inputs of the shading model.
struct Surface {
    // Unit vector to the eye.
    view: vec3<f32>,
    // Not normalized.
    normal: vec3<f32>,
    front: bool,
    color: vec3<f32>,
    metallic: f32,
    roughness: f32,
    // Linear rgb and strength.
    tint: vec4<f32>,
    // The fragment's position.
    pixel: vec4<f32>,
}

fn shade(surface: Surface) -> vec3<f32> {
    let tint = surface.tint;
    let metallic = surface.metallic * (1.0 - tint.a);
    let roughness = max(surface.roughness, MIN_ROUGHNESS);
    let albedo = mix(surface.color, tint.rgb, tint.a);

    let view = surface.view;
    let outward = unit_or(surface.normal, view);
    let normal = select(-outward, outward, surface.front);
    let half_way = normalize(view + SUN_DIRECTION);
    let nl = max(dot(normal, SUN_DIRECTION), 0.0);
    let nv = max(dot(normal, view), 1e-3);
    let nh = max(dot(normal, half_way), 0.0);
    let vh = max(dot(view, half_way), 0.0);

    let reflectance = mix(vec3<f32>(DIELECTRIC_REFLECTANCE), albedo, metallic);
    let diffuse = albedo * (1.0 - metallic);
    let fresnel_sun = reflectance + (1.0 - reflectance) * pow5(1.0 - vh);
    let grazing = max(vec3<f32>(1.0 - roughness), reflectance) - reflectance;
    let fresnel_view = reflectance + grazing * pow5(1.0 - nv);

    let sun = SUN_COLOR * (nl * sunlight(surface.pixel, normal)) * (diffuse + fresnel_sun * specular_lobe(roughness, nl, nv, nh));
    let ambient = diffuse * environment(normal, 1.0) * (1.0 + dot(normal, SKY_SLANT))
        + fresnel_view * environment(reflect(-view, normal), roughness);
    let fill = (diffuse + 0.5 * reflectance) * FILL_STRENGTH * nv;
    let lit = sun + ambient + fill + material.emissive.rgb;
    // Part of the tint is emissive: it must be legible in the shade too.
    return tone_map(mix(lit, tint.rgb, 0.35 * tint.a));
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
    let color = surface_color(Varyings(in.clip, in.normal, in.uv, in.highlight), front);
    return vec4<f32>(color.rgb, tinted_coverage(in.coverage, tint_at(in.highlight, in.clip.xy)));
}

fn surface_color(in: Varyings, front: bool) -> vec4<f32> {
    let color = material_color(in.uv);
    let metallic_roughness =
        textureSample(metallic_roughness_texture, metallic_roughness_sampler, in.uv);
    if color.a < material.alpha_cutoff {
        discard;
    }
    discard_clipped(in.clip);
    if is_cut_face(front) {
        return vec4<f32>(apply_fog(hatching(in.clip), in.clip.w, 0.0), 1.0);
    }
    let metallic = material.metallic * metallic_roughness.b;
    let roughness = material.roughness * metallic_roughness.g;
    let view = view_direction(in.clip.xy);
    let tint = tint_at(in.highlight, in.clip.xy);
    let surface =
        Surface(view, in.normal, front, color.rgb, metallic, roughness, tint, in.clip);
    return vec4<f32>(apply_fog(shade(surface), in.clip.w, tint.a), color.a);
}

// Opaque materials without textures: no sampling, and, without discard, early depth tests.
@fragment
fn plain_fragment_main(
    in: PlainVaryings,
    @builtin(front_facing) front: bool,
) -> @location(0) vec4<f32> {
    return vec4<f32>(plain_surface_color(in, front), 1.0);
}

// Alpha to coverage.
@fragment
fn plain_slender_fragment_main(
    in: PlainSlenderVaryings,
    @builtin(front_facing) front: bool,
) -> @location(0) vec4<f32> {
    return vec4<f32>(plain_surface_color(PlainVaryings(in.clip, in.normal), front), in.coverage);
}

fn plain_surface_color(in: PlainVaryings, front: bool) -> vec3<f32> {
    discard_clipped(in.clip);
    if is_cut_face(front) {
        return apply_fog(hatching(in.clip), in.clip.w, 0.0);
    }
    let surface = Surface(
        view_direction(in.clip.xy),
        in.normal,
        front,
        material.base_color.rgb,
        material.metallic,
        material.roughness,
        vec4<f32>(0.0),
        in.clip,
    );
    return apply_fog(shade(surface), in.clip.w, 0.0);
}
