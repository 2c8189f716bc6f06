//! Motion of a model's part: rotation about a hinge, translation and scale.

use glam::{Mat4, Quat, Vec3};

/// A way from where a part is modelled to its other end: it turns about a hinge, shifts,
/// or folds. In the part's own space, metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Motion {
    /// Point of the hinge's axis, and the fixed point of folding.
    pub pivot: Vec3,
    /// Direction of the hinge's axis; of any length but 0.
    pub axis: Vec3,
    /// By how much it turns, right-handed about the axis.
    pub degrees: f32,
    /// By how much it shifts.
    pub travel: Vec3,
    /// By which factors it becomes smaller or larger, along x, y and z.
    pub scale: Vec3,
}

impl Motion {
    /// Returns the part's transform at a share of the way: 0 as modelled, 1 at the other end.
    pub fn transform_at(&self, share: f32) -> Mat4 {
        let axis = self.axis.normalize_or(Vec3::Y);
        let turn = Quat::from_axis_angle(axis, (self.degrees * share).to_radians());
        let scale = Vec3::ONE.lerp(self.scale, share);
        let about_pivot =
            Mat4::from_scale_rotation_translation(scale, turn, self.pivot + self.travel * share);
        about_pivot * Mat4::from_translation(-self.pivot)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const STILL: Motion = Motion {
        pivot: Vec3::ZERO,
        axis: Vec3::Y,
        degrees: 0.0,
        travel: Vec3::ZERO,
        scale: Vec3::ONE,
    };

    #[track_caller]
    fn check(motion: Motion, share: f32, from: Vec3, to: Vec3) {
        let there = motion.transform_at(share).transform_point3(from);
        assert!(there.distance(to) < 1e-5, "{there} is not {to}");
    }

    #[test]
    fn a_blade_turns_about_its_hinge() {
        let pivot = Vec3::new(1.0, 0.0, 0.0);
        let blade = Motion { pivot, axis: Vec3::Y * 3.0, degrees: 90.0, ..STILL };
        check(blade, 0.0, Vec3::new(2.0, 5.0, 0.0), Vec3::new(2.0, 5.0, 0.0));
        check(blade, 1.0, Vec3::new(2.0, 5.0, 0.0), Vec3::new(1.0, 5.0, -1.0));
        let half = 0.5_f32.sqrt();
        check(blade, 0.5, Vec3::new(2.0, 0.0, 0.0), Vec3::new(1.0 + half, 0.0, -half));
    }

    #[test]
    fn a_part_shifts_and_folds_by_shares() {
        let travel = Vec3::new(0.0, -2.0, 0.0);
        check(Motion { travel, ..STILL }, 0.25, Vec3::ONE, Vec3::new(1.0, 0.5, 1.0));
        let (pivot, scale) = (Vec3::Y, Vec3::new(1.0, 0.2, 1.5));
        let fold = Motion { pivot, scale, ..STILL };
        check(fold, 1.0, Vec3::new(1.0, 2.0, 2.0), Vec3::new(1.0, 1.2, 3.0));
        check(fold, 1.0, pivot, pivot);
    }
}
