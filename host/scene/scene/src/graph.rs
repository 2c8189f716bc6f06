//! Scene graph: placed models, flattened to mesh instances.

use std::borrow::Borrow;
use std::ops::Range;
use std::sync::Arc;

use busbar_geometry::Bounds;
use glam::{DMat4, DVec3, EulerRot, Mat4, Quat, Vec3};
use thiserror::Error;

use crate::instances::{Instances, MeshInstance};
use crate::node_index::{EquipmentId, NodeAddress, NodeIndex, PolicyIndex};
use crate::nodes::Nodes;
use crate::parts::Parts;
use crate::{Model, ModelIndex};

/// The most nodes one scene may hold, model nodes of every placement included.
pub const MAX_NODES: usize = 4_000_000;

/// Placement transform: scale, then rotate (about x, y, z in turn), then translate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Transform {
    /// Translation along each axis, metres.
    pub translation: DVec3,
    /// Degrees about x, y and z, applied in that order.
    pub rotation_degrees: Vec3,
    /// Factors along x, y and z.
    pub scale: Vec3,
}

/// One piece of equipment to place, as the configuration words it.
#[derive(Clone, Debug, PartialEq)]
pub struct Placement {
    /// Equipment id, without `/`.
    pub id: EquipmentId,
    /// The placement it hangs under: an earlier one.
    pub parent: Option<usize>,
    /// Transform to the parent's space.
    pub transform: Transform,
    /// Model that is shown here.
    pub model: Option<ModelIndex>,
    /// Theta policy of this placement; none where the model's policy holds.
    pub theta: Option<PolicyIndex>,
}

/// A node of the graph.
#[derive(Clone, Copy, Debug)]
pub struct SceneNode<'a> {
    nodes: &'a Nodes,
    place: NodeAddress,
}

impl<'a> SceneNode<'a> {
    /// Returns the equipment id. Model nodes are called `placement/node`, features of their meshes
    /// `placement/feature` or, where that would be ambiguous, `placement/node/feature`.
    pub fn id(&self) -> EquipmentId {
        self.nodes.id(self.place)
    }

    /// Returns the last part of its id: the name of a part, or the id of a placement.
    pub fn name(&self) -> &'a str {
        self.nodes.name(self.place)
    }

    /// Reports whether the node is a part of a placed model.
    pub fn is_part(&self) -> bool {
        self.place.part.is_some()
    }

    /// Returns the parent, an earlier node.
    pub fn parent(&self) -> Option<NodeIndex> {
        self.nodes.parent(self.place)
    }

    /// Returns the transform from this node's space to the world, relative to
    /// [`SceneGraph::world_origin`].
    pub fn world_from_node(&self) -> Mat4 {
        self.nodes.world_from(self.place)
    }

    /// Returns the world-space box around this node's subtree, relative to [`SceneGraph::world_origin`].
    pub fn bounds(&self) -> Option<Bounds> {
        self.nodes.bounds(self.place)
    }
}
/// Reasons why placements make no scene.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
pub enum SceneError {
    /// Two nodes have one id.
    #[error(
        "equipment id '{id}' is used twice: {} and {}",
        place(first_parent),
        place(second_parent)
    )]
    DuplicateId {
        /// Equipment id used twice.
        id: EquipmentId,
        /// Parent of the node that has it.
        first_parent: Option<EquipmentId>,
        /// Parent of the node that was to have it too.
        second_parent: Option<EquipmentId>,
    },
    /// An id that looks like a part's.
    #[error("equipment id '{id}' has a '/'")]
    SlashInId {
        /// Equipment id with a slash.
        id: EquipmentId,
    },
    /// More nodes than [`MAX_NODES`].
    #[error("the scene has more than {MAX_NODES} nodes")]
    TooManyNodes,
}

impl SceneError {
    /// Returns the remedy for the reader of the message.
    pub fn remedy(&self) -> &'static str {
        match self {
            Self::DuplicateId { .. } => "give one of them another id, or its model other names",
            Self::SlashInId { .. } => "write it without: '/' leads to the nodes of a model",
            Self::TooManyNodes => "place fewer or smaller models",
        }
    }
}

fn place(parent: &Option<EquipmentId>) -> String {
    parent.as_ref().map_or("at the top".into(), |parent| format!("under '{parent}'"))
}

