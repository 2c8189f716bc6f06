// A mesh on its way from one cursor to a coarser one: each vertex goes straight to the
// one that stands for it there. At weight 0 it is the finer mesh, at 1 it looks as the
// coarser one does: triangles that die in between have lost their area.

struct MorphStep {
    vertices: u32,
    // Where the first one is written, vertices.
    start: u32,
    weight: f32,
}

var<immediate> step: MorphStep;

// Two words a vertex, as VertexInput takes them.
@group(0) @binding(0) var<storage, read> vertices: array<vec4<f32>>;
// The vertex that stands for each one at the coarser cursor.
@group(0) @binding(1) var<storage, read> standing: array<u32>;
@group(1) @binding(0) var<storage, read_write> morphed: array<vec4<f32>>;

@compute @workgroup_size(64)
fn morph_main(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x >= step.vertices {
        return;
    }
    let here = 2u * id.x;
    let there = 2u * standing[id.x];
    let at = 2u * (step.start + id.x);
    morphed[at] = mix(vertices[here], vertices[there], step.weight);
    morphed[at + 1u] = turned(vertices[here + 1u], vertices[there + 1u]);
}

// A normal on its way; of what is slender it keeps the length, which says how thick it is.
fn turned(from_v: vec4<f32>, to_v: vec4<f32>) -> vec4<f32> {
    let normal = mix(from_v, to_v, step.weight);
    let lengths = vec2<f32>(length(from_v.xyz), length(to_v.xyz));
    let is_slender = min(lengths.x, lengths.y) > SLENDER - 0.5;
    let stretched = mix(lengths.x, lengths.y, step.weight) / max(length(normal.xyz), 1e-6);
    return vec4<f32>(normal.xyz * select(1.0, stretched, is_slender), normal.w);
}
