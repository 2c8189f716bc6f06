//! Animated transition from one camera to another.

use std::f32::consts::{PI, TAU};

use busbar_geometry::Bounds;

use super::collision_free_path::CameraPath;
use super::{Camera, ProjectionMode};

/// A camera that moves along a path and turns as it goes.
#[derive(Clone, Debug)]
pub(crate) struct Transition {
    from: Camera,
    to: Camera,
    path: CameraPath,
    seconds: f32,
    elapsed: f32,
}

impl Transition {
    /// `None` where there is no way, or nothing to do on it.
    pub(crate) fn between(
        from: Camera,
        to: Camera,
        seconds: f32,
        equipment: &[Bounds],
    ) -> Option<Self> {
        if seconds <= 0.0 || from == to {
            return None;
        }
        let path = CameraPath::between(from.eye(), to.eye(), equipment)?;
        Some(Self { from, to, path, seconds, elapsed: 0.0 })
    }

    /// Returns the destination of the transition.
    pub(crate) fn destination(&self) -> Camera {
        self.to
    }

    /// The camera so many seconds on, and whether it has arrived.
    pub(crate) fn step(&mut self, seconds: f32) -> (Camera, bool) {
        self.elapsed += seconds;
        let share = self.elapsed / self.seconds;
        if share >= 1.0 {
            return (self.to, true);
        }
        (self.at(ease(share)), false)
    }

    fn at(&self, share: f32) -> Camera {
        let (from, to) = (&self.from, &self.to);
        let between = |a: f32, b: f32| a + (b - a) * share;
        let mut camera = Camera {
            target: to.target,
            distance: from.distance * (to.distance / from.distance).powf(share),
            yaw: from.yaw + nearest_turn(to.yaw - from.yaw) * share,
            pitch: between(from.pitch, to.pitch),
            fov_y: between(from.fov_y, to.fov_y),
            // Perspective on the way, so that one sees where it goes.
            projection_mode: if from.projection_mode == to.projection_mode {
                to.projection_mode
            } else {
                ProjectionMode::Perspective
            },
        };
        camera.move_eye_to(self.path.at(share));
        camera
    }
}

/// Begins and ends at rest (smootherstep: K. Perlin, "Improving Noise", 2002).
fn ease(share: f32) -> f32 {
    share * share * share * (share * (share * 6.0 - 15.0) + 10.0)
}

/// The same turn by half a revolution at most.
fn nearest_turn(angle: f32) -> f32 {
    (angle + PI).rem_euclid(TAU) - PI
}

#[cfg(test)]
mod tests {
    use glam::{Vec3, vec3};

    use super::*;

    #[test]
    fn a_transition_has_the_given_ends_and_turns_the_shorter_way() {
        let mut from = Camera::framing(None);
        from.yaw = 3.0;
        let to = Camera::look_at(vec3(40.0, 9.0, -60.0), Vec3::X * 50.0, 0.9);
        let mut transition = Transition::between(from, to, 2.0, &[]).unwrap();
        let (start, _) = transition.step(0.0);
        assert!(start.eye().distance(from.eye()) < 1e-3 && start.yaw == from.yaw);
        let mut last = start;
        for _ in 0..39 {
            let (camera, arrived) = transition.step(0.05);
            assert!(!arrived && (camera.yaw - last.yaw).abs() < 0.2, "no jump");
            last = camera;
        }
        assert!(last.eye().distance(to.eye()) < 0.1);
        assert_eq!(transition.step(0.2), (to, true));
    }

    #[test]
    fn a_duration_of_zero_gives_no_transition() {
        let camera = Camera::framing(None);
        let other = camera.moved_to(Vec3::ONE, Vec3::ZERO);
        assert!(Transition::between(camera, other, 0.0, &[]).is_none());
    }
}
