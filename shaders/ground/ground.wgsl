// Ground plane with an antialiased grid: a veil over the background with lines every metre
// and every ten metres (B. Golus, "The Best Darn Grid Shader (Yet)", 2023), faded out before
// the horizon.

// Grid dimensions, metres.
const FINE_CELL = 1.0;
const COARSE_CELL = 10.0;
const LINE_WIDTH = 0.03;
const COARSE_LINE_WIDTH = 0.08;
// Opacity of each over the background.
const VEIL = 0.07;
const FINE_LINE = 0.16;
const COARSE_LINE = 0.26;
// Share of the ground's radius at which it starts to fade.
const FADE_FROM = 0.25;
// Luminance of the background above which lines are dark.
const BRIGHT = 0.18;
const DARK_INK = vec3<f32>(0.03, 0.032, 0.036);
const LIGHT_INK = vec3<f32>(0.75, 0.77, 0.8);
// Opacity of shadows on the ground.
const SHADOW_OPACITY = 0.3;

struct Varyings {
    @builtin(position) clip: vec4<f32>,
    // Offset from the ground point below the eye, metres.
    @location(0) offset: vec2<f32>,
}

@vertex
fn vertex_main(vertex: VertexInput) -> Varyings {
    let offset = vertex.position_u.xz * frame.ground.w;
    let world = frame.ground.xyz + vec3<f32>(offset.x, 0.0, offset.y);
    return Varyings(clip_position(world), offset);
}

// Coverage of a pixel by grid lines. `metres` is the position, `spread` its change per pixel
// along each axis.
fn grid(metres: vec2<f32>, spread: vec2<f32>, cell: f32, width: f32) -> f32 {
    let line_share = vec2<f32>(width / cell);
    let change = spread / cell;
    // At least a pixel wide, and fainter by the factor of widening.
    let drawn_share = clamp(line_share, change, vec2<f32>(0.5));
    let soft = max(change * 1.5, vec2<f32>(1e-6));
    let from_line = 1.0 - abs(fract(metres / cell) * 2.0 - 1.0);
    var share = smoothstep(drawn_share + soft, drawn_share - soft, from_line) * clamp(line_share / drawn_share, vec2<f32>(0.0), vec2<f32>(1.0));
    // Cells smaller than a pixel take their mean coverage.
    share = mix(share, line_share, clamp(change * 2.0 - 1.0, vec2<f32>(0.0), vec2<f32>(1.0)));
    return mix(share.x, 1.0, share.y);
}

@fragment
fn fragment_main(in: Varyings) -> @location(0) vec4<f32> {
    let metres = in.offset + frame.ground_phase.xy;
    let right = dpdx(in.offset);
    let down = dpdy(in.offset);
    let spread = vec2<f32>(length(vec2<f32>(right.x, down.x)), length(vec2<f32>(right.y, down.y)));
    let fine = grid(metres, spread, FINE_CELL, LINE_WIDTH);
    let coarse = grid(metres, spread, COARSE_CELL, COARSE_LINE_WIDTH);
    let cover = max(VEIL, max(VEIL + FINE_LINE * fine, VEIL + COARSE_LINE * coarse));
    let away = length(in.offset) / frame.ground.w;
    let fade = 1.0 - smoothstep(FADE_FROM, 1.0, away);
    // The shadow is composited over the veil.
    let shadow = (1.0 - sunlight(in.clip, vec3<f32>(0.0, 1.0, 0.0))) * SHADOW_OPACITY * fade;
    let veil = cover * fade * (1.0 - shadow);
    let covered = veil + shadow;
    let luminance = dot(frame.fog.rgb, vec3<f32>(0.2126, 0.7152, 0.0722));
    let ink = select(LIGHT_INK, DARK_INK, luminance > BRIGHT);
    return vec4<f32>(ink * (veil / max(covered, 1e-6)), covered);
}
