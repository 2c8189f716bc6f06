//! Puts what is drawn in order: same mesh at the same cursor together.

use std::ops::Range;

use busbar_shaders::Instance;
use glam::Mat4;

use crate::index_cache::IndexKey;
use crate::model::GpuModel;
use crate::{DrawInstance, RenderError};

/// Instances that one draw call a section draws.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Batch {
    pub(crate) key: IndexKey,
    /// The transforms mirror.
    pub(crate) mirrored: bool,
    /// Range in [`Plan::instances`].
    pub(crate) instances: Range<u32>,
}

/// One frame's instances in drawing order.
#[derive(Default)]
pub(crate) struct Plan {
    pub(crate) instances: Vec<Instance>,
    pub(crate) batches: Vec<Batch>,
}

impl Plan {
    /// Sorts and groups. The order depends on what is drawn alone, so that the
    /// same frame gives the same picture.
    pub(crate) fn of(
        models: &[Option<GpuModel>],
        draws: &[DrawInstance],
    ) -> Result<Self, RenderError> {
        let mut sorted = Vec::with_capacity(draws.len());
        for draw in draws {
            sorted.push((key_of(models, draw)?, mirrors(&draw.world_from_mesh), draw));
        }
        sorted.sort_by_key(|&(key, mirrored, _)| (key, mirrored));
        let mut plan = Self::default();
        for (key, mirrored, draw) in sorted {
            let index = plan.instances.len() as u32;
            plan.instances.push(instance_of(draw, mirrored));
            match plan.batches.last_mut() {
                Some(batch) if (batch.key, batch.mirrored) == (key, mirrored) => {
                    batch.instances.end = index + 1;
                }
                _ => plan.batches.push(Batch { key, mirrored, instances: index..index + 1 }),
            }
        }
        Ok(plan)
    }
}

fn key_of(models: &[Option<GpuModel>], draw: &DrawInstance) -> Result<IndexKey, RenderError> {
    let model = draw.model.0;
    let meshes = &models
        .get(model as usize)
        .and_then(Option::as_ref)
        .ok_or(RenderError::UnknownModel(model))?
        .meshes;
    let mesh = meshes.get(draw.mesh as usize).ok_or_else(|| RenderError::BadReference {
        place: format!("an instance of model {model}"),
        what: "mesh",
        index: draw.mesh,
        count: meshes.len(),
    })?;
    let cursor = draw.cursor.min(mesh.stacks.collapse_count());
    Ok(IndexKey { model, mesh: draw.mesh, cursor })
}

fn mirrors(world_from_mesh: &Mat4) -> bool {
    world_from_mesh.determinant() < 0.0
}

fn instance_of(draw: &DrawInstance, mirrored: bool) -> Instance {
    let [r, g, b, strength] = draw.highlight;
    Instance {
        world_from_mesh: draw.world_from_mesh.to_cols_array_2d(),
        highlight: [r, g, b, strength.clamp(0.0, 1.0)],
        object: draw.object,
        handedness: if mirrored { -1.0 } else { 1.0 },
        padding: [0; 2],
    }
}
