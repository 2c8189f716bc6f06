//! The scene graph: placed models, flattened to mesh instances.

use std::collections::HashMap;

use busbar_geometry::{Bounds, Mesh};
use glam::{EulerRot, Mat4, Quat, Vec3};
use thiserror::Error;

use crate::{Model, ModelIndex, ThetaPolicy};

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
    /// Equipment id; model nodes are called `placement/node`.
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
    /// Index into the model's meshes.
    pub mesh: u32,
    /// Transform from mesh space to the world.
    pub world_from_mesh: Mat4,
    /// World-space box around the mesh; `None` without vertices.
    pub bounds: Option<Bounds>,
    /// The placement's own theta policy; none where the model's holds.
    pub theta: Option<PolicyIndex>,
}

/// Why placements make no scene.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
pub enum SceneError {
    /// Two nodes have one id.
    #[error("equipment id '{0}' is used twice")]
    DuplicateId(EquipmentId),
    /// More nodes than [`MAX_NODES`].
    #[error("the scene has more than {MAX_NODES} nodes")]
    TooManyNodes,
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
        if self.by_id.insert(id.clone(), index).is_some() {
            return Err(SceneError::DuplicateId(id));
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
        let mut added: Vec<NodeIndex> = Vec::with_capacity(model.nodes.len());
        for node in &model.nodes {
            let parent = node.parent.map_or(placement, |p| added[p as usize]);
            let id = format!("{prefix}/{}", node.name);
            let index = self.add(id, Some(parent), node.parent_from_node)?;
            added.push(index);
            if let Some(mesh) = node.mesh {
                self.instances.push(MeshInstance {
                    node: index,
                    model: model_index,
                    mesh,
                    world_from_mesh: self.node(index).world_from_node,
                    bounds: None,
                    theta,
                });
            }
        }
        Ok(())
    }

    /// Fills in bounds, from the meshes up to the roots.
    fn measure(&mut self, models: &[Model]) {
        let meshes = models.iter().map(|m| m.meshes.iter().map(Mesh::bounds).collect());
        let meshes: Vec<Vec<Option<Bounds>>> = meshes.collect();
        for instance in &mut self.instances {
            let mesh = meshes[instance.model.0 as usize][instance.mesh as usize];
            instance.bounds = mesh.and_then(|b| {
                let corners = b.corners().map(|c| instance.world_from_mesh.transform_point3(c));
                Bounds::around(corners)
            });
            grow(&mut self.nodes[instance.node.0 as usize].bounds, instance.bounds);
        }
        for index in (0..self.nodes.len()).rev() {
            if let Some(parent) = self.nodes[index].parent {
                let bounds = self.nodes[index].bounds;
                grow(&mut self.nodes[parent.0 as usize].bounds, bounds);
            }
        }
    }
}

fn grow(into: &mut Option<Bounds>, by: Option<Bounds>) {
    *into = match (*into, by) {
        (Some(a), Some(b)) => Some(a.union(b)),
        (a, b) => a.or(b),
    };
}

#[cfg(test)]
mod tests {
    use busbar_geometry::{RawPrimitive, weld};

    use super::*;
    use crate::ModelNode;

    fn model() -> Model {
        let primitive = RawPrimitive {
            positions: vec![Vec3::ZERO, Vec3::X, Vec3::Y],
            triangles: vec![[0, 1, 2]],
            ..Default::default()
        };
        let node = |name: &str, parent, mesh| ModelNode {
            name: name.into(),
            parent,
            parent_from_node: Mat4::from_translation(Vec3::Z),
            mesh,
        };
        Model {
            meshes: vec![weld(&[primitive]).unwrap().0],
            nodes: vec![node("tank", None, None), node("bushing", Some(0), Some(0))],
            ..Default::default()
        }
    }

    fn placement(id: &str, parent: Option<usize>, x: f32) -> Placement {
        let transform = Transform { translation: Vec3::X * x, ..Default::default() };
        Placement { id: id.into(), parent, transform, model: Some(ModelIndex(0)), theta: None }
    }

    #[test]
    fn model_nodes_hang_under_their_placement() {
        let placements = [placement("T1", None, 10.0), placement("T2", Some(0), 5.0)];
        let graph = SceneGraph::build(&placements, &[model()]).unwrap();
        assert_eq!(graph.instances().len(), 2);
        let bushing = graph.find("T2/bushing").unwrap();
        let world = graph.node(bushing).world_from_node.transform_point3(Vec3::ZERO);
        assert_eq!(world, Vec3::new(15.0, 0.0, 2.0));
        let all = graph.bounds().unwrap();
        assert_eq!((all.min.x, all.max.x), (10.0, 16.0));
        let world = graph.instances()[1].bounds.unwrap();
        assert_eq!((world.min, world.max), (Vec3::new(15.0, 0.0, 2.0), Vec3::new(16.0, 1.0, 2.0)));
    }

    #[test]
    fn a_placement_may_have_a_policy_of_its_own() {
        let mut placements = [placement("T1", None, 0.0), placement("T2", None, 5.0)];
        placements[1].theta = Some(ThetaPolicy::Fixed(0.5));
        let graph = SceneGraph::build(&placements, &[model()]).unwrap();
        let thetas: Vec<_> = graph.instances().iter().map(|i| i.theta).collect();
        assert_eq!(thetas, [None, Some(PolicyIndex(0))]);
        assert_eq!(graph.policies(), [ThetaPolicy::Fixed(0.5)]);
    }

    #[test]
    fn an_id_used_twice_is_refused() {
        let placements = [placement("T1", None, 0.0), placement("T1", None, 1.0)];
        let error = SceneGraph::build(&placements, &[model()]).unwrap_err();
        assert_eq!(error, SceneError::DuplicateId("T1".into()));
    }

    #[test]
    fn rotations_apply_about_x_then_y_then_z() {
        let transform =
            Transform { rotation_degrees: Vec3::new(90.0, 0.0, 90.0), ..Default::default() };
        let turned = transform.matrix().transform_vector3(Vec3::Y);
        assert!((turned - Vec3::Z).length() < 1e-6, "y -> z about x; z stays about z");
    }
}