/// Nodes and boxes that a model adds to a scene wherever it is placed.
#[derive(Clone, Debug)]
pub struct ModelParts(Arc<Parts>);

impl ModelParts {
    /// Collects the parts of a model as imported.
    pub fn from_model(model: &Model) -> Self {
        Self(Arc::new(Parts::from_model(model)))
    }
}

/// All nodes, parents before children, and the meshes they show.
#[derive(Clone, Debug, Default)]
pub struct SceneGraph {
    nodes: Nodes,
    /// Around all of them.
    bounds: Option<Bounds>,
    instances: Instances,
}

impl Default for Transform {
    fn default() -> Self {
        Self { translation: DVec3::ZERO, rotation_degrees: Vec3::ZERO, scale: Vec3::ONE }
    }
}

impl Transform {
    /// Returns the matrix from the placement's space to its parent's.
    pub fn matrix(&self) -> DMat4 {
        let [x, y, z] = (self.rotation_degrees * (std::f32::consts::PI / 180.0)).to_array();
        let rotation = Quat::from_euler(EulerRot::ZYX, z, y, x);
        let turn = Mat4::from_scale_rotation_translation(self.scale, rotation, Vec3::ZERO);
        DMat4 { w_axis: self.translation.extend(1.0), ..turn.as_dmat4() }
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
        Self::from_parts(placements, models.iter().map(ModelParts::from_model).collect())
    }

    /// Places models whose parts are known, one for each index.
    ///
    /// # Errors
    /// Returns the errors of [`SceneGraph::build`].
    pub fn from_parts<P: Borrow<Placement>>(
        placements: impl IntoIterator<Item = P, IntoIter: Clone>,
        models: Vec<ModelParts>,
    ) -> Result<Self, SceneError> {
        let placements = placements.into_iter();
        let parts: Vec<Arc<Parts>> = models.into_iter().map(|ModelParts(parts)| parts).collect();
        let (mut count, mut nodes, mut instances) = (0, 0, 0);
        for model in placements.clone().map(|placement| placement.borrow().model) {
            let parts = model.map(|model| &parts[model.0 as usize]);
            count += 1;
            nodes += 1 + parts.map_or(0, |parts| parts.all.len());
            instances += parts.map_or(0, |parts| parts.meshes.len());
            if nodes > MAX_NODES {
                return Err(SceneError::TooManyNodes);
            }
        }
        let mut graph = Self {
            nodes: Nodes::new(parts, count),
            bounds: None,
            instances: Instances::with_capacity(instances),
        };
        for placement in placements {
            graph.place(placement.borrow())?;
        }
        graph.instances.finish();
        graph.bounds = graph.nodes.finish();
        Ok(graph)
    }

    /// Returns the parts that a model adds wherever it is placed, for use in another graph.
    pub fn model_parts(&self, model: ModelIndex) -> ModelParts {
        ModelParts(Arc::clone(self.nodes.parts_of_model(model)))
    }

    /// Returns the number of nodes.
    pub fn node_count(&self) -> usize {
        self.nodes.len()
    }

