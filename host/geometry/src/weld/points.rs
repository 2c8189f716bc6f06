//! Vertex deduplication: groups of vertices at one point, found by hash partitioning.
//!
//! Looked up one by one in a table of all points, each costs a few reads from main memory.
//! Here vertices are dealt to piles by hash, and a pile and its table stay in the cache.

use std::hash::BuildHasher;

use hashbrown::{DefaultHashBuilder, HashTable};

use super::{RawPrimitive, clean};
use crate::NO_FEATURE;

/// Vertices that a pile has on average, at most, up to [`MAX_PILES`].
const PILE: usize = 4096;
/// More would be dealt to than the processor can write to at once.
const MAX_PILES: usize = 512;

/// First vertex at the same point, and of the same feature, for each vertex. Vertices come
/// primitive by primitive; then all triangle corners whose feature is not their vertex's own.
pub(super) struct Points {
    firsts: Vec<u32>,
    /// The vertex that the next primitive begins with, and the next foreign corner.
    next_vertex: u32,
    next_foreign: u32,
}

/// A vertex, and what makes two of them one position.
#[derive(Clone, Copy, Default)]
struct Entry {
    key: [u32; 4],
    vertex: u32,
}

impl Points {
    /// All together must be fewer than 2^32.
    pub(super) fn of(primitives: &[RawPrimitive]) -> Self {
        let hasher = DefaultHashBuilder::default();
        let count = keys(primitives).count();
        let piles = (count / PILE).next_power_of_two().min(MAX_PILES);
        let pile_of = |key: [u32; 4]| hasher.hash_one(as_number(key)) as usize & (piles - 1);
        let mut ends = vec![0; piles];
        keys(primitives).for_each(|key| ends[pile_of(key)] += 1);
        let mut sum = 0;
        for end in &mut ends {
            (*end, sum) = (sum, sum + *end);
        }
        let mut entries = vec![Entry::default(); count];
        let mut vertex = 0;
        keys(primitives).for_each(|key| {
            let end: &mut usize = &mut ends[pile_of(key)];
            entries[*end] = Entry { key, vertex };
            (*end, vertex) = (*end + 1, vertex + 1);
        });
        let mut firsts = vec![0; count];
        let (mut table, mut start) = (HashTable::new(), 0);
        for end in ends {
            let pile = &entries[start..end];
            start = end;
            table.clear();
            for (index, entry) in pile.iter().enumerate() {
                // The pile's own bits are the same for all of it.
                let hash_of =
                    |entry: &Entry| hasher.hash_one(as_number(entry.key)).rotate_right(32);
                let found = table.entry(
                    hash_of(entry),
                    |&other: &u32| pile[other as usize].key == entry.key,
                    |&other| hash_of(&pile[other as usize]),
                );
                let first = *found.or_insert(index as u32).get();
                firsts[entry.vertex as usize] = pile[first as usize].vertex;
            }
        }
        let vertices: usize = primitives.iter().map(|primitive| primitive.positions.len()).sum();
        Self { firsts, next_vertex: 0, next_foreign: vertices as u32 }
    }

    /// Vertices and foreign corners.
    pub(super) fn len(&self) -> usize {
        self.firsts.len()
    }

    /// The number of a primitive's first vertex; primitives come in order.
    pub(super) fn begin(&mut self, primitive: &RawPrimitive) -> u32 {
        let first = self.next_vertex;
        self.next_vertex += primitive.positions.len() as u32;
        first
    }

    /// The number of the next foreign corner, in the order of triangles.
    pub(super) fn next_foreign(&mut self) -> u32 {
        self.next_foreign += 1;
        self.next_foreign - 1
    }

    /// The first that is where a vertex or foreign corner is.
    pub(super) fn first_at(&self, vertex: u32) -> u32 {
        self.firsts[vertex as usize]
    }
}

/// Iterates over the keys of all vertices, then of all foreign corners.
fn keys(primitives: &[RawPrimitive]) -> impl Iterator<Item = [u32; 4]> {
    primitives.iter().flat_map(vertex_keys).chain(primitives.iter().flat_map(foreign_keys))
}

fn vertex_keys(primitive: &RawPrimitive) -> impl Iterator<Item = [u32; 4]> {
    let vertices = 0..primitive.positions.len() as u32;
    vertices.map(|vertex| {
        let own = primitive.features.get(vertex as usize).copied();
        key(primitive, vertex, own.unwrap_or(NO_FEATURE))
    })
}

fn foreign_keys(primitive: &RawPrimitive) -> impl Iterator<Item = [u32; 4]> {
    let triangles = if primitive.features.is_empty() { &[][..] } else { &primitive.triangles };
    triangles.iter().flat_map(move |&corners| {
        let feature = primitive.feature_of(corners);
        let foreign = move |corner: &u32| primitive.is_foreign(*corner, feature);
        corners.into_iter().filter(foreign).map(move |corner| key(primitive, corner, feature))
    })
}

/// A key for the hasher, which takes one number faster than an array.
fn as_number(key: [u32; 4]) -> u128 {
    key.into_iter().rev().fold(0, |number, word| number << 32 | u128::from(word))
}

/// Returns the key by which two vertices are one position.
fn key(primitive: &RawPrimitive, vertex: u32, feature: u32) -> [u32; 4] {
    let [x, y, z] = clean(primitive.positions[vertex as usize]).to_array().map(f32::to_bits);
    [x, y, z, feature]
}
