// Screen-space ambient occlusion from the depth buffer. Computed at half resolution along
// each axis (`ambient_occlusion_main`), then filtered with depth-dependent weights and
// multiplied into the picture (`apply_main`). Spiral sampling: M. McGuire, M. Mara and
// D. Luebke, "Scalable Ambient Obscurance", HPG 2012.

// Radius of occlusion, metres.
const RADIUS = 0.9;
// Maximum radius, as a share of the picture's height; range of radii in pixels over which
// occlusion fades in.
const MAX_RADIUS_SHARE = 0.11;
const FADE_PIXELS = vec2<f32>(2.0, 10.0);
const SAMPLES = 12;
// Angle between consecutive samples: the golden angle, radians.
const SAMPLE_ANGLE = 2.39996323;
// Sine of elevation below which samples do not occlude, so that facets of tubes stay
// invisible.
const ELEVATION_BIAS = 0.16;
const STRENGTH = 3.0;
// Minimum visibility.
const MIN_VISIBILITY = 0.45;
// Difference of distances to the eye within one surface: metres, and a share.
const TOLERANCE_METRES = 0.12;
const TOLERANCE_SHARE = 0.012;
// Maximum stored distance, within the range of a half float.
const MAX_DISTANCE = 60000.0;
const TAU = 6.28318531;
// Bayer matrix: rotations of the spiral that differ much between neighbours (B. Bayer, 1973).
const ROTATION_ORDER = array<f32, 16>(
    0.0, 8.0, 2.0, 10.0, 12.0, 4.0, 14.0, 6.0, 3.0, 11.0, 1.0, 9.0, 15.0, 7.0, 13.0, 5.0,
);

@group(1) @binding(0) var scene_depth: texture_2d<f32>;
// Visibility of the sky, and distance to the eye's plane in metres.
@group(2) @binding(0) var sky_visibility: texture_2d<f32>;

// Reverse-Z depth of a pixel, the ground included; 0 for the background.
fn depth_at(pixel: vec2<i32>) -> f32 {
    let size = vec2<i32>(textureDimensions(scene_depth));
    let inside = clamp(pixel, vec2<i32>(0), size - 1);
    let depth = textureLoad(scene_depth, inside, 0).r;
    let plane = frame.ground_plane;
    let across = plane.x * (f32(inside.x) + 0.5) + plane.y * (f32(inside.y) + 0.5) + plane.w;
    let ground = select(0.0, -across / plane.z, plane.z != 0.0);
    return max(depth, select(0.0, ground, ground < 1.0));
}

// Camera-space position of a screen position; very far away for the background.
fn camera_position(at: vec2<f32>, depth: f32) -> vec3<f32> {
    let position = frame.camera_from_pixel * vec4<f32>(at, max(depth, 1e-9), 1.0);
    return position.xyz / position.w;
}

// Camera-space position of a pixel, clamped to the picture.
fn pixel_position(pixel: vec2<i32>) -> vec3<f32> {
    let size = vec2<i32>(textureDimensions(scene_depth));
    let inside = clamp(pixel, vec2<i32>(0), size - 1);
    return camera_position(vec2<f32>(inside) + 0.5, depth_at(inside));
}

// One-sided difference with the smaller change of depth, so that it stays on one surface.
fn surface_difference(here: vec3<f32>, before: vec3<f32>, after: vec3<f32>) -> vec3<f32> {
    let back = here - before;
    let on = after - here;
    return select(back, on, abs(on.z) < abs(back.z));
}

fn normal_at(pixel: vec2<i32>, here: vec3<f32>) -> vec3<f32> {
    let x = vec2<i32>(1, 0);
    let y = vec2<i32>(0, 1);
    let right = surface_difference(here, pixel_position(pixel - x), pixel_position(pixel + x));
    let down = surface_difference(here, pixel_position(pixel - y), pixel_position(pixel + y));
    let normal = cross(down, right);
    return normal * inverseSqrt(max(dot(normal, normal), 1e-30));
}

@fragment
fn ambient_occlusion_main(@builtin(position) at: vec4<f32>) -> @location(0) vec2<f32> {
    let pixel = vec2<i32>(at.xy) * 2;
    let depth = depth_at(pixel);
    let here = pixel_position(pixel);
    let neighbour = camera_position(vec2<f32>(pixel) + vec2<f32>(1.5, 0.5), depth);
    let metres_a_pixel = max(distance(here, neighbour), 1e-9);
    let height = f32(textureDimensions(scene_depth).y);
    let reach = min(RADIUS / metres_a_pixel, height * MAX_RADIUS_SHARE);
    let distance_to_eye = min(-here.z, MAX_DISTANCE);
    if depth <= 0.0 || reach < FADE_PIXELS.x {
        return vec2<f32>(1.0, distance_to_eye);
    }
    let radius = reach * metres_a_pixel;
    let normal = normal_at(pixel, here);
    let cell = vec2<i32>(at.xy) & vec2<i32>(3);
    let start = ROTATION_ORDER[cell.y * 4 + cell.x] * (TAU / 16.0);
    var occlusion = 0.0;
    for (var i = 0; i < SAMPLES; i += 1) {
        let out = (f32(i) + 0.5) / f32(SAMPLES) * reach;
        let angle = start + f32(i) * SAMPLE_ANGLE;
        let offset = vec2<f32>(cos(angle), sin(angle)) * max(out, 1.5);
        let direction = pixel_position(pixel + vec2<i32>(round(offset))) - here;
        let squared = max(dot(direction, direction), 1e-12);
        let elevation = dot(direction, normal) * inverseSqrt(squared);
        let falloff = max(1.0 - squared / (radius * radius), 0.0);
        occlusion += max(elevation - ELEVATION_BIAS, 0.0) * falloff;
    }
    let fade = smoothstep(FADE_PIXELS.x, FADE_PIXELS.y, reach);
    let visibility = 1.0 - STRENGTH * fade * occlusion / f32(SAMPLES);
    return vec2<f32>(max(visibility, MIN_VISIBILITY), distance_to_eye);
}

@fragment
fn apply_main(@builtin(position) at: vec4<f32>) -> @location(0) vec4<f32> {
    let pixel = vec2<i32>(at.xy);
    let depth = depth_at(pixel);
    if depth <= 0.0 {
        return vec4<f32>(1.0);
    }
    let distance_to_eye = -camera_position(at.xy, depth).z;
    let inverse_tolerance = 1.0 / (TOLERANCE_METRES + TOLERANCE_SHARE * distance_to_eye);
    let size = vec2<i32>(textureDimensions(sky_visibility));
    // The 4 x 4 cells around the pixel contain each rotation of the spiral once.
    let corner = (pixel - vec2<i32>(3)) / 2;
    var visibility = 0.0;
    var total = 0.0;
    for (var i = 0; i < 16; i += 1) {
        let cell = clamp(corner + vec2<i32>(i & 3, i >> 2u), vec2<i32>(0), size - 1);
        let cell_value = textureLoad(sky_visibility, cell, 0);
        let weight = max(1.0 - abs(cell_value.g - distance_to_eye) * inverse_tolerance, 0.0);
        visibility += cell_value.r * weight;
        total += weight;
    }
    let filtered = select(1.0, visibility / max(total, 1e-6), total > 0.5);
    // Fog takes the background's colour, which is not occluded.
    let clear = 1.0 / (1.0 + frame.fog.w * distance_to_eye * distance_to_eye);
    return vec4<f32>(vec3<f32>(mix(1.0, filtered, clear)), 1.0);
}
