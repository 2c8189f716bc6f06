//! Policies that choose theta, the share of vertices collapsed.
//!
//! The paper draws far equipment from fewer vertices (section III) and leaves
//! open how far is far: a policy says it. Pure values and functions; whoever
//! steps frames keeps the level that each instance is at.

use std::sync::Arc;

use busbar_geometry::Bounds;
use busbar_scene::MeshInstance;
use glam::Vec3;

use crate::screen_error::ScreenError;

/// Policy that chooses an instance's theta. Every policy has levels, counted from 0 for the finest,
/// with a detail each.
#[derive(Clone, Debug, PartialEq)]
pub enum ThetaPolicy {
    /// One level: the same theta at every distance.
    Fixed(f64),
    /// Levels chosen by distance.
    Distance(DistanceTable),
    /// Levels chosen by screen-space error.
    ScreenError(ScreenError),
}

/// Distance and pixel size at which an instance is seen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ViewMetrics {
    /// From the eye to the instance's bounds, metres.
    pub distance: f32,
    /// Least size of a pixel at that distance, metres.
    pub meters_per_pixel: f32,
}

/// Target that a mesh is collapsed to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Detail {
    /// To this share of its vertices, 0 to 1.
    Theta(f64),
    /// Greatest error of the collapsed mesh, metres.
    Error(f64),
}

/// Levels by the distance from the eye to an instance's bounds.
#[derive(Clone, Debug, PartialEq)]
pub struct DistanceTable {
    levels: Vec<DistanceLevel>,
    /// Share of a distance at which the returning eye finds the finer level again.
    return_share: f32,
}

/// One level of detail.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DistanceLevel {
    /// Metres beyond which it holds.
    pub beyond: f32,
    /// Share of vertices collapsed, 0 to 1.
    pub theta: f64,
}

impl DistanceTable {
    /// Levels in ascending order of distance; the first holds from the eye on,
    /// wherever it begins. `hysteresis`, from 0 to below 1, is the share of a
    /// distance by which the eye must come back before the finer level returns.
    pub fn new(levels: Vec<DistanceLevel>, hysteresis: f32) -> Self {
        Self { levels, return_share: 1.0 - hysteresis }
    }

    /// Returns the level at a distance in metres, coming from `last`.
    fn level(&self, distance: f32, last: Option<u32>) -> u32 {
        let begun = |share: f32| {
            let count = self.levels.partition_point(|level| level.beyond * share < distance);
            count.saturating_sub(1) as u32
        };
        let leaving = begun(1.0);
        match last {
            Some(last) if last > leaving => last.min(begun(self.return_share)),
            _ => leaving,
        }
    }
}

impl ThetaPolicy {
    /// Reports whether the level depends on the eye's position.
    pub fn follows_camera(&self) -> bool {
        matches!(self, Self::Distance(_) | Self::ScreenError(_))
    }

    /// Returns the level of an instance that was last at level `last`; without `last` there is no
    /// hysteresis.
    pub fn level(&self, view: ViewMetrics, last: Option<u32>) -> u32 {
        match self {
            Self::Fixed(_) => 0,
            Self::Distance(table) => table.level(view.distance, last),
            Self::ScreenError(error) => error.level(view.meters_per_pixel, last),
        }
    }

    /// Returns the detail of a level; full detail at one that the policy does not have.
    pub fn detail(&self, level: u32) -> Detail {
        match self {
            Self::Fixed(theta) => Detail::Theta(*theta),
            Self::Distance(table) => {
                let level = table.levels.get(level as usize);
                Detail::Theta(level.map_or(0.0, |level| level.theta))
            }
            Self::ScreenError(_) => Detail::Error(ScreenError::error(level)),
        }
    }
}

/// Theta policies of all mesh instances of a scene.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct InstancePolicies {
    /// Policies of models, by model index; those of placements without their own.
    pub of_models: Vec<ThetaPolicy>,
    /// Policies of single placements, by policy index.
    pub of_placements: Arc<[ThetaPolicy]>,
}

impl InstancePolicies {
    /// Returns the policy of an instance.
    pub fn for_instance(&self, instance: &MeshInstance) -> &ThetaPolicy {
        match instance.theta {
            Some(theta) => &self.of_placements[theta.0 as usize],
            None => &self.of_models[instance.model.0 as usize],
        }
    }

    /// Returns the index of an instance's policy in [`InstancePolicies::to_vec`].
    pub(crate) fn index_for(&self, instance: &MeshInstance) -> u32 {
        let own = |theta: u32| self.of_models.len() as u32 + theta;
        instance.theta.map_or(instance.model.0, |theta| own(theta.0))
    }

