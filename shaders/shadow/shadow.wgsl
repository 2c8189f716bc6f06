// What the sun sees: depth alone.

struct Varyings {
    @builtin(position) clip: vec4<f32>,
    @location(0) uv: vec2<f32>,
}

@vertex
fn vertex_main(vertex: VertexInput) -> Varyings {
    return Varyings(clip_position(world_position(vertex)), texture_coordinate(vertex));
}

// For what may have holes.
@fragment
fn fragment_main(in: Varyings) {
    if material_color(in.uv).a < material.alpha_cutoff {
        discard;
    }
    cut_away(in.clip);
}

@vertex
fn plain_vertex_main(vertex: VertexInput) -> @builtin(position) vec4<f32> {
    return clip_position(world_position(vertex));
}

// For what is opaque, but may be cut.
@fragment
fn plain_fragment_main(@builtin(position) clip: vec4<f32>) {
    cut_away(clip);
}
