// Variant without shadows: all fragments are lit.

fn sunlight(pixel: vec4<f32>, normal: vec3<f32>) -> f32 {
    return 1.0;
}
