//! Transforms of nodes (glTF 2.0, section 3.5.2).

use glam::{DMat4, DQuat, DVec3};

use crate::scalars::Doubles;
use crate::schema::Node;

/// Returns the transform of a node in the space of its parent.
pub(crate) fn matrix(node: &Node<'_>) -> DMat4 {
    if let Some(matrix) = &node.matrix {
        return DMat4::from_cols_array(&matrix.0);
    }
    let vector = |values: Option<Doubles<3>>, default: f64| {
        values.map_or(DVec3::splat(default), |values| DVec3::from_array(values.0))
    };
    let rotation = node.rotation.map_or(DQuat::IDENTITY, |values| DQuat::from_array(values.0));
    DMat4::from_scale_rotation_translation(
        vector(node.scale, 1.0),
        unit_rotation(rotation),
        vector(node.translation, 0.0),
    )
}

/// Normalizes a rotation. Exporters write all-zero quaternions for "no rotation".
pub(crate) fn unit_rotation(rotation: DQuat) -> DQuat {
    if rotation.length_squared() == 0.0 { DQuat::IDENTITY } else { rotation.normalize() }
}
