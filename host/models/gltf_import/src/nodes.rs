//! Node hierarchy of the scene that is shown, flattened with parents before children.

use std::collections::{HashMap, HashSet};
use std::ops::Range;

use busbar_scene::ModelNode;
use glam::DMat4;

use crate::ImportLimits;
use crate::bounded::List;
use crate::buffers::Buffers;
use crate::document::Document;
use crate::error::{ImportError, ImportFault};
use crate::instances;
use crate::limits::{MAX_CHILDREN, MAX_COORDINATE, MAX_SKIN_REMARKS};
use crate::names::{UniqueNames, clean_name};
use crate::report::Notes;
use crate::scalars::{Tolerant, Whole};
use crate::scene_choice::{self, SceneChoice};
use crate::schema::{Mesh, Node, NodeChildren, Scene};
use crate::shapes::{MeshShape, Shapes};
use crate::skins::{NONE, PoseFinder};
use crate::transforms::matrix;

/// Builds the nodes to show. Their meshes are indices into the shapes.
pub(crate) fn build<'a>(
    buffers: &'a Buffers<'a>,
    scene: Option<&SceneChoice>,
    limits: &ImportLimits,
    notes: &mut Notes,
) -> Result<(Vec<ModelNode>, Vec<MeshShape>), ImportError> {
    let document = buffers.document();
    let scene = scene.map(|choice| scene_choice::find(document, choice, notes)).transpose()?;
    let mut tree = Tree { document, parents: vec![NONE; document.nodes.len()], notes };
    let starts = tree.starts(scene)?;
    let reached = tree.attach(&starts, limits)?;
    let shown = tree.flatten(&starts, buffers, limits)?;
    let skipped = document.nodes.len() - reached;
    notes.add_many("node skipped: it is not in the scene shown", skipped);
    Ok(shown)
}

/// Parents of the nodes that are shown. A node that several nodes name hangs under the last of
/// them, and a root of the scene under none, as in other viewers.
struct Tree<'a, 'n> {
    document: &'a Document<'a>,
    /// Parent of each node, [`NONE`], or [`ROOT`] for a root of the scene.
    parents: Vec<u32>,
    notes: &'n mut Notes,
}

const ROOT: u32 = u32::MAX - 1;

