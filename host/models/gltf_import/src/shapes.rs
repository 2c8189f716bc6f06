//! Shapes: meshes with the morph weights and the pose in which a node shows them.

use std::collections::HashMap;
use std::rc::Rc;

use crate::document::Document;
use crate::limits::MAX_JSON_BYTES;
use crate::skins::Pose;

/// Mesh of the file as a node shows it.
#[derive(Clone, Debug)]
pub(crate) struct MeshShape {
    /// Index of the mesh in the file.
    pub(crate) mesh: usize,
    /// Weights of the morph targets that the node gives; those of the mesh without.
    pub(crate) weights: Option<Vec<f32>>,
    /// Pose of the node's skin.
    pub(crate) pose: Option<Rc<Pose>>,
}

impl MeshShape {
    /// Reports whether the mesh alone decides the shape.
    pub(crate) fn is_default(&self) -> bool {
        self.weights.is_none() && self.pose.is_none()
    }
}

/// Shapes of the nodes that are shown, each once.
pub(crate) struct Shapes<'a> {
    document: &'a Document<'a>,
    shapes: Vec<MeshShape>,
    /// Shapes without a pose, by mesh and the bits of the weights.
    known: HashMap<(usize, Option<Vec<u32>>), u32>,
    /// Bytes of JSON of the meshes that are shown in other shapes than their own.
    bytes: u64,
}

impl<'a> Shapes<'a> {
    pub(crate) fn new(document: &'a Document<'a>) -> Self {
        Self { document, shapes: Vec::new(), known: HashMap::new(), bytes: 0 }
    }

    /// Returns the shape of a mesh without a pose; `None` where there are too many.
    pub(crate) fn unposed(&mut self, mesh: usize, weights: Option<&[f32]>) -> Option<u32> {
        let bits = weights.map(|weights| weights.iter().map(|weight| weight.to_bits()).collect());
        let key = (mesh, bits);
        if let Some(&known) = self.known.get(&key) {
            return Some(known);
        }
        let shape = MeshShape { mesh, weights: weights.map(<[f32]>::to_vec), pose: None };
        let added = self.add(shape)?;
        self.known.insert(key, added);
        Some(added)
    }

    /// Adds a shape in a pose; `None` where there are too many.
    pub(crate) fn posed(&mut self, unposed: u32, pose: Rc<Pose>) -> Option<u32> {
        let shape = MeshShape { pose: Some(pose), ..self.shapes[unposed as usize].clone() };
        self.add(shape)
    }

    /// Adds a shape. A mesh is parsed for each of its shapes, so that their text is bounded.
    fn add(&mut self, shape: MeshShape) -> Option<u32> {
        if !shape.is_default() {
            let text = self.document.meshes.require(shape.mesh, String::new).ok()?.get();
            let bytes = self.bytes + text.len() as u64;
            if bytes > MAX_JSON_BYTES {
                return None;
            }
            self.bytes = bytes;
        }
        self.shapes.push(shape);
        Some(self.shapes.len() as u32 - 1)
    }

    pub(crate) fn into_list(self) -> Vec<MeshShape> {
        self.shapes
    }
}
