//! Instance buckets: instances sorted by mesh, cursor and morph, for instanced draws.
//!
//! It follows a list from frame to frame and moves what changed. The order depends on
//! what is drawn alone, not on how it came to be, so that the same frame gives the same
//! picture.

use std::collections::HashMap;

use busbar_culling::BoundingSphere;
use busbar_shaders::{Instance, NONE};
use glam::Mat4;

use crate::batch::{IndexKey, MorphKey};
use crate::model::{GpuMesh, GpuModel};
use crate::{DrawInstance, DrawList, InstanceSource, Morph, PATTERNS, RenderError};

/// Sort key of instances that are drawn together, the most important field first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub(crate) struct BucketKey {
    pub(crate) mesh: IndexKey,
    /// Morph target and weight, if the mesh morphs.
    pub(crate) morph: Option<MorphKey>,
    /// Handedness: the transforms mirror.
    pub(crate) mirrored: bool,
}

/// Bucket: instances with the same key.
#[derive(Debug)]
pub(crate) struct Bucket {
    pub(crate) key: BucketKey,
    /// In the order of their places.
    pub(crate) entries: Vec<BucketEntry>,
    /// Bounding spheres of the entries, world space. Kept side by side, since culling reads all of
    /// them with a cold cache.
    pub(crate) spheres: Vec<BoundingSphere>,
    /// Pending additions or removals that are not sorted in yet.
    is_stale: bool,
}

/// Instance in a bucket.
#[derive(Clone, Copy, Debug)]
pub(crate) struct BucketEntry {
    place: u32,
    /// Index of the instance in [`InstanceBuckets::instances`].
    pub(crate) slot: u32,
}

/// Marker of an empty slot or bucket number.
const EMPTY: u32 = u32::MAX;

/// Greatest number of empty buckets that are kept for instances that come back.
const MAX_EMPTY_BUCKETS: usize = 256;

/// A list in order.
#[derive(Default)]
pub(crate) struct InstanceBuckets {
    /// Revision of the retained list, if there is one.
    revision: Option<u64>,
    /// Slot of the instance in each place, or [`EMPTY`].
    slots: Vec<u32>,
    /// By slot; features are named, but not tinted yet.
    pub(crate) instances: Vec<Instance>,
    /// Bucket number of each slot, or [`EMPTY`].
    bucket_of_slot: Vec<u32>,
    /// Slots that are free again.
    free: Vec<u32>,
    /// Buckets, by bucket number.
    buckets: Vec<Bucket>,
    number_of_key: HashMap<BucketKey, u32, foldhash::fast::RandomState>,
    /// Bucket numbers in the order of their keys.
    order: Vec<u32>,
    /// Numbers of the stale buckets.
    stale: Vec<u32>,
    /// Room to put members in order.
    joined: Vec<(BucketEntry, BoundingSphere)>,
}

impl InstanceBuckets {
    /// Updates the buckets to the state of a list.
    pub(crate) fn update(
        &mut self,
        models: &[Option<GpuModel>],
        instances: InstanceSource<'_>,
    ) -> Result<(), RenderError> {
        // After an error nothing is known.
        let known = self.revision.take();
        match instances {
            InstanceSource::Listed(listed) => self.fill(models, (0..).zip(listed)),
            InstanceSource::Retained(list) => {
                match known.and_then(|revision| list.changed_since(revision)) {
                    Some(changed) => self.apply_changes(models, list, changed)?,
                    None => self.fill(models, list.iter_with_places())?,
                }
                self.revision = Some(list.revision());
                Ok(())
            }
        }
    }

    /// Invalidates all buckets: the next update reads the whole list, since models changed.
    pub(crate) fn invalidate(&mut self) {
        self.revision = None;
    }

    /// Returns the non-empty buckets in order.
    pub(crate) fn buckets(&self) -> impl Iterator<Item = &Bucket> {
        let in_order = self.order.iter().map(|&number| &self.buckets[number as usize]);
        in_order.filter(|entries| !entries.entries.is_empty())
    }

