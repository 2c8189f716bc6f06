//! The scene graph: placed models, flattened to mesh instances.

use std::borrow::Borrow;
use std::collections::HashMap;
use std::ops::Range;

use busbar_geometry::{Bounds, Mesh};
use glam::{EulerRot, Mat4, Quat, Vec3};
use thiserror::Error;

use crate::nodes::{NodeName, Nodes, TextIndex};
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
#[derive(Clone, Copy, Debug)]
pub struct SceneNode<'a> {
    nodes: &'a Nodes,
    index: usize,
}

impl<'a> SceneNode<'a> {
    /// Equipment id; model nodes are called `placement/node`, features of their
    /// meshes `placement/feature` or, where that would be ambiguous within the
    /// model, `placement/node/feature`.
    pub fn id(&self) -> EquipmentId {
        self.nodes.id(self.index)
    }

    /// Parent, an earlier node.
    pub fn parent(&self) -> Option<NodeIndex> {
        self.nodes.parent(self.index)
    }

    /// Transform from this node's space to the world.
    pub fn world_from_node(&self) -> &'a Mat4 {
        self.nodes.world_from_node(self.index)
    }

    /// World-space box around all that hangs under this node.
    pub fn bounds(&self) -> Option<Bounds> {
        self.nodes.bounds(self.index)
    }
}

/// Index of a theta policy in the graph.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PolicyIndex(pub u32);

/// One mesh drawn at one node, whose space is the mesh's.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MeshInstance {
    /// The node, whose id is the equipment's.
    pub node: NodeIndex,
    /// Model the mesh belongs to.
    pub model: ModelIndex,
    /// Index into the model's meshes, or their pieces ([`SceneGraph::take_apart`]).
    pub mesh: u32,
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
    nodes: Nodes,
    instances: Vec<MeshInstance>,
    policies: Vec<ThetaPolicy>,
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
    /// Places models. The parent of a placement comes before it.
    ///
    /// # Errors
    /// A duplicate id, or too many nodes.
    pub fn build<P: Borrow<Placement>>(
        placements: impl IntoIterator<Item = P, IntoIter: Clone>,
        models: &[Model],
    ) -> Result<Self, SceneError> {
        let placements = placements.into_iter();
        let parts: Vec<Parts> = models.iter().map(Parts::of).collect();
        let mut builder = Builder {
            graph: Self::with_room(placements.clone().map(|p| p.borrow().model), &parts)?,
            texts: vec![None; models.len()],
            parts: &parts,
            models,
        };
        let mut placed: Vec<NodeIndex> = Vec::new();
        for placement in placements {
            placed.push(builder.place(placement.borrow(), &placed)?);
        }
        let mut graph = builder.graph;
        graph.measure(models);
        Ok(graph)
    }

    /// With room for what is placed.
    fn with_room(
        placed: impl Iterator<Item = Option<ModelIndex>>,
        parts: &[Parts],
    ) -> Result<Self, SceneError> {
        let (mut nodes, mut moved, mut instances) = (0, 0, 0);
        for model in placed {
            let parts = model.map(|model| &parts[model.0 as usize]);
            nodes += 1 + parts.map_or(0, |parts| parts.nodes);
            moved += 1 + parts.map_or(0, |parts| parts.moved);
            instances += parts.map_or(0, |parts| parts.instances);
            if nodes > MAX_NODES {
                return Err(SceneError::TooManyNodes);
            }
        }
        let nodes = Nodes::with_capacity(nodes, moved);
        Ok(Self { nodes, instances: Vec::with_capacity(instances), policies: Vec::new() })
    }

    /// Number of nodes.
    pub fn node_count(&self) -> usize {
        self.nodes.len()
    }

    /// All nodes.
    pub fn nodes(&self) -> impl DoubleEndedIterator<Item = SceneNode<'_>> + ExactSizeIterator {
        (0..self.nodes.len()).map(|index| SceneNode { nodes: &self.nodes, index })
    }

    /// One node.
    pub fn node(&self, index: NodeIndex) -> SceneNode<'_> {
        SceneNode { nodes: &self.nodes, index: index.0 as usize }
    }

    /// Transform from the space of an instance's mesh to the world.
    pub fn world_from_mesh(&self, instance: &MeshInstance) -> &Mat4 {
        self.node(instance.node).world_from_node()
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
        self.nodes.find(id)
    }

    /// The box around everything.
    pub fn bounds(&self) -> Option<Bounds> {
        let roots = self.nodes().filter(|node| node.parent().is_none());
        roots.filter_map(|node| node.bounds()).reduce(Bounds::union)
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
        let pieces_of = |i: &MeshInstance| match i.model == model {
            true => pieces.get(i.mesh as usize).map_or(1, Range::len),
            false => 1,
        };
        self.instances.reserve_exact(whole.iter().map(pieces_of).sum());
        for instance in whole {
            let of_mesh = pieces.get(instance.mesh as usize).filter(|_| instance.model == model);
            let Some(of_mesh) = of_mesh else {
                self.instances.push(instance);
                continue;
            };
            let node = instance.node.0 as usize;
            self.instances.extend(of_mesh.clone().map(|piece| {
                let bounds = boxes.get(piece as usize).copied().flatten();
                let bounds =
                    bounds.map(|bounds| bounds.transformed(self.nodes.world_from_node(node)));
                MeshInstance { mesh: piece, bounds, ..instance }
            }));
        }
    }

    fn add(
        &mut self,
        name: NodeName<'_>,
        parent: Option<NodeIndex>,
        parent_from_node: &Mat4,
    ) -> Result<NodeIndex, SceneError> {
        self.nodes.add(name, parent, parent_from_node).map_err(|first| {
            let id_of = |node: NodeIndex| self.node(node).id();
            SceneError::DuplicateId {
                id: id_of(first),
                first_parent: self.node(first).parent().map(id_of),
                second_parent: parent.map(id_of),
            }
        })
    }

    fn add_policy(&mut self, policy: ThetaPolicy) -> PolicyIndex {
        self.policies.push(policy);
        PolicyIndex(self.policies.len() as u32 - 1)
    }

    /// Fills in bounds, from the meshes up to the roots.
    fn measure(&mut self, models: &[Model]) {
        let meshes = models.iter().map(|m| m.meshes.iter().map(Mesh::bounds).collect());
        let meshes: Vec<Vec<Option<Bounds>>> = meshes.collect();
        let mut boxes = HashMap::new();
        let Self { nodes, instances, .. } = self;
        for instance in instances {
            let (model, mesh) = (instance.model.0 as usize, instance.mesh as usize);
            let node = instance.node.0 as usize;
            let world_from_mesh = *nodes.world_from_node(node);
            let to_world =
                |bounds: Option<Bounds>| bounds.map(|bounds| bounds.transformed(&world_from_mesh));
            let bounds = to_world(meshes[model][mesh]);
            if let Some(NodeIndex(first)) = instance.first_feature {
                let boxes = boxes.entry((model, mesh)).or_insert_with(|| {
                    let count = models[model].feature_names(mesh).len();
                    features::boxes(&models[model].meshes[mesh], count)
                });
                for (node, &feature) in (first as usize..).zip(boxes.iter()) {
                    grow(nodes.bounds_mut(node), to_world(feature));
                }
            }
            grow(nodes.bounds_mut(node), bounds);
            instance.bounds = bounds;
        }
        for node in (0..nodes.len()).rev() {
            if let Some(NodeIndex(parent)) = nodes.parent(node) {
                let bounds = nodes.bounds(node);
                grow(nodes.bounds_mut(parent as usize), bounds);
            }
        }
    }
}

