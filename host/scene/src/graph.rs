//! The scene graph: placed models, flattened to mesh instances.

use std::collections::HashMap;
use std::ops::Range;

use busbar_geometry::{Bounds, Mesh};
use glam::{EulerRot, Mat4, Quat, Vec3};
use thiserror::Error;

use crate::{Model, ModelIndex, ThetaPolicy, features};

/// An equipment id, such as `=S12D1T1-TA1` or `=S12D1T1-TA1/bushing 1U`.
pub type EquipmentId = String;

/// The most nodes one scene may hold, model nodes of every placement included.
pub const MAX_NODES: usize = 4_000_000;

/// Index of a node in the graph. Picking and bindings name equipment by it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct NodeIndex(pub u32);

/// Where something stands: scale, then rotate (about x, y, z in turn), then
/// translate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Transform {
    /// Metres.
    pub translation: Vec3,
    /// Degrees about x, y and z, applied in that order.
    pub rotation_degrees: Vec3,
    /// Factors along x, y and z.
    pub scale: Vec3,
}

/// One piece of equipment to place, as the configuration words it.
#[derive(Clone, Debug, PartialEq)]
pub struct Placement {
    /// Equipment id.
    pub id: EquipmentId,
    /// The placement it hangs under: an earlier one.
    pub parent: Option<usize>,
    /// Transform to the parent's space.
    pub transform: Transform,
    /// Model shown here.
    pub model: Option<ModelIndex>,
    /// How its theta is chosen here; none where the model's policy holds.
    pub theta: Option<ThetaPolicy>,
}

/// A node of the graph.
#[derive(Clone, Debug, PartialEq)]
pub struct SceneNode {
    /// Equipment id; model nodes are called `placement/node`, features of their
    /// meshes `placement/feature` or, where that would be ambiguous within the
    /// model, `placement/node/feature`.
    pub id: EquipmentId,
    /// Parent, an earlier node.
    pub parent: Option<NodeIndex>,
    /// Transform from this node's space to the world.
    pub world_from_node: Mat4,
    /// World-space box around all that hangs under this node.
    pub bounds: Option<Bounds>,
}

/// Index of a theta policy in the graph.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PolicyIndex(pub u32);

/// One mesh drawn at one node.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MeshInstance {
    /// The node, whose id is the equipment's.
    pub node: NodeIndex,
    /// Model the mesh belongs to.
    pub model: ModelIndex,
    /// Index into the model's meshes, or their pieces ([`SceneGraph::take_apart`]).
    pub mesh: u32,
    /// Transform from mesh space to the world.
    pub world_from_mesh: Mat4,
    /// World-space box around the mesh; `None` without vertices.
    pub bounds: Option<Bounds>,
    /// The placement's own theta policy; none where the model's holds.
    pub theta: Option<PolicyIndex>,
    /// Node of the mesh's feature 0, those of the others after it; `None` for a
    /// mesh without named features.
    pub first_feature: Option<NodeIndex>,
}

/// Why placements make no scene.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
pub enum SceneError {
    /// Two nodes have one id.
    #[error(
        "equipment id '{id}' is used twice: {} and {}",
        place(first_parent),
        place(second_parent)
    )]
    DuplicateId {
        /// The id.
        id: EquipmentId,
        /// Parent of the node that has it.
        first_parent: Option<EquipmentId>,
        /// Parent of the node that was to have it too.
        second_parent: Option<EquipmentId>,
    },
    /// More nodes than [`MAX_NODES`].
    #[error("the scene has more than {MAX_NODES} nodes")]
    TooManyNodes,
}

impl SceneError {
    /// What the reader of the message can do.
    pub fn remedy(&self) -> &'static str {
        match self {
            Self::DuplicateId { .. } => "give one of them another id, or its model other names",
            Self::TooManyNodes => "place fewer or smaller models",
        }
    }
}

fn place(parent: &Option<EquipmentId>) -> String {
    parent.as_ref().map_or("at the top".into(), |parent| format!("under '{parent}'"))
}

