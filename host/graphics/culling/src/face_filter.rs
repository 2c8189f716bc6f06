//! Filter of occluding faces by the pixels that they may cover.

use std::f32::consts::PI;

use glam::{Vec2, Vec3, Vec4};

use crate::{BoundingSphere, CameraView};

/// Least share of a picture that an occluding face must cover.
const MIN_SCREEN_SHARE: f32 = 1.0 / 128.0;

/// Filter of the faces that cover enough of a picture to occlude anything.
pub struct FaceFilter {
    eye: Vec3,
    /// Pixels that a square unit covers a unit away.
    square: f32,
    /// Pixels that a face must cover.
    least: f32,
    /// Greatest squared distance, in squared radii, at which a disc as large as a sphere covers
    /// enough pixels.
    near: f32,
    /// Pixels from the middle of the picture to its edges.
    half: Vec2,
}

impl FaceFilter {
    /// Makes the filter of a camera, for a picture of a size in pixels.
    pub fn new(camera: &CameraView, size: [u32; 2]) -> Self {
        let [width, height] = size.map(|pixels| pixels as f32);
        let square = camera.pixels_per_unit(size[1]).powi(2);
        let least = width * height * MIN_SCREEN_SHARE;
        let near = (1.0 + (PI * square / least).sqrt()).powi(2);
        Self { eye: camera.eye, square, least, near, half: Vec2::new(width, height) * 0.5 }
    }

    /// Returns the position of the eye in world space, metres.
    pub fn eye(&self) -> Vec3 {
        self.eye
    }

    /// Reports whether so many pixels are enough.
    pub fn is_large(&self, pixels: f32) -> bool {
        pixels >= self.least
    }

    /// Reports whether any face within a sphere may be large enough to occlude.
    #[inline]
    pub fn is_near(&self, sphere: &BoundingSphere) -> bool {
        sphere.center.distance_squared(self.eye) <= self.near * sphere.radius * sphere.radius
    }

    /// Returns the least area of a face within a sphere that may cover enough pixels.
    #[inline]
    pub fn least_area(&self, sphere: &BoundingSphere) -> f32 {
        let distance = (sphere.center.distance(self.eye) - sphere.radius).max(0.0);
        self.least * distance * distance / self.square
    }

    /// Returns the pixels that a face covers by its corners in clip space, also beside the picture,
    /// and one over its least distance. Both are infinite where it reaches behind the eye.
    pub fn screen_size(&self, corners: &[Vec4]) -> (f32, f32) {
        let least = corners.iter().fold(f32::INFINITY, |least, corner| least.min(corner.w));
        if least <= 0.0 {
            return (f32::INFINITY, f32::INFINITY);
        }
        let place = |corner: &Vec4| Vec2::new(corner.x, corner.y) / corner.w * self.half;
        let mut last = corners.last().map(place).unwrap_or_default();
        let twice = corners
            .iter()
            .map(place)
            .fold(0.0, |twice, place| twice + std::mem::replace(&mut last, place).perp_dot(place));
        (0.5 * twice.abs(), least.recip())
    }
}

/// Reports whether a face, by its corners in clip space, is wholly outside the frustum.
pub fn is_outside_frustum(corners: &[Vec4]) -> bool {
    let all = |is_out: fn(&Vec4) -> bool| corners.iter().all(is_out);
    all(|corner| corner.x > corner.w)
        || all(|corner| corner.x < -corner.w)
        || all(|corner| corner.y > corner.w)
        || all(|corner| corner.y < -corner.w)
        || all(|corner| corner.z > corner.w)
}
