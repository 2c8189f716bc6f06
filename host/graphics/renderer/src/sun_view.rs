//! Orthographic view of the scene from the sun, snapped to the texels of the shadow map.

use busbar_geometry::Bounds;
use busbar_shaders::SUN_DIRECTION;
use glam::camera::rh::view;
use glam::{DMat4, DVec3, Mat4, Vec3};

use crate::CameraView;

/// Texels along a side of the map: 16 MiB of depth.
pub(crate) const MAP_TEXELS: u32 = 2048;

/// Texels at each edge that are kept empty, so that surfaces beyond are lit.
const MARGIN: f64 = 3.0;

/// Sides that bounds have at least, metres: flat things have shadows, too.
const MIN_SIDE_METRES: f64 = 0.01;

/// Orthographic view of the scene from the sun.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct SunView {
    pub(crate) camera: CameraView,
    /// The longer side of a texel, metres.
    texel: f64,
}

impl SunView {
    /// Fits the map to bounds. Its texels lie on a grid that the world keeps, so that
    /// shadows stand still where bounds move.
    pub(crate) fn fit(bounds: Bounds) -> Self {
        let toward_sun = Vec3::from(SUN_DIRECTION);
        let sun_from_world = view::look_to_mat4(Vec3::ZERO, -toward_sun, Vec3::Y);
        let turn = sun_from_world.as_dmat4();
        let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        for corner in corners(bounds) {
            let seen = turn.transform_point3(corner);
            (low, high) = (low.min(seen), high.max(seen));
        }
        let sides = (high - low).max(DVec3::splat(MIN_SIDE_METRES));
        let texels = f64::from(MAP_TEXELS);
        // One more: what is snapped moves by up to a texel.
        let texel = sides / (texels - 2.0 * MARGIN - 1.0);
        let start = (low / texel).floor() * texel - MARGIN * texel;
        let whole = texel * texels;
        // Clip space: y down, the nearest to the sun at depth 1.
        let scale = DVec3::new(2.0 / whole.x, -2.0 / whole.y, 1.0 / sides.z);
        let shift = DVec3::new(-1.0, 1.0, 0.0) - scale * DVec3::new(start.x, start.y, low.z);
        let projection = DMat4::from_translation(shift) * DMat4::from_scale(scale);
        let camera = CameraView {
            camera_from_world: sun_from_world,
            projection: projection.as_mat4(),
            eye: bounds.center() + toward_sun * bounds.radius(),
        };
        Self { camera, texel: texel.x.max(texel.y) }
    }

    /// Returns the transform from world space to the map: 0 to 1 right and down, and its depth.
    pub(crate) fn shadow_from_world(&self) -> DMat4 {
        let shadow_from_clip = DMat4::from_translation(DVec3::new(0.5, 0.5, 0.0))
            * DMat4::from_scale(DVec3::new(0.5, 0.5, 1.0));
        let CameraView { projection, camera_from_world, .. } = self.camera;
        shadow_from_clip * projection.as_dmat4() * camera_from_world.as_dmat4()
    }

    /// Returns the transform from world directions in texels to distances on the map.
    pub(crate) fn shadow_from_texels(&self) -> Mat4 {
        let mut linear = self.shadow_from_world() * DMat4::from_scale(DVec3::splat(self.texel));
        linear.w_axis = glam::DVec4::ZERO;
        linear.as_mat4()
    }
}

fn corners(bounds: Bounds) -> impl Iterator<Item = DVec3> {
    let [low, high] = [bounds.min, bounds.max].map(|corner| corner.as_dvec3());
    (0..8).map(move |i| DVec3::select(glam::BVec3::new(i & 1 > 0, i & 2 > 0, i & 4 > 0), high, low))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bounds_lie_on_the_map_within_its_margin() {
        let bounds = Bounds { min: Vec3::new(-40.0, -1.0, 3.0), max: Vec3::new(95.0, 18.0, 60.0) };
        let shadow_from_world = SunView::fit(bounds).shadow_from_world();
        let margin = 2.0 / f64::from(MAP_TEXELS);
        let mut depths = Vec::new();
        for corner in corners(bounds) {
            let at = shadow_from_world.project_point3(corner);
            for side in [at.x, at.y] {
                assert!((margin..=1.0 - margin).contains(&side), "{at}");
            }
            depths.push(at.z);
        }
        let [far, near] = [f64::min, f64::max].map(|of| depths.iter().copied().reduce(of).unwrap());
        assert!(far.abs() < 1e-4 && (near - 1.0).abs() < 1e-4, "{far} to {near}");
        // What is nearer to the sun is deeper by reverse-Z.
        let depth = |at: Vec3| shadow_from_world.project_point3(at.as_dvec3()).z;
        let center = bounds.center();
        assert!(depth(center + Vec3::from(SUN_DIRECTION)) > depth(center));
    }

    #[test]
    fn texels_stand_still_where_bounds_move() {
        let place = |by: f32| {
            let min = Vec3::new(by, 0.0, 0.0);
            let sun = SunView::fit(Bounds { min, max: min + Vec3::new(50.0, 10.0, 30.0) });
            let at = sun.shadow_from_world().project_point3(DVec3::new(20.0, 3.0, 9.0));
            (at.truncate() * f64::from(MAP_TEXELS)).fract_gl()
        };
        let still = place(0.0);
        for by in [0.013, 1.7, 4.0] {
            let apart = (place(by) - still).abs();
            let apart = apart.min(1.0 - apart);
            assert!(apart.max_element() < 0.01, "{by}: {apart}");
        }
    }
}
