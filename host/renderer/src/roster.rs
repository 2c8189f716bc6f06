//! What is drawn in order: same mesh at the same cursor together, whoever looks.
//!
//! It follows a list from frame to frame and moves what changed. The order depends on
//! what is drawn alone, not on how it came to be, so that the same frame gives the same
//! picture.

use std::collections::HashMap;

use busbar_shaders::{Instance, NONE};
use glam::Mat4;

use crate::frustum::Ball;
use crate::index_cache::IndexKey;
use crate::model::{GpuMesh, GpuModel};
use crate::morph::Way;
use crate::{DrawInstance, DrawList, Instances, Morph, PATTERNS, RenderError};

/// What is drawn together, the most important first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub(crate) struct Kind {
    pub(crate) key: IndexKey,
    /// Where it is on its way to, if it is.
    pub(crate) way: Option<Way>,
    /// The transforms mirror.
    pub(crate) mirrored: bool,
}

/// Instances of a kind.
#[derive(Debug)]
pub(crate) struct Members {
    pub(crate) kind: Kind,
    /// In the order of their places.
    pub(crate) members: Vec<Member>,
    /// Around each, world space: beside each other, since whoever looks goes through all
    /// of them while the caches hold the last picture.
    pub(crate) balls: Vec<Ball>,
    /// Whether some came or went that are not in order yet.
    is_stale: bool,
}

/// An instance of a kind.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Member {
    place: u32,
    /// Index in [`Roster::instances`].
    pub(crate) slot: u32,
}

/// In place of a slot or a kind: nothing is drawn there.
const EMPTY: u32 = u32::MAX;

/// Kinds that are kept though nothing is of them any more: what comes and goes as one walks
/// finds its room again.
const MAX_BARE_KINDS: usize = 256;

/// A list in order.
#[derive(Default)]
pub(crate) struct Roster {
    /// That of the list, where it is one that is kept.
    revision: Option<u64>,
    /// Of each place the slot of what is drawn there, or [`EMPTY`].
    slots: Vec<u32>,
    /// By slot; features are named, but not tinted yet.
    pub(crate) instances: Vec<Instance>,
    /// By slot the number of its kind, or [`EMPTY`].
    kinds: Vec<u32>,
    /// Slots that nothing is in any more.
    free: Vec<u32>,
    /// By the numbers of their kinds.
    members: Vec<Members>,
    numbers: HashMap<Kind, u32, foldhash::fast::RandomState>,
    /// Numbers of kinds in the order of those.
    order: Vec<u32>,
    /// Numbers of those that are stale.
    stale: Vec<u32>,
    /// Room to put members in order.
    joined: Vec<(Member, Ball)>,
}

impl Roster {
    /// Takes over what a list came to.
    pub(crate) fn follow(
        &mut self,
        models: &[Option<GpuModel>],
        instances: Instances<'_>,
    ) -> Result<(), RenderError> {
        // After an error nothing is known.
        let known = self.revision.take();
        match instances {
            Instances::Listed(listed) => self.fill(models, (0..).zip(listed)),
            Instances::Kept(list) => {
                match known.and_then(|revision| list.changed_since(revision)) {
                    Some(changed) => self.follow_changes(models, list, changed)?,
                    None => self.fill(models, list.placed())?,
                }
                self.revision = Some(list.revision());
                Ok(())
            }
        }
    }

    /// Looks through the next list from the beginning: models are not what they were.
    pub(crate) fn forget(&mut self) {
        self.revision = None;
    }

    /// What there is of each kind, in order.
    pub(crate) fn members(&self) -> impl Iterator<Item = &Members> {
        let in_order = self.order.iter().map(|&number| &self.members[number as usize]);
        in_order.filter(|members| !members.members.is_empty())
    }

    fn fill<'a>(
        &mut self,
        models: &[Option<GpuModel>],
        drawn: impl Iterator<Item = (u32, &'a DrawInstance)>,
    ) -> Result<(), RenderError> {
        *self = Self::default();
        for (place, drawn) in drawn {
            self.slots.resize(place as usize + 1, EMPTY);
            self.put(place, InOrder::of(models, drawn)?);
        }
        self.put_in_order();
        Ok(())
    }

    fn follow_changes(
        &mut self,
        models: &[Option<GpuModel>],
        list: &DrawList,
        changed: impl Iterator<Item = usize>,
    ) -> Result<(), RenderError> {
        self.slots.resize(list.len(), EMPTY);
        for place in changed {
            match list.get(place) {
                Some(drawn) => self.put(place as u32, InOrder::of(models, drawn)?),
                None => self.empty(place as u32),
            }
        }
        self.put_in_order();
        self.drop_bare();
        Ok(())
    }

