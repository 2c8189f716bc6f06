// Variant without a section plane.

fn discard_clipped(pixel: vec4<f32>) {}

fn is_cut_face(front: bool) -> bool {
    return false;
}

fn hatching(pixel: vec4<f32>) -> vec3<f32> {
    return vec3<f32>(0.0);
}
