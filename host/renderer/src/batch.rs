//! Puts what is drawn in order: same mesh at the same cursor together.

use std::ops::Range;

use busbar_shaders::{Instance, NONE};
use glam::Mat4;

use crate::frustum::Frustum;
use crate::index_cache::IndexKey;
use crate::model::{GpuMesh, GpuModel};
use crate::morph::Way;
use crate::pipelines::Highlights;
use crate::renderer::MAX_MODELS;
use crate::{DrawInstance, Frame, Morph, PATTERNS, RenderError};

/// Instances that one draw call a section draws.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Batch {
    pub(crate) key: IndexKey,
    /// Where it is on its way to, if it is.
    pub(crate) way: Option<Way>,
    /// The transforms mirror.
    pub(crate) mirrored: bool,
    /// Whether any of it may be in the picture; if not, it is ready for the camera to
    /// turn, but not drawn.
    pub(crate) seen: bool,
    pub(crate) highlights: Highlights,
    /// Range in [`Plan::instances`]; empty where it is not seen.
    pub(crate) instances: Range<u32>,
    /// How many it has, seen or not.
    pub(crate) count: u32,
}

impl Batch {
    fn holds(&self, place: Place) -> bool {
        let Place { key, way, mirrored, seen } = place;
        (self.key, self.way, self.mirrored, self.seen) == (key, way, mirrored, seen)
    }
}

/// One frame's instances in drawing order. Filled anew each frame, so that its room, and
/// the order that it found, serve the next one: from frame to frame little changes.
#[derive(Default)]
pub(crate) struct Plan {
    /// Those of batches that are seen.
    pub(crate) instances: Vec<Instance>,
    /// Tints of features, instance by instance.
    pub(crate) feature_highlights: Vec<[f32; 4]>,
    pub(crate) batches: Vec<Batch>,
    /// By index in the frame.
    places: Vec<Place>,
    /// In order: [`Place::rank`].
    order: Vec<u128>,
}

/// What decides where an instance is drawn, the most important first.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Place {
    key: IndexKey,
    way: Option<Way>,
    mirrored: bool,
    seen: bool,
}

impl Place {
    /// All of it and the index as one number, which is sorted the faster. Of ways, few as
    /// they are, it tells only whether there is one.
    fn rank(self, index: u32) -> u128 {
        let IndexKey { model, mesh, cursor } = self.key;
        let words = [model, mesh, cursor].map(u128::from);
        let flags = [self.way.is_some(), self.mirrored, self.seen];
        let flags = flags.into_iter().fold(0, |bits, flag| bits << 1 | u128::from(flag));
        // A model's number has fewer bits than would be cut off.
        words[0] << 99 | words[1] << 67 | words[2] << 35 | flags << 32 | u128::from(index)
    }
}

/// That of the last pattern, fully.
const MAX_STRENGTH: f32 = 2.0 * (PATTERNS - 1) as f32 + 1.0;

const _: () = assert!(MAX_MODELS <= 1 << 29);

impl Plan {
    /// Sorts and groups; draws what `frustum` may see. The order depends on what is drawn
    /// alone, so that the same frame gives the same picture.
    pub(crate) fn fill(
        &mut self,
        models: &[Option<GpuModel>],
        frame: &Frame<'_>,
        frustum: &Frustum,
    ) -> Result<(), RenderError> {
        self.places.clear();
        for draw in frame.instances {
            let mesh = mesh_of(models, draw)?;
            let key = key_of(mesh, draw);
            self.places.push(Place {
                key,
                way: draw.morph.and_then(|morph| way_of(mesh, key, morph)),
                mirrored: mirrors(&draw.world_from_mesh),
                seen: frustum.may_see(&mesh.ball.transformed(&draw.world_from_mesh)),
            });
        }
        if self.order.len() != self.places.len() {
            self.order = (0..self.places.len() as u128).collect();
        }
        // As they lay last: then they are nearly sorted.
        for rank in &mut self.order {
            let index = *rank as u32;
            *rank = self.places[index as usize].rank(index);
        }
        self.order.sort_unstable();
        self.instances.clear();
        self.feature_highlights.clear();
        self.batches.clear();
        for at in 0..self.order.len() {
            let index = self.order[at] as u32 as usize;
            let place = self.places[index];
            let highlights = match place.seen {
                true => self.add(models, &frame.instances[index], frame, place)?,
                false => Highlights::None,
            };
            let end = self.instances.len() as u32;
            match self.batches.last_mut() {
                Some(batch) if batch.holds(place) => {
                    batch.instances.end = end;
                    batch.count += 1;
                    batch.highlights = batch.highlights.max(highlights);
                }
                _ => self.batches.push(Batch {
                    key: place.key,
                    way: place.way,
                    mirrored: place.mirrored,
                    seen: place.seen,
                    highlights,
                    instances: end - u32::from(place.seen)..end,
                    count: 1,
                }),
            }
        }
        Ok(())
    }

    /// Adds an instance that is seen.
    fn add(
        &mut self,
        models: &[Option<GpuModel>],
        draw: &DrawInstance,
        frame: &Frame<'_>,
        place: Place,
    ) -> Result<Highlights, RenderError> {
        let mut instance = instance_of(draw, place.mirrored);
        if let Some(first) = draw.first_feature {
            let mesh = mesh_of(models, draw)?;
            self.add_features(&mut instance, first, mesh, frame.object_highlights)?;
        }
        self.instances.push(instance);
        Ok(highlights_of(&instance))
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
        instance.first_feature_object = first_object;
        if highlights.is_empty() {
            return Ok(());
        }
        let of_objects = first_object.checked_sub(1).and_then(|first| {
            highlights.get(first as usize..first as usize + features.count as usize)
        });
        let Some(of_objects) = of_objects else {
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

/// `None` where there is nowhere to go.
fn way_of(mesh: &GpuMesh, key: IndexKey, morph: Morph) -> Option<Way> {
    let coarser = morph.coarser.min(mesh.stacks.collapse_count());
    let weight = morph.weight.clamp(0.0, 1.0);
    (coarser > key.cursor && weight > 0.0).then_some(Way { coarser, weight: weight.to_bits() })
}

fn mirrors(world_from_mesh: &Mat4) -> bool {
    let [x, y, z] = [0, 1, 2].map(|column| world_from_mesh.col(column).truncate());
    x.cross(y).dot(z) < 0.0
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
    [r, g, b, strength.clamp(0.0, MAX_STRENGTH)]
}
