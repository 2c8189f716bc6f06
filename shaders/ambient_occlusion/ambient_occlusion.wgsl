// How much of the sky is hidden by what stands near: a contact cue from the depth of
// the picture alone. Worked out at every other pixel along each axis (`ambient_occlusion_main`),
// then smoothed among what lies at the same distance and multiplied into the picture
// (`apply_main`). Sampling along a spiral: M. McGuire, M. Mara and D. Luebke, "Scalable
// Ambient Obscurance", HPG 2012.

// How far away things hide each other, metres.
const RADIUS = 0.9;
// The same at most, as a share of the picture's height; how many pixels it fades in over.
const MAX_SHARE = 0.11;
const FADE_PIXELS = vec2<f32>(2.0, 10.0);
const SAMPLES = 12;
// Of one sample to the next: the golden angle, radians.
const TURN = 2.39996323;
// Sines above the surface that hide nothing: faceted tubes are round.
const MIN_RISE = 0.16;
const STRENGTH = 3.0;
// What is left at least.
const DARKEST = 0.45;
// Distances to the eye that count as one surface: metres, and a share.
const SAME_METRES = 0.12;
const SAME_SHARE = 0.012;
// Nearest depth that a half float tells from nothing.
const FAR = 60000.0;
const TAU = 6.28318531;
// An order of 16 turns in which neighbours differ much (B. Bayer, 1973).
const ORDER = array<f32, 16>(
    0.0, 8.0, 2.0, 10.0, 12.0, 4.0, 14.0, 6.0, 3.0, 11.0, 1.0, 9.0, 15.0, 7.0, 13.0, 5.0,
);

@group(1) @binding(0) var scene_depth: texture_2d<f32>;
// Share of the sky that is seen, and distance to the eye's plane in metres.
@group(2) @binding(0) var seen_sky: texture_2d<f32>;

// Reverse-Z depth of what a pixel shows, the ground included; 0 for nothing.
fn depth_at(pixel: vec2<i32>) -> f32 {
    let size = vec2<i32>(textureDimensions(scene_depth));
    let inside = clamp(pixel, vec2<i32>(0), size - 1);
    let depth = textureLoad(scene_depth, inside, 0).r;
    let plane = frame.ground_plane;
    let across = plane.x * (f32(inside.x) + 0.5) + plane.y * (f32(inside.y) + 0.5) + plane.w;
    let ground = select(0.0, -across / plane.z, plane.z != 0.0);
    return max(depth, select(0.0, ground, ground < 1.0));
}

// Camera space; very far away where nothing is.
fn place_of(at: vec2<f32>, depth: f32) -> vec3<f32> {
    let place = frame.camera_from_pixel * vec4<f32>(at, max(depth, 1e-9), 1.0);
    return place.xyz / place.w;
}

// Beyond the picture, of its nearest pixel.
fn place_at(pixel: vec2<i32>) -> vec3<f32> {
    let size = vec2<i32>(textureDimensions(scene_depth));
    let inside = clamp(pixel, vec2<i32>(0), size - 1);
    return place_of(vec2<f32>(inside) + 0.5, depth_at(inside));
}

// Of two neighbours, the way to the one on the same surface.
fn along(here: vec3<f32>, before: vec3<f32>, after: vec3<f32>) -> vec3<f32> {
    let back = here - before;
    let on = after - here;
    return select(back, on, abs(on.z) < abs(back.z));
}

fn normal_at(pixel: vec2<i32>, here: vec3<f32>) -> vec3<f32> {
    let x = vec2<i32>(1, 0);
    let y = vec2<i32>(0, 1);
    let right = along(here, place_at(pixel - x), place_at(pixel + x));
    let down = along(here, place_at(pixel - y), place_at(pixel + y));
    let normal = cross(down, right);
    return normal * inverseSqrt(max(dot(normal, normal), 1e-30));
}

@fragment
fn ambient_occlusion_main(@builtin(position) at: vec4<f32>) -> @location(0) vec2<f32> {
    let pixel = vec2<i32>(at.xy) * 2;
    let depth = depth_at(pixel);
    let here = place_at(pixel);
    let beside = place_of(vec2<f32>(pixel) + vec2<f32>(1.5, 0.5), depth);
    let metres_a_pixel = max(distance(here, beside), 1e-9);
    let height = f32(textureDimensions(scene_depth).y);
    let reach = min(RADIUS / metres_a_pixel, height * MAX_SHARE);
    let far = min(-here.z, FAR);
    if depth <= 0.0 || reach < FADE_PIXELS.x {
        return vec2<f32>(1.0, far);
    }
    let radius = reach * metres_a_pixel;
    let normal = normal_at(pixel, here);
    let cell = vec2<i32>(at.xy) & vec2<i32>(3);
    let start = ORDER[cell.y * 4 + cell.x] * (TAU / 16.0);
    var hidden = 0.0;
    for (var i = 0; i < SAMPLES; i += 1) {
        let out = (f32(i) + 0.5) / f32(SAMPLES) * reach;
        let angle = start + f32(i) * TURN;
        let offset = vec2<f32>(cos(angle), sin(angle)) * max(out, 1.5);
        let way = place_at(pixel + vec2<i32>(round(offset))) - here;
        let squared = max(dot(way, way), 1e-12);
        let rise = dot(way, normal) * inverseSqrt(squared);
        let near = max(1.0 - squared / (radius * radius), 0.0);
        hidden += max(rise - MIN_RISE, 0.0) * near;
    }
    let fade = smoothstep(FADE_PIXELS.x, FADE_PIXELS.y, reach);
    let seen = 1.0 - STRENGTH * fade * hidden / f32(SAMPLES);
    return vec2<f32>(max(seen, DARKEST), far);
}

@fragment
fn apply_main(@builtin(position) at: vec4<f32>) -> @location(0) vec4<f32> {
    let pixel = vec2<i32>(at.xy);
    let depth = depth_at(pixel);
    if depth <= 0.0 {
        return vec4<f32>(1.0);
    }
    let far = -place_of(at.xy, depth).z;
    let same = 1.0 / (SAME_METRES + SAME_SHARE * far);
    let size = vec2<i32>(textureDimensions(seen_sky));
    // The 4 x 4 around the pixel: each start of the spiral once.
    let corner = (pixel - vec2<i32>(3)) / 2;
    var seen = 0.0;
    var total = 0.0;
    for (var i = 0; i < 16; i += 1) {
        let cell = clamp(corner + vec2<i32>(i & 3, i >> 2u), vec2<i32>(0), size - 1);
        let there = textureLoad(seen_sky, cell, 0);
        let weight = max(1.0 - abs(there.g - far) * same, 0.0);
        seen += there.r * weight;
        total += weight;
    }
    let smooth_seen = select(1.0, seen / max(total, 1e-6), total > 0.5);
    // What is fogged shows its background, which nothing hides.
    let clear = 1.0 / (1.0 + frame.fog.w * far * far);
    return vec4<f32>(vec3<f32>(mix(1.0, smooth_seen, clear)), 1.0);
}