/// All nodes, parents before children, and the meshes they show.
#[derive(Clone, Debug, Default)]
pub struct SceneGraph {
    nodes: Vec<SceneNode>,
    instances: Vec<MeshInstance>,
    policies: Vec<ThetaPolicy>,
    by_id: HashMap<EquipmentId, NodeIndex>,
}

impl Default for Transform {
    fn default() -> Self {
        Self { translation: Vec3::ZERO, rotation_degrees: Vec3::ZERO, scale: Vec3::ONE }
    }
}

impl Transform {
    /// The matrix from the placed thing's space to its parent's.
    pub fn matrix(&self) -> Mat4 {
        let [x, y, z] = (self.rotation_degrees * (std::f32::consts::PI / 180.0)).to_array();
        let rotation = Quat::from_euler(EulerRot::ZYX, z, y, x);
        Mat4::from_scale_rotation_translation(self.scale, rotation, self.translation)
    }
}

impl SceneGraph {
    /// Places models. `placements[i].parent` must be less than `i`.
    ///
    /// # Errors
    /// A duplicate id, or too many nodes.
    pub fn build(placements: &[Placement], models: &[Model]) -> Result<Self, SceneError> {
        let mut graph = Self::default();
        let mut placed: Vec<NodeIndex> = Vec::with_capacity(placements.len());
        for placement in placements {
            let parent = placement.parent.map(|p| placed[p]);
            let node = graph.add(placement.id.clone(), parent, placement.transform.matrix())?;
            placed.push(node);
            if let Some(model) = placement.model {
                let theta = placement.theta.clone().map(|policy| graph.add_policy(policy));
                graph.add_model(node, model, theta, &models[model.0 as usize])?;
            }
        }
        graph.measure(models);
        Ok(graph)
    }

    /// All nodes.
    pub fn nodes(&self) -> &[SceneNode] {
        &self.nodes
    }

    /// One node.
    pub fn node(&self, index: NodeIndex) -> &SceneNode {
        &self.nodes[index.0 as usize]
    }

    /// Meshes to draw.
    pub fn instances(&self) -> &[MeshInstance] {
        &self.instances
    }

    /// Theta policies that placements have of their own.
    pub fn policies(&self) -> &[ThetaPolicy] {
        &self.policies
    }

    /// The node of an equipment id.
    pub fn find(&self, id: &str) -> Option<NodeIndex> {
        self.by_id.get(id).copied()
    }

    /// The box around everything.
    pub fn bounds(&self) -> Option<Bounds> {
        let roots = self.nodes.iter().filter(|n| n.parent.is_none());
        roots.filter_map(|n| n.bounds).reduce(Bounds::union)
    }

    /// Shows the meshes of a model as the pieces that they were taken apart into: for
    /// each mesh the range of its pieces, for each piece its box in mesh space.
    pub fn take_apart(
        &mut self,
        model: ModelIndex,
        pieces: &[Range<u32>],
        boxes: &[Option<Bounds>],
    ) {
        let whole = std::mem::take(&mut self.instances);
        for instance in whole {
            let of_mesh = pieces.get(instance.mesh as usize).filter(|_| instance.model == model);
            let Some(of_mesh) = of_mesh else {
                self.instances.push(instance);
                continue;
            };
            self.instances.extend(of_mesh.clone().map(|piece| {
                let bounds = boxes.get(piece as usize).copied().flatten();
                let bounds = bounds.map(|bounds| bounds.transformed(&instance.world_from_mesh));
                MeshInstance { mesh: piece, bounds, ..instance }
            }));
        }
    }

    fn add(
        &mut self,
        id: EquipmentId,
        parent: Option<NodeIndex>,
        parent_from_node: Mat4,
    ) -> Result<NodeIndex, SceneError> {
        if self.nodes.len() >= MAX_NODES {
            return Err(SceneError::TooManyNodes);
        }
        let index = NodeIndex(self.nodes.len() as u32);
        if let Some(first) = self.by_id.insert(id.clone(), index) {
            let id_of = |node: NodeIndex| self.node(node).id.clone();
            let first_parent = self.node(first).parent.map(id_of);
            return Err(SceneError::DuplicateId {
                id,
                first_parent,
                second_parent: parent.map(id_of),
            });
        }
        let world_from_parent = parent.map_or(Mat4::IDENTITY, |p| self.node(p).world_from_node);
        let world_from_node = world_from_parent * parent_from_node;
        self.nodes.push(SceneNode { id, parent, world_from_node, bounds: None });
        Ok(index)
    }

