//! Node hierarchy: strict trees, flattened with parents before children.

use busbar_scene::ModelNode;
use glam::{Mat4, Quat, Vec3};
use gltf::json::{Node, Root, scene};

use crate::ImportLimits;
use crate::error::{ImportError, ImportFault, item};
use crate::limits::MAX_COORDINATE;
use crate::names::{UniqueNames, clean_name};
use crate::report::Notes;

const NONE: u32 = u32::MAX;

/// Builds the nodes to show. Their meshes are indices into the *file's* meshes.
pub(crate) fn build(
    root: &Root,
    limits: &ImportLimits,
    notes: &mut Notes,
) -> Result<Vec<ModelNode>, ImportError> {
    let parents = parents(root)?;
    refuse_cycles(root, &parents)?;
    let starts = starts(root, &parents)?;
    let nodes = flatten(root, &starts, limits)?;
    notes.add_many("node skipped: it is not in the scene shown", root.nodes.len() - nodes.len());
    Ok(nodes)
}

/// Returns each node's parent, or [`NONE`].
fn parents(root: &Root) -> Result<Vec<u32>, ImportError> {
    let mut parents = vec![NONE; root.nodes.len()];
    for (index, node) in root.nodes.iter().enumerate() {
        for (position, child) in children(node).iter().enumerate() {
            let place = || format!("/nodes/{index}/children/{position}");
            item(&root.nodes, child.value(), "node", place)?;
            let parent = &mut parents[child.value()];
            if *parent != NONE {
                let (first, second) = (*parent as usize, index);
                let fault = ImportFault::TwoParents { node: child.value(), first, second };
                return Err(fault.at(place()));
            }
            *parent = index as u32;
        }
    }
    Ok(parents)
}

/// Refuses cycles: with at most one parent a node, nodes that no root reaches form a circle.
fn refuse_cycles(root: &Root, parents: &[u32]) -> Result<(), ImportError> {
    let mut reached: Vec<bool> = parents.iter().map(|&p| p == NONE).collect();
    let mut queue: Vec<usize> = (0..parents.len()).filter(|&n| reached[n]).collect();
    while let Some(node) = queue.pop() {
        for child in children(&root.nodes[node]) {
            reached[child.value()] = true;
            queue.push(child.value());
        }
    }
    match reached.iter().position(|&r| !r) {
        None => Ok(()),
        Some(node) => Err(ImportFault::Cycle(node).at(format!("/nodes/{node}/children"))),
    }
}

/// Returns the nodes that the default scene shows. Without one, those of all scenes; without
/// scenes, all that have no parent.
fn starts(root: &Root, parents: &[u32]) -> Result<Vec<usize>, ImportError> {
    let scenes: Vec<usize> = match root.scene {
        Some(scene) => {
            item(&root.scenes, scene.value(), "scene", || "/scene".into())?;
            vec![scene.value()]
        }
        None => (0..root.scenes.len()).collect(),
    };
    if scenes.is_empty() {
        return Ok((0..parents.len()).filter(|&n| parents[n] == NONE).collect());
    }
    let mut listed = vec![false; parents.len()];
    let mut starts = Vec::new();
    for scene in scenes {
        for (position, node) in root.scenes[scene].nodes.iter().enumerate() {
            let place = || format!("/scenes/{scene}/nodes/{position}");
            let node = node.value();
            item(&root.nodes, node, "node", place)?;
            if parents[node] != NONE {
                let what = format!("node {node} is a child of node {}, no root", parents[node]);
                return Err(ImportFault::Invalid(what).at(place()));
            }
            if !std::mem::replace(&mut listed[node], true) {
                starts.push(node);
            }
        }
    }
    Ok(starts)
}

/// Flattens the trees depth first, in the order of the file's lists.
fn flatten(
    root: &Root,
    starts: &[usize],
    limits: &ImportLimits,
) -> Result<Vec<ModelNode>, ImportError> {
    struct Pending {
        node: usize,
        parent: Option<u32>,
        model_from_parent: Mat4,
        level: u32,
    }
    let mut names = UniqueNames::default();
    let mut nodes = Vec::new();
    let pend =
        |node, parent, model_from_parent, level| Pending { node, parent, model_from_parent, level };
    let mut stack: Vec<Pending> =
        starts.iter().rev().map(|&node| pend(node, None, Mat4::IDENTITY, 1)).collect();
    while let Some(Pending { node: index, parent, model_from_parent, level }) = stack.pop() {
        let node = &root.nodes[index];
        if level > limits.max_depth {
            let (count, limit) = (level.into(), limits.max_depth.into());
            let fault = ImportFault::TooMany { what: "levels of nodes", count, limit };
            return Err(fault.at(format!("/nodes/{index}")));
        }
        let parent_from_node = matrix(node);
        let model_from_node = model_from_parent * parent_from_node;
        refuse_far(&parent_from_node, &model_from_node)
            .map_err(|fault| fault.at(format!("/nodes/{index}")))?;
        let mesh = match node.mesh {
            None => None,
            Some(mesh) => {
                item(&root.meshes, mesh.value(), "mesh", || format!("/nodes/{index}/mesh"))?;
                Some(mesh.value() as u32)
            }
        };
        let here = nodes.len() as u32;
        let name = names.unique(name_of(root, index));
        nodes.push(ModelNode { name, parent, parent_from_node, mesh });
        let below = children(node).iter().rev();
        stack.extend(below.map(|c| pend(c.value(), Some(here), model_from_node, level + 1)));
    }
    Ok(nodes)
}

/// Nodes keep to the bound that positions keep to; so do the factors of the
/// products down the hierarchy, which else would soon not be finite.
fn refuse_far(parent_from_node: &Mat4, model_from_node: &Mat4) -> Result<(), ImportFault> {
    let within = |values: &[f32]| values.iter().all(|v| v.abs() <= MAX_COORDINATE);
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

fn children(node: &Node) -> &[gltf::json::Index<scene::Node>] {
    node.children.as_deref().unwrap_or_default()
}

fn matrix(node: &Node) -> Mat4 {
    if let Some(matrix) = &node.matrix {
        return Mat4::from_cols_array(matrix);
    }
    let translation = Vec3::from_array(node.translation.unwrap_or([0.0; 3]));
    let scale = Vec3::from_array(node.scale.unwrap_or([1.0; 3]));
    let rotation = Quat::from_array(node.rotation.unwrap_or_default().0);
    // Exporters write all-zero quaternions for "no rotation".
    let length_squared = rotation.length_squared();
    let rotation = if length_squared == 0.0 { Quat::IDENTITY } else { rotation.normalize() };
    Mat4::from_scale_rotation_translation(scale, rotation, translation)
}

/// Returns the node's own name, or its mesh's, or its number.
fn name_of(root: &Root, index: usize) -> String {
    let node = &root.nodes[index];
    let mesh_name = || root.meshes.get(node.mesh?.value())?.name.as_deref();
    let given = |name: Option<&str>| name.map(clean_name).filter(|n| !n.is_empty());
    given(node.name.as_deref())
        .or_else(|| given(mesh_name()))
        .unwrap_or_else(|| format!("node {index}"))
}
