//! Linear blend skinning at import: meshes in the pose in which the joints stand in the file
//! (glTF 2.0, section 3.7.3).

use std::collections::HashMap;
use std::rc::Rc;

use busbar_scene::ModelNode;
use glam::{DAffine3, DMat3, DMat4, DVec3, Vec3};

use crate::ImportLimits;
use crate::accessor::Accessor;
use crate::buffers::Buffers;
use crate::error::{ImportError, ImportFault};
use crate::limits::{MAX_POSED_JOINTS, MIN_POSED_JOINTS};
use crate::report::Notes;
use crate::schema::{ComponentType, Node, NodeChildren, Shape, Skin};
use crate::transforms::matrix;

/// Index that stands for no node.
pub(crate) const NONE: u32 = u32::MAX;

const IDENTITIES: &str = "inverse bind matrices that cannot be read: identities are used";

/// Transforms of a skin's joints, from the mesh as modelled to the space of the node that shows it.
/// Joints whose transform is not finite are `None`.
#[derive(Debug)]
pub(crate) struct Pose {
    joints: Vec<Option<DAffine3>>,
}

/// Places of a skin's joints in the space of the model.
pub(crate) struct JointPlaces {
    /// Transforms from the mesh as modelled, by joint.
    model_from_mesh: Vec<DMat4>,
    /// Origin of the first joint.
    pub(crate) origin: DVec3,
}

impl JointPlaces {
    /// Returns the pose in the space of a node.
    pub(crate) fn pose(&self, node_from_model: &DMat4, notes: &mut Notes) -> Rc<Pose> {
        let joint = |model_from_mesh: &DMat4| {
            let transform = *node_from_model * *model_from_mesh;
            transform.is_finite().then(|| DAffine3::from_mat4(transform))
        };
        let joints: Vec<_> = self.model_from_mesh.iter().map(joint).collect();
        let unusable = joints.iter().filter(|joint| joint.is_none()).count();
        notes.add_many("joint left out: its transform is not finite", unusable);
        Rc::new(Pose { joints })
    }
}

/// Finds the poses of skins from the nodes of a file.
pub(crate) struct PoseFinder<'a> {
    pub(crate) buffers: &'a Buffers<'a>,
    /// Parent of each node of the file, as it is shown; [`NONE`] or a larger number for roots and
    /// for nodes that are not shown.
    parents: Vec<u32>,
    /// Index of each node of the file among those that are shown, or [`NONE`].
    shown_index: Vec<u32>,
    /// True once `parents` holds nodes outside the shown scene too.
    is_whole: bool,
    known: HashMap<u32, DMat4>,
    /// Places of the joints of each skin that was read; `None` for a skin that cannot be.
    places: HashMap<usize, Option<Rc<JointPlaces>>>,
    /// Joints of all poses so far.
    joints: usize,
    max_depth: u32,
}

impl<'a> PoseFinder<'a> {
    pub(crate) fn new(buffers: &'a Buffers<'a>, parents: Vec<u32>, limits: &ImportLimits) -> Self {
        let shown_index = vec![NONE; parents.len()];
        let (known, places, max_depth) = (HashMap::new(), HashMap::new(), limits.max_depth);
        let is_whole = false;
        Self { buffers, parents, shown_index, is_whole, known, places, joints: 0, max_depth }
    }

    /// Records the place of a node among those that are shown.
    pub(crate) fn set_shown(&mut self, node: usize, shown: u32) {
        self.shown_index[node] = shown;
    }

    /// Finds the places of a skin's joints; `named_by` is the place that names the skin. Each skin is
    /// read once.
    pub(crate) fn joints(
        &mut self,
        skin: usize,
        nodes: &[ModelNode],
        named_by: impl FnOnce() -> String,
        notes: &mut Notes,
    ) -> Result<Rc<JointPlaces>, ImportError> {
        match self.places.get(&skin).cloned() {
            Some(Some(places)) => {
                self.charge(skin, places.model_from_mesh.len())?;
                Ok(places)
            }
            Some(None) => {
                let fault = ImportFault::Invalid("its skin cannot be read".into());
                Err(fault.at(format!("/skins/{skin}")))
            }
            None => {
                let places = self.read_joints(skin, nodes, named_by, notes).map(Rc::new);
                self.places.insert(skin, places.as_ref().ok().cloned());
                places
            }
        }
    }

    /// Counts joints of a pose against their limit.
    fn charge(&mut self, skin: usize, joints: usize) -> Result<(), ImportError> {
        self.joints = self.joints.saturating_add(joints);
        let text = self.buffers.document().text();
        let limit = text.len().clamp(MIN_POSED_JOINTS, MAX_POSED_JOINTS);
        if self.joints <= limit {
            return Ok(());
        }
        let (count, limit) = (self.joints as u64, limit as u64);
        let fault = ImportFault::TooMany { what: "joints of all skins", count, limit };
        Err(fault.at(format!("/skins/{skin}/joints")))
    }