impl<'a> Tree<'a, '_> {
    /// Returns the roots of the chosen scene, or else of the default scene. Without one, those of
    /// all scenes; without scenes, all nodes that have no parent.
    fn starts(&mut self, chosen: Option<usize>) -> Result<Vec<usize>, ImportError> {
        let document = self.document;
        let count = document.scenes.len();
        let scenes = match (chosen, document.scene.map(Whole::index)) {
            (Some(scene), _) => scene..scene + 1,
            (None, Some(scene)) if scene < count => scene..scene + 1,
            (None, Some(_)) if count > 0 => {
                self.notes.add("default scene that does not exist: the first one is shown");
                0..1
            }
            _ => 0..count,
        };
        if scenes.is_empty() {
            return self.parentless();
        }
        let mut starts = Vec::new();
        for scene in scenes {
            let place = || "/scene".to_owned();
            let scene_nodes: Scene<'_> = document.scenes.parse(scene, place)?;
            for (position, node) in scene_nodes.nodes.unwrap_or_default().0.iter().enumerate() {
                let place = || format!("/scenes/{scene}/nodes/{position}");
                document.nodes.require(node.index(), place)?;
                let parent = &mut self.parents[node.index()];
                if *parent != ROOT {
                    *parent = ROOT;
                    starts.push(node.index());
                }
            }
        }
        Ok(starts)
    }

    /// Returns all nodes that no node names as a child.
    fn parentless(&mut self) -> Result<Vec<usize>, ImportError> {
        let count = self.document.nodes.len();
        let mut is_child = vec![false; count];
        for node in 0..count {
            for child in self.children(node)? {
                is_child[child.index()] = true;
            }
        }
        let starts: Vec<usize> = (0..count).filter(|&node| !is_child[node]).collect();
        for &start in &starts {
            self.parents[start] = ROOT;
        }
        Ok(starts)
    }

    /// Gives each node that is shown its parent, and counts them. A node that leads back to itself
    /// is refused.
    fn attach(&mut self, starts: &[usize], limits: &ImportLimits) -> Result<usize, ImportError> {
        let mut reached = vec![false; self.parents.len()];
        let mut stack: Vec<usize> = starts.iter().rev().copied().collect();
        let mut order = Vec::new();
        for &start in starts {
            reached[start] = true;
        }
        // Depth first, in the order of the file's lists, so that the last parent is the last one
        // that a reader meets.
        while let Some(node) = stack.pop() {
            order.push(node);
            let children = self.children(node)?;
            for child in &children {
                let child = child.index();
                let before = std::mem::replace(&mut self.parents[child], node as u32);
                if before == ROOT {
                    self.parents[child] = ROOT;
                    self.refuse_own_ancestor(child, node, limits)?;
                    self.notes.add("root of the scene that is also a child: shown as a root");
                } else if before == node as u32 {
                    self.notes.add("child named twice: shown once");
                } else if before != NONE {
                    self.notes.add("node with several parents: shown under the last one");
                }
            }
            for child in children.iter().rev().map(|child| child.index()) {
                if !std::mem::replace(&mut reached[child], true) {
                    stack.push(child);
                }
            }
        }
        self.refuse_cycles(&order, limits)?;
        Ok(order.len())
    }

    /// Refuses a root that is named by a node below it.
    fn refuse_own_ancestor(
        &self,
        root: usize,
        node: usize,
        limits: &ImportLimits,
    ) -> Result<(), ImportError> {
        let mut ancestor = node;
        for _ in 0..=limits.max_depth {
            if ancestor == root {
                return Err(ImportFault::Cycle(root).at(format!("/nodes/{root}/children")));
            }
            match self.parents.get(self.parents[ancestor] as usize) {
                Some(_) => ancestor = self.parents[ancestor] as usize,
                None => break,
            }
        }
        Ok(())
    }

    /// Refuses cycles and too many levels: from each node, its parents lead to a root.
    fn refuse_cycles(&self, order: &[usize], limits: &ImportLimits) -> Result<(), ImportError> {
        // Levels of nodes below a root; 0 where not yet known.
        let mut levels = vec![0_u32; self.parents.len()];
        let mut path = Vec::new();
        for &start in order {
            let mut node = start;
            path.clear();
            while levels[node] == 0 && self.parents[node] != ROOT {
                path.push(node);
                if path.len() > self.parents.len() {
                    return Err(ImportFault::Cycle(start).at(format!("/nodes/{start}/children")));
                }
                node = self.parents[node] as usize;
            }
            // The node that was known already is looked at once more; no other is.
            path.push(node);
            let mut level = levels[node].saturating_sub(1);
            while let Some(node) = path.pop() {
                level += 1;
                levels[node] = level;
                if level > limits.max_depth {
                    let (count, limit) = (level.into(), limits.max_depth.into());
                    let fault = ImportFault::TooMany { what: "levels of nodes", count, limit };
                    return Err(fault.at(format!("/nodes/{node}")));
                }
            }
        }
        Ok(())
    }

    fn children(&self, node: usize) -> Result<Vec<Whole>, ImportError> {
        let element: NodeChildren = self.document.nodes.parse(node, || format!("/nodes/{node}"))?;
        let children = element.children.unwrap_or_default().0;
        for (position, child) in children.iter().enumerate() {
            let place = || format!("/nodes/{node}/children/{position}");
            self.document.nodes.require(child.index(), place)?;
        }
        Ok(children)
    }

    /// Flattens the trees depth first, in the order of the file's lists.
    fn flatten(
        &mut self,
        starts: &[usize],
        buffers: &'a Buffers<'a>,
        limits: &ImportLimits,
    ) -> Result<(Vec<ModelNode>, Vec<MeshShape>), ImportError> {
        struct Pending {
            node: usize,
            parent: Option<u32>,
            model_from_parent: DMat4,
        }
        let document = self.document;
        let mut names =
            NodeNames { document, unique: UniqueNames::default(), meshes: HashMap::new() };
        let mut shown: Vec<ModelNode> = Vec::new();
        let mut shapes = Shapes::new(document);
        let has_skins = document.skins.len() > 0;
        let mut poses = has_skins.then(|| PoseFinder::new(buffers, self.parents.clone(), limits));
        let mut skinned = Vec::new();
        let pend = |node, parent, model_from_parent| Pending { node, parent, model_from_parent };
        let mut stack: Vec<Pending> =
            starts.iter().rev().map(|&node| pend(node, None, DMat4::IDENTITY)).collect();
        while let Some(Pending { node: index, parent, model_from_parent }) = stack.pop() {
            let place = || format!("/nodes/{index}");
            let node: Node<'_> = document.nodes.parse(index, place)?;
            let parent_from_node = matrix(&node);
            let model_from_node = model_from_parent * parent_from_node;
            refuse_far(&parent_from_node, &model_from_node).map_err(|fault| fault.at(place()))?;
            if let Some(mesh) = node.mesh {
                document.meshes.require(mesh.index(), || place() + "/mesh")?;
            }
            let here = shown.len() as u32;
            let name = names.name_of(&node, index);
            let mesh = node.mesh.map(|mesh| self.shape(&node, mesh, &mut shapes));
            let extensions = node.extensions.as_ref();
            let instancing = extensions.and_then(|extensions| extensions.instancing.as_ref());
            let instances =
                match instancing.filter(|of| mesh.is_some() && instances::has_places(of)) {
                    None => None,
                    Some(instancing) => Some(instances::read(instancing, buffers, &place())?),
                };
            let own_mesh = if instances.is_some() { None } else { mesh };
            let added = 1 + instances.as_ref().map_or(0, Vec::len);
            let (count, limit) = ((shown.len() + added) as u64, limits.max_nodes.into());
            if count > limit {
                return Err(ImportFault::TooMany { what: "nodes", count, limit }.at(place()));
            }
            let part = |name, parent, matrix, mesh| ModelNode {
                name,
                parent,
                parent_from_node: matrix,
                mesh,
            };
            shown.push(part(name.clone(), parent, parent_from_node, own_mesh));
            for (instance, matrix) in instances.into_iter().flatten().enumerate() {
                match refuse_far(&matrix, &(model_from_node * matrix)) {
                    Ok(()) => {
                        let name = names.unique.unique(format!("{name}[{instance}]"));
                        shown.push(part(name, Some(here), matrix, mesh));
                    }
                    Err(_) => self.notes.add("instance left out: its place is no coordinate"),
                }
            }
            if let Some(poses) = &mut poses {
                poses.set_shown(index, here);
            }
            if let Some(skin) = &node.skin
                && mesh.is_some()
            {
                let nodes = here as usize..shown.len();
                skinned.push(Skinned { node: index, skin: skin.0, nodes, model_from_node });
            }
            let List(children): List<Whole, MAX_CHILDREN> = node.children.unwrap_or_default();
            let first = stack.len();
            for child in children.iter().map(|child| child.index()) {
                // Only under its own parent, and once there.
                if self.parents[child] == index as u32 {
                    self.parents[child] = NONE;
                    stack.push(pend(child, Some(here), model_from_node));
                }
            }
            stack[first..].reverse();
        }
        let skins = skinned.iter().filter_map(|of| of.skin).map(|skin| skin.0);
        let used = skins.collect::<HashSet<_>>().len();
        let unused = document.skins.len().saturating_sub(used);
        self.notes.add_many("skin skipped: no node shows it", unused);
        let mut refused = 0;
        for of in &skinned {
            let posed = self.pose(of, poses.as_mut(), (&mut shown, &mut shapes));
            let added = posed.unwrap_or_else(|ImportError { fault, place, .. }| {
                refused += 1;
                let remark = "skin ignored, its mesh is shown as modelled";
                self.notes.add(match refused <= MAX_SKIN_REMARKS {
                    true => format!("{remark}: {fault}, at {place}"),
                    false => format!("further {remark}"),
                });
                None
            });
            let Some(mut added) = added else { continue };
            if shown.len() < limits.max_nodes as usize {
                added.name = names.unique.unique(added.name);
                shown.push(added);
                self.notes.add(MOVED_SKINNED);
            } else {
                self.notes.add("skinned mesh left out: there are too many nodes");
            }
        }
        Ok((shown, shapes.into_list()))
    }

    /// Returns the shape of a node's mesh, before its skin.
    fn shape(&mut self, node: &Node<'_>, mesh: Whole, shapes: &mut Shapes<'_>) -> u32 {
        let weights = match &node.weights {
            Some(Tolerant(None)) => {
                self.notes.add(ODD_WEIGHTS);
                None
            }
            Some(Tolerant(Some(List(weights)))) => {
                Some(weights.iter().map(|weight| weight.0).collect::<Vec<_>>())
            }
            None => None,
        };
        let shape = shapes.unposed(mesh.index(), weights.as_deref());
        shape.unwrap_or_else(|| {
            self.notes.add(TOO_MANY_SHAPES);
            // Shapes without weights and pose are not bounded but by the meshes.
            shapes.unposed(mesh.index(), None).unwrap_or_default()
        })
    }

    /// Gives the nodes of a skinned mesh its shape in the pose. Returns a node to show it where the
    /// transform of its own node cannot be undone, or is far away from the joints.
    fn pose(
        &mut self,
        of: &Skinned,
        poses: Option<&mut PoseFinder<'_>>,
        (shown, shapes): (&mut [ModelNode], &mut Shapes<'_>),
    ) -> Result<Option<ModelNode>, ImportError> {
        let named_by = || format!("/nodes/{}/skin", of.node);
        let Some(skin) = of.skin else {
            return Err(ImportFault::Invalid("it is no index".into()).at(named_by()));
        };
        let Some(poses) = poses else {
            let (what, index) = ("skin", skin.index());
            return Err(ImportFault::Index { what, index, count: 0 }.at(named_by()));
        };
        let joints = poses.joints(skin.index(), shown, named_by, self.notes)?;
        let own = of.nodes.start;
        let Some(unposed) = shown[of.nodes.clone()].iter().find_map(|node| node.mesh) else {
            return Ok(None);
        };
        let inverse = of.model_from_node.inverse();
        let undone = inverse * of.model_from_node;
        let is_inverse = inverse.is_finite() && undone.abs_diff_eq(DMat4::IDENTITY, 1e-6);
        let distance = of.model_from_node.w_axis.truncate().distance(joints.origin);
        let is_near = distance <= MAX_JOINT_DISTANCE || of.nodes.len() > 1;
        // A node of its own stands at the first joint, where coordinates are small.
        // Primitives without joints stay where the node is.
        let is_wholly_skinned = shapes.summary_of(unposed).is_wholly_skinned;
        let (place, pose) = if is_inverse && (is_near || !is_wholly_skinned) {
            (None, joints.pose(&inverse, self.notes))
        } else {
            let model_from_place = DMat4::from_translation(joints.origin);
            let pose = joints.pose(&DMat4::from_translation(-joints.origin), self.notes);
            let (parent, parent_from_model) =
                if is_inverse { (Some(own as u32), inverse) } else { (None, DMat4::IDENTITY) };
            (Some((parent, parent_from_model * model_from_place)), pose)
        };
        let Some(posed) = shapes.posed(unposed, pose) else {
            self.notes.add(TOO_MANY_SHAPES);
            return Ok(None);
        };
        for node in shown[of.nodes.clone()].iter_mut().filter(|node| node.mesh.is_some()) {
            node.mesh = Some(posed).filter(|_| place.is_none());
        }
        Ok(place.map(|(parent, parent_from_node)| {
            let name = format!("{}[skin]", shown[own].name);
            ModelNode { name, parent, parent_from_node, mesh: Some(posed) }
        }))
    }
}

