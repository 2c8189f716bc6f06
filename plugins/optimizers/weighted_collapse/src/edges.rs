//! Edges of a mesh with the triangles at each: sides counted into a bucket for
//! each edge's smaller vertex, and each bucket sorted.

use std::ops::Range;

use busbar_plugin_sdk::{Mesh, on_huge_pages};

use crate::threads;

/// All edges of a mesh in ascending order of (smaller, larger) vertex index.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct Edges {
    /// Vertex pairs, the smaller index first.
    pub(crate) ends: Vec<[u32; 2]>,
    /// Start of each edge's sides in `sides`, and the total.
    starts: Vec<u32>,
    /// Sides, edge by edge, ascending.
    sides: Vec<Side>,
}

/// A triangle at an edge, seen from the edge's smaller vertex. Its order brings
/// the sides of an edge together.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Side(u64);

impl Side {
    /// Makes a side of a triangle with the edge's `larger` vertex, its smaller one and `opposite`.
    pub(crate) fn new(larger: u32, opposite: u32) -> Self {
        Self(u64::from(larger) << 32 | u64::from(opposite))
    }

    /// Returns the edge's larger vertex.
    pub(crate) fn larger(self) -> u32 {
        (self.0 >> 32) as u32
    }

    /// Returns the triangle's corner that is not on the edge: V3 and V4 of Eq. 3 and 4.
    pub(crate) fn opposite(self) -> u32 {
        self.0 as u32
    }
}

impl Edges {
    /// Returns the number of edges.
    pub(crate) fn len(&self) -> usize {
        self.ends.len()
    }

    /// Returns the triangles at an edge.
    pub(crate) fn sides(&self, edge: usize) -> &[Side] {
        &self.sides[self.starts[edge] as usize..self.starts[edge + 1] as usize]
    }
}

/// Finds all edges of a mesh with at most a third of 2^32 triangles.
pub(crate) fn find(mesh: &Mesh<'_>, threads: usize) -> Edges {
    let buckets = bucket_starts(mesh, threads);
    let side_count = mesh.triangles.len() * 3;
    let mut sides = on_huge_pages(Vec::with_capacity(side_count));
    sides.resize(side_count, Side(0));
    let mut jobs = Vec::with_capacity(threads);
    let mut rest = sides.as_mut_slice();
    for vertices in equal_parts(&buckets, threads) {
        let count = (buckets[vertices.end] - buckets[vertices.start]) as usize;
        let (part, others) = rest.split_at_mut(count);
        rest = others;
        jobs.push((vertices, part));
    }
    let parts = threads::map(jobs, threads, |(vertices, sides)| {
        let buckets = &buckets[vertices.start..=vertices.end];
        fill(mesh, vertices.start as u32, buckets, sides);
        sort_into_edges(vertices.start as u32, buckets, sides)
    });
    let (mut ends, mut starts) = join(parts);
    starts.push(sides.len() as u32);
    ends.shrink_to_fit();
    starts.shrink_to_fit();
    Edges { ends, starts, sides }
}

/// Counts the sides of each smaller vertex; returns their starts and the total.
fn bucket_starts(mesh: &Mesh<'_>, threads: usize) -> Vec<u32> {
    let vertices = mesh.positions.len();
    let share = mesh.triangles.len().div_ceil(threads).max(1);
    let counts = threads::map(mesh.triangles.chunks(share).collect(), threads, |triangles| {
        let mut counts = vec![0_u32; vertices + 1];
        for &corners in triangles {
            let [low, middle, _] = ascending(corners);
            counts[low as usize] += 2;
            counts[middle as usize] += 1;
        }
        counts
    });
    let mut counts = counts.into_iter();
    let mut starts = counts.next().unwrap_or_else(|| vec![0; vertices + 1]);
    for part in counts {
        starts.iter_mut().zip(part).for_each(|(sum, count)| *sum += count);
    }
    let mut total = 0;
    for start in &mut starts {
        total += std::mem::replace(start, total);
    }
    starts
}

/// Divides the vertices into ranges with about the same number of sides.
fn equal_parts(buckets: &[u32], parts: usize) -> Vec<Range<usize>> {
    let vertices = buckets.len() - 1;
    let total = u64::from(buckets[vertices]);
    let mut first = 0;
    let part = |i| {
        let sides = (total * i as u64 / parts as u64) as u32;
        let end = if i == parts { vertices } else { buckets.partition_point(|&s| s < sides) };
        std::mem::replace(&mut first, end)..end
    };
    (1..=parts).map(part).collect()
}