    fn read_joints(
        &mut self,
        skin: usize,
        nodes: &[ModelNode],
        named_by: impl FnOnce() -> String,
        notes: &mut Notes,
    ) -> Result<JointPlaces, ImportError> {
        let document = self.buffers.document();
        let json: Skin = document.skins.parse(skin, named_by)?;
        self.charge(skin, json.joints.0.len())?;
        let inverse_binds = json.inverse_bind_matrices.and_then(|index| {
            let place = || format!("/skins/{skin}/inverseBindMatrices");
            let read = Accessor::new(self.buffers, index.index(), place).ok();
            let read = read.filter(|read| {
                read.shape == Shape::Mat4
                    && read.component_type == ComponentType::F32
                    && read.count >= json.joints.0.len()
            });
            notes.add_many(IDENTITIES, read.is_none().into());
            read
        });
        let mut model_from_mesh = Vec::with_capacity(json.joints.0.len());
        let mut origin = None;
        for (index, joint) in json.joints.0.iter().enumerate() {
            let place = || format!("/skins/{skin}/joints/{index}");
            document.nodes.require(joint.index(), place)?;
            let bind_from_mesh = inverse_binds.map_or(DMat4::IDENTITY, |matrices| {
                DMat4::from_cols_array(&matrices.floats_at::<16>(index).map(f64::from))
            });
            let model_from_joint = self.model_from_node(joint.0, nodes)?;
            origin.get_or_insert(model_from_joint.w_axis.truncate());
            model_from_mesh.push(model_from_joint * bind_from_mesh);
        }
        let origin = origin.filter(|origin| origin.is_finite()).unwrap_or_default();
        Ok(JointPlaces { model_from_mesh, origin })
    }

