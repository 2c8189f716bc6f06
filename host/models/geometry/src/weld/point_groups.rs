//! Vertex deduplication: groups of vertices at one point, found by hash partitioning.
//!
//! Looked up one by one in a table of all points, each costs a few reads from main memory.
//! Here vertices are dealt to piles by hash, and a pile and its table stay in the cache.

use std::hash::BuildHasher;

use hashbrown::{DefaultHashBuilder, HashTable};

use super::{RawPrimitive, normalize_zero};
use crate::NO_FEATURE;

/// Vertices that a pile has on average, at most, up to [`MAX_PARTITIONS`].
const PARTITION_SIZE: usize = 4096;
/// More would be dealt to than the processor can write to at once.
const MAX_PARTITIONS: usize = 512;

/// First vertex at the same point, and of the same feature, for each vertex. Vertices come
/// primitive by primitive, then the foreign corners of triangles.
pub(super) struct PointGroups {
    firsts: Vec<u32>,
    /// The vertex that the next primitive begins with, and the next foreign corner.
    next_vertex: u32,
    next_foreign: u32,
}

/// Vertex with its position key.
#[derive(Clone, Copy, Default)]
struct Entry {
    key: [u32; 4],
    vertex: u32,
}

impl PointGroups {
    /// Groups all vertices; together they must be fewer than 2^32.
    pub(super) fn new(primitives: &[RawPrimitive]) -> Self {
        let hasher = DefaultHashBuilder::default();
        let count = keys(primitives).count();
        let partitions = (count / PARTITION_SIZE).next_power_of_two().min(MAX_PARTITIONS);
        let partition_of =
            |key: [u32; 4]| hasher.hash_one(as_number(key)) as usize & (partitions - 1);
        let mut ends = vec![0; partitions];
        keys(primitives).for_each(|key| ends[partition_of(key)] += 1);
        let mut sum = 0;
        for end in &mut ends {
            (*end, sum) = (sum, sum + *end);
        }
        let mut entries = vec![Entry::default(); count];
        let mut vertex = 0;
        keys(primitives).for_each(|key| {
            let end: &mut usize = &mut ends[partition_of(key)];
            entries[*end] = Entry { key, vertex };
            (*end, vertex) = (*end + 1, vertex + 1);
        });
        let mut firsts = vec![0; count];
        let (mut table, mut start) = (HashTable::new(), 0);
        for end in ends {
            let partition = &entries[start..end];
            start = end;
            table.clear();
            for (index, entry) in partition.iter().enumerate() {
                // The pile's own bits are the same for all of it.
                let hash_of =
                    |entry: &Entry| hasher.hash_one(as_number(entry.key)).rotate_right(32);
                let found = table.entry(
                    hash_of(entry),
                    |&other: &u32| partition[other as usize].key == entry.key,
                    |&other| hash_of(&partition[other as usize]),
                );
                let first = *found.or_insert(index as u32).get();
                firsts[entry.vertex as usize] = partition[first as usize].vertex;
            }
        }
        let vertices: usize = primitives.iter().map(|primitive| primitive.positions.len()).sum();
        Self { firsts, next_vertex: 0, next_foreign: vertices as u32 }
    }

    /// Returns the number of vertices and foreign corners.
    pub(super) fn len(&self) -> usize {
        self.firsts.len()
    }

    /// Returns the number of a primitive's first vertex; primitives come in order.
    pub(super) fn begin(&mut self, primitive: &RawPrimitive) -> u32 {
        let first = self.next_vertex;
        self.next_vertex += primitive.positions.len() as u32;
        first
    }

    /// Returns the number of the next foreign corner, in the order of triangles.
    pub(super) fn next_foreign(&mut self) -> u32 {
        self.next_foreign += 1;
        self.next_foreign - 1
    }

    /// Returns the first vertex at the point of a vertex or foreign corner.
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

/// Converts a key to one number, which the hasher takes faster than an array.
fn as_number(key: [u32; 4]) -> u128 {
    key.into_iter().rev().fold(0, |number, word| number << 32 | u128::from(word))
}

/// Returns the key by which two vertices are one position.
fn key(primitive: &RawPrimitive, vertex: u32, feature: u32) -> [u32; 4] {
    let [x, y, z] =
        normalize_zero(primitive.positions[vertex as usize]).to_array().map(f32::to_bits);
    [x, y, z, feature]
}