    /// Puts something into a place, whatever was there.
    fn put(&mut self, place: u32, InOrder { kind, ball, instance }: InOrder) {
        let number = self.number_of(kind);
        let slot = match self.slots[place as usize] {
            EMPTY => self.free.pop().unwrap_or(self.instances.len() as u32),
            slot => slot,
        };
        self.slots[place as usize] = slot;
        if slot as usize == self.instances.len() {
            self.instances.push(instance);
            self.kinds.push(number);
        } else {
            self.instances[slot as usize] = instance;
            let was = std::mem::replace(&mut self.kinds[slot as usize], number);
            if was != EMPTY && was != number {
                self.note_stale(was);
            }
        }
        self.note_stale(number);
        let Members { members, balls, .. } = &mut self.members[number as usize];
        members.push(Member { place, slot });
        balls.push(ball);
    }

    fn empty(&mut self, place: u32) {
        let slot = std::mem::replace(&mut self.slots[place as usize], EMPTY);
        if slot != EMPTY {
            self.free.push(slot);
            let was = std::mem::replace(&mut self.kinds[slot as usize], EMPTY);
            self.note_stale(was);
        }
    }

    fn number_of(&mut self, kind: Kind) -> u32 {
        let Self { members, numbers, order, .. } = self;
        *numbers.entry(kind).or_insert_with(|| {
            let number = members.len() as u32;
            let of = |&number: &u32| members[number as usize].kind;
            let at = order.partition_point(|number| of(number) < kind);
            order.insert(at, number);
            members.push(Members { kind, members: Vec::new(), balls: Vec::new(), is_stale: false });
            number
        })
    }

    fn note_stale(&mut self, number: u32) {
        if !std::mem::replace(&mut self.members[number as usize].is_stale, true) {
            self.stale.push(number);
        }
    }

    /// Lets go of members that are no more, and puts those that came where they belong.
    fn put_in_order(&mut self) {
        let Self { slots, kinds, members, stale, joined, .. } = self;
        for number in stale.drain(..) {
            let Members { members, balls, is_stale, .. } = &mut members[number as usize];
            *is_stale = false;
            let is_there = |(Member { place, slot }, _): &(Member, Ball)| {
                slots[*place as usize] == *slot && kinds[*slot as usize] == number
            };
            joined.extend(members.drain(..).zip(balls.drain(..)).filter(is_there));
            // Stable: of what moved, the last is how it is.
            joined.sort_by_key(|(member, _)| member.place);
            for (member, ball) in joined.drain(..) {
                if members.last().is_some_and(|last| last.place == member.place) {
                    members.pop();
                    balls.pop();
                }
                members.push(member);
                balls.push(ball);
            }
        }
    }

    /// Forgets kinds of which nothing is, where they are many: others are numbered anew.
    fn drop_bare(&mut self) {
        if self.order.len() - self.members().count() <= MAX_BARE_KINDS {
            return;
        }
        let Self { kinds, members, numbers, order, .. } = self;
        order.retain(|&number| !members[number as usize].members.is_empty());
        let mut renumbered = vec![EMPTY; members.len()];
        for (was, known) in std::mem::take(members).into_iter().enumerate() {
            if known.members.is_empty() {
                numbers.remove(&known.kind);
            } else {
                renumbered[was] = members.len() as u32;
                members.push(known);
            }
        }
        let of_slots = kinds.iter_mut().filter(|number| **number != EMPTY);
        for number in numbers.values_mut().chain(order).chain(of_slots) {
            *number = renumbered[*number as usize];
        }
    }
}

/// What becomes of an instance.
struct InOrder {
    kind: Kind,
    ball: Ball,
    /// Features are named, but not tinted yet.
    instance: Instance,
}

impl InOrder {
    fn of(models: &[Option<GpuModel>], drawn: &DrawInstance) -> Result<Self, RenderError> {
        let mesh = mesh_of(models, drawn)?;
        let kind = kind_of(mesh, drawn);
        Ok(Self {
            kind,
            ball: mesh.ball.transformed(&drawn.world_from_mesh),
            instance: instance_of(mesh, drawn, kind.mirrored),
        })
    }
}

/// That of the last pattern, fully.
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

fn kind_of(mesh: &GpuMesh, drawn: &DrawInstance) -> Kind {
    let cursor = drawn.cursor.min(mesh.stacks.collapse_count());
    Kind {
        key: IndexKey { model: drawn.model.0, mesh: drawn.mesh, cursor },
        way: drawn.morph.and_then(|morph| way_of(mesh, cursor, morph)),
        mirrored: mirrors(&drawn.world_from_mesh),
    }
}

/// `None` where there is nowhere to go.
fn way_of(mesh: &GpuMesh, cursor: u32, morph: Morph) -> Option<Way> {
    let coarser = morph.coarser.min(mesh.stacks.collapse_count());
    let weight = morph.weight.clamp(0.0, 1.0);
    (coarser > cursor && weight > 0.0).then_some(Way { coarser, weight: weight.to_bits() })
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
