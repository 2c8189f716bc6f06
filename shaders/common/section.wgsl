// Clipping by a section plane: fragments in front of it are discarded, and exposed back
// faces are hatched like cut faces in drawings (ISO 128-3).

// Spacing of hatching lines and their width, pixels.
const HATCH_PERIOD = 9.0;
const HATCH_WIDTH = 1.6;
// Linear rgb.
const CUT_FACE = vec3<f32>(0.085, 0.088, 0.094);
const CUT_LINE = vec3<f32>(0.022, 0.023, 0.026);

// Discards fragments in front of the section plane.
fn discard_clipped(pixel: vec4<f32>) {
    if dot(frame.section_plane, vec4<f32>(pixel.xyz, 1.0)) > 0.0 {
        discard;
    }
}

// Back faces of single-sided materials.
fn is_cut_face(front: bool) -> bool {
    return !front && material.emissive.w == 0.0;
}

// Unshaded hatching, so that cut faces are told from surfaces.
fn hatching(pixel: vec4<f32>) -> vec3<f32> {
    let across = (pixel.x + pixel.y) * 0.70710678;
    let from_line = abs(fract(across / HATCH_PERIOD) - 0.5) * HATCH_PERIOD;
    let line = clamp(0.5 * HATCH_WIDTH + 0.5 - from_line, 0.0, 1.0);
    return mix(CUT_FACE, CUT_LINE, line);
}
