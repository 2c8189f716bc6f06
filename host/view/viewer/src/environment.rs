//! Environment of the equipment: ground plane, fog and shadow bounds by the size of the scene.

use busbar_config::{SectionConfig, ViewConfig};
use busbar_geometry::Bounds;
use busbar_renderer::{Ground, SectionPlane};
use busbar_ui::AxisSection;
use glam::{DVec3, Vec3};

/// Depth of the ground below the scene's lowest point, metres; it prevents z-fighting with feet.
const BELOW_METRES: f32 = 0.02;
/// Extent of the ground as a multiple of the scene's radius, and its least extent in metres.
const REACH: f32 = 6.0;
const MIN_REACH_METRES: f32 = 40.0;
/// Distance of half fog as a multiple of the scene's radius, and its least distance in metres.
const FOG: f32 = 9.0;
const MIN_FOG_METRES: f32 = 300.0;

/// Environment of a scene as configured; empty for an empty scene.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Environment {
    pub(crate) ground: Option<Ground>,
    /// Distance at which fog covers half, metres.
    pub(crate) fog_distance: Option<f32>,
    /// Bounds of shadow casters; used at high quality only.
    pub(crate) shadow_bounds: Option<Bounds>,
}

/// A plane as the renderer has it.
pub(crate) fn section_of(section: SectionConfig, origin: DVec3) -> SectionPlane {
    let normal = Vec3::from(section.normal);
    let distance = section.distance - normal.as_dvec3().dot(origin);
    SectionPlane { normal, distance: distance as f32 }
}

/// The plane of a cut that the panels ask for.
pub(crate) fn plane_of(cut: AxisSection) -> Option<SectionPlane> {
    let AxisSection { axis, at, from_below } = cut;
    let along = *Vec3::AXES.get(axis)?;
    let (normal, distance) = if from_below { (-along, -at) } else { (along, at) };
    Some(SectionPlane { normal, distance })
}

/// A plane as the panels show it; `None` for one that is aslant.
pub(crate) fn cut_of(plane: &SectionPlane) -> Option<AxisSection> {
    let SectionPlane { normal, distance } = *plane;
    let axis = Vec3::AXES.iter().position(|axis| normal == *axis || normal == -*axis)?;
    let from_below = normal[axis] < 0.0;
    Some(AxisSection { axis, at: if from_below { -distance } else { distance }, from_below })
}

impl Environment {
    /// A box around what the ground reaches to, in a scene with these bounds.
    pub(crate) fn with_ground(&self, scene: Option<Bounds>) -> Option<Bounds> {
        let (Some(ground), Some(bounds)) = (self.ground, scene) else { return scene };
        let aside = Vec3::new(ground.reach, 0.0, ground.reach);
        Some(Bounds { min: bounds.min - aside, max: bounds.max + aside })
    }

    pub(crate) fn new(view: &ViewConfig, bounds: Option<Bounds>) -> Self {
        let Some(bounds) = bounds else { return Self::default() };
        let radius = bounds.radius();
        let ground = Ground {
            height: bounds.min.y - BELOW_METRES,
            reach: (radius * REACH).max(MIN_REACH_METRES),
        };
        Self {
            ground: view.ground.then_some(ground),
            fog_distance: view.fog.then_some((radius * FOG).max(MIN_FOG_METRES)),
            shadow_bounds: Some(bounds),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_section_is_recovered_from_its_plane() {
        for axis in 0..3 {
            for from_below in [false, true] {
                let cut = AxisSection { axis, at: 2.5, from_below };
                let plane = plane_of(cut).unwrap();
                assert_eq!(cut_of(&plane), Some(cut));
                // A metre beyond it, where things are cut away.
                let beyond =
                    plane.normal.dot(Vec3::AXES[axis] * if from_below { 1.5 } else { 3.5 });
                assert!(beyond > plane.distance);
            }
        }
        assert_eq!(cut_of(&SectionPlane { normal: Vec3::ONE.normalize(), distance: 0.0 }), None);
    }

    #[test]
    fn the_environment_fits_the_scene_and_exists_only_if_configured() {
        let view = |text: &str| {
            let text = format!(r#"{{"version": 1, "scene": [], "graphics": {text}}}"#);
            busbar_config::parse(&text).unwrap().view
        };
        let bounds = |size: f32| Bounds { min: Vec3::Y * -3.0, max: Vec3::splat(size) };
        let both = view(r#"{"ground": true, "fog": true}"#);
        let [small, large] = [1.0, 1e4].map(|size| Environment::new(&both, Some(bounds(size))));
        let [near, far] = [small, large].map(|around| around.ground.unwrap());
        assert!(near.height < -3.0 && near.height > -3.1);
        assert!(near.reach == MIN_REACH_METRES && far.reach > 1e4);
        assert!(small.fog_distance.unwrap() < large.fog_distance.unwrap());
        assert_eq!(Environment::new(&both, None), Environment::default());
        let alone = Environment::new(&view("{}"), Some(bounds(1.0)));
        assert_eq!((alone.ground, alone.fog_distance), (None, None));
    }
}
