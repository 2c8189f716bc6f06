// User interface: triangles of egui. Its colours are sRGB bytes with premultiplied alpha and
// are multiplied and blended without decoding (epaint, `Color32`).

// Scale from points, from the upper left corner, to clip space; z and w unused.
@group(0) @binding(0) var<uniform> clip_per_point: vec4<f32>;
@group(1) @binding(0) var panel_texture: texture_2d<f32>;
@group(1) @binding(1) var panel_sampler: sampler;

struct PanelVaryings {
    @builtin(position) clip: vec4<f32>,
    @location(0) uv: vec2<f32>,
    @location(1) color: vec4<f32>,
}

@vertex
fn vertex_main(
    @location(0) position: vec2<f32>,
    @location(1) uv: vec2<f32>,
    @location(2) color: vec4<f32>,
) -> PanelVaryings {
    var out: PanelVaryings;
    out.clip = vec4<f32>(position * clip_per_point.xy - 1.0, 0.0, 1.0);
    out.uv = uv;
    out.color = color;
    return out;
}

@fragment
fn fragment_main(in: PanelVaryings) -> @location(0) vec4<f32> {
    return in.color * textureSample(panel_texture, panel_sampler, in.uv);
}