    /// Composes the transforms from a node of the file up to its root.
    fn model_from_node(&mut self, node: u32, nodes: &[ModelNode]) -> Result<DMat4, ImportError> {
        let mut path = Vec::new();
        let mut current = node;
        let mut model_from_node = loop {
            if let Some(&known) = self.known.get(&current) {
                break known;
            }
            path.push(current);
            if path.len() > self.max_depth as usize {
                let (count, limit) = (path.len() as u64, self.max_depth.into());
                let fault = ImportFault::TooMany { what: "levels of nodes", count, limit };
                return Err(fault.at(format!("/nodes/{node}")));
            }
            match self.parent(current) {
                Some(parent) => current = parent,
                None => break DMat4::IDENTITY,
            }
        };
        while let Some(node) = path.pop() {
            let shown = nodes.get(self.shown_index[node as usize] as usize);
            let parent_from_node = match shown {
                Some(shown) => shown.parent_from_node,
                None => {
                    let nodes = &self.buffers.document().nodes;
                    let place = || format!("/nodes/{node}");
                    matrix(&nodes.parse::<Node<'_>>(node as usize, place)?)
                }
            };
            model_from_node *= parent_from_node;
            self.known.insert(node, model_from_node);
        }
        Ok(model_from_node)
    }

    fn parent(&mut self, node: u32) -> Option<u32> {
        let is_shown = self.shown_index[node as usize] != NONE;
        if !is_shown && !self.is_whole {
            self.is_whole = true;
            self.attach_hidden();
        }
        let parent = self.parents[node as usize];
        ((parent as usize) < self.parents.len()).then_some(parent)
    }

    /// Gives nodes outside the shown scene their parents. Faults in them are no faults of the
    /// file: such nodes have no children.
    fn attach_hidden(&mut self) {
        let nodes = &self.buffers.document().nodes;
        for node in (0..nodes.len()).filter(|&node| self.shown_index[node] == NONE) {
            let element = nodes.parse::<NodeChildren>(node, String::new).ok();
            let children = element.and_then(|element| element.children).unwrap_or_default();
            for child in children.0.iter().map(|child| child.index()) {
                if self.shown_index.get(child) == Some(&NONE) {
                    self.parents[child] = node as u32;
                }
            }
        }
    }
}

/// Joints and weights of a primitive's vertices, with the pose of their skin.
pub(crate) struct Skinning<'a> {
    pose: Rc<Pose>,
    /// Accessors of joints and of weights, a pair a set.
    sets: Vec<[Accessor<'a>; 2]>,
}

/// Odd influences of a primitive, counted.
#[derive(Default)]
struct OddInfluences {
    /// Influences of joints that do not exist.
    of_no_joint: usize,
    /// Vertices whose weights are all zero.
    weightless: usize,
    /// Vertices whose weights have another sum than one.
    unnormalized: usize,
}

/// Difference of a vertex's weights from the sum of one that is no reason for a remark.
const WEIGHT_TOLERANCE: f64 = 0.01;

impl<'a> Skinning<'a> {
    /// Makes the skinning of a primitive from its sets of joints and weights; `None` without any.
    pub(crate) fn new(pose: &Rc<Pose>, sets: Vec<[Accessor<'a>; 2]>) -> Option<Self> {
        let read =
            |[joints, weights]: [Accessor<'a>; 2]| [joints.into_whole(), weights.into_normalized()];
        let sets: Vec<_> = sets.into_iter().map(read).collect();
        (!sets.is_empty()).then(|| Self { pose: Rc::clone(pose), sets })
    }

    pub(crate) fn accessors(&self) -> impl Iterator<Item = &Accessor<'a>> {
        self.sets.as_flattened().iter()
    }

    /// Blends the transforms of a vertex's joints by its weights, which are normalised. A vertex
    /// that no joint moves follows its first one.
    fn transform(&self, vertex: usize) -> DAffine3 {
        let (mut blended, mut total) = (DAffine3::ZERO, 0.0);
        for (joint, weight) in self.influences(vertex) {
            if let Some(joint) = joint.filter(|_| weight > 0.0) {
                blended.matrix3 += joint.matrix3 * weight;
                blended.translation += joint.translation * weight;
                total += weight;
            }
        }
        if total > 0.0 {
            let DAffine3 { matrix3, translation } = blended;
            return DAffine3 { matrix3: matrix3 / total, translation: translation / total };
        }
        let first = self.influences(vertex).find_map(|(joint, _)| joint);
        first.or(self.pose.joints.first().copied().flatten()).unwrap_or(DAffine3::IDENTITY)
    }

    /// Lists the joints of a vertex with their weights; weights that are none are zero.
    fn influences(&self, vertex: usize) -> impl Iterator<Item = (Option<DAffine3>, f64)> {
        self.sets.iter().flat_map(move |[joints, weights]| {
            let weights = weights.floats_at::<4>(vertex);
            std::iter::zip(joints.floats_at::<4>(vertex), weights).map(|(joint, weight)| {
                let is_index = joint >= 0.0 && joint.fract() == 0.0;
                let joint = is_index.then(|| self.pose.joints.get(joint as usize).copied());
                let weight = if weight.is_finite() { weight.max(0.0) } else { 0.0 };
                (joint.flatten().flatten(), weight.into())
            })
        })
    }

    pub(crate) fn position(&self, vertex: usize, position: Vec3) -> Vec3 {
        self.transform(vertex).transform_point3(position.as_dvec3()).as_vec3()
    }

    /// Turns a normal by the inverse transpose of the blended transform; its length is not one.
    pub(crate) fn normal(&self, vertex: usize, normal: Vec3) -> Vec3 {
        let DMat3 { x_axis: x, y_axis: y, z_axis: z } = self.transform(vertex).matrix3;
        // The cofactors, which need no division.
        let cofactors = DMat3::from_cols(y.cross(z), z.cross(x), x.cross(y));
        let sign = x.dot(y.cross(z)).signum();
        let turned: DVec3 = cofactors * normal.as_dvec3() * sign;
        turned.normalize_or_zero().as_vec3()
    }

    /// Reports whether a vertex is mirrored, which turns its triangles round.
    pub(crate) fn is_mirrored(&self, vertex: u32) -> bool {
        self.transform(vertex as usize).matrix3.determinant() < 0.0
    }

    /// Adds remarks on odd joints and weights of a primitive's vertices.
    pub(crate) fn note(&self, vertices: usize, notes: &mut Notes) {
        let stored = self.accessors().map(Accessor::stored_elements).max().unwrap_or(0);
        let mut odd = OddInfluences::default();
        for vertex in 0..vertices.min(usize::try_from(stored).unwrap_or(usize::MAX)) {
            let mut total = 0.0;
            for (joint, weight) in self.influences(vertex) {
                total += weight;
                odd.of_no_joint += usize::from(joint.is_none() && weight > 0.0);
            }
            odd.weightless += usize::from(total == 0.0);
            odd.unnormalized += usize::from(total > 0.0 && (total - 1.0).abs() > WEIGHT_TOLERANCE);
        }
        let OddInfluences { of_no_joint, weightless, unnormalized } = odd;
        notes.add_many("influence on a vertex left out: there is no such joint", of_no_joint);
        notes.add_many("skinned vertex without weights: it follows its first joint", weightless);
        notes.add_many("skinned vertex whose weights were normalised", unnormalized);
    }
}
