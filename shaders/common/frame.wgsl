// Bindings shared by all mesh passes: the frame uniform and feature highlights (group 0),
// the features of a mesh (group 1) and a material (group 2); and the vertex functions.

struct FrameUniform {
    // Vulkan clip space, reverse-Z.
    clip_from_world: mat4x4<f32>,
    // View ray through the pixel (x, y), world space, not normalized:
    // ray_corner + x * ray_right + y * ray_down; w unused.
    ray_corner: vec4<f32>,
    ray_right: vec4<f32>,
    ray_down: vec4<f32>,
    // Linear rgb of the background; one over the squared distance at which fog hides half
    // of a surface.
    fog: vec4<f32>,
    // Ground point below the eye, metres; radius of the ground around it.
    ground: vec4<f32>,
    // Position of that point within its cell of ten metres; z and w unused.
    ground_phase: vec4<f32>,
    // Planes in screen space, as factors of (x, y, depth, 1): the ground, and the section
    // plane, whose product is positive in front of it. Zero where there is none.
    ground_plane: vec4<f32>,
    section_plane: vec4<f32>,
    // Screen space (x, y, depth, 1) to camera space, y up; divide by w.
    camera_from_pixel: mat4x4<f32>,
    // Screen space to the shadow map: 0 to 1 right and down, and its depth, reverse-Z.
    shadow_from_pixel: mat4x4<f32>,
    // World-space direction, in texels of the shadow map, to shadow map space.
    shadow_from_texels: mat4x4<f32>,
    // Texels along a side of the shadow map; physical pixels a point; the picture's
    // width and height, pixels.
    sizes: vec4<f32>,
}

struct MaterialUniform {
    // Linear rgb and alpha.
    base_color: vec4<f32>,
    // Linear rgb; w is 1 for double-sided materials.
    emissive: vec4<f32>,
    // sRGB rgb of base_color, darkened for metals at low quality; w unused.
    encoded_color: vec4<f32>,
    metallic: f32,
    roughness: f32,
    // Fragments with less alpha are discarded.
    alpha_cutoff: f32,
    // 1 where alpha counts (mask, blend), 0 where it is ignored.
    alpha_used: f32,
}

@group(0) @binding(0) var<uniform> frame: FrameUniform;
// Linear rgb and strength.
@group(0) @binding(1) var<storage, read> feature_highlights: array<vec4<f32>>;

// Feature of each vertex; read only where an instance has features.
@group(1) @binding(0) var<storage, read> features: array<u32>;

@group(2) @binding(0) var<uniform> material: MaterialUniform;
@group(2) @binding(1) var base_color_texture: texture_2d<f32>;
@group(2) @binding(2) var base_color_sampler: sampler;
@group(2) @binding(3) var metallic_roughness_texture: texture_2d<f32>;
@group(2) @binding(4) var metallic_roughness_sampler: sampler;

// A vertex with its per-instance attributes. Instance data are attributes because a storage
// buffer is read once per vertex, an attribute once per draw.
struct VertexInput {
    // Mesh space; w is u of the texture coordinate.
    @location(0) position_u: vec4<f32>,
    // Mesh space, of unit length; on slender parts of length SLENDER plus the radius in
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

// Object id of a vertex, for picking.
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

// Unit vector from a fragment to the eye, computed from its pixel: a varying would cost
// every vertex and every triangle.
fn view_direction(pixel: vec2<f32>) -> vec3<f32> {
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

// Half of the minimum width on the screen of conductors, wires and rods, pixels. Narrower
// ones would be rasterized with gaps, and shimmer.
const MIN_HALF_WIDTH = 0.5;
// Maximum factor of that widening: much narrower parts do not matter any more. It is reached
// by a conductor of 24 mm at 330 m, where 720 lines show 45 degrees.
const MAX_WIDENING = 16.0;
// Minimum coverage of a widened part: one of four samples.
const MIN_COVERAGE = 0.25;
// Length of a slender part's normal without its radius. Vertices whose normal is shorter
// than this by more than a half are not slender.
const SLENDER = 2.0;

// Clip position of a vertex with screen-space widening.
struct WidenedVertex {
    clip: vec4<f32>,
    // Share of its pixels that a slender part covers; 1 for other vertices.
    coverage: f32,
    // 0 for parts at most a pixel wide, whose normals would alias; 1 for parts at least twice
    // as wide, and for other vertices.
    roundness: f32,
}

// Shading normal, not normalized: blends from the view direction to the vertex's own normal
// by roundness.
fn shading_normal(vertex: VertexInput, widened: WidenedVertex) -> vec3<f32> {
    let own = world_normal(vertex);
    let middle = widened.clip.xy / widened.clip.w * 0.5 + 0.5;
    let eye = view_direction(middle * frame.sizes.zw);
    let unit = own * inverseSqrt(max(dot(own, own), 1e-30));
    return mix(eye, unit, widened.roundness);
}

// Coverage of a tinted fragment: tinted parts carry information, and cover their pixels fully.
fn tinted_coverage(coverage: f32, tint: vec4<f32>) -> f32 {
    return mix(coverage, 1.0, tint.a);
}

// Widens slender parts to the minimum width on the screen.
fn widened_vertex(vertex: VertexInput) -> WidenedVertex {
    let world = world_position(vertex);
    let clip = clip_position(world);
    let reach = length(vertex.normal_v.xyz);
    if reach < SLENDER - 0.5 {
        return WidenedVertex(clip, 1.0, 1.0);
    }
    // Scale from mesh to world space, away from the axis.
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
    // Clip space has a height of two.
    let pixel_radius = 2.0 * MIN_HALF_WIDTH * clip.w / (length(upward) * frame.sizes.w);
    let min_radius = min(pixel_radius, MAX_WIDENING * radius);
    let roundness = saturate(radius / max(pixel_radius, 1e-20) - 1.0);
    if radius >= min_radius {
        return WidenedVertex(clip, 1.0, roundness);
    }
    let widened = world + outward * ((min_radius - radius) / scale);
    return WidenedVertex(clip_position(widened), max(radius / min_radius, MIN_COVERAGE), roundness);
}

// Transforms a normal by the cofactor matrix, which exists for singular transforms too,
// unlike the inverse; mirroring transforms flip it back outwards.
fn world_normal(vertex: VertexInput) -> vec3<f32> {
    let x = vertex.world_x.xyz;
    let y = vertex.world_y.xyz;
    let z = vertex.world_z.xyz;
    let normal = vertex.normal_v.xyz;
    let transformed = vec3<f32>(
        dot(cross(y, z), normal),
        dot(cross(z, x), normal),
        dot(cross(x, y), normal),
    );
    return select(transformed, -transformed, vertex.ids.w == 1u);
}

fn material_color(uv: vec2<f32>) -> vec4<f32> {
    let color = material.base_color * textureSample(base_color_texture, base_color_sampler, uv);
    return vec4<f32>(color.rgb, mix(1.0, color.a, material.alpha_used));
}
