//! Scale factors of affine transforms.

use glam::Mat4;

/// Returns the greatest scale factor of a transform along an axis of the mesh.
pub fn max_scale_factor(transform: &Mat4) -> f32 {
    let [x, y, z] =
        [transform.x_axis, transform.y_axis, transform.z_axis].map(|axis| axis.truncate().length());
    x.max(y).max(z).max(f32::MIN_POSITIVE)
}