    fn fill<'a>(
        &mut self,
        models: &[Option<GpuModel>],
        drawn: impl Iterator<Item = (u32, &'a DrawInstance)>,
    ) -> Result<(), RenderError> {
        *self = Self::default();
        for (place, drawn) in drawn {
            self.slots.resize(place as usize + 1, EMPTY);
            self.put(place, PlacedInstance::new(models, drawn)?);
        }
        self.restore_order();
        Ok(())
    }

    fn apply_changes(
        &mut self,
        models: &[Option<GpuModel>],
        list: &DrawList,
        changed: impl Iterator<Item = usize>,
    ) -> Result<(), RenderError> {
        self.slots.resize(list.len(), EMPTY);
        for place in changed {
            match list.get(place) {
                Some(drawn) => self.put(place as u32, PlacedInstance::new(models, drawn)?),
                None => self.empty(place as u32),
            }
        }
        self.restore_order();
        self.remove_empty_buckets();
        Ok(())
    }

    /// Puts an instance into a place, replacing any other.
    fn put(&mut self, place: u32, PlacedInstance { key, sphere, instance }: PlacedInstance) {
        let number = self.bucket_number(key);
        let slot = match self.slots[place as usize] {
            EMPTY => self.free.pop().unwrap_or(self.instances.len() as u32),
            slot => slot,
        };
        self.slots[place as usize] = slot;
        if slot as usize == self.instances.len() {
            self.instances.push(instance);
            self.bucket_of_slot.push(number);
        } else {
            self.instances[slot as usize] = instance;
            let was = std::mem::replace(&mut self.bucket_of_slot[slot as usize], number);
            if was != EMPTY && was != number {
                self.mark_stale(was);
            }
        }
        self.mark_stale(number);
        let Bucket { entries, spheres, .. } = &mut self.buckets[number as usize];
        entries.push(BucketEntry { place, slot });
        spheres.push(sphere);
    }

    fn empty(&mut self, place: u32) {
        let slot = std::mem::replace(&mut self.slots[place as usize], EMPTY);
        if slot != EMPTY {
            self.free.push(slot);
            let was = std::mem::replace(&mut self.bucket_of_slot[slot as usize], EMPTY);
            self.mark_stale(was);
        }
    }

    fn bucket_number(&mut self, key: BucketKey) -> u32 {
        let Self { buckets, number_of_key, order, .. } = self;
        *number_of_key.entry(key).or_insert_with(|| {
            let number = buckets.len() as u32;
            let key_of = |&number: &u32| buckets[number as usize].key;
            let at = order.partition_point(|number| key_of(number) < key);
            order.insert(at, number);
            buckets.push(Bucket { key, entries: Vec::new(), spheres: Vec::new(), is_stale: false });
            number
        })
    }

    fn mark_stale(&mut self, number: u32) {
        if !std::mem::replace(&mut self.buckets[number as usize].is_stale, true) {
            self.stale.push(number);
        }
    }

    /// Removes instances that no longer exist and restores the sort order.
    fn restore_order(&mut self) {
        let Self { slots, bucket_of_slot, buckets, stale, joined, .. } = self;
        for number in stale.drain(..) {
            let Bucket { entries, spheres, is_stale, .. } = &mut buckets[number as usize];
            *is_stale = false;
            let is_there = |(BucketEntry { place, slot }, _): &(BucketEntry, BoundingSphere)| {
                slots[*place as usize] == *slot && bucket_of_slot[*slot as usize] == number
            };
            joined.extend(entries.drain(..).zip(spheres.drain(..)).filter(is_there));
            // Stable: of what moved, the last is how it is.
            joined.sort_by_key(|(entry, _)| entry.place);
            for (entry, sphere) in joined.drain(..) {
                if entries.last().is_some_and(|last| last.place == entry.place) {
                    entries.pop();
                    spheres.pop();
                }
                entries.push(entry);
                spheres.push(sphere);
            }
        }
    }