/// A node with a skinned mesh, and the nodes that show it.
struct Skinned {
    /// Index in the file.
    node: usize,
    skin: Option<Whole>,
    nodes: Range<usize>,
    model_from_node: DMat4,
}

const ODD_WEIGHTS: &str = "weights of morph targets that cannot be read: the mesh's are used";
const TOO_MANY_SHAPES: &str =
    "mesh shown as modelled: too many nodes show meshes in weights or poses of their own";
const MOVED_SKINNED: &str =
    "skinned mesh shown by a node of its own: its node is flat, or far from the joints";
/// Distance of a skinned mesh's node from the first joint, metres: single precision keeps a tenth
/// of a millimetre there.
const MAX_JOINT_DISTANCE: f64 = 1000.0;

/// Nodes keep to the bound that positions keep to; so do the factors of the
/// products down the hierarchy, which else would soon not be finite.
fn refuse_far(parent_from_node: &DMat4, model_from_node: &DMat4) -> Result<(), ImportFault> {
    let within = |values: &[f64]| values.iter().all(|v| v.abs() <= MAX_COORDINATE.into());
    let what = if !parent_from_node.is_finite() || !model_from_node.is_finite() {
        "the transform is not finite".to_owned()
    } else if !within(&parent_from_node.w_axis.to_array()) {
        format!("the translation is beyond {MAX_COORDINATE:e} metres")
    } else if !within(&model_from_node.to_cols_array()) {
        format!("the transform, together with those above it, exceeds {MAX_COORDINATE:e}")
    } else {
        return Ok(());
    };
    Err(ImportFault::Invalid(what))
}

/// Names of nodes, unique within the model.
struct NodeNames<'a> {
    document: &'a Document<'a>,
    unique: UniqueNames,
    /// Names of the meshes that gave theirs to nodes.
    meshes: HashMap<u32, String>,
}

impl NodeNames<'_> {
    /// Returns the node's own name, or its mesh's, or its number.
    fn name_of(&mut self, node: &Node<'_>, index: usize) -> String {
        let own = node.name.as_deref().map(clean_name).filter(|name| !name.is_empty());
        let name =
            own.or_else(|| self.mesh_name(node.mesh?)).unwrap_or_else(|| format!("node {index}"));
        self.unique.unique(name)
    }

    fn mesh_name(&mut self, mesh: Whole) -> Option<String> {
        let document = self.document;
        let name = self.meshes.entry(mesh.0).or_insert_with(|| {
            let parsed = document.meshes.parse(mesh.index(), String::new);
            let name =
                parsed.ok().and_then(|mesh: Mesh<'_>| Some(clean_name(mesh.name.as_deref()?)));
            name.unwrap_or_default()
        });
        Some(name.clone()).filter(|name| !name.is_empty())
    }
}
