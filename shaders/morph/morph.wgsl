// Geomorph between two levels of detail: each vertex moves linearly to its representative at
// the coarser cursor. At weight 0 the mesh is the finer one; at 1 it looks like the coarser
// one, since triangles that are removed in between have no area.

struct MorphStep {
    vertices: u32,
    // Offset of the first written vertex, vertices.
    start: u32,
    weight: f32,
}

var<immediate> step: MorphStep;

// Two vectors per vertex, in the layout of VertexInput.
@group(0) @binding(0) var<storage, read> vertices: array<vec4<f32>>;
// Representative of each vertex at the coarser cursor.
@group(0) @binding(1) var<storage, read> representatives: array<u32>;
@group(1) @binding(0) var<storage, read_write> morphed: array<vec4<f32>>;

@compute @workgroup_size(64)
fn morph_main(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x >= step.vertices {
        return;
    }
    let here = 2u * id.x;
    let there = 2u * representatives[id.x];
    let at = 2u * (step.start + id.x);
    morphed[at] = mix(vertices[here], vertices[there], step.weight);
    morphed[at + 1u] = morphed_normal(vertices[here + 1u], vertices[there + 1u]);
}

// Interpolates a normal; normals of slender parts keep their length, which holds the radius.
fn morphed_normal(from_v: vec4<f32>, to_v: vec4<f32>) -> vec4<f32> {
    let normal = mix(from_v, to_v, step.weight);
    let lengths = vec2<f32>(length(from_v.xyz), length(to_v.xyz));
    let is_slender = min(lengths.x, lengths.y) > SLENDER - 0.5;
    let length_factor = mix(lengths.x, lengths.y, step.weight) / max(length(normal.xyz), 1e-6);
    return vec4<f32>(normal.xyz * select(1.0, length_factor, is_slender), normal.w);
}
