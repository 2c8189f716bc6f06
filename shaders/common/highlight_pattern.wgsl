// Highlight patterns: period in points, and the share of the period that a mark covers.
// Between marks a surface is paler, by a share of the tint's strength, so that marks are
// legible on any surface, dark porcelain too, and without colour.
const PATTERN_PERIOD = 9.0;
const PATTERN_MARK = 0.42;
const PATTERN_BETWEEN = 0.42;
const BETWEEN_MARKS = vec3<f32>(0.9);

// Tint of a highlight at a pixel: linear rgb and strength. Patterns are in screen space, so
// that they are equally legible at every distance.
fn tint_at(highlight: vec4<f32>, pixel: vec2<f32>) -> vec4<f32> {
    let pattern = floor(highlight.a * 0.5);
    let strength = highlight.a - 2.0 * pattern;
    if pattern == 0.0 {
        return vec4<f32>(highlight.rgb, strength);
    }
    let period = PATTERN_PERIOD * frame.sizes.y;
    let along = vec2<f32>(pixel.x + pixel.y, pixel.x - pixel.y) * 0.70710678 / period;
    let phase = abs(fract(along) - 0.5) * 2.0;
    // Stripes; stripes both ways, thinner; dots where both ways have one.
    let marks = select(
        select(max(phase.x, phase.y) - 0.15, min(phase.x, phase.y) + 0.08, pattern == 3.0),
        phase.x,
        pattern == 1.0,
    );
    let edge = 1.5 / period;
    let mark = smoothstep(1.0 - PATTERN_MARK - edge, 1.0 - PATTERN_MARK + edge, marks);
    let rgb = mix(BETWEEN_MARKS, highlight.rgb, mark);
    return vec4<f32>(rgb, strength * mix(PATTERN_BETWEEN, 1.0, mark));
}
