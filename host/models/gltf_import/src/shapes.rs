//! Shapes: meshes with the morph weights and the pose in which a node shows them.

use std::collections::HashMap;
use std::rc::Rc;

use crate::document::Document;
use crate::error::ImportError;
use crate::limits::{
    MAX_JOINT_SETS, MAX_JSON_BYTES, MAX_SHAPE_CORNERS, MIN_SHAPE_BYTES, MIN_SHAPE_CORNERS,
};
use crate::scalars::Whole;
use crate::schema;
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
    /// Corners of those meshes, as [`MAX_SHAPE_CORNERS`] counts them.
    corners: u64,
    summaries: HashMap<usize, MeshSummary>,
}

/// Facts of a mesh that decide on shapes of its own.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct MeshSummary {
    /// Corners of its triangles, as [`MAX_SHAPE_CORNERS`] counts them.
    corners: u64,
    /// True where each primitive has joints.
    pub(crate) is_wholly_skinned: bool,
}

impl<'a> Shapes<'a> {
    pub(crate) fn new(document: &'a Document<'a>) -> Self {
        let (shapes, known, summaries) = (Vec::new(), HashMap::new(), HashMap::new());
        Self { document, shapes, known, bytes: 0, corners: 0, summaries }
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

    /// Returns the facts of a shape's mesh.
    pub(crate) fn summary_of(&mut self, shape: u32) -> MeshSummary {
        let Some(&MeshShape { mesh, .. }) = self.shapes.get(shape as usize) else {
            return MeshSummary::default();
        };
        let read = || summary(self.document, mesh).unwrap_or_default();
        *self.summaries.entry(mesh).or_insert_with(read)
    }

    /// Adds a shape. A mesh is parsed and built for each of its shapes, so that text and corners
    /// are bounded.
    fn add(&mut self, shape: MeshShape) -> Option<u32> {
        if !shape.is_default() {
            let text = self.document.meshes.require(shape.mesh, String::new).ok()?.get();
            let bytes = self.bytes + text.len() as u64;
            let limit = (self.document.text().len() as u64).clamp(MIN_SHAPE_BYTES, MAX_JSON_BYTES);
            if bytes > limit {
                return None;
            }
            self.bytes = bytes;
        }
        let (is_default, added) = (shape.is_default(), self.shapes.len() as u32);
        self.shapes.push(shape);
        let corners =
            if is_default { 0 } else { self.summary_of(added).corners.max(MIN_SHAPE_CORNERS) };
        let total = self.corners.saturating_add(corners);
        if total > MAX_SHAPE_CORNERS {
            self.shapes.pop();
            return None;
        }
        self.corners = total;
        Some(added)
    }

    pub(crate) fn into_list(self) -> Vec<MeshShape> {
        self.shapes
    }
}

/// Reads the facts of a mesh. Faults are told where the mesh is read.
fn summary(document: &Document<'_>, mesh: usize) -> Result<MeshSummary, ImportError> {
    let json: schema::Mesh<'_> = document.meshes.parse(mesh, String::new)?;
    let mut summary = MeshSummary { corners: 0, is_wholly_skinned: true };
    for part in json.primitives.unwrap_or_default().0 {
        let primitive: schema::Primitive = document.parse(part, String::new)?;
        let count = |accessor: Option<Whole>| {
            let accessor = accessor.map(|accessor| {
                document.accessors.parse::<schema::Accessor<'_>>(accessor.index(), String::new)
            });
            accessor.and_then(Result::ok).map_or(0, |accessor| accessor.count.index() as u64)
        };
        let has_set = |set: &usize| primitive.attribute(&format!("JOINTS_{set}")).is_some();
        let sets = (0..MAX_JOINT_SETS).take_while(has_set).count();
        let elements = count(primitive.indices).max(count(primitive.attribute("POSITION")));
        let cost = elements.saturating_mul(sets.max(1) as u64);
        summary.corners = summary.corners.saturating_add(cost);
        summary.is_wholly_skinned &= sets > 0;
    }
    Ok(summary)
}