    /// Returns the policies of models, then those of placements.
    pub(crate) fn to_vec(&self) -> Vec<ThetaPolicy> {
        self.of_models.iter().chain(self.of_placements.iter()).cloned().collect()
    }
}

/// Metres from a point to the nearest point of a box; 0 inside.
pub fn distance_to_bounds(point: Vec3, bounds: &Bounds) -> f32 {
    let outside = (bounds.min - point).max(point - bounds.max).max(Vec3::ZERO);
    outside.length()
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn policy(hysteresis: f32) -> ThetaPolicy {
        let levels = [(0.0, 0.0), (40.0, 0.5), (120.0, 0.85)];
        let levels = levels.map(|(beyond, theta)| DistanceLevel { beyond, theta });
        ThetaPolicy::Distance(DistanceTable::new(levels.to_vec(), hysteresis))
    }

    fn at(distance: f32) -> ViewMetrics {
        ViewMetrics { distance, meters_per_pixel: distance * 1e-3 }
    }

    /// Levels of an eye at these distances, one after the other.
    fn walk(policy: &ThetaPolicy, distances: &[f32]) -> Vec<u32> {
        let mut last = None;
        let step = |&distance: &f32| {
            last = Some(policy.level(at(distance), last));
            last.unwrap_or_default()
        };
        distances.iter().map(step).collect()
    }

    #[test]
    fn a_level_begins_beyond_its_distance() {
        let distances = [0.0, 39.9, 40.0, 40.1, 120.0, 120.1, 1e9, f32::INFINITY];
        let fresh = distances.map(|distance| policy(0.1).level(at(distance), None));
        assert_eq!(fresh, [0, 0, 0, 1, 1, 2, 2, 2]);
        assert_eq!(walk(&policy(0.1), &distances), fresh);
    }

    #[test]
    fn detail_returns_later_than_it_went() {
        let back = [130.0, 119.0, 108.1, 107.9, 39.0, 36.1, 36.0, 35.9];
        assert_eq!(walk(&policy(0.1), &back), [2, 2, 2, 1, 1, 1, 0, 0]);
        assert_eq!(walk(&policy(0.0), &back), [2, 1, 1, 1, 0, 0, 0, 0]);
        assert_eq!(walk(&policy(0.5), &[130.0, 30.0, 130.0, 0.0]), [2, 1, 2, 0], "leaps");
    }

    #[test]
    fn an_eye_that_trembles_at_a_limit_changes_level_once() {
        let trembling: Vec<f32> = (0..50).map(|i| if i % 2 == 0 { 39.8 } else { 40.2 }).collect();
        let levels = walk(&policy(0.05), &trembling);
        assert_eq!(levels[0], 0);
        assert!(levels[1..].iter().all(|&level| level == 1), "{levels:?}");
    }

    #[test]
    fn a_level_has_its_theta() {
        let thetas = [0, 1, 2, 3].map(|level| policy(0.1).detail(level));
        assert_eq!(thetas, [0.0, 0.5, 0.85, 0.0].map(Detail::Theta));
        let fixed = ThetaPolicy::Fixed(0.3);
        assert_eq!((fixed.level(at(1e6), None), fixed.detail(0)), (0, Detail::Theta(0.3)));
        assert!(policy(0.1).follows_camera() && !fixed.follows_camera());
    }

    #[test]
    fn distance_is_to_the_nearest_point() {
        let bounds = Bounds { min: Vec3::new(-1.0, 0.0, 2.0), max: Vec3::new(1.0, 3.0, 4.0) };
        let check = |point: [f32; 3], distance| {
            assert_eq!(distance_to_bounds(point.into(), &bounds), distance, "{point:?}");
        };
        check([0.0, 1.0, 3.0], 0.0);
        check([1.0, 3.0, 4.0], 0.0);
        check([0.0, -2.0, 3.0], 2.0);
        check([4.0, 1.0, 8.0], 5.0);
        check([-3.0, 5.0, 1.0], 3.0);
    }

    proptest! {
        /// The level lies between those of leaving and of returning, after any history, and does
        /// not change while the eye stands still.
        #[test]
        fn the_past_matters_only_within_the_hysteresis(
            distance in 0.0_f32..200.0, last in 0_u32..3, hysteresis in 0.0_f32..0.5,
        ) {
            let policy = policy(hysteresis);
            let level = policy.level(at(distance), Some(last));
            prop_assert!(level >= policy.level(at(distance), None));
            let returned = distance / (1.0 - hysteresis) + 1e-3;
            prop_assert!(level <= policy.level(at(returned), None));
            prop_assert_eq!(policy.level(at(distance), Some(level)), level);
        }
    }
}
