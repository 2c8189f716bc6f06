// Screen-space-wide lines and filled faces in world space: charts placed in the scene.

// Antialiasing range beyond a line's edge, pixels.
const FEATHER = 0.5;
// Near clipping distance, as a share of the farther end's.
const NEAR_SHARE = 1e-4;
// Periods of dashes, points.
const DASH = 14.0;
const DOT = 7.0;

struct StrokeInput {
    // 0 at its beginning, 1 at its end; -1 on its right, 1 on its left.
    @location(0) corner: vec2<f32>,
    // World space; its width in points.
    @location(1) from_width: vec4<f32>,
    // World space; the number of its pattern.
    @location(2) to_pattern: vec4<f32>,
    // Colour in the target's encoding, and opacity.
    @location(3) color: vec4<f32>,
}

struct FaceInput {
    @location(0) corner: vec2<f32>,
    // Corners in order; with each a channel of the colour, and with the last the opacity.
    @location(1) a_red: vec4<f32>,
    @location(2) b_green: vec4<f32>,
    @location(3) c_blue: vec4<f32>,
    @location(4) d_cover: vec4<f32>,
}

struct StrokeVaryings {
    @builtin(position) clip: vec4<f32>,
    @location(0) @interpolate(flat) color: vec4<f32>,
    // Distance from the centre line, and along it from the beginning, pixels.
    @location(1) @interpolate(linear) place: vec2<f32>,
    // Half the width in pixels, and the pattern.
    @location(2) @interpolate(flat) look: vec2<f32>,
}

struct FaceVaryings {
    @builtin(position) clip: vec4<f32>,
    @location(0) @interpolate(flat) color: vec4<f32>,
}

// Clips the end of a segment to the near distance: points behind the eye have no projection.
fn clip_to_near(end: vec4<f32>, other: vec4<f32>) -> vec4<f32> {
    let near = max(abs(other.w), 1e-3) * NEAR_SHARE;
    if end.w >= near || other.w <= near {
        return end;
    }
    return mix(end, other, (near - end.w) / (other.w - end.w));
}

@vertex
fn stroke_vertex(in: StrokeInput) -> StrokeVaryings {
    let first = clip_position(in.from_width.xyz);
    let last = clip_position(in.to_pattern.xyz);
    let from_clip = clip_to_near(first, last);
    let to_clip = clip_to_near(last, first);
    let half_size = 0.5 * frame.sizes.zw;
    let from_pixel = from_clip.xy / from_clip.w * half_size;
    let to_pixel = to_clip.xy / to_clip.w * half_size;
    let way = to_pixel - from_pixel;
    let far = length(way);
    let along = select(vec2<f32>(1.0, 0.0), way / far, far > 1e-3);
    let half_width = max(0.5 * in.from_width.w * frame.sizes.y, 0.35);
    let reach = half_width + FEATHER + 0.5;
    let offset = vec2<f32>(-along.y, along.x) * in.corner.y * reach;
    var clip = mix(from_clip, to_clip, in.corner.x);
    clip = vec4<f32>(clip.xy + offset / half_size * clip.w, clip.zw);
    let place = vec2<f32>(in.corner.y * reach, in.corner.x * far);
    return StrokeVaryings(clip, in.color, place, vec2<f32>(half_width, in.to_pattern.w));
}

// Whether a dash pattern is drawn at a distance along the line, pixels.
fn is_marked(pattern: f32, along: f32) -> bool {
    let scale = frame.sizes.y;
    let dash = fract(along / (DASH * scale));
    if pattern == 1.0 {
        return dash < 0.64;
    }
    if pattern == 2.0 {
        return dash < 0.5 || (dash > 0.68 && dash < 0.82);
    }
    return pattern == 0.0 || fract(along / (DOT * scale)) < 0.45;
}

@fragment
fn stroke_fragment(in: StrokeVaryings) -> @location(0) vec4<f32> {
    let inside = clamp(in.look.x + FEATHER - abs(in.place.x), 0.0, 1.0);
    let shown = select(0.0, 1.0, is_marked(in.look.y, in.place.y));
    return vec4<f32>(in.color.rgb, in.color.a * inside * shown);
}

@vertex
fn face_vertex(in: FaceInput) -> FaceVaryings {
    let far = in.corner.x > 0.5;
    let left = in.corner.y > 0.0;
    let at_first = select(in.a_red.xyz, in.d_cover.xyz, left);
    let at_last = select(in.b_green.xyz, in.c_blue.xyz, left);
    let color = vec4<f32>(in.a_red.w, in.b_green.w, in.c_blue.w, in.d_cover.w);
    return FaceVaryings(clip_position(select(at_first, at_last, far)), color);
}

@fragment
fn face_fragment(in: FaceVaryings) -> @location(0) vec4<f32> {
    return in.color;
}
