//! Camera poses, the same for every renderer.

use busbar_geometry::Bounds;
use glam::Vec3;
use serde::{Deserialize, Serialize};

/// Full vertical field of view, degrees: the default of every renderer, or its setting.
pub(crate) const FOV_DEGREES: f32 = 45.0;
/// Aspect ratio of all pictures, width over height.
const ASPECT: f32 = 16.0 / 9.0;
/// Pitch of the orbit above the horizon, radians.
const ORBIT_PITCH: f32 = 0.35;
/// Height of an operator's eyes in a walk through the yard, metres.
const EYE_HEIGHT: f32 = 1.8;

/// Camera pose in metres, y up.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Camera {
    pub(crate) eye: [f32; 3],
    pub(crate) target: [f32; 3],
    /// Full vertical field of view, degrees.
    pub(crate) fov_degrees: f32,
}

impl Camera {
    fn look(eye: Vec3, target: Vec3) -> Self {
        Self { eye: eye.into(), target: target.into(), fov_degrees: FOV_DEGREES }
    }
}

/// Returns cameras once around the box, which fills the picture, times a factor of distance.
pub(crate) fn orbit(bounds: Bounds, poses: usize, farther: f32) -> Vec<Camera> {
    let center = bounds.center();
    let radius = (bounds.max - bounds.min).length() * 0.5;
    let tan = (FOV_DEGREES.to_radians() * 0.5).tan();
    // The ball around the box touches the picture's upper and lower edge, or its sides.
    let distance = radius / tan.min(tan * ASPECT).atan().sin() * farther;
    let pose = |number: usize| {
        let yaw = number as f32 / poses as f32 * std::f32::consts::TAU;
        let level = Vec3::new(yaw.sin(), 0.0, yaw.cos()) * ORBIT_PITCH.cos();
        let eye = center + (level + Vec3::Y * ORBIT_PITCH.sin()) * distance;
        Camera::look(eye, center)
    };
    (0..poses).map(pose).collect()
}

/// Returns cameras through the middle of the box, at an operator's height, looking ahead.
pub(crate) fn walk(bounds: Bounds, poses: usize) -> Vec<Camera> {
    let middle = bounds.center();
    let at = |share: f32| {
        let x = bounds.min.x + (bounds.max.x - bounds.min.x) * share;
        Vec3::new(x, bounds.min.y + EYE_HEIGHT, middle.z)
    };
    let pose = |number: usize| {
        let share = (number as f32 + 0.5) / poses as f32 * 0.8;
        Camera::look(at(share), at(share + 0.1) + Vec3::Y)
    };
    (0..poses).map(pose).collect()
}

/// Returns cameras from the middle of the box onwards, at an operator's height, `metres` apart.
pub(crate) fn stride(bounds: Bounds, poses: usize, metres: f32) -> Vec<Camera> {
    let middle = bounds.center();
    let pose = |number: usize| {
        let eye = Vec3::new(middle.x + number as f32 * metres, bounds.min.y + EYE_HEIGHT, middle.z);
        Camera::look(eye, eye + Vec3::new(10.0, 1.0, 0.0))
    };
    (0..poses).map(pose).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const BOX: Bounds =
        Bounds { min: Vec3::new(-40.0, 0.0, -20.0), max: Vec3::new(60.0, 20.0, 30.0) };

    #[test]
    fn the_box_is_in_every_picture_of_an_orbit() {
        for camera in orbit(BOX, 8, 1.0) {
            let [eye, target] = [camera.eye, camera.target].map(Vec3::from);
            let ahead = (target - eye).normalize();
            for corner in BOX.corners() {
                let offset = corner - eye;
                let angle = offset.normalize().dot(ahead).acos().to_degrees();
                assert!(angle <= FOV_DEGREES * 0.5 + 0.01, "{angle}");
            }
        }
        let [near, far] = [1.0, 4.0].map(|farther| Vec3::from(orbit(BOX, 1, farther)[0].eye));
        let center = BOX.center();
        assert!((far.distance(center) / near.distance(center) - 4.0).abs() < 1e-4);
    }

    #[test]
    fn a_walk_stays_inside() {
        for camera in walk(BOX, 6) {
            let eye = Vec3::from(camera.eye);
            assert!(eye.cmpge(BOX.min).all() && eye.cmple(BOX.max).all());
            assert!(camera.target[0] > camera.eye[0]);
        }
    }
}
