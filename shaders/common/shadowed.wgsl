// Shadow mapping with percentage-closer filtering.

@group(0) @binding(2) var shadow_map: texture_depth_2d;
@group(0) @binding(3) var shadow_sampler: sampler_comparison;

// Share of sunlight that a full shadow removes: shadowed parts must stay readable.
const SHADOW_STRENGTH = 0.85;
// Shadow bias in texels, against self-shadowing: along the normal, scaled by the sine of its
// angle to the sun, for the reach of the filter; and towards the sun.
const NORMAL_BIAS_TEXELS = 2.2;
const SUN_BIAS_TEXELS = 0.5;

// Bilinear comparison: lit share of the four texels around a position, in texels.
fn lit_share(texels: vec2<f32>, depth: f32) -> f32 {
    return textureSampleCompareLevel(shadow_map, shadow_sampler, texels / frame.sizes.x, depth);
}

// Sunlight at a fragment, 1 where it is lit: tent filter over 3 x 3 texels by four bilinear
// samples (I. Castaño, "Shadow Mapping Summary", 2013). `pixel` is the fragment's position.
fn sunlight(pixel: vec4<f32>, normal: vec3<f32>) -> f32 {
    let place = frame.shadow_from_pixel * vec4<f32>(pixel.xyz, 1.0);
    let facing = dot(normal, SUN_DIRECTION);
    let slant = sqrt(max(1.0 - facing * facing, 0.0));
    let bias = NORMAL_BIAS_TEXELS * slant * normal + SUN_BIAS_TEXELS * SUN_DIRECTION;
    let at = place.xyz / place.w + (frame.shadow_from_texels * vec4<f32>(bias, 0.0)).xyz;
    // Fragments behind the farthest caster are clamped to its depth.
    let depth = clamp(at.z, 0.0, 1.0);
    let texels = at.xy * frame.sizes.x;
    let corner = floor(texels + 0.5);
    let part = texels + 0.5 - corner;
    let near = 3.0 - 2.0 * part;
    let far = 1.0 + 2.0 * part;
    let before = corner - 0.5 + (2.0 - part) / near - 1.0;
    let after = corner - 0.5 + part / far + 1.0;
    let lit = near.x * near.y * lit_share(before, depth)
        + far.x * near.y * lit_share(vec2<f32>(after.x, before.y), depth)
        + near.x * far.y * lit_share(vec2<f32>(before.x, after.y), depth)
        + far.x * far.y * lit_share(after, depth);
    return mix(1.0 - SHADOW_STRENGTH, 1.0, lit / 16.0);
}
