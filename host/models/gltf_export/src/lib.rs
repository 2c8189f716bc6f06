//! Models to GLB bytes (glTF 2.0, binary container).
//!
//! Invariant: the same model gives the same bytes, and every byte written is
//! reachable from the file's nodes or meshes: no unreferenced vertex survives.

mod binary;
mod check;
mod document;
mod error;
mod extensions;
mod features;
mod materials;
mod meshes;

use busbar_scene::{Model, ModelNode};
use glam::DMat4;

use crate::binary::Binary;
use crate::document::{Asset, Document, Node, Scene};
pub use crate::error::ExportError;
use crate::materials::MaterialWriter;

/// Writes a model as a GLB 2.0 file.
///
/// Each section with triangles becomes one primitive with the vertices that it
/// references, in order of first use. Sections without triangles, meshes
/// without any, and textures that no material names are left out: glTF has no
/// form for empty primitives.
///
/// Features are written by EXT_mesh_features, as 16-bit ids where all of a mesh
/// fit and as floats elsewhere, and their names by EXT_structural_metadata.
///
/// # Errors
/// [`ExportError`] names the part of the model that contradicts itself, or that
/// the file exceeds the 4 GiB of the format.
pub fn write_glb(model: &Model) -> Result<Vec<u8>, ExportError> {
    check::check(model)?;
    let mut binary = Binary::default();
    let mut document = Document {
        asset: Asset { version: "2.0", generator: concat!("busbar ", env!("CARGO_PKG_VERSION")) },
        ..Default::default()
    };
    let file_meshes = meshes::write(model, &mut document, &mut binary);
    MaterialWriter::write(model, &mut document, &mut binary)?;
    write_nodes(model, &file_meshes, &mut document);
    binary.finish(document)
}

/// Writes the node hierarchy. `file_meshes[i]` is the file's mesh for model mesh `i`, if it has
/// triangles.
fn write_nodes(model: &Model, file_meshes: &[Option<u32>], document: &mut Document) {
    let mut scene = Scene::default();
    document.nodes = model.nodes.iter().map(|node| file_node(node, file_meshes)).collect();
    for (index, node) in model.nodes.iter().enumerate() {
        match node.parent {
            Some(parent) => document.nodes[parent as usize].children.push(index as u32),
            None => scene.nodes.push(index as u32),
        }
    }
    if !scene.nodes.is_empty() {
        document.scene = Some(0);
        document.scenes = vec![scene];
    }
}

fn file_node(node: &ModelNode, file_meshes: &[Option<u32>]) -> Node {
    let matrix = node.parent_from_node;
    Node {
        name: node.name.clone(),
        matrix: (matrix != DMat4::IDENTITY).then(|| matrix.to_cols_array()),
        mesh: node.mesh.and_then(|mesh| file_meshes[mesh as usize]),
        children: Vec::new(),
    }
}
