//! What is drawn in order: same mesh at the same cursor together, whoever looks.
//!
//! It follows a list from frame to frame and moves what changed. The order depends on
//! what is drawn alone, not on how it came to be, so that the same frame gives the same
//! picture.

use busbar_shaders::{Instance, NONE};
use glam::Mat4;

use crate::frustum::Ball;
use crate::index_cache::IndexKey;
use crate::model::{GpuMesh, GpuModel};
use crate::morph::Way;
use crate::{DrawInstance, DrawList, Instances, Morph, PATTERNS, RenderError};

/// What is drawn together, the most important first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
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
}

/// An instance of a kind.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Member {
    place: u32,
    /// Index in [`Roster::instances`].
    pub(crate) slot: u32,
}

/// In place of a slot: nothing is drawn there.
const EMPTY: u32 = u32::MAX;

/// A list in order.
#[derive(Default)]
pub(crate) struct Roster {
    /// That of the list, where it is one that is kept.
    revision: Option<u64>,
    /// Of each place the slot of what is drawn there, or [`EMPTY`].
    slots: Vec<u32>,
    /// By slot; features are named, but not tinted yet.
    pub(crate) instances: Vec<Instance>,
    kinds: Vec<Kind>,
    /// Slots that nothing is in any more.
    free: Vec<u32>,
    /// In order.
    members: Vec<Members>,
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

    pub(crate) fn members(&self) -> &[Members] {
        &self.members
    }

    fn fill<'a>(
        &mut self,
        models: &[Option<GpuModel>],
        drawn: impl Iterator<Item = (u32, &'a DrawInstance)>,
    ) -> Result<(), RenderError> {
        self.slots.clear();
        self.free.clear();
        self.members.clear();
        let mut order = drawn
            .map(|(place, drawn)| Ok((place, InOrder::of(models, drawn)?)))
            .collect::<Result<Vec<(u32, InOrder)>, RenderError>>()?;
        let places = order.last().map_or(0, |(last, _)| last + 1);
        self.slots.resize(places as usize, EMPTY);
        order.sort_unstable_by_key(|(place, drawn)| (drawn.kind, *place));
        for (slot, (place, _)) in (0..).zip(&order) {
            self.slots[*place as usize] = slot;
        }
        self.instances = order.iter().map(|(_, drawn)| drawn.instance).collect();
        self.kinds = order.iter().map(|(_, drawn)| drawn.kind).collect();
        let of_kinds = order.chunk_by(|(_, a), (_, b)| a.kind == b.kind);
        self.members.extend(of_kinds.map(|of_kind| {
            let member =
                |&(place, _): &(u32, InOrder)| Member { place, slot: self.slots[place as usize] };
            Members {
                kind: of_kind[0].1.kind,
                members: of_kind.iter().map(member).collect(),
                balls: of_kind.iter().map(|(_, drawn)| drawn.ball).collect(),
            }
        }));
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
            let drawn = list.get(place).map(|drawn| InOrder::of(models, drawn)).transpose()?;
            let slot = self.slots[place];
            let kind = drawn.as_ref().map(|drawn| drawn.kind);
            let was = self.kinds.get(slot as usize).copied();
            if was != kind {
                was.into_iter().for_each(|kind| self.leave(kind, place as u32));
            }
            match drawn {
                Some(drawn) => self.put(place, drawn),
                None if slot != EMPTY => {
                    self.slots[place] = EMPTY;
                    self.free.push(slot);
                }
                None => {}
            }
        }
        Ok(())
    }

    /// Puts into a place what is not among members of another kind.
    fn put(&mut self, place: usize, InOrder { kind, ball, instance }: InOrder) {
        let slot = match self.slots[place] {
            EMPTY => self.free.pop().unwrap_or(self.instances.len() as u32),
            slot => slot,
        };
        self.slots[place] = slot;
        if slot as usize == self.instances.len() {
            self.instances.push(instance);
            self.kinds.push(kind);
        } else {
            (self.instances[slot as usize], self.kinds[slot as usize]) = (instance, kind);
        }
        self.join(kind, Member { place: place as u32, slot }, ball);
    }

    fn leave(&mut self, kind: Kind, place: u32) {
        let Ok(at) = self.members.binary_search_by_key(&kind, |members| members.kind) else {
            return;
        };
        let Members { members, balls, .. } = &mut self.members[at];
        if let Ok(index) = members.binary_search_by_key(&place, |member| member.place) {
            members.remove(index);
            balls.remove(index);
        }
        if members.is_empty() {
            self.members.remove(at);
        }
    }

    /// Takes it in, or moves it where it is in already.
    fn join(&mut self, kind: Kind, member: Member, ball: Ball) {
        match self.members.binary_search_by_key(&kind, |members| members.kind) {
            Ok(at) => {
                let Members { members, balls, .. } = &mut self.members[at];
                match members.binary_search_by_key(&member.place, |member| member.place) {
                    Ok(index) => balls[index] = ball,
                    Err(index) => {
                        members.insert(index, member);
                        balls.insert(index, ball);
                    }
                }
            }
            Err(at) => {
                let (members, balls) = (vec![member], vec![ball]);
                self.members.insert(at, Members { kind, members, balls });
            }
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
