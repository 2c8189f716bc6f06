//! Normals of meshes whose file has none, or unusable ones: flat, that of each face.

use glam::Vec3;

/// Returns the unit normal of a triangle; that of a degenerate one points up.
pub(super) fn face_normal([a, b, c]: [Vec3; 3]) -> Vec3 {
    let cross = (b - a).as_dvec3().cross((c - a).as_dvec3());
    cross.try_normalize().map_or(Vec3::Y, |n| n.as_vec3())
}

/// Reports whether a normal of a file can be used: files hold zero and NaN ones.
pub(super) fn is_usable(normal: Vec3) -> bool {
    normal.is_finite() && normal.length_squared() > 1e-12
}
