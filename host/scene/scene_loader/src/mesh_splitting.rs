//! Large meshes to pieces of a bay's size, each with a distance and a detail of its own.

use std::ops::Range;

use busbar_config::Config;
use busbar_geometry::{Mesh, PieceLimits};
use busbar_scene::{Model, ModelIndex, SceneGraph};
use rayon::prelude::*;

use crate::models::{ImportedModels, ModelSource};
use crate::theta_policies::screen_error_models;

/// Limits for splitting meshes. Pieces have enough triangles that draw calls cost little. A piece
/// about as large as a bay has a distance and a visibility of its own.
const PIECES: PieceLimits = PieceLimits { triangles: 16_384, triangles_if_wide: 2048, wide: 10.0 };

/// Takes the meshes apart whose detail follows the error on the screen, so that each
/// piece has a cursor for its own distance: a site is often drawn as one mesh, and its
/// far end may be coarse while the near one is not.
pub(crate) fn split_meshes(
    config: &Config,
    imported: &mut ImportedModels,
    graph: Option<&mut SceneGraph>,
) {
    let Some(graph) = graph else { return };
    let following = screen_error_models(config);
    for (index, name) in config.models.keys().enumerate() {
        let model = ModelIndex(index as u32);
        let provenance = match &mut imported.models[index] {
            ModelSource::Known(known, _) if !known.provenance.pieces.is_empty() => {
                let boxes: Vec<_> =
                    known.stacks.iter().map(|stacks| stacks.mesh().bounds()).collect();
                graph.split_meshes(model, &known.provenance.pieces, &boxes);
                continue;
            }
            ModelSource::New(provenance, _) if following.contains(name) => provenance,
            _ => continue,
        };
        let meshes = &mut provenance.meshes;
        if meshes.iter().all(|mesh| mesh.triangles.len() <= PIECES.triangles as usize) {
            continue;
        }
        let whole = std::mem::take(meshes);
        let apart: Vec<_> = whole.into_par_iter().map(|mesh| mesh.into_pieces(PIECES)).collect();
        let mut pieces = Vec::with_capacity(apart.len());
        for of_mesh in apart {
            let first = meshes.len() as u32;
            meshes.extend(of_mesh);
            pieces.push(first..meshes.len() as u32);
        }
        let boxes: Vec<_> = meshes.iter().map(Mesh::bounds).collect();
        graph.split_meshes(model, &pieces, &boxes);
        imported.pieces.insert(index, pieces);
    }
}

/// Scales of the pieces that the meshes of a model were taken apart into.
pub(crate) fn scales_of_pieces(model: &Model, pieces: &[Range<u32>]) -> Vec<f32> {
    let mut scales = vec![1.0; model.meshes.len()];
    for (range, scale) in pieces.iter().zip(model.mesh_scales()) {
        scales[range.start as usize..range.end as usize].fill(scale);
    }
    scales
}
