//! Mesh instances of all placements, packed: a site of a hundred stations has some 120,000 of few
//! kinds.

use std::collections::HashMap;
use std::ops::Range;

use busbar_geometry::Bounds;

use crate::ModelIndex;
use crate::node_index::{NodeAddress, NodeIndex, PolicyIndex};
use crate::nodes::Nodes;
use crate::parts::{PartMesh, Parts};

/// One mesh drawn at one node, whose space is the mesh's.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MeshInstance {
    /// The node, whose id is the equipment's.
    pub node: NodeIndex,
    /// Model the mesh belongs to.
    pub model: ModelIndex,
    /// Index into the model's meshes, or their pieces
    /// ([`crate::SceneGraph::split_meshes`]).
    pub mesh: u32,
    /// The placement's own theta policy; none where the model's holds.
    pub theta: Option<PolicyIndex>,
    /// Node of the mesh's feature 0, those of the others after it; `None` for a
    /// mesh without named features.
    pub first_feature: Option<NodeIndex>,
    /// The placement that `node` is a part of.
    pub(crate) placement: u32,
    kind: u32,
}

/// Mesh, policy and part that several placements share.
#[derive(Clone, Copy, Debug)]
struct InstanceKind {
    model: ModelIndex,
    mesh: u32,
    theta: Option<PolicyIndex>,
    /// The part that shows it, and that of its first feature.
    part: u32,
    first_feature: Option<u32>,
    /// Around the mesh, in its own space; `None` without vertices.
    bounds: Option<Bounds>,
}

/// Instance kind at a placement.
#[derive(Clone, Copy, Debug)]
struct ShownInstance {
    placement: u32,
    kind: u32,
}

/// All instances, in the order of their placements.
#[derive(Clone, Debug, Default)]
pub(crate) struct Instances {
    kinds: Vec<InstanceKind>,
    /// Instance kind of a model's first mesh, those of the others after it; kept while placements
    /// are added.
    known: HashMap<(ModelIndex, Option<PolicyIndex>), u32>,
    shown: Vec<ShownInstance>,
}

impl Instances {
    pub(crate) fn with_capacity(count: usize) -> Self {
        Self { shown: Vec::with_capacity(count), ..Self::default() }
    }

    /// Adds those of a model that is placed.
    pub(crate) fn show(
        &mut self,
        placement: u32,
        model: ModelIndex,
        theta: Option<PolicyIndex>,
        parts: &Parts,
    ) {
        let next = self.kinds.len() as u32;
        let first = *self.known.entry((model, theta)).or_insert(next);
        if first == next {
            let kind_of = |&PartMesh { part, mesh, bounds, first_feature }: &PartMesh| {
                InstanceKind { model, mesh, theta, part, first_feature, bounds }
            };
            self.kinds.extend(parts.meshes.iter().map(kind_of));
        }
        let kinds = (first..).take(parts.meshes.len());
        self.shown.extend(kinds.map(|kind| ShownInstance { placement, kind }));
    }

    /// Ends the adding of placements.
    pub(crate) fn finish(&mut self) {
        self.known = HashMap::new();
    }

    pub(crate) fn len(&self) -> usize {
        self.shown.len()
    }

    pub(crate) fn get(&self, index: usize, nodes: &Nodes) -> MeshInstance {
        let ShownInstance { placement, kind } = self.shown[index];
        let InstanceKind { model, mesh, theta, part, first_feature, .. } =
            self.kinds[kind as usize];
        let node = |part| nodes.node(NodeAddress { placement, part: Some(part) });
        let (first_feature, node) = (first_feature.map(node), node(part));
        MeshInstance { node, model, mesh, theta, first_feature, placement, kind }
    }

    /// Returns the box around an instance's mesh, in its own space.
    pub(crate) fn bounds_of_mesh(&self, instance: &MeshInstance) -> Option<Bounds> {
        self.kinds.get(instance.kind as usize)?.bounds
    }

    /// Returns the instances of a placement, by index.
    pub(crate) fn of_placement(&self, placement: u32) -> Range<usize> {
        let first = self.shown.partition_point(|shown| shown.placement < placement);
        let count = self.shown[first..].partition_point(|shown| shown.placement == placement);
        first..first + count
    }

    /// Replaces meshes by their pieces; see [`crate::SceneGraph::split_meshes`].
    pub(crate) fn split_meshes(
        &mut self,
        model: ModelIndex,
        pieces: &[Range<u32>],
        boxes: &[Option<Bounds>],
    ) {
        let mut kinds = Vec::with_capacity(self.kinds.len());
        // What each kind becomes.
        let mut new_kinds = Vec::with_capacity(self.kinds.len());
        for kind in &self.kinds {
            let first = kinds.len() as u32;
            match pieces.get(kind.mesh as usize).filter(|_| kind.model == model) {
                Some(of_mesh) => kinds.extend(of_mesh.clone().map(|mesh| {
                    let bounds = boxes.get(mesh as usize).copied().flatten();
                    InstanceKind { mesh, bounds, ..*kind }
                })),
                None => kinds.push(*kind),
            }
            new_kinds.push(first..kinds.len() as u32);
        }
        self.kinds = kinds;
        let whole = std::mem::take(&mut self.shown);
        let becomes = |shown: &ShownInstance| new_kinds[shown.kind as usize].clone();
        self.shown.reserve_exact(whole.iter().map(|shown| becomes(shown).len()).sum());
        for shown in whole {
            self.shown.extend(becomes(&shown).map(|kind| ShownInstance { kind, ..shown }));
        }
    }
}
