// What every pass over the meshes reads: the frame with its instances, the
// features of a mesh, and a material. Bound as groups 0, 1 and 2.

struct FrameUniform {
    // Vulkan clip space, reverse-Z.
    clip_from_world: mat4x4<f32>,
    // World space, metres; w unused.
    eye: vec4<f32>,
}

struct Instance {
    world_from_mesh: mat4x4<f32>,
    // Linear rgb and strength.
    highlight: vec4<f32>,
    // Non-zero id for picking.
    object: u32,
    // -1 where the transform mirrors, else 1.
    handedness: f32,
    // Id of the mesh's feature 0, those of the others after it; 0 where the
    // mesh is drawn as one piece.
    first_feature_object: u32,
    // Index of the highlight of the mesh's feature 0.
    first_feature_highlight: u32,
}

struct MaterialUniform {
    // Linear rgb and alpha.
    base_color: vec4<f32>,
    // Linear rgb; w unused.
    emissive: vec4<f32>,
    metallic: f32,
    roughness: f32,
    // Fragments with less alpha are left out.
    alpha_cutoff: f32,
    // 1 where alpha counts (mask, blend), 0 where it is ignored.
    alpha_used: f32,
}

@group(0) @binding(0) var<uniform> frame: FrameUniform;
@group(0) @binding(1) var<storage, read> instances: array<Instance>;
// Linear rgb and strength.
@group(0) @binding(2) var<storage, read> feature_highlights: array<vec4<f32>>;

// A vertex's feature; read only where an instance has features.
@group(1) @binding(0) var<storage, read> features: array<u32>;

@group(2) @binding(0) var<uniform> material: MaterialUniform;
@group(2) @binding(1) var base_color_texture: texture_2d<f32>;
@group(2) @binding(2) var base_color_sampler: sampler;
@group(2) @binding(3) var metallic_roughness_texture: texture_2d<f32>;
@group(2) @binding(4) var metallic_roughness_sampler: sampler;

struct VertexInput {
    @location(0) position: vec3<f32>,
    @location(1) normal: vec3<f32>,
    @location(2) uv: vec2<f32>,
    @builtin(instance_index) instance: u32,
    @builtin(vertex_index) index: u32,
}

const NO_FEATURE = 0xffffffffu;

fn feature_of(vertex: VertexInput) -> u32 {
    if instances[vertex.instance].first_feature_object == 0u {
        return NO_FEATURE;
    }
    return features[vertex.index];
}

// Whose the vertex is, for picking.
fn object_of(vertex: VertexInput) -> u32 {
    let feature = feature_of(vertex);
    if feature == NO_FEATURE {
        return instances[vertex.instance].object;
    }
    return instances[vertex.instance].first_feature_object + feature;
}

fn highlight_of(vertex: VertexInput) -> vec4<f32> {
    let feature = feature_of(vertex);
    if feature == NO_FEATURE {
        return instances[vertex.instance].highlight;
    }
    return feature_highlights[instances[vertex.instance].first_feature_highlight + feature];
}

fn clip_position(vertex: VertexInput) -> vec4<f32> {
    let world = instances[vertex.instance].world_from_mesh * vec4<f32>(vertex.position, 1.0);
    return frame.clip_from_world * world;
}

// Cofactors turn normals under any transform, unlike the inverse, which a
// flattening scale has not; under a mirror they point inwards.
fn world_normal(instance: u32, normal: vec3<f32>) -> vec3<f32> {
    let m = instances[instance].world_from_mesh;
    let cofactors = mat3x3<f32>(
        cross(m[1].xyz, m[2].xyz),
        cross(m[2].xyz, m[0].xyz),
        cross(m[0].xyz, m[1].xyz),
    );
    return (cofactors * normal) * instances[instance].handedness;
}

fn material_color(uv: vec2<f32>) -> vec4<f32> {
    let color = material.base_color * textureSample(base_color_texture, base_color_sampler, uv);
    return vec4<f32>(color.rgb, mix(1.0, color.a, material.alpha_used));
}
