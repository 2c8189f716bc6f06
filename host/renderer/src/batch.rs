//! Puts what is drawn in order: same mesh at the same cursor together.

use std::ops::Range;

use busbar_shaders::{Instance, NONE};
use glam::Mat4;

use crate::frustum::Frustum;
use crate::index_cache::IndexKey;
use crate::model::{GpuMesh, GpuModel};
use crate::pipelines::Highlights;
use crate::{DrawInstance, Frame, RenderError};

/// Instances that one draw call a section draws.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Batch {
    pub(crate) key: IndexKey,
    /// The transforms mirror.
    pub(crate) mirrored: bool,
    /// Whether any of it may be in the picture; if not, it is ready for the camera to
    /// turn, but not drawn.
    pub(crate) seen: bool,
    pub(crate) highlights: Highlights,
    /// Range in [`Plan::instances`].
    pub(crate) instances: Range<u32>,
}

/// One frame's instances in drawing order.
#[derive(Default)]
pub(crate) struct Plan {
    pub(crate) instances: Vec<Instance>,
    /// Tints of features, instance by instance.
    pub(crate) feature_highlights: Vec<[f32; 4]>,
    pub(crate) batches: Vec<Batch>,
}

impl Plan {
    /// Sorts and groups. The order depends on what is drawn alone, so that the
    /// same frame gives the same picture.
    pub(crate) fn of(models: &[Option<GpuModel>], frame: &Frame<'_>) -> Result<Self, RenderError> {
        let frustum = Frustum::of(&frame.camera.clip_from_world());
        let mut sorted = Vec::with_capacity(frame.instances.len());
        for draw in frame.instances {
            let mesh = mesh_of(models, draw)?;
            let ball = mesh.ball.transformed(&draw.world_from_mesh);
            let kind = (mirrors(&draw.world_from_mesh), frustum.may_see(&ball));
            sorted.push((key_of(mesh, draw), kind, draw));
        }
        sorted.sort_by_key(|&(key, kind, _)| (key, kind));
        let mut plan = Self::default();
        for (key, (mirrored, seen), draw) in sorted {
            let index = plan.instances.len() as u32;
            let mut instance = instance_of(draw, mirrored);
            if let Some(first) = draw.first_feature {
                let mesh = mesh_of(models, draw)?;
                plan.add_features(&mut instance, first, mesh, frame.object_highlights)?;
            }
            let highlights = highlights_of(&instance);
            plan.instances.push(instance);
            match plan.batches.last_mut() {
                Some(batch) if (batch.key, batch.mirrored, batch.seen) == (key, mirrored, seen) => {
                    batch.instances.end = index + 1;
                    batch.highlights = batch.highlights.max(highlights);
                }
                _ => plan.batches.push(Batch {
                    key,
                    mirrored,
                    seen,
                    highlights,
                    instances: index..index + 1,
                }),
            }
        }
        Ok(plan)
    }

    /// Batches of which something may be in the picture.
    pub(crate) fn seen(&self) -> impl Iterator<Item = &Batch> {
        self.batches.iter().filter(|batch| batch.seen)
    }

    /// Lets the features of an instance's mesh stand in for it.
    fn add_features(
        &mut self,
        instance: &mut Instance,
        first_object: u32,
        mesh: &GpuMesh,
        highlights: &[[f32; 4]],
    ) -> Result<(), RenderError> {
        let Some(features) = &mesh.features else {
            return Ok(());
        };
        let of_objects = first_object.checked_sub(1).and_then(|first| {
            highlights.get(first as usize..first as usize + features.count as usize)
        });
        let Some(of_objects) = of_objects else {
            let object = first_object.saturating_add(features.count - 1);
            return Err(RenderError::NoHighlight { object, count: highlights.len() });
        };
        instance.first_feature_object = first_object;
        if of_objects.iter().any(|&[.., strength]| strength > 0.0) {
            instance.first_feature_highlight = self.feature_highlights.len() as u32;
            self.feature_highlights.extend(of_objects.iter().copied().map(clamped));
        }
        Ok(())
    }
}

fn highlights_of(instance: &Instance) -> Highlights {
    let [.., strength] = instance.highlight;
    match instance.first_feature_highlight {
        NONE if strength > 0.0 => Highlights::OfInstances,
        NONE => Highlights::None,
        _ => Highlights::OfFeatures,
    }
}

fn mesh_of<'a>(
    models: &'a [Option<GpuModel>],
    draw: &DrawInstance,
) -> Result<&'a GpuMesh, RenderError> {
    let model = draw.model.0;
    let meshes = &models
        .get(model as usize)
        .and_then(Option::as_ref)
        .ok_or(RenderError::UnknownModel(model))?
        .meshes;
    meshes.get(draw.mesh as usize).ok_or_else(|| RenderError::BadReference {
        place: format!("an instance of model {model}"),
        what: "mesh",
        index: draw.mesh,
        count: meshes.len(),
    })
}

fn key_of(mesh: &GpuMesh, draw: &DrawInstance) -> IndexKey {
    let cursor = draw.cursor.min(mesh.stacks.collapse_count());
    IndexKey { model: draw.model.0, mesh: draw.mesh, cursor }
}

fn mirrors(world_from_mesh: &Mat4) -> bool {
    world_from_mesh.determinant() < 0.0
}

fn instance_of(draw: &DrawInstance, mirrored: bool) -> Instance {
    let rows = draw.world_from_mesh.transpose().to_cols_array_2d();
    Instance {
        world_from_mesh: [rows[0], rows[1], rows[2]],
        highlight: clamped(draw.highlight),
        object: draw.object,
        first_feature_object: 0,
        first_feature_highlight: NONE,
        mirrored: mirrored.into(),
    }
}

fn clamped([r, g, b, strength]: [f32; 4]) -> [f32; 4] {
    [r, g, b, strength.clamp(0.0, 1.0)]
}
