//! Transforms of instances as their vertex attributes hold them.

use busbar_shaders::Instance;
use glam::{Mat4, Vec4};

/// Returns the instance's transform as a matrix.
pub(crate) fn world_from_mesh(instance: &Instance) -> Mat4 {
    let [x, y, z] = instance.world_from_mesh.map(Vec4::from_array);
    Mat4::from_cols(x, y, z, Vec4::W).transpose()
}
