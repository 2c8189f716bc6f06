// Object id buffer for picking.

struct Varyings {
    @builtin(position) clip: vec4<f32>,
    @location(0) uv: vec2<f32>,
    @location(1) @interpolate(flat) object: u32,
}

@vertex
fn vertex_main(vertex: VertexInput, @builtin(vertex_index) index: u32) -> Varyings {
    var out: Varyings;
    out.clip = widened_vertex(vertex).clip;
    out.uv = texture_coordinate(vertex);
    out.object = object_of(vertex, index);
    return out;
}

@fragment
fn fragment_main(in: Varyings) -> @location(0) u32 {
    // Masked-out fragments are not pickable, as they are not visible.
    if material_color(in.uv).a < material.alpha_cutoff {
        discard;
    }
    discard_clipped(in.clip);
    return in.object;
}
