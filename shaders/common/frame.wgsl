// What every pass over the meshes reads: the frame with its instances, the
// features of a mesh, and a material. Bound as groups 0, 1 and 2.

struct FrameUniform {
    // Vulkan clip space, reverse-Z.
    clip_from_world: mat4x4<f32>,
    // From the eye through the pixel (x, y), world space, of any length:
    // ray_corner + x * ray_right + y * ray_down; w unused.
    ray_corner: vec4<f32>,
    ray_right: vec4<f32>,
    ray_down: vec4<f32>,
    // Linear rgb of the background; one over the squared distance at which half of
    // what is seen is background.
    fog: vec4<f32>,
    // The point of the ground below the eye, metres; how far it reaches from there.
    ground: vec4<f32>,
    // That point's place within its cell of ten metres; z and w unused.
    ground_phase: vec4<f32>,
    // Planes by what a pixel shows, (x, y, depth, 1): the ground, and the section, before
    // which the product is positive. Zero where there is none.
    ground_plane: vec4<f32>,
    section_plane: vec4<f32>,
    // From what a pixel shows to camera space, y up; divide by w.
    camera_from_pixel: mat4x4<f32>,
    // Likewise to the shadow map: 0 to 1 right and down, and its depth, reverse-Z.
    shadow_from_pixel: mat4x4<f32>,
    // A direction in the world, in texels of the map, likewise.
    shadow_from_texels: mat4x4<f32>,
    // Texels along a side of the shadow map; physical pixels a point; the picture's
    // width and height, pixels.
    sizes: vec4<f32>,
}

struct MaterialUniform {
    // Linear rgb and alpha.
    base_color: vec4<f32>,
    // Linear rgb; w is 1 where both sides are shown.
    emissive: vec4<f32>,
    // sRGB rgb of base_color, less what a metal loses at low quality; w unused.
    encoded_color: vec4<f32>,
    metallic: f32,
    roughness: f32,
    // Fragments with less alpha are left out.
    alpha_cutoff: f32,
    // 1 where alpha counts (mask, blend), 0 where it is ignored.
    alpha_used: f32,
}

@group(0) @binding(0) var<uniform> frame: FrameUniform;
// Linear rgb and strength.
@group(0) @binding(1) var<storage, read> feature_highlights: array<vec4<f32>>;

// A vertex's feature; read only where an instance has features.
@group(1) @binding(0) var<storage, read> features: array<u32>;

@group(2) @binding(0) var<uniform> material: MaterialUniform;
@group(2) @binding(1) var base_color_texture: texture_2d<f32>;
@group(2) @binding(2) var base_color_sampler: sampler;
@group(2) @binding(3) var metallic_roughness_texture: texture_2d<f32>;
@group(2) @binding(4) var metallic_roughness_sampler: sampler;

// A vertex, and the instance that it is drawn for. The instance's data come as
// attributes: a storage buffer is read once a vertex, an attribute once a draw.
struct VertexInput {
    // Mesh space; w is u of the texture coordinate.
    @location(0) position_u: vec4<f32>,
    // Mesh space, of unit length; of slender things longer than SLENDER by their radius,
    // metres; w is v of the texture coordinate.
    @location(1) normal_v: vec4<f32>,
    // The rows of world_from_mesh; the last one would be (0, 0, 0, 1).
    @location(2) world_x: vec4<f32>,
    @location(3) world_y: vec4<f32>,
    @location(4) world_z: vec4<f32>,
    // Linear rgb; strength, and twice the number of a pattern.
    @location(5) highlight: vec4<f32>,
    // Id for picking; id of feature 0, or 0 where the mesh is drawn as one
    // piece; index of feature 0's highlight, or NONE where no feature has one;
    // 1 where the transform mirrors.
    @location(6) ids: vec4<u32>,
}

const NONE = 0xffffffffu;

fn feature_of(vertex: VertexInput, index: u32) -> u32 {
    if vertex.ids.y == 0u {
        return NONE;
    }
    return features[index];
}

// Whose the vertex is, for picking.
fn object_of(vertex: VertexInput, index: u32) -> u32 {
    let feature = feature_of(vertex, index);
    if feature == NONE {
        return vertex.ids.x;
    }
    return vertex.ids.y + feature;
}

fn feature_highlight(vertex: VertexInput, index: u32) -> vec4<f32> {
    let feature = feature_of(vertex, index);
    if feature == NONE || vertex.ids.z == NONE {
        return vertex.highlight;
    }
    return feature_highlights[vertex.ids.z + feature];
}

// Of patterns: points from mark to mark, and the share of it that a mark takes. Between
// marks a body is paler, by a share of the tint's strength, so that marks are seen on any
// body, dark porcelain too, and without colour.
const PATTERN_PERIOD = 9.0;
const PATTERN_MARK = 0.42;
const PATTERN_BETWEEN = 0.42;
const BETWEEN_MARKS = vec3<f32>(0.9);

