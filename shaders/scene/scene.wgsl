// The shaded picture: metallic-roughness materials (glTF 2.0, appendix B) under
// one sun, a hemisphere of sky and ground, and a weak fill from the viewer, so
// that shape stays readable from every side.

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
// Below this a highlight is smaller than a pixel and only flickers.
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

// For meshes of which some feature is highlighted.
@vertex
fn feature_vertex_main(
    vertex: VertexInput,
    @builtin(vertex_index) index: u32,
) -> Varyings {
    return varyings(vertex, feature_highlight(vertex, index));
}

// What plain materials need where nothing is highlighted.
struct PlainVaryings {
    @builtin(position) clip: vec4<f32>,
    @location(0) normal: vec3<f32>,
}

@vertex
fn plain_vertex_main(vertex: VertexInput) -> PlainVaryings {
    return PlainVaryings(clip_position(world_position(vertex)), world_normal(vertex));
}

// For meshes that hold slender things.
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
    let place = placed(vertex);
    let highlight = feature_highlight(vertex, index);
    let uv = texture_coordinate(vertex);
    return SlenderVaryings(place.clip, lit_normal(vertex, place), uv, highlight, place.coverage);
}

struct PlainSlenderVaryings {
    @builtin(position) clip: vec4<f32>,
    @location(0) normal: vec3<f32>,
    @location(1) coverage: f32,
}

@vertex
fn plain_slender_vertex_main(vertex: VertexInput) -> PlainSlenderVaryings {
    let place = placed(vertex);
    return PlainSlenderVaryings(place.clip, lit_normal(vertex, place), place.coverage);
}

// A mesh may hold a zero normal; then the face looks at the viewer.
fn unit_or(v: vec3<f32>, fallback: vec3<f32>) -> vec3<f32> {
    let squared = dot(v, v);
    return select(fallback, v * inverseSqrt(max(squared, 1e-30)), squared > 1e-30);
}

fn pow5(x: f32) -> f32 {
    let squared = x * x;
    return squared * squared * x;
}

// What a surface sees in a direction: sky over ground, blurred by roughness.
fn surroundings(direction: vec3<f32>, roughness: f32) -> vec3<f32> {
    let blur = mix(0.12, 1.0, roughness);
    return mix(GROUND_COLOR, SKY_COLOR, smoothstep(-blur, blur, direction.y));
}

// GGX distribution times Schlick-Smith visibility.
fn sun_lobe(roughness: f32, nl: f32, nv: f32, nh: f32) -> f32 {
    let alpha = roughness * roughness;
    let alpha_squared = alpha * alpha;
    let spread = nh * nh * (alpha_squared - 1.0) + 1.0;
    let k = alpha * 0.5;
    let visibility = 0.25 / ((nl * (1.0 - k) + k) * (nv * (1.0 - k) + k));
    return alpha_squared / (spread * spread) * visibility;
}

// Leaves radiance below the knee alone and bends what is brighter towards
// white, by the strongest channel so that hues hold.
fn tone_map(radiance: vec3<f32>) -> vec3<f32> {
    let peak = max(max(radiance.r, radiance.g), radiance.b);
    let room = 1.0 - TONE_KNEE;
    let bent = 1.0 - room * exp(-(peak - TONE_KNEE) / room);
    return radiance * select(1.0, bent / max(peak, 1e-6), peak > TONE_KNEE);
}

// What is left of a colour at a distance to the eye: far things fade into the
// background, but for what is tinted, which says something. The fragment's position
// tells one over the distance.
fn fogged(color: vec3<f32>, inverse_distance: f32, tint: f32) -> vec3<f32> {
    let thickness = frame.fog.w / max(inverse_distance * inverse_distance, 1e-20);
    return mix(color, frame.fog.rgb, (1.0 - tint) * thickness / (1.0 + thickness));
}

// Where light comes from, and what is lit.
struct Surface {
    // Unit vector to the eye.
    view: vec3<f32>,
    // Of any length.
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

    let sun = SUN_COLOR * (nl * sunlight(surface.pixel, normal)) * (diffuse + fresnel_sun * sun_lobe(roughness, nl, nv, nh));
    let ambient = diffuse * surroundings(normal, 1.0) * (1.0 + dot(normal, SKY_SLANT))
        + fresnel_view * surroundings(reflect(-view, normal), roughness);
    let fill = (diffuse + 0.5 * reflectance) * FILL_STRENGTH * nv;
    let lit = sun + ambient + fill + material.emissive.rgb;
    // Part of the tint shines by itself: it must be seen in the shade too.
    return tone_map(mix(lit, tint.rgb, 0.35 * tint.a));
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
    let color = shown(Varyings(in.clip, in.normal, in.uv, in.highlight), front);
    return vec4<f32>(color.rgb, covered(in.coverage, tint_at(in.highlight, in.clip.xy)));
}

fn shown(in: Varyings, front: bool) -> vec4<f32> {
    let color = material_color(in.uv);
    let metallic_roughness =
        textureSample(metallic_roughness_texture, metallic_roughness_sampler, in.uv);
    if color.a < material.alpha_cutoff {
        discard;
    }
    cut_away(in.clip);
    if is_cut_face(front) {
        return vec4<f32>(fogged(hatching(in.clip), in.clip.w, 0.0), 1.0);
    }
    let metallic = material.metallic * metallic_roughness.b;
    let roughness = material.roughness * metallic_roughness.g;
    let view = towards_eye(in.clip.xy);
    let tint = tint_at(in.highlight, in.clip.xy);
    let surface =
        Surface(view, in.normal, front, color.rgb, metallic, roughness, tint, in.clip);
    return vec4<f32>(fogged(shade(surface), in.clip.w, tint.a), color.a);
}

// For opaque materials without textures: nothing to sample, and, as nothing is
// discarded, depth is tested before anything is shaded.
@fragment
fn plain_fragment_main(
    in: PlainVaryings,
    @builtin(front_facing) front: bool,
) -> @location(0) vec4<f32> {
    return vec4<f32>(plainly_shown(in, front), 1.0);
}

// Alpha becomes coverage.
@fragment
fn plain_slender_fragment_main(
    in: PlainSlenderVaryings,
    @builtin(front_facing) front: bool,
) -> @location(0) vec4<f32> {
    return vec4<f32>(plainly_shown(PlainVaryings(in.clip, in.normal), front), in.coverage);
}

fn plainly_shown(in: PlainVaryings, front: bool) -> vec3<f32> {
    cut_away(in.clip);
    if is_cut_face(front) {
        return fogged(hatching(in.clip), in.clip.w, 0.0);
    }
    let surface = Surface(
        towards_eye(in.clip.xy),
        in.normal,
        front,
        material.base_color.rgb,
        material.metallic,
        material.roughness,
        vec4<f32>(0.0),
        in.clip,
    );
    return fogged(shade(surface), in.clip.w, 0.0);
}