    fn add_policy(&mut self, policy: ThetaPolicy) -> PolicyIndex {
        self.policies.push(policy);
        PolicyIndex(self.policies.len() as u32 - 1)
    }

    fn add_model(
        &mut self,
        placement: NodeIndex,
        model_index: ModelIndex,
        theta: Option<PolicyIndex>,
        model: &Model,
    ) -> Result<(), SceneError> {
        let prefix = self.node(placement).id.clone();
        let short_ids = features::short_ids(model);
        let mut added: Vec<NodeIndex> = Vec::with_capacity(model.nodes.len());
        for node in &model.nodes {
            let parent = node.parent.map_or(placement, |p| added[p as usize]);
            let id = format!("{prefix}/{}", node.name);
            let index = self.add(id.clone(), Some(parent), node.parent_from_node)?;
            added.push(index);
            if let Some(mesh) = node.mesh {
                let prefix = if short_ids[mesh as usize] { &prefix } else { &id };
                let first_feature =
                    self.add_features(index, prefix, model.feature_names(mesh as usize))?;
                self.instances.push(MeshInstance {
                    node: index,
                    model: model_index,
                    mesh,
                    world_from_mesh: self.node(index).world_from_node,
                    bounds: None,
                    theta,
                    first_feature,
                });
            }
        }
        Ok(())
    }

    /// Adds a node for each feature of the mesh at a node; the first one's index.
    fn add_features(
        &mut self,
        node: NodeIndex,
        prefix: &str,
        names: &[String],
    ) -> Result<Option<NodeIndex>, SceneError> {
        let first = NodeIndex(self.nodes.len() as u32);
        for name in names {
            self.add(format!("{prefix}/{name}"), Some(node), Mat4::IDENTITY)?;
        }
        Ok((!names.is_empty()).then_some(first))
    }

    /// Fills in bounds, from the meshes up to the roots.
    fn measure(&mut self, models: &[Model]) {
        let meshes = models.iter().map(|m| m.meshes.iter().map(Mesh::bounds).collect());
        let meshes: Vec<Vec<Option<Bounds>>> = meshes.collect();
        let mut boxes = HashMap::new();
        for instance in &mut self.instances {
            let (model, mesh) = (instance.model.0 as usize, instance.mesh as usize);
            let to_world = |bounds: Option<Bounds>| {
                bounds.map(|bounds| bounds.transformed(&instance.world_from_mesh))
            };
            let bounds = to_world(meshes[model][mesh]);
            if let Some(NodeIndex(first)) = instance.first_feature {
                let boxes = boxes.entry((model, mesh)).or_insert_with(|| {
                    let count = models[model].feature_names(mesh).len();
                    features::boxes(&models[model].meshes[mesh], count)
                });
                for (node, &feature) in (first..).zip(boxes.iter()) {
                    grow(&mut self.nodes[node as usize].bounds, to_world(feature));
                }
            }
            grow(&mut self.nodes[instance.node.0 as usize].bounds, bounds);
            instance.bounds = bounds;
        }
        for index in (0..self.nodes.len()).rev() {
            if let Some(parent) = self.nodes[index].parent {
                let bounds = self.nodes[index].bounds;
                grow(&mut self.nodes[parent.0 as usize].bounds, bounds);
            }
        }
    }
}

/// By how much a transform stretches at most along an axis of the mesh.
pub fn greatest_stretch(transform: &Mat4) -> f32 {
    let [x, y, z] =
        [transform.x_axis, transform.y_axis, transform.z_axis].map(|axis| axis.truncate().length());
    x.max(y).max(z).max(f32::MIN_POSITIVE)
}

fn grow(into: &mut Option<Bounds>, by: Option<Bounds>) {
    *into = match (*into, by) {
        (Some(a), Some(b)) => Some(a.union(b)),
        (a, b) => a.or(b),
    };
}
