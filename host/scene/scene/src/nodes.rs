//! Nodes of a scene, packed: a site of a hundred stations has some 300,000. Each placement has a
//! record; its parts follow from its model.

use std::collections::HashMap;
use std::hash::{BuildHasher, RandomState};
use std::sync::Arc;

use busbar_geometry::Bounds;
use glam::{DMat3, DMat4, DVec3, Mat4};
use hashbrown::HashTable;

use crate::node_index::{NodeAddress, NodeIndex};
use crate::parts::{Part, PartMesh, Parts, union_bounds};
use crate::poses::Poses;
use crate::{EquipmentId, ModelIndex};

/// In place of an index: there is none.
const NONE: u32 = u32::MAX;

/// Distance of a scene's middle from zero up to which its transforms are those of the world: single
/// precision keeps half a millimetre there, metres.
const NEAR_METRES: f64 = 4096.0;
/// Step of the point that transforms are relative to, metres: a number that adds without rounding.
const ORIGIN_STEP: f64 = 1024.0;

/// Packed record of a placement.
#[derive(Clone, Copy, Debug)]
struct PlacementRecord {
    /// Node of the placement; those of its parts follow.
    node: u32,
    /// The placement it hangs under.
    parent: u32,
    model: u32,
    /// End of its id in the concatenated texts; it begins where the one before ends.
    id_end: u32,
}

/// Affine transforms in double precision: how things are turned and scaled, of which a site has
/// few ways, is kept once.
#[derive(Clone, Debug, Default)]
struct Transforms {
    /// The first three columns.
    turns: Vec<DMat3>,
    /// Turns by the bits of their numbers, as long as something is placed.
    known: HashMap<[u64; 9], u32>,
    all: Vec<PackedTransform>,
}

/// A transform by its turn's index and its last column.
#[derive(Clone, Copy, Debug)]
struct PackedTransform {
    turn: u32,
    origin: DVec3,
}

impl Transforms {
    fn with_capacity(count: usize) -> Self {
        Self { all: Vec::with_capacity(count), ..Self::default() }
    }

    fn push(&mut self, matrix: &DMat4) {
        let turn = DMat3::from_mat4(*matrix);
        let next = self.turns.len() as u32;
        let known = self.known.entry(turn.to_cols_array().map(f64::to_bits)).or_insert(next);
        if *known == next {
            self.turns.push(turn);
        }
        self.all.push(PackedTransform { turn: *known, origin: matrix.w_axis.truncate() });
    }

    /// Returns a transform as it is relative to a point of the world.
    fn get(&self, index: u32, relative_to: DVec3) -> DMat4 {
        let PackedTransform { turn, origin } = self.all[index as usize];
        let DMat3 { x_axis, y_axis, z_axis } = self.turns[turn as usize];
        DMat4::from_cols(
            x_axis.extend(0.0),
            y_axis.extend(0.0),
            z_axis.extend(0.0),
            (origin - relative_to).extend(1.0),
        )
    }
}

/// All nodes, parents before children.
#[derive(Clone, Debug, Default)]
pub(crate) struct Nodes {
    /// Parts of each model.
    parts: Vec<Arc<Parts>>,
    records: Vec<PlacementRecord>,
    world_from_placements: Transforms,
    /// Point of the world that all transforms and boxes are relative to.
    world_origin: DVec3,
    /// Boxes of the subtrees of placements that have children.
    tree_bounds: HashMap<u32, Bounds>,
    /// All placements' ids, one behind the other.
    ids: String,
    /// Placements by the hash of their ids.
    by_id: HashTable<u32>,
    hasher: RandomState,
    count: usize,
    poses: Poses,
}

impl Nodes {
    pub(crate) fn new(parts: Vec<Arc<Parts>>, placements: usize) -> Self {
        Self {
            parts,
            records: Vec::with_capacity(placements),
            world_from_placements: Transforms::with_capacity(placements),
            by_id: HashTable::with_capacity(placements),
            ..Self::default()
        }
    }

    pub(crate) fn len(&self) -> usize {
        self.count
    }

    pub(crate) fn parts_of_model(&self, model: ModelIndex) -> &Arc<Parts> {
        &self.parts[model.0 as usize]
    }

