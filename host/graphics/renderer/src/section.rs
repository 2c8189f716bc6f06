//! Section plane that cuts equipment open.

use glam::{DVec4, Vec3};

/// Section plane. Geometry before it is neither drawn nor picked, and casts no shadow. Insides that
/// become visible are hatched.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SectionPlane {
    /// Unit vector towards the side that is cut away, world space.
    pub normal: Vec3,
    /// From the world's origin along the normal, metres.
    pub distance: f32,
}

impl SectionPlane {
    /// Factors of (x, y, z, 1); their sum is positive before the plane.
    pub(crate) fn equation(&self) -> DVec4 {
        self.normal.as_dvec3().extend(-f64::from(self.distance))
    }
}