/// Puts the sides of consecutive smaller vertices, of which `first` is the
/// first, into their buckets.
fn fill(mesh: &Mesh<'_>, first: u32, buckets: &[u32], sides: &mut [Side]) {
    let base = buckets[0];
    let mut next: Vec<u32> = buckets[..buckets.len() - 1].iter().map(|s| s - base).collect();
    for &corners in mesh.triangles {
        let [low, middle, high] = ascending(corners);
        // A vertex before the first wraps round to one behind the last.
        if let Some(slot) = next.get_mut(low.wrapping_sub(first) as usize) {
            let at = *slot as usize;
            *slot += 2;
            sides[at] = Side::new(middle, high);
            sides[at + 1] = Side::new(high, middle);
        }
        if let Some(slot) = next.get_mut(middle.wrapping_sub(first) as usize) {
            sides[*slot as usize] = Side::new(high, low);
            *slot += 1;
        }
    }
}

/// Sorts each bucket. Returns the ends of the edges found, and where the sides
/// of each start.
fn sort_into_edges(first: u32, buckets: &[u32], sides: &mut [Side]) -> (Vec<[u32; 2]>, Vec<u32>) {
    let base = buckets[0];
    // Room for the worst case; what is not used is never touched.
    let mut ends = on_huge_pages(Vec::with_capacity(sides.len()));
    let mut starts = on_huge_pages(Vec::with_capacity(sides.len() + 1));
    for (vertex, bucket) in (first..).zip(buckets.windows(2)) {
        let bucket_sides = &mut sides[(bucket[0] - base) as usize..(bucket[1] - base) as usize];
        bucket_sides.sort_unstable();
        let mut last = None;
        for (start, side) in (bucket[0]..).zip(bucket_sides.iter()) {
            if last != Some(side.larger()) {
                last = Some(side.larger());
                ends.push([vertex, side.larger()]);
                starts.push(start);
            }
        }
    }
    (ends, starts)
}

fn join(parts: Vec<(Vec<[u32; 2]>, Vec<u32>)>) -> (Vec<[u32; 2]>, Vec<u32>) {
    let mut parts = parts.into_iter();
    let (mut ends, mut starts) = parts.next().unwrap_or_default();
    for (more_ends, more_starts) in parts {
        ends.extend(more_ends);
        starts.extend(more_starts);
    }
    (ends, starts)
}

fn ascending([a, b, c]: [u32; 3]) -> [u32; 3] {
    let (low, high) = (a.min(b).min(c), a.max(b).max(c));
    [low, a ^ b ^ c ^ low ^ high, high]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn opposites(edges: &Edges, ends: [u32; 2]) -> Vec<u32> {
        let edge = edges.ends.iter().position(|&e| e == ends).unwrap();
        edges.sides(edge).iter().map(|side| side.opposite()).collect()
    }

    #[test]
    fn each_edge_has_its_triangles() {
        let triangles = [[0, 1, 2], [2, 1, 3], [1, 2, 4]];
        for threads in 1..4 {
            let edges = find(
                &Mesh { positions: &[[0.0; 3]; 5], triangles: &triangles, wedges: None },
                threads,
            );
            assert_eq!(edges.len(), 7);
            assert!(edges.ends.is_sorted());
            assert_eq!(opposites(&edges, [1, 2]), [0, 3, 4]);
            assert_eq!(opposites(&edges, [0, 1]), [2]);
            assert_eq!(opposites(&edges, [2, 4]), [1]);
        }
    }

    #[test]
    fn an_empty_mesh_has_no_edges() {
        for threads in 1..3 {
            assert_eq!(
                find(&Mesh { positions: &[], triangles: &[], wedges: None }, threads).len(),
                0
            );
            assert_eq!(
                find(&Mesh { positions: &[[0.0; 3]], triangles: &[], wedges: None }, threads).len(),
                0
            );
        }
    }

    #[test]
    fn corners_ascend() {
        for corners in [[1, 2, 3], [1, 3, 2], [2, 1, 3], [2, 3, 1], [3, 1, 2], [3, 2, 1]] {
            assert_eq!(ascending(corners), [1, 2, 3]);
        }
    }
}
