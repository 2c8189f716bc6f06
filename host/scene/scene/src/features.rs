//! Feature nodes: names and boxes of the features of meshes.

use std::collections::HashMap;

use busbar_geometry::{Bounds, Mesh};

use crate::Model;

/// Returns for each mesh whether its features are called `placement/feature`. The mesh must be
/// shown at one node, and the names must be unique within the model. Otherwise features are called
/// `placement/node/feature`.
pub(crate) fn short_ids(model: &Model) -> Vec<bool> {
    let mut uses = vec![0; model.meshes.len()];
    let mut names: HashMap<&str, u32> = HashMap::new();
    for node in &model.nodes {
        *names.entry(&node.name).or_default() += 1;
        if let Some(mesh) = node.mesh {
            uses[mesh as usize] += 1;
        }
    }
    let shown_once = |mesh: &usize| uses[*mesh] == 1;
    for mesh in (0..uses.len()).filter(shown_once) {
        for name in model.feature_names(mesh) {
            *names.entry(name).or_default() += 1;
        }
    }
    let unique = |name: &String| names.get(name.as_str()) == Some(&1);
    let is_short = |mesh| shown_once(&mesh) && model.feature_names(mesh).iter().all(unique);
    (0..uses.len()).map(is_short).collect()
}

/// Computes the box around each of a mesh's first `count` features, in the mesh's space.
pub(crate) fn feature_bounds(mesh: &Mesh, count: usize) -> Vec<Option<Bounds>> {
    let mut boxes: Vec<Option<Bounds>> = vec![None; count];
    for (&position, &feature) in mesh.positions.iter().zip(&mesh.features) {
        if let Some(bounds) = boxes.get_mut(feature as usize) {
            let point = Bounds { min: position, max: position };
            *bounds = Some(bounds.map_or(point, |b| b.union(point)));
        }
    }
    boxes
}