// What of a highlight is seen at a pixel: linear rgb and strength. A pattern lies on the
// screen, so that it is as legible far away as it is near.
fn tint_at(highlight: vec4<f32>, pixel: vec2<f32>) -> vec4<f32> {
    let pattern = floor(highlight.a * 0.5);
    let strength = highlight.a - 2.0 * pattern;
    if pattern == 0.0 {
        return vec4<f32>(highlight.rgb, strength);
    }
    let period = PATTERN_PERIOD * max(frame.sizes.y, 1.0);
    let along = vec2<f32>(pixel.x + pixel.y, pixel.x - pixel.y) * 0.70710678 / period;
    let phase = abs(fract(along) - 0.5) * 2.0;
    // Stripes; stripes both ways, thinner; dots where both ways have one.
    let marks = select(
        select(max(phase.x, phase.y) - 0.15, min(phase.x, phase.y) + 0.08, pattern == 3.0),
        phase.x,
        pattern == 1.0,
    );
    let edge = 1.5 / period;
    let mark = smoothstep(1.0 - PATTERN_MARK - edge, 1.0 - PATTERN_MARK + edge, marks);
    let rgb = mix(BETWEEN_MARKS, highlight.rgb, mark);
    return vec4<f32>(rgb, strength * mix(PATTERN_BETWEEN, 1.0, mark));
}

// Unit vector from what a fragment shows to the eye. A pixel knows it: a
// varying would cost every vertex and every triangle.
fn towards_eye(pixel: vec2<f32>) -> vec3<f32> {
    let ray = frame.ray_corner + pixel.x * frame.ray_right + pixel.y * frame.ray_down;
    return -normalize(ray.xyz);
}

fn texture_coordinate(vertex: VertexInput) -> vec2<f32> {
    return vec2<f32>(vertex.position_u.w, vertex.normal_v.w);
}

fn world_position(vertex: VertexInput) -> vec3<f32> {
    let position = vec4<f32>(vertex.position_u.xyz, 1.0);
    return vec3<f32>(
        dot(vertex.world_x, position),
        dot(vertex.world_y, position),
        dot(vertex.world_z, position),
    );
}

fn clip_position(world: vec3<f32>) -> vec4<f32> {
    return frame.clip_from_world * vec4<f32>(world, 1.0);
}

// Half of the least width on the screen of a conductor, a wire, a rod: pixels. What is
// narrower would be drawn in some pixels and left out in others, and shimmer.
const LEAST_HALF_WIDTH = 0.5;
// By how much it is widened for that: what is much narrower does not matter any more. As far as
// a conductor of 24 mm is 330 m away, where 720 lines show 45 degrees.
const MOST_WIDENED = 16.0;
// The least that it covers of them then: one of four samples.
const LEAST_COVERAGE = 0.25;
// Length of a slender thing's normal without its radius; of what is shorter than this,
// less the half, none.
const SLENDER = 2.0;

// Where a vertex is on the screen.
struct Placed {
    clip: vec4<f32>,
    // How much of the pixels that it is drawn in a slender thing covers: 1 of all others.
    coverage: f32,
    // How round that looks: 0 of what is at most a pixel wide, which shows all its sides in
    // one and would glitter; 1 of what is twice as wide, and of all others.
    roundness: f32,
}

// The normal that a slender thing is lit by, of any length: its own as far as it looks
// round, else one that faces the eye.
fn lit_normal(vertex: VertexInput, place: Placed) -> vec3<f32> {
    let own = world_normal(vertex);
    let middle = place.clip.xy / place.clip.w * 0.5 + 0.5;
    let eye = towards_eye(middle * frame.sizes.zw);
    let unit = own * inverseSqrt(max(dot(own, own), 1e-30));
    return mix(eye, unit, place.roundness);
}

// What is tinted says something, and covers all that it is drawn in.
fn covered(coverage: f32, tint: vec4<f32>) -> f32 {
    return mix(coverage, 1.0, tint.a);
}

fn placed(vertex: VertexInput) -> Placed {
    let world = world_position(vertex);
    let clip = clip_position(world);
    let reach = length(vertex.normal_v.xyz);
    if reach < SLENDER - 0.5 {
        return Placed(clip, 1.0, 1.0);
    }
    // Metres of the world that a metre of the mesh is, away from the axis.
    let normal = vertex.normal_v.xyz / reach;
    let outward = vec3<f32>(
        dot(vertex.world_x.xyz, normal),
        dot(vertex.world_y.xyz, normal),
        dot(vertex.world_z.xyz, normal),
    );
    let scale = max(length(outward), 1e-20);
    let radius = (reach - SLENDER) * scale;
    let upward = vec3<f32>(
        frame.clip_from_world[0].y,
        frame.clip_from_world[1].y,
        frame.clip_from_world[2].y,
    );
    // Clip space is two high.
    let wanted = 2.0 * LEAST_HALF_WIDTH * clip.w / (length(upward) * frame.sizes.w);
    let least = min(wanted, MOST_WIDENED * radius);
    let roundness = saturate(radius / max(wanted, 1e-20) - 1.0);
    if radius >= least {
        return Placed(clip, 1.0, roundness);
    }
    let widened = world + outward * ((least - radius) / scale);
    return Placed(clip_position(widened), max(radius / least, LEAST_COVERAGE), roundness);
}

// Cofactors turn normals under any transform, unlike the inverse, which a
// flattening scale has not; under a mirror they point inwards.
fn world_normal(vertex: VertexInput) -> vec3<f32> {
    let x = vertex.world_x.xyz;
    let y = vertex.world_y.xyz;
    let z = vertex.world_z.xyz;
    let normal = vertex.normal_v.xyz;
    let turned = vec3<f32>(
        dot(cross(y, z), normal),
        dot(cross(z, x), normal),
        dot(cross(x, y), normal),
    );
    return select(turned, -turned, vertex.ids.w == 1u);
}

fn material_color(uv: vec2<f32>) -> vec4<f32> {
    let color = material.base_color * textureSample(base_color_texture, base_color_sampler, uv);
    return vec4<f32>(color.rgb, mix(1.0, color.a, material.alpha_used));
}