    /// Removes empty buckets beyond the limit; other buckets are renumbered.
    fn remove_empty_buckets(&mut self) {
        if self.order.len() - self.buckets().count() <= MAX_EMPTY_BUCKETS {
            return;
        }
        let Self { bucket_of_slot, buckets, number_of_key, order, .. } = self;
        order.retain(|&number| !buckets[number as usize].entries.is_empty());
        let mut renumbered = vec![EMPTY; buckets.len()];
        for (was, known) in std::mem::take(buckets).into_iter().enumerate() {
            if known.entries.is_empty() {
                number_of_key.remove(&known.key);
            } else {
                renumbered[was] = buckets.len() as u32;
                buckets.push(known);
            }
        }
        let of_slots = bucket_of_slot.iter_mut().filter(|number| **number != EMPTY);
        for number in number_of_key.values_mut().chain(order).chain(of_slots) {
            *number = renumbered[*number as usize];
        }
    }
}

/// Instance with its bucket key and bounding sphere.
struct PlacedInstance {
    key: BucketKey,
    sphere: BoundingSphere,
    /// Features are named, but not tinted yet.
    instance: Instance,
}

impl PlacedInstance {
    fn new(models: &[Option<GpuModel>], drawn: &DrawInstance) -> Result<Self, RenderError> {
        let mesh = mesh_of(models, drawn)?;
        let key = key_of(mesh, drawn);
        Ok(Self {
            key,
            sphere: mesh.sphere.transformed(&drawn.world_from_mesh),
            instance: instance_of(mesh, drawn, key.mirrored),
        })
    }
}

/// Greatest strength: the last pattern at full tint.
const MAX_STRENGTH: f32 = 2.0 * (PATTERNS - 1) as f32 + 1.0;

fn mesh_of<'a>(
    models: &'a [Option<GpuModel>],
    drawn: &DrawInstance,
) -> Result<&'a GpuMesh, RenderError> {
    let model = drawn.model.0;
    let meshes = &models
        .get(model as usize)
        .and_then(Option::as_ref)
        .ok_or(RenderError::UnknownModel(model))?
        .meshes;
    meshes.get(drawn.mesh as usize).ok_or_else(|| RenderError::BadReference {
        place: format!("an instance of model {model}"),
        what: "mesh",
        index: drawn.mesh,
        count: meshes.len(),
    })
}

fn key_of(mesh: &GpuMesh, drawn: &DrawInstance) -> BucketKey {
    let cursor = drawn.cursor.min(mesh.stacks.collapse_count());
    BucketKey {
        mesh: IndexKey { model: drawn.model.0, mesh: drawn.mesh, cursor },
        morph: drawn.morph.and_then(|morph| morph_key(mesh, cursor, morph)),
        mirrored: mirrors(&drawn.world_from_mesh),
    }
}

/// Returns the morph of an instance; `None` where its vertices do not move.
fn morph_key(mesh: &GpuMesh, cursor: u32, morph: Morph) -> Option<MorphKey> {
    let coarser = morph.coarser.min(mesh.stacks.collapse_count());
    let weight = morph.weight.clamp(0.0, 1.0);
    (coarser > cursor && weight > 0.0).then_some(MorphKey { coarser, weight: weight.to_bits() })
}

fn mirrors(world_from_mesh: &Mat4) -> bool {
    let [x, y, z] = [0, 1, 2].map(|column| world_from_mesh.col(column).truncate());
    x.cross(y).dot(z) < 0.0
}

fn instance_of(mesh: &GpuMesh, drawn: &DrawInstance, mirrored: bool) -> Instance {
    let rows = drawn.world_from_mesh.transpose().to_cols_array_2d();
    let first_feature = drawn.first_feature.filter(|_| mesh.features.is_some());
    Instance {
        world_from_mesh: [rows[0], rows[1], rows[2]],
        highlight: clamped(drawn.highlight),
        object: drawn.object,
        first_feature_object: first_feature.unwrap_or(0),
        first_feature_highlight: NONE,
        mirrored: mirrored.into(),
    }
}

pub(crate) fn clamped([r, g, b, strength]: [f32; 4]) -> [f32; 4] {
    [r, g, b, strength.clamp(0.0, MAX_STRENGTH)]
}
