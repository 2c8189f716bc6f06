//! Frustum culling of bounding spheres.

use glam::{Mat4, Vec3, Vec4};

/// A ball around a mesh.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct BoundingSphere {
    /// Middle of the sphere.
    pub center: Vec3,
    /// Radius of the sphere, in the units of its space.
    pub radius: f32,
}

impl BoundingSphere {
    /// Returns a sphere around this one under a transform.
    #[inline]
    pub fn transformed(self, transform: &Mat4) -> Self {
        let [x, y, z] = [transform.x_axis, transform.y_axis, transform.z_axis].map(Vec4::truncate);
        // Of a matrix the Frobenius norm is at least what it stretches by.
        let squares = x * x + y * y + z * z;
        let stretch = (squares.x + squares.y + squares.z).sqrt();
        let center = transform.transform_point3(self.center);
        Self { center, radius: self.radius * stretch }
    }
}

/// The planes that bound the picture, pointing inwards; there is no far one.
#[derive(Clone, Copy, Debug)]
pub struct Frustum {
    /// Side planes, a row each, so that one product gives the distances to all.
    sides: Mat4,
    near: Vec4,
}

impl Frustum {
    /// Extracts the planes of a transform to Vulkan clip space with reverse-Z (G. Gribb and K.
    /// Hartmann, "Fast Extraction of Viewing Frustum Planes", 2001).
    pub fn from_matrix(clip_from_world: &Mat4) -> Self {
        let [x, y, z, w] = [0, 1, 2, 3].map(|row| clip_from_world.row(row));
        // Planes of unit length measure distances.
        let unit = |plane: Vec4| plane / plane.truncate().length().max(f32::MIN_POSITIVE);
        let [left, right, up, down, near] = [w + x, w - x, w + y, w - y, w - z].map(unit);
        Self { sides: Mat4::from_cols(left, right, up, down).transpose(), near }
    }

    /// Reports whether a sphere may be in the picture; one with NaN coordinates may be.
    #[inline]
    pub fn is_visible(&self, sphere: &BoundingSphere) -> bool {
        let center = sphere.center.extend(1.0);
        let is_outside = (self.sides * center).cmplt(Vec4::splat(-sphere.radius)).any();
        !(is_outside | (self.near.dot(center) < -sphere.radius))
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::CameraView;

    fn frustum() -> (CameraView, Frustum) {
        let eye = Vec3::new(3.0, 2.0, 10.0);
        let camera = CameraView::look_at(eye, Vec3::ZERO, Vec3::Y, 0.8, 1.6, 0.5);
        (camera, Frustum::from_matrix(&camera.clip_from_world()))
    }

    #[test]
    fn what_is_beside_behind_or_too_near_is_not_seen() {
        let (camera, frustum) = frustum();
        let sees = |center: Vec3, radius| frustum.is_visible(&BoundingSphere { center, radius });
        assert!(sees(Vec3::ZERO, 0.1));
        assert!(sees(-camera.eye * 1e5, 0.1), "however far");
        assert!(!sees(camera.eye * 2.0, 1.0), "behind the eye");
        assert!(sees(camera.eye * 2.0, 20.0), "around the eye");
        assert!(!sees(Vec3::new(0.0, 50.0, 0.0), 10.0));
        assert!(!sees(camera.eye * 0.99, 0.01), "before the near plane");
        assert!(sees(Vec3::splat(f32::NAN), 1.0));
    }

    proptest! {
        /// Every point with a place in the picture is visible.
        #[test]
        fn no_point_in_the_picture_is_missed(
            x in -1.0_f32..1.0, y in -1.0_f32..1.0, depth in 0.6_f32..1e4, radius in 0.0_f32..5.0,
            away in prop::array::uniform3(-1.0_f32..1.0),
        ) {
            let (camera, frustum) = frustum();
            let world_from_clip = camera.clip_from_world().inverse();
            let near = 0.5;
            let point = world_from_clip.project_point3(Vec3::new(x, y, near / depth));
            // A ball that holds the point.
            let center = point + Vec3::from(away).clamp_length_max(1.0) * radius;
            let radius = radius * 1.0001 + 1e-3 * depth;
            let sphere = BoundingSphere { center, radius };
            prop_assert!(frustum.is_visible(&sphere));
        }

        #[test]
        fn a_ball_holds_what_it_held_before_it_was_transformed(
            at in prop::array::uniform3(-1.0_f32..1.0),
            scale in prop::array::uniform3(-3.0_f32..3.0),
            angle in -3.0_f32..3.0,
        ) {
            let sphere = BoundingSphere { center: Vec3::new(1.0, -2.0, 0.5), radius: 2.0 };
            let transform = Mat4::from_rotation_y(angle)
                * Mat4::from_scale(scale.into())
                * Mat4::from_rotation_x(angle)
                * Mat4::from_translation(Vec3::splat(4.0));
            let point = sphere.center + Vec3::from(at).clamp_length_max(1.0) * sphere.radius;
            let around = sphere.transformed(&transform);
            let distance = transform.transform_point3(point).distance(around.center);
            prop_assert!(distance <= around.radius * 1.0001 + 1e-4);
        }
    }
}
