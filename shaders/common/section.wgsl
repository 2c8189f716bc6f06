// With a section plane: what lies before it is left out, and insides that come to be
// seen are hatched, as sections are drawn (ISO 128-3).

// Pixels from line to line, and their width.
const HATCH_PERIOD = 9.0;
const HATCH_WIDTH = 1.6;
// Linear.
const CUT_FACE = vec3<f32>(0.085, 0.088, 0.094);
const CUT_LINE = vec3<f32>(0.022, 0.023, 0.026);

fn cut_away(pixel: vec4<f32>) {
    if dot(frame.section_plane, vec4<f32>(pixel.xyz, 1.0)) > 0.0 {
        discard;
    }
}

// Insides of what has an inside.
fn is_cut_face(front: bool) -> bool {
    return !front && material.emissive.w == 0.0;
}

// Flat, so that it is seen for what it is.
fn hatching(pixel: vec4<f32>) -> vec3<f32> {
    let across = (pixel.x + pixel.y) * 0.70710678;
    let from_line = abs(fract(across / HATCH_PERIOD) - 0.5) * HATCH_PERIOD;
    let line = clamp(0.5 * HATCH_WIDTH + 0.5 - from_line, 0.0, 1.0);
    return mix(CUT_FACE, CUT_LINE, line);
}
