//! Model parts: nodes and features that a model adds to the scene wherever it is placed.

use std::collections::HashMap;

use busbar_geometry::{Bounds, Mesh};
use glam::DMat4;

use crate::{Model, features};

/// The nodes of a model, and those of its meshes' features after the node of each.
#[derive(Clone, Debug, Default)]
pub(crate) struct Parts {
    pub(crate) all: Vec<Part>,
    pub(crate) meshes: Vec<PartMesh>,
    by_name: HashMap<String, u32>,
    /// Two parts with the same name, if any.
    pub(crate) twins: Option<(u32, u32)>,
}

#[derive(Clone, Debug)]
pub(crate) struct Part {
    /// Name behind the placement's id and a slash.
    pub(crate) name: String,
    /// Index of a part before this one; `None` where that is the placement.
    pub(crate) parent: Option<u32>,
    pub(crate) placement_from_part: DMat4,
    /// Around all that hangs under it, in its own space.
    pub(crate) bounds: Option<Bounds>,
}

/// A mesh that a part shows.
#[derive(Clone, Debug)]
pub(crate) struct PartMesh {
    pub(crate) part: u32,
    pub(crate) mesh: u32,
    pub(crate) bounds: Option<Bounds>,
    pub(crate) first_feature: Option<u32>,
}

impl Parts {
    pub(crate) fn from_model(model: &Model) -> Self {
        let mut parts = Self::default();
        let boxes: Vec<Option<Bounds>> = model.meshes.iter().map(Mesh::bounds).collect();
        let short_ids = features::short_ids(model);
        let mut added: Vec<u32> = Vec::with_capacity(model.nodes.len());
        for node in &model.nodes {
            let parent = node.parent.map(|parent| added[parent as usize]);
            let index = parts.add(node.name.clone(), parent, &node.parent_from_node, None);
            added.push(index);
            let Some(mesh) = node.mesh else { continue };
            let first_feature = parts.all.len() as u32;
            let names = model.feature_names(mesh as usize);
            let own = features::feature_bounds(&model.meshes[mesh as usize], names.len());
            for (name, bounds) in names.iter().zip(own) {
                let name = match short_ids[mesh as usize] {
                    true => name.clone(),
                    false => format!("{}/{name}", node.name),
                };
                parts.add(name, Some(index), &DMat4::IDENTITY, bounds);
            }
            let bounds = boxes[mesh as usize];
            parts.all[index as usize].bounds = bounds;
            let first_feature = (!names.is_empty()).then_some(first_feature);
            parts.meshes.push(PartMesh { part: index, mesh, bounds, first_feature });
        }
        parts.measure(model);
        parts
    }

    /// Finds the part of a name.
    pub(crate) fn find(&self, name: &str) -> Option<u32> {
        self.by_name.get(name).copied()
    }

    fn add(
        &mut self,
        name: String,
        parent: Option<u32>,
        parent_from_part: &DMat4,
        bounds: Option<Bounds>,
    ) -> u32 {
        let index = self.all.len() as u32;
        if let Some(first) = self.by_name.insert(name.clone(), index) {
            self.twins.get_or_insert((first, index));
        }
        let of_parent =
            parent.map_or(DMat4::IDENTITY, |parent| self.all[parent as usize].placement_from_part);
        let placement_from_part = of_parent * *parent_from_part;
        self.all.push(Part { name, parent, placement_from_part, bounds });
        index
    }

    /// Adds to the box of each node those of the nodes under it.
    fn measure(&mut self, model: &Model) {
        let nodes = model.nodes.iter().map(|node| self.find(&node.name));
        let nodes: Vec<Option<u32>> = nodes.collect();
        for (node, &own) in model.nodes.iter().zip(&nodes).rev() {
            let above = node.parent.and_then(|parent| nodes[parent as usize]);
            let (Some(own), Some(above)) = (own, above) else { continue };
            let bounds = self.all[own as usize].bounds;
            let in_parent =
                bounds.map(|bounds| bounds.transformed(&node.parent_from_node.as_mat4()));
            let into = &mut self.all[above as usize].bounds;
            *into = union_bounds(*into, in_parent);
        }
    }
}

/// Returns the box around both boxes.
pub(crate) fn union_bounds(a: Option<Bounds>, b: Option<Bounds>) -> Option<Bounds> {
    match (a, b) {
        (Some(a), Some(b)) => Some(a.union(b)),
        (a, b) => a.or(b),
    }
}
