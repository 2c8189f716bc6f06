//! Instance culling: visible instances of a frame, culled by frustum and occlusion, in batches.

use std::cell::LazyCell;
use std::ops::Range;

use busbar_culling::Frustum;
use busbar_geometry::Bounds;
use busbar_shaders::{Instance, NONE};
use glam::Mat4;

use crate::RenderError;
use crate::batch::{Batch, DrawPhase, Highlights, IndexKey};
use crate::instance_buckets::{Bucket, InstanceBuckets, clamped};
use crate::model::{GpuMesh, GpuModel};

/// Test of an instance, with the bounds of its mesh: reports whether all of it is occluded.
pub(crate) type OcclusionQuery<'a> = &'a dyn Fn(&Instance, &Bounds) -> bool;

/// Frustum and occlusion query that instances are culled by.
pub(crate) struct CullView<'a> {
    frustum: Frustum,
    /// Occlusion query; `None` where nothing is occluded.
    is_occluded: Option<OcclusionQuery<'a>>,
}

impl<'a> CullView<'a> {
    /// Makes a view that culls by the frustum and, if there is one, by an occlusion query.
    pub(crate) fn new(clip_from_world: &Mat4, is_occluded: Option<OcclusionQuery<'a>>) -> Self {
        Self { frustum: Frustum::from_matrix(clip_from_world), is_occluded }
    }
}

/// One frame's instances in drawing order. Filled anew each frame; its room serves the
/// next one.
#[derive(Default)]
pub(crate) struct VisibleInstances {
    /// Instances that may be visible.
    pub(crate) instances: Vec<Instance>,
    /// Tints of features, instance by instance.
    pub(crate) feature_highlights: Vec<[f32; 4]>,
    pub(crate) batches: Vec<Batch>,
    /// Room for them in another order.
    pub(crate) ordered: Vec<Instance>,
    /// Two-pass occlusion: whether near instances are drawn first.
    pub(crate) has_first_phase: bool,
}

impl VisibleInstances {
    /// Lists the visible instances. `object_highlights` tints objects, for features; it may be
    /// empty.
    pub(crate) fn fill(
        &mut self,
        models: &[Option<GpuModel>],
        buckets: &InstanceBuckets,
        object_highlights: &[[f32; 4]],
        view: &CullView<'_>,
    ) -> Result<(), RenderError> {
        self.instances.clear();
        self.feature_highlights.clear();
        self.batches.clear();
        self.has_first_phase = false;
        for Bucket { key, entries, spheres, .. } in buckets.buckets() {
            let mut start = self.instances.len() as u32;
            let mut highlights = Highlights::None;
            // Of most kinds it is of no account.
            let mesh = LazyCell::new(|| mesh_at(models, key.mesh));
            let is_hidden = |instance: &Instance| {
                view.is_occluded.is_some_and(|is_occluded| {
                    mesh.is_some_and(|mesh| is_occluded(instance, &mesh.bounds))
                })
            };
            let seen =
                entries.iter().zip(spheres).filter(|(_, sphere)| view.frustum.is_visible(sphere));
            for (entry, _) in seen {
                let mut instance = buckets.instances[entry.slot as usize];
                if is_hidden(&instance) {
                    continue;
                }
                if instance.first_feature_object != 0 && !object_highlights.is_empty() {
                    self.tint_features(&mut instance, *mesh, object_highlights)?;
                }
                highlights = highlights.max(highlights_of(&instance));
                self.instances.push(instance);
            }
            // Parts of a model stand where the others do: they share what was written of those.
            if let [.., last, instance] = self.instances.as_slice()
                && start + 1 == self.instances.len() as u32
                && last == instance
            {
                self.instances.pop();
                start -= 1;
            }
            self.batches.push(Batch {
                key: key.mesh,
                morph: key.morph,
                mirrored: key.mirrored,
                highlights,
                instances: start..self.instances.len() as u32,
                first_count: 0,
                count: entries.len() as u32,
            });
        }
        Ok(())
    }

    /// Batches of which something may be in the picture.
    pub(crate) fn seen(&self) -> impl Iterator<Item = &Batch> {
        self.batches.iter().filter(|batch| !batch.instances.is_empty())
    }

    /// Iterates over the visible batches of a phase, with the instances in it.
    pub(crate) fn visible_in(&self, phase: DrawPhase) -> impl Iterator<Item = Batch> {
        let phases = self.seen().map(move |batch| batch.in_phase(phase));
        phases.filter(|batch| !batch.instances.is_empty())
    }

    /// Counts the instances that may be visible; instances that batches share count once.
    pub(crate) fn seen_count(&self) -> u32 {
        let mut counted = 0;
        let more = |batch: &Batch| {
            let Range { start, end } = batch.instances;
            let more = end.saturating_sub(start.max(counted));
            counted = counted.max(end);
            more
        };
        self.seen().map(more).sum()
    }

    /// Notes the tints of an instance's features, where any has one.
    fn tint_features(
        &mut self,
        instance: &mut Instance,
        mesh: Option<&GpuMesh>,
        highlights: &[[f32; 4]],
    ) -> Result<(), RenderError> {
        let Some(features) = mesh.and_then(|mesh| mesh.features.as_ref()) else {
            return Ok(());
        };
        let first_object = instance.first_feature_object;
        let first = first_object as usize - 1;
        let Some(of_objects) = highlights.get(first..first + features.count as usize) else {
            let object = first_object.saturating_add(features.count - 1);
            return Err(RenderError::NoHighlight { object, count: highlights.len() });
        };
        if of_objects.iter().any(|&[.., strength]| strength > 0.0) {
            instance.first_feature_highlight = self.feature_highlights.len() as u32;
            self.feature_highlights.extend(of_objects.iter().copied().map(clamped));
        }
        Ok(())
    }
}

pub(crate) fn mesh_at(models: &[Option<GpuModel>], key: IndexKey) -> Option<&GpuMesh> {
    models.get(key.model as usize)?.as_ref()?.meshes.get(key.mesh as usize)
}

fn highlights_of(instance: &Instance) -> Highlights {
    let [.., strength] = instance.highlight;
    match instance.first_feature_highlight {
        NONE if strength > 0.0 => Highlights::OfInstances,
        NONE => Highlights::None,
        _ => Highlights::OfFeatures,
    }
}
