// Without a section plane: nothing is cut.

fn cut_away(pixel: vec4<f32>) {}

fn is_cut_face(front: bool) -> bool {
    return false;
}

fn hatching(pixel: vec4<f32>) -> vec3<f32> {
    return vec3<f32>(0.0);
}