    /// Adds a placement and its parts; its index.
    ///
    /// # Errors
    /// The placement that has its id.
    pub(crate) fn place(
        &mut self,
        id: &str,
        parent: Option<u32>,
        parent_from_placement: &DMat4,
        model: Option<ModelIndex>,
    ) -> Result<u32, u32> {
        if let Some(first) = self.placement(id) {
            return Err(first);
        }
        let placement = self.records.len() as u32;
        self.ids.push_str(id);
        self.records.push(PlacementRecord {
            node: self.count as u32,
            parent: parent.unwrap_or(NONE),
            model: model.map_or(NONE, |model| model.0),
            id_end: self.ids.len() as u32,
        });
        self.count += 1 + model.map_or(0, |model| self.parts_of_model(model).all.len());
        let world_from_parent = parent
            .map_or(DMat4::IDENTITY, |parent| self.world_from_placements.get(parent, DVec3::ZERO));
        self.world_from_placements.push(&(world_from_parent * *parent_from_placement));
        let hash = self.hasher.hash_one(id);
        let Self { by_id, records, ids, hasher, .. } = self;
        by_id.insert_unique(hash, placement, |&other| hasher.hash_one(id_of(records, ids, other)));
        Ok(placement)
    }

    /// Finds the placement that has an id.
    fn placement(&self, id: &str) -> Option<u32> {
        let has_id = |&placement: &u32| id_of(&self.records, &self.ids, placement) == id;
        self.by_id.find(self.hasher.hash_one(id), has_id).copied()
    }

    /// Measures the subtrees of placements. Returns the box around all; no placement is added
    /// afterwards.
    pub(crate) fn finish(&mut self) -> Option<Bounds> {
        self.world_from_placements.known = HashMap::new();
        self.ids.shrink_to_fit();
        self.world_origin = self.far_origin();
        let mut all = None;
        for placement in (0..self.records.len() as u32).rev() {
            let below = self.tree_bounds.get(&placement).copied();
            let Some(bounds) = union_bounds(self.bounds_as_modelled(placement), below) else {
                continue;
            };
            if below.is_some() {
                self.tree_bounds.insert(placement, bounds);
            }
            let above = match self.records[placement as usize].parent {
                NONE => all.get_or_insert(bounds),
                parent => self.tree_bounds.entry(parent).or_insert(bounds),
            };
            *above = above.union(bounds);
        }
        all
    }

    /// Point that the transforms of a scene are relative to: its middle, where that is far from zero.
    fn far_origin(&self) -> DVec3 {
        let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        for placement in 0..self.records.len() as u32 {
            let Some(parts) = self.parts.get(self.records[placement as usize].model as usize)
            else {
                continue;
            };
            let world_from_placement = self.world_from_placements.get(placement, DVec3::ZERO);
            for mesh in &parts.meshes {
                let Some(bounds) = mesh.bounds else { continue };
                let placement_from_part = parts.all[mesh.part as usize].placement_from_part;
                let middle = placement_from_part.transform_point3(bounds.center().as_dvec3());
                let middle = world_from_placement.transform_point3(middle);
                (low, high) = (low.min(middle), high.max(middle));
            }
        }
        let middle = (low + high) * 0.5;
        match middle.is_finite() && middle.abs().max_element() > NEAR_METRES {
            true => (middle / ORIGIN_STEP).round() * ORIGIN_STEP,
            false => DVec3::ZERO,
        }
    }

    /// Returns the point of the world that transforms and boxes are relative to.
    pub(crate) fn world_origin(&self) -> DVec3 {
        self.world_origin
    }

    fn placed(&self, placement: u32) -> DMat4 {
        self.world_from_placements.get(placement, self.world_origin)
    }

    /// Returns the box around a placement's own meshes, as modelled.
    fn bounds_as_modelled(&self, placement: u32) -> Option<Bounds> {
        let parts = self.parts.get(self.records[placement as usize].model as usize)?;
        let world_from_placement = self.placed(placement);
        let of_mesh = |mesh: &PartMesh| {
            let placement_from_part = parts.all[mesh.part as usize].placement_from_part;
            Some(mesh.bounds?.transformed(&(world_from_placement * placement_from_part).as_mat4()))
        };
        parts.meshes.iter().filter_map(of_mesh).reduce(Bounds::union)
    }

    /// Iterates over the addresses of all placements and parts.
    pub(crate) fn addresses(&self) -> impl Iterator<Item = NodeAddress> {
        let of_placement = |(record, placement): (&PlacementRecord, u32)| {
            let parts = self.parts.get(record.model as usize).map_or(0, |parts| parts.all.len());
            let parts = (0..parts as u32).map(Some);
            std::iter::once(None).chain(parts).map(move |part| NodeAddress { placement, part })
        };
        self.records.iter().zip(0..).flat_map(of_placement)
    }

