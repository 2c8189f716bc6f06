//! Assembly of named parts to the model that is written.

use busbar_geometry::{WeldError, weld};
use busbar_scene::{Model, ModelNode};
use glam::{Mat4, Vec3};

use crate::{Finish, Part};

/// Handle of a mesh in an [`Assembly`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MeshId(u32);

/// Handle of a node in an [`Assembly`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct NodeId(u32);

/// A model under construction.
#[derive(Debug, Default)]
pub struct Assembly {
    model: Model,
    finishes: Vec<Finish>,
}

impl Assembly {
    /// Creates an assembly whose root node has this name and stands on the origin.
    pub fn new(name: &str) -> (Self, NodeId) {
        let mut assembly = Self::default();
        let root = assembly.push_node(name, None, None, Mat4::IDENTITY);
        (assembly, root)
    }

    /// Converts a part to a mesh that any number of nodes can share.
    ///
    /// # Errors
    /// [`WeldError`] if a solid's points are not finite.
    pub fn mesh(&mut self, part: &Part) -> Result<MeshId, WeldError> {
        let primitives = part.primitives(|finish| self.material(finish));
        let (mesh, _) = weld(&primitives)?;
        self.model.meshes.push(mesh);
        Ok(MeshId(self.model.meshes.len() as u32 - 1))
    }

    /// Adds a node with a mesh and a name.
    pub fn place(&mut self, name: &str, parent: NodeId, mesh: MeshId, transform: Mat4) -> NodeId {
        self.push_node(name, Some(parent), Some(mesh), transform)
    }

    /// Adds a node with a part that is used once.
    ///
    /// # Errors
    /// Returns the errors of [`Assembly::mesh`].
    pub fn place_part(
        &mut self,
        name: &str,
        parent: NodeId,
        part: &Part,
        transform: Mat4,
    ) -> Result<NodeId, WeldError> {
        let mesh = self.mesh(part)?;
        Ok(self.place(name, parent, mesh, transform))
    }

    /// Returns the finished model.
    pub fn into_model(self) -> Model {
        self.model
    }

    fn push_node(
        &mut self,
        name: &str,
        parent: Option<NodeId>,
        mesh: Option<MeshId>,
        parent_from_node: Mat4,
    ) -> NodeId {
        self.model.nodes.push(ModelNode {
            name: name.to_owned(),
            parent: parent.map(|node| node.0),
            parent_from_node: parent_from_node.as_dmat4(),
            mesh: mesh.map(|mesh| mesh.0),
        });
        NodeId(self.model.nodes.len() as u32 - 1)
    }

    fn material(&mut self, finish: Finish) -> u32 {
        let known = self.finishes.iter().position(|&f| f == finish);
        let index = known.unwrap_or_else(|| {
            self.finishes.push(finish);
            self.model.materials.push(finish.material(&mut self.model.textures));
            self.finishes.len() - 1
        });
        index as u32
    }
}

/// Returns the transform that moves the origin to a point.
pub fn at(x: f32, y: f32, z: f32) -> Mat4 {
    Mat4::from_translation(Vec3::new(x, y, z))
}