    /// Iterates over all nodes.
    pub fn nodes(&self) -> impl Iterator<Item = SceneNode<'_>> {
        self.nodes.addresses().map(|place| SceneNode { nodes: &self.nodes, place })
    }

    /// Returns the node of an index.
    pub fn node(&self, index: NodeIndex) -> SceneNode<'_> {
        SceneNode { nodes: &self.nodes, place: self.nodes.address_of(index) }
    }

    /// Returns the point of the world, metres, that all transforms and boxes of the scene are
    /// relative to: zero, or near the middle of a scene that is far from it. Single precision would
    /// else place a part of a plant in national coordinates a quarter of a metre wrong.
    pub fn world_origin(&self) -> DVec3 {
        self.nodes.world_origin()
    }

    /// Returns a point of the world, metres, as the scene's transforms and boxes have it.
    pub fn point_from_world(&self, point: [f64; 3]) -> Vec3 {
        (DVec3::from(point) - self.world_origin()).as_vec3()
    }

    /// Returns a point of the scene in coordinates of the world, metres.
    pub fn point_to_world(&self, point: Vec3) -> [f64; 3] {
        (point.as_dvec3() + self.world_origin()).to_array()
    }

    /// Returns the transform from the space of an instance's mesh to the world, relative to
    /// [`Self::world_origin`].
    pub fn world_from_mesh(&self, instance: &MeshInstance) -> Mat4 {
        self.nodes.world_from(self.nodes.address_in(instance.placement, instance.node))
    }

    /// Returns the world-space box around an instance's mesh; `None` without vertices.
    pub fn bounds_of_mesh(&self, instance: &MeshInstance) -> Option<Bounds> {
        let bounds = self.instances.bounds_of_mesh(instance)?;
        Some(bounds.transformed(&self.world_from_mesh(instance)))
    }

    /// Iterates over the mesh instances to draw.
    pub fn instances(&self) -> impl ExactSizeIterator<Item = MeshInstance> {
        (0..self.instances.len()).map(|index| self.instance(index))
    }

    /// Returns the mesh instance of an index.
    pub fn instance(&self, index: usize) -> MeshInstance {
        self.instances.get(index, &self.nodes)
    }

    /// Finds the node of an equipment id.
    pub fn find(&self, id: &str) -> Option<NodeIndex> {
        self.nodes.find(id)
    }

    /// Returns the box around everything.
    pub fn bounds(&self) -> Option<Bounds> {
        self.bounds
    }

    /// Shows the meshes of a model as the pieces that they were taken apart into: for
    /// each mesh the range of its pieces, for each piece its box in mesh space.
    pub fn split_meshes(
        &mut self,
        model: ModelIndex,
        pieces: &[Range<u32>],
        boxes: &[Option<Bounds>],
    ) {
        self.instances.split_meshes(model, pieces, boxes);
    }

    /// Moves a part of a placement, with its subtree, from its modelled place. `pose` is a
    /// transform of the part's own space; `None` restores it. Returns the indices of the instances
    /// that moved. The box of the whole placement stays.
    pub fn set_part_pose(&mut self, part: NodeIndex, pose: Option<Mat4>) -> Vec<usize> {
        let place = self.nodes.address_of(part);
        let Some(index) = place.part.filter(|_| self.nodes.set_part_pose(place, pose)) else {
            return Vec::new();
        };
        let hangs_under = |instance: &usize| {
            let own = self.nodes.address_in(place.placement, self.instance(*instance).node);
            self.nodes.hangs_under(own, index)
        };
        self.instances.of_placement(place.placement).filter(hangs_under).collect()
    }

    fn place(&mut self, placement: &Placement) -> Result<(), SceneError> {
        let Placement { id, parent, transform, model, theta } = placement;
        if id.contains('/') {
            return Err(SceneError::SlashInId { id: id.clone() });
        }
        let parent = parent.map(|parent| parent as u32);
        let id_of = |nodes: &Nodes, placement: u32| nodes.id(NodeAddress { placement, part: None });
        let placed = self.nodes.place(id, parent, &transform.matrix(), *model);
        let placement = placed.map_err(|first| {
            let first = SceneNode {
                nodes: &self.nodes,
                place: NodeAddress { placement: first, part: None },
            };
            SceneError::DuplicateId {
                id: id.clone(),
                first_parent: first.parent().map(|parent| self.node(parent).id()),
                second_parent: parent.map(|parent| id_of(&self.nodes, parent)),
            }
        })?;
        if let Some(model) = *model {
            self.show(placement, model, *theta)?;
        }
        Ok(())
    }

    /// Adds the instances of a model that is placed.
    fn show(
        &mut self,
        placement: u32,
        model: ModelIndex,
        theta: Option<PolicyIndex>,
    ) -> Result<(), SceneError> {
        let place = |part: u32| NodeAddress { placement, part: Some(part) };
        let parts = self.nodes.parts_of_model(model);
        if let Some((first, second)) = parts.twins {
            let [first, second] =
                [first, second].map(|part| SceneNode { nodes: &self.nodes, place: place(part) });
            let parent = |node: SceneNode<'_>| Some(self.node(node.parent()?).id());
            return Err(SceneError::DuplicateId {
                id: first.id(),
                first_parent: parent(first),
                second_parent: parent(second),
            });
        }
        self.instances.show(placement, model, theta, parts);
        Ok(())
    }
}