    pub(crate) fn address_of(&self, NodeIndex(node): NodeIndex) -> NodeAddress {
        let placement = self.records.partition_point(|record| record.node <= node) as u32 - 1;
        self.address_in(placement, NodeIndex(node))
    }

    /// Returns the address of a node that belongs to a placement.
    pub(crate) fn address_in(&self, placement: u32, NodeIndex(node): NodeIndex) -> NodeAddress {
        let part = (node - self.records[placement as usize].node).checked_sub(1);
        NodeAddress { placement, part }
    }

    pub(crate) fn node(&self, place: NodeAddress) -> NodeIndex {
        let node = self.records[place.placement as usize].node;
        NodeIndex(node + place.part.map_or(0, |part| part + 1))
    }

    fn part(&self, place: NodeAddress) -> Option<&Part> {
        let PlacementRecord { model, .. } = self.records[place.placement as usize];
        place.part.map(|part| &self.parts[model as usize].all[part as usize])
    }

    pub(crate) fn parent(&self, place: NodeAddress) -> Option<NodeIndex> {
        let NodeAddress { placement, .. } = place;
        let above = match self.part(place) {
            Some(part) => NodeAddress { placement, part: part.parent },
            None => {
                let parent = self.records[placement as usize].parent;
                NodeAddress { placement: (parent != NONE).then_some(parent)?, part: None }
            }
        };
        Some(self.node(above))
    }

    /// Returns the transform from a node to the world, relative to [`Self::world_origin`].
    pub(crate) fn world_from(&self, place: NodeAddress) -> Mat4 {
        let world_from_placement = self.placed(place.placement);
        let Some(part) = place.part else { return world_from_placement.as_mat4() };
        let PlacementRecord { model, .. } = self.records[place.placement as usize];
        let parts = &self.parts[model as usize];
        let placement_from_part = self.poses.placement_from(parts, place.placement, part);
        // Most parts stand where their placement does, and this is asked each frame.
        if placement_from_part == DMat4::IDENTITY {
            return world_from_placement.as_mat4();
        }
        (world_from_placement * placement_from_part).as_mat4()
    }

    /// Moves a part from where its model has it, or back there; whether that changes it.
    pub(crate) fn set_part_pose(&mut self, place: NodeAddress, pose: Option<Mat4>) -> bool {
        self.poses.set(place, pose)
    }

    /// Reports whether a part of a placement is another one, or hangs under it.
    pub(crate) fn hangs_under(&self, place: NodeAddress, part: u32) -> bool {
        let PlacementRecord { model, .. } = self.records[place.placement as usize];
        let mut above = place.part;
        while let Some(index) = above {
            if index == part {
                return true;
            }
            above = self.parts[model as usize].all[index as usize].parent;
        }
        false
    }

    pub(crate) fn bounds(&self, place: NodeAddress) -> Option<Bounds> {
        match self.part(place) {
            Some(part) => part.bounds.map(|bounds| bounds.transformed(&self.world_from(place))),
            None => {
                let of_tree = self.tree_bounds.get(&place.placement).copied();
                of_tree.or_else(|| self.bounds_as_modelled(place.placement))
            }
        }
    }

    pub(crate) fn id(&self, place: NodeAddress) -> EquipmentId {
        let id = id_of(&self.records, &self.ids, place.placement);
        match self.part(place) {
            Some(part) => format!("{id}/{}", part.name),
            None => id.to_owned(),
        }
    }

    pub(crate) fn name(&self, place: NodeAddress) -> &str {
        match self.part(place) {
            Some(part) => &part.name,
            None => id_of(&self.records, &self.ids, place.placement),
        }
    }

    pub(crate) fn find(&self, id: &str) -> Option<NodeIndex> {
        let (id, part) = match id.split_once('/') {
            Some((id, part)) => (id, Some(part)),
            None => (id, None),
        };
        let placement = self.placement(id)?;
        let PlacementRecord { model, .. } = self.records[placement as usize];
        let part = match part {
            Some(name) => Some(self.parts.get(model as usize)?.find(name)?),
            None => None,
        };
        Some(self.node(NodeAddress { placement, part }))
    }
}

/// Returns the id of a placement.
fn id_of<'a>(records: &[PlacementRecord], ids: &'a str, placement: u32) -> &'a str {
    let placement = placement as usize;
    let start = placement.checked_sub(1).map_or(0, |before| records[before].id_end);
    &ids[start as usize..records[placement].id_end as usize]
}
