//! Frame uniform: matrices, planes and sizes that all shaders of a frame read.

use busbar_gpu::Viewport;
use busbar_shaders::FrameUniform;
use glam::{DMat4, DVec3, DVec4, Mat4};

use crate::sun_view::{MAP_TEXELS, SunView};
use crate::{Frame, ground};

/// Computes the uniform for a picture with a viewport. Without a sun everything is lit.
pub(crate) fn frame_uniform(
    frame: &Frame<'_>,
    viewport: Viewport,
    sun: Option<&SunView>,
) -> FrameUniform {
    let size = viewport.size.map(|pixels| pixels.max(1.0));
    let rays = frame.camera.pixel_rays(size);
    let [ray_corner, ray_right, ray_down] = rays.map(|ray| ray.extend(0.0).to_array());
    let [red, green, blue] = frame.background;
    let inverse_square = |distance: f32| (distance * distance).max(f32::MIN_POSITIVE).recip();
    let [ground, ground_phase] = ground::uniforms(frame.ground, frame.camera.eye);
    let clip_from_pixel = clip_from_pixel(viewport);
    let camera_from_pixel = frame.camera.projection.as_dmat4().inverse() * clip_from_pixel;
    let world_from_camera = frame.camera.camera_from_world.as_dmat4().inverse();
    let world_from_pixel = world_from_camera * camera_from_pixel;
    // A plane's factors go the other way: as a row.
    let by_pixel = |plane: DVec4| (world_from_pixel.transpose() * plane).as_vec4().to_array();
    let ground_below = frame.ground.filter(|ground| ground.height < frame.camera.eye.y);
    let level = |height: f32| DVec3::Y.extend(-f64::from(height));
    let everywhere = DMat4::from_cols(DVec4::ZERO, DVec4::ZERO, DVec4::ZERO, DVec4::ONE);
    let shadow_from_world = sun.map(|sun| sun.shadow_from_world());
    FrameUniform {
        clip_from_world: frame.camera.clip_from_world().to_cols_array_2d(),
        ray_corner,
        ray_right,
        ray_down,
        fog: [red, green, blue, frame.fog_distance.map_or(0.0, inverse_square)],
        ground,
        ground_phase,
        ground_plane: ground_below.map_or([0.0; 4], |ground| by_pixel(level(ground.height))),
        section_plane: frame.section.map_or([0.0; 4], |section| by_pixel(section.equation())),
        camera_from_pixel: camera_from_pixel.as_mat4().to_cols_array_2d(),
        shadow_from_pixel: shadow_from_world
            .map_or(everywhere, |shadow| shadow * world_from_pixel)
            .as_mat4()
            .to_cols_array_2d(),
        shadow_from_texels: sun
            .map_or(Mat4::ZERO, |sun| sun.shadow_from_texels())
            .to_cols_array_2d(),
        sizes: [MAP_TEXELS as f32, frame.scene_pixels_per_point(), size[0], size[1]],
    }
}

/// Returns the transform to clip space from (x, y, depth, 1), pixels from the picture's upper left
/// corner.
fn clip_from_pixel(viewport: Viewport) -> DMat4 {
    let [x, y] = [0, 1].map(|axis| {
        let scale = 2.0 / f64::from(viewport.size[axis]).max(1.0);
        (scale, -1.0 - f64::from(viewport.origin[axis]) * scale)
    });
    DMat4::from_cols(
        DVec4::new(x.0, 0.0, 0.0, 0.0),
        DVec4::new(0.0, y.0, 0.0, 0.0),
        DVec4::Z,
        DVec4::new(x.1, y.1, 0.0, 1.0),
    )
}

#[cfg(test)]
mod tests {
    use glam::{Vec3, Vec4};

    use super::*;
    use crate::{CameraView, Ground, SectionPlane};

    const VIEWPORT: Viewport = Viewport { origin: [-17.0, -5.0], size: [640.0, 360.0] };

    fn frame() -> Frame<'static> {
        let eye = Vec3::new(12.0, 7.0, 30.0);
        let camera = CameraView::look_at(eye, Vec3::ONE, Vec3::Y, 0.8, 16.0 / 9.0, 0.2);
        Frame {
            ground: Some(Ground { height: -1.5, reach: 100.0 }),
            section: Some(SectionPlane { normal: Vec3::X, distance: 2.0 }),
            ..Frame::new(camera, &[])
        }
    }

    /// Returns pixel coordinates and depth that a world point is seen at.
    fn pixel_of(world: Vec3) -> Vec4 {
        let clip = frame().camera.clip_from_world() * world.extend(1.0);
        let at = |axis: usize| {
            (clip[axis] / clip.w + 1.0) * 0.5 * VIEWPORT.size[axis] + VIEWPORT.origin[axis]
        };
        Vec4::new(at(0), at(1), clip.z / clip.w, 1.0)
    }

    #[test]
    fn planes_are_told_apart_by_what_pixels_show() {
        let uniform = frame_uniform(&frame(), VIEWPORT, None);
        let [section, ground] = [uniform.section_plane, uniform.ground_plane].map(Vec4::from);
        for (x, y) in [(-3.0, 0.0), (1.9, 4.0), (2.1, -1.0), (9.0, 3.0)] {
            let pixel = pixel_of(Vec3::new(x, y, -4.0));
            assert_eq!(section.dot(pixel) > 0.0, x > 2.0, "{x}");
            assert!(ground.dot(pixel) > 0.0, "above the ground");
        }
        // Where the ground is seen, its depth follows from the pixel.
        let seen = pixel_of(Vec3::new(3.0, -1.5, 2.0));
        let depth = -(ground.x * seen.x + ground.y * seen.y + ground.w) / ground.z;
        assert!((depth / seen.z - 1.0).abs() < 1e-4, "{depth} {}", seen.z);
    }

    #[test]
    fn a_pixel_leads_back_to_camera_space() {
        let uniform = frame_uniform(&frame(), VIEWPORT, None);
        let world = Vec3::new(-2.0, 3.0, 8.0);
        let there = Mat4::from_cols_array_2d(&uniform.camera_from_pixel) * pixel_of(world);
        let expected = frame().camera.camera_from_world.transform_point3(world);
        assert!((there.truncate() / there.w).distance(expected) < 1e-3);
    }
}