/// What a placement of a model adds.
struct Parts {
    nodes: usize,
    /// How many of them stand elsewhere than their parents.
    moved: usize,
    instances: usize,
    /// For each mesh, whether its features go without their node's name.
    short_ids: Vec<bool>,
}

impl Parts {
    fn of(model: &Model) -> Self {
        let meshes = || model.nodes.iter().filter_map(|node| node.mesh);
        let features = |mesh: u32| model.feature_names(mesh as usize).len();
        Self {
            nodes: model.nodes.len() + meshes().map(features).sum::<usize>(),
            moved: model.nodes.iter().filter(|n| n.parent_from_node != Mat4::IDENTITY).count(),
            instances: meshes().count(),
            short_ids: features::short_ids(model),
        }
    }
}

/// The texts that the ids of a model's parts have in common, wherever it is placed.
#[derive(Clone)]
struct PartTexts {
    /// One a node.
    nodes: Vec<TextIndex>,
    /// Of each node, one a feature of its mesh.
    features: Vec<Vec<TextIndex>>,
}

impl PartTexts {
    fn add(model: &Model, parts: &Parts, nodes: &mut Nodes) -> Self {
        let names = model.nodes.iter().map(|node| nodes.add_text(&node.name)).collect();
        let mut features = Vec::with_capacity(model.nodes.len());
        for node in &model.nodes {
            let Some(mesh) = node.mesh.map(|mesh| mesh as usize) else {
                features.push(Vec::new());
                continue;
            };
            let texts = model.feature_names(mesh).iter().map(|name| match parts.short_ids[mesh] {
                true => nodes.add_text(name),
                false => nodes.add_text(&format!("{}/{name}", node.name)),
            });
            features.push(texts.collect());
        }
        Self { nodes: names, features }
    }
}

/// A graph in the making.
struct Builder<'a> {
    graph: SceneGraph,
    models: &'a [Model],
    parts: &'a [Parts],
    /// Of models that are placed already.
    texts: Vec<Option<PartTexts>>,
}

impl Builder<'_> {
    fn place(
        &mut self,
        placement: &Placement,
        placed: &[NodeIndex],
    ) -> Result<NodeIndex, SceneError> {
        let parent = placement.parent.map(|parent| placed[parent]);
        let name = NodeName::Placement(&placement.id);
        let node = self.graph.add(name, parent, &placement.transform.matrix())?;
        if let Some(model) = placement.model {
            let theta = placement.theta.clone().map(|policy| self.graph.add_policy(policy));
            self.add_model(node, model, theta)?;
        }
        Ok(node)
    }

    fn add_model(
        &mut self,
        placement: NodeIndex,
        model_index: ModelIndex,
        theta: Option<PolicyIndex>,
    ) -> Result<(), SceneError> {
        let Self { graph, models, parts, texts } = self;
        let index = model_index.0 as usize;
        let model = &models[index];
        let texts = texts[index]
            .get_or_insert_with(|| PartTexts::add(model, &parts[index], &mut graph.nodes));
        let mut added: Vec<NodeIndex> = Vec::with_capacity(model.nodes.len());
        for ((node, &text), features) in model.nodes.iter().zip(&texts.nodes).zip(&texts.features) {
            let parent = node.parent.map_or(placement, |p| added[p as usize]);
            let name = NodeName::Part(placement, text);
            let index = graph.add(name, Some(parent), &node.parent_from_node)?;
            added.push(index);
            let Some(mesh) = node.mesh else { continue };
            let first_feature = NodeIndex(graph.nodes.len() as u32);
            for &text in features {
                graph.add(NodeName::Part(placement, text), Some(index), &Mat4::IDENTITY)?;
            }
            graph.instances.push(MeshInstance {
                node: index,
                model: model_index,
                mesh,
                bounds: None,
                theta,
                first_feature: (!features.is_empty()).then_some(first_feature),
            });
        }
        Ok(())
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
