// What of the sun reaches a place, by the shadow map.

@group(0) @binding(2) var shadow_map: texture_depth_2d;
@group(0) @binding(3) var shadow_sampler: sampler_comparison;

// What of the sun a shadow takes: what lies in it must stay readable.
const SHADOW_STRENGTH = 0.85;
// By how many texels a surface is moved so that it does not shade itself: along its
// normal, by the sine of its slant to the sun times the tent's reach; and to the sun.
const SLANT_TEXELS = 2.2;
const FACING_TEXELS = 0.5;

// Share of four texels around a place, in texels, that do not shade it.
fn unshaded(texels: vec2<f32>, depth: f32) -> f32 {
    return textureSampleCompareLevel(shadow_map, shadow_sampler, texels / frame.sizes.x, depth);
}

// 1 in the sun. A tent over 3 x 3 texels by four samples that interpolate
// (I. Castaño, "Shadow Mapping Summary", 2013). `pixel` is the fragment's position.
fn sunlight(pixel: vec4<f32>, normal: vec3<f32>) -> f32 {
    let place = frame.shadow_from_pixel * vec4<f32>(pixel.xyz, 1.0);
    let facing = dot(normal, SUN_DIRECTION);
    let slant = sqrt(max(1.0 - facing * facing, 0.0));
    let moved = SLANT_TEXELS * slant * normal + FACING_TEXELS * SUN_DIRECTION;
    let at = place.xyz / place.w + (frame.shadow_from_texels * vec4<f32>(moved, 0.0)).xyz;
    // What lies behind the map's last caster is shaded as the last caster is.
    let depth = clamp(at.z, 0.0, 1.0);
    let texels = at.xy * frame.sizes.x;
    let corner = floor(texels + 0.5);
    let part = texels + 0.5 - corner;
    let near = 3.0 - 2.0 * part;
    let far = 1.0 + 2.0 * part;
    let before = corner - 0.5 + (2.0 - part) / near - 1.0;
    let after = corner - 0.5 + part / far + 1.0;
    let lit = near.x * near.y * unshaded(before, depth)
        + far.x * near.y * unshaded(vec2<f32>(after.x, before.y), depth)
        + near.x * far.y * unshaded(vec2<f32>(before.x, after.y), depth)
        + far.x * far.y * unshaded(after, depth);
    return mix(1.0 - SHADOW_STRENGTH, 1.0, lit / 16.0);
}
