//! Camera: view matrix and reverse-Z projection, perspective or orthographic.

use glam::camera::rh::{proj::vulkan, view};
use glam::{Mat3, Mat4, Vec3, Vec4};

/// View and projection that a picture is taken with.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CameraView {
    /// World to camera space: x right, y up, looking along -z; metres.
    pub camera_from_world: Mat4,
    /// Camera to Vulkan clip space: y down, reverse-Z (near is 1, far is 0).
    pub projection: Mat4,
    /// Position of the eye in world space, metres.
    pub eye: Vec3,
}

/// Squared sine of the angle below which two directions count as parallel.
const PARALLEL: f32 = 1e-8;

impl CameraView {
    /// Builds a perspective view without far limit.
    ///
    /// `fov_y_radians` is the whole vertical angle, `aspect` width by height,
    /// `near` the distance of the near clipping plane in metres. An `up`
    /// along the line of sight, or a target at the eye, is replaced by some
    /// other direction.
    pub fn look_at(
        eye: Vec3,
        target: Vec3,
        up: Vec3,
        fov_y_radians: f32,
        aspect: f32,
        near: f32,
    ) -> Self {
        let forward = (target - eye).try_normalize().unwrap_or(Vec3::NEG_Z);
        let up = [up, Vec3::Y, Vec3::Z]
            .into_iter()
            .find(|up| forward.cross(up.normalize_or_zero()).length_squared() > PARALLEL)
            .unwrap_or(Vec3::X);
        Self {
            camera_from_world: view::look_to_mat4(eye, forward, up),
            projection: vulkan::perspective_infinite_reverse(fov_y_radians, aspect, near),
            eye,
        }
    }

    /// Builds an orthographic view: size does not depend on distance.
    ///
    /// It looks from `eye` at `target` with `up` upwards, which must not be along
    /// the line of sight; `height` is what it sees from the lower edge to the upper one,
    /// metres, and `reach` how far before and behind the target anything is seen.
    pub fn orthographic(
        eye: Vec3,
        target: Vec3,
        up: Vec3,
        height: f32,
        aspect: f32,
        reach: f32,
    ) -> Self {
        let forward = (target - eye).try_normalize().unwrap_or(Vec3::NEG_Z);
        let far = eye.distance(target) + reach;
        let depth = 1.0 / (2.0 * reach);
        let projection = Mat4::from_cols(
            Vec4::X * (2.0 / (height * aspect)),
            Vec4::Y * (-2.0 / height),
            Vec4::Z * depth,
            Vec4::new(0.0, 0.0, far * depth, 1.0),
        );
        Self { camera_from_world: view::look_to_mat4(eye, forward, up), projection, eye }
    }

    /// Reports whether the projection is orthographic, so that size does not depend on depth.
    pub fn is_orthographic(&self) -> bool {
        self.projection.row(3) == Vec4::W
    }

    /// Computes the rays of a picture of `size` pixels: through the upper left corner, and their
    /// change per pixel to the right and down. World space, of any length.
    pub fn pixel_rays(&self, [width, height]: [f32; 2]) -> [Vec3; 3] {
        let camera_from_clip = self.projection.inverse();
        // By its rotation alone: far from the origin positions are coarse.
        let world_from_camera = Mat3::from_mat4(self.camera_from_world).transpose();
        if self.is_orthographic() {
            return [world_from_camera * Vec3::NEG_Z, Vec3::ZERO, Vec3::ZERO];
        }
        let through = |x: f32, y: f32| {
            world_from_camera * camera_from_clip.project_point3(Vec3::new(x, y, 1.0))
        };
        let corner = through(-1.0, -1.0);
        let right = (through(1.0, -1.0) - corner) / width;
        [corner, right, (through(-1.0, 1.0) - corner) / height]
    }

    /// Returns the pixels that a metre covers at a metre's distance, or anywhere without
    /// perspective, in a picture of a height in pixels.
    pub fn pixels_per_unit(&self, height: u32) -> f32 {
        self.projection.y_axis.y.abs() * height as f32 * 0.5
    }

    /// Returns the transform from world to clip space.
    pub fn clip_from_world(&self) -> Mat4 {
        self.projection * self.camera_from_world
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec2;

    use super::*;

    fn project(camera: &CameraView, world: Vec3) -> Vec3 {
        let clip = camera.clip_from_world() * world.extend(1.0);
        clip.truncate() / clip.w
    }

    #[test]
    fn near_is_one_far_is_zero_and_up_is_up() {
        let camera = CameraView::look_at(Vec3::Z * 5.0, Vec3::ZERO, Vec3::Y, 1.0, 1.5, 0.1);
        assert!((project(&camera, Vec3::Z * 4.9).z - 1.0).abs() < 1e-4);
        assert!(project(&camera, Vec3::Z * -1e6).z < 1e-6);
        assert!(project(&camera, Vec3::Y).y < 0.0, "Vulkan's y points down");
        assert!(project(&camera, Vec3::X).x > 0.0);
    }

    #[test]
    fn rays_lead_to_what_their_pixels_show() {
        let size = [640.0, 360.0];
        let eye = Vec3::new(40.0, -7.0, 12.0);
        let camera = CameraView::look_at(eye, Vec3::ONE, Vec3::Y, 0.9, 16.0 / 9.0, 0.3);
        let [corner, right, down] = camera.pixel_rays(size);
        for world in [Vec3::ZERO, Vec3::new(3.0, 9.0, -4.0), Vec3::new(-20.0, 1.0, 2.0)] {
            let pixel = (project(&camera, world).truncate() + 1.0) * Vec2::new(320.0, 180.0);
            let ray = (corner + pixel.x * right + pixel.y * down).normalize();
            assert!(ray.distance((world - eye).normalize()) < 1e-4, "{ray} to {world}");
        }
    }

    #[test]
    fn without_perspective_size_does_not_depend_on_depth() {
        let (eye, target) = (Vec3::new(0.0, 10.0, 10.0), Vec3::ZERO);
        let up = Vec3::new(0.0, 1.0, -1.0);
        let camera = CameraView::orthographic(eye, target, up, 8.0, 2.0, 50.0);
        assert!(camera.is_orthographic());
        assert_eq!(
            camera.pixel_rays([640.0, 360.0])[1..],
            [Vec3::ZERO; 2],
            "all rays are parallel"
        );
        let back = (eye - target).normalize();
        for depth in [-40.0, 0.0, 40.0] {
            let at = project(&camera, back * depth + Vec3::X * 8.0);
            assert!((at.x - 1.0).abs() < 1e-5 && at.y.abs() < 1e-5, "{at}");
            assert!((at.z - (0.5 + depth / 100.0)).abs() < 1e-5, "near is 1: {at}");
        }
        assert!((project(&camera, up.normalize() * 4.0).y + 1.0).abs() < 1e-5);
    }

    #[test]
    fn looking_along_up_or_at_oneself_still_gives_a_view() {
        for (eye, target) in [(Vec3::Y * 3.0, Vec3::ZERO), (Vec3::ONE, Vec3::ONE)] {
            let camera = CameraView::look_at(eye, target, Vec3::Y, 1.0, 1.0, 0.1);
            assert!(camera.clip_from_world().is_finite());
        }
    }
}
