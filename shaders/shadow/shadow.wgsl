// Shadow map: depth from the sun.

struct Varyings {
    @builtin(position) clip: vec4<f32>,
    @location(0) uv: vec2<f32>,
}

@vertex
fn vertex_main(vertex: VertexInput) -> Varyings {
    return Varyings(clip_position(world_position(vertex)), texture_coordinate(vertex));
}

// Alpha-masked materials.
@fragment
fn fragment_main(in: Varyings) {
    if material_color(in.uv).a < material.alpha_cutoff {
        discard;
    }
    discard_clipped(in.clip);
}

@vertex
fn plain_vertex_main(vertex: VertexInput) -> @builtin(position) vec4<f32> {
    return clip_position(world_position(vertex));
}

// Opaque materials with a section plane.
@fragment
fn plain_fragment_main(@builtin(position) clip: vec4<f32>) {
    discard_clipped(clip);
}
