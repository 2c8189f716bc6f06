//! Static collapse order of the paper: edges ascending by W, joined into a spanning forest.

use busbar_plugin_sdk::{Collapse, CollapseList, Mesh, on_huge_pages};

use crate::edges::Edges;
use crate::sort::KeyPartitions;
use crate::vector::{norm, point, sub};

/// Points looked up at a time, ahead of their use: the lookups wait for memory
/// together.
const LOOKAHEAD: usize = 128;

/// Collapses edges in ascending order of weight.
///
/// The paper's K = (V1, V2) -> (V1, V1) does not say which end stays: here the
/// smaller class of already joined vertices moves onto the larger, of equal
/// ones the one that the larger index stands for moves, so chains of ancestors
/// stay short. The list is static, so an edge may join classes whose vertices
/// moved already; one whose ends are in one class is no collapse. That makes
/// the sequence a minimum spanning forest by W, with V - components entries.
///
/// The error of an entry is the greatest distance that any vertex of the
/// removed class has moved so far.
///
/// The collapses and their stages go to `list`. Edges are sorted `part_size` at
/// a time, the lightest first, without those whose ends are joined by then
/// (filter-Kruskal: Osipov, Sanders and Singler, ALENEX 2009).
pub(crate) fn collapse(
    mesh: &Mesh<'_>,
    edges: &Edges,
    weights: &[f64],
    part_size: usize,
    list: &mut CollapseList,
) {
    let mut classes = Classes::new(mesh.positions.len());
    let mut collapses = on_huge_pages(Vec::with_capacity(mesh.positions.len()));
    let mut parts = list.stage("sort", || KeyPartitions::new(weights, part_size));
    let mut joining: Vec<[u32; 2]> = Vec::new();
    for part in 0..parts.len() {
        list.stage("sort", || {
            let sorted = parts.sort(part, |edge| {
                let [v1, v2] = edges.ends[edge as usize];
                classes.survivor(v1) != classes.survivor(v2)
            });
            // Looked up ahead: the lookups wait for memory together.
            joining.clear();
            joining.extend(sorted.map(|edge| edges.ends[edge as usize]));
        });
        list.stage("collapse", || {
            for &[v1, v2] in &joining {
                if let Some((removed, kept)) = classes.join(v1, v2) {
                    collapses.push(Collapse { removed, kept, error: 0.0 });
                }
            }
        });
    }
    list.stage("collapse", || measure_errors(mesh, &mut collapses));
    list.collapses = collapses;
}

fn measure_errors(mesh: &Mesh<'_>, collapses: &mut [Collapse]) {
    let mut errors = Errors::new(mesh.positions.len());
    for block in collapses.chunks_mut(LOOKAHEAD) {
        for collapse in block.iter_mut() {
            collapse.error = distance(mesh, collapse.removed, collapse.kept);
        }
        for collapse in block {
            collapse.error = errors.join(collapse.error, collapse.removed, collapse.kept);
        }
    }
}

/// Computes the distance between two vertices, at most the greatest f32.
pub(crate) fn distance(mesh: &Mesh<'_>, a: u32, b: u32) -> f32 {
    norm(sub(point(mesh, a), point(mesh, b))).min(f64::from(f32::MAX)) as f32
}

/// Classes of joined vertices: union-find by size. The representative of a
/// class is its surviving vertex.
pub(crate) struct Classes {
    /// A survivor's class size with the top bit set, or any other vertex's way
    /// to its survivor.
    link: Vec<u32>,
}

impl Classes {
    const SURVIVES: u32 = 1 << 31;
    /// Vertices that the links have room for.
    pub(crate) const MAX_VERTICES: usize = (1 << 31) - 1;

    /// Makes a class of each vertex by itself; at most [`Self::MAX_VERTICES`].
    pub(crate) fn new(count: usize) -> Self {
        Self { link: vec![Self::SURVIVES | 1; count] }
    }

    /// Finds the survivor of a vertex.
    fn survivor(&mut self, mut vertex: u32) -> u32 {
        loop {
            let parent = self.link[vertex as usize];
            if parent & Self::SURVIVES != 0 {
                return vertex;
            }
            let grandparent = self.link[parent as usize];
            if grandparent & Self::SURVIVES != 0 {
                return parent;
            }
            self.link[vertex as usize] = grandparent;
            vertex = grandparent;
        }
    }

    /// Orders two survivors: the one to move, then the one to stay.
    pub(crate) fn rank(&self, a: u32, b: u32) -> (u32, u32) {
        let rank = |v: u32| (self.link[v as usize], std::cmp::Reverse(v));
        if rank(a) < rank(b) { (a, b) } else { (b, a) }
    }

    /// Puts a survivor's class into that of another one.
    pub(crate) fn merge(&mut self, removed: u32, kept: u32) {
        self.link[kept as usize] += self.link[removed as usize] & !Self::SURVIVES;
        self.link[removed as usize] = kept;
    }

    /// Joins the classes of two vertices: (removed, kept) survivors, or `None`
    /// if they are one already.
    fn join(&mut self, v1: u32, v2: u32) -> Option<(u32, u32)> {
        let (a, b) = (self.survivor(v1), self.survivor(v2));
        if a == b {
            return None;
        }
        let (removed, kept) = self.rank(a, b);
        self.merge(removed, kept);
        Some((removed, kept))
    }
}

/// Distances that vertices have moved.
pub(crate) struct Errors {
    /// Bound on how far any vertex of a class is from its survivor.
    radius: Vec<f32>,
    largest: f32,
}

impl Errors {
    pub(crate) fn new(count: usize) -> Self {
        Self { radius: vec![0.0; count], largest: 0.0 }
    }

    /// Returns the error after a class has joined another one at a distance: the greatest distance
    /// that any vertex of a removed class has moved so far.
    pub(crate) fn join(&mut self, distance: f32, removed: u32, kept: u32) -> f32 {
        // Radii can add up to more than f32 reaches.
        let moved = (distance + self.radius[removed as usize]).min(f32::MAX);
        let radius = &mut self.radius[kept as usize];
        *radius = radius.max(moved);
        self.largest = self.largest.max(moved);
        self.largest
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_smaller_class_joins_the_larger_and_ties_go_by_index() {
        let mut classes = Classes::new(5);
        assert_eq!(classes.join(3, 1), Some((3, 1)), "equal sizes: the smaller index stays");
        assert_eq!(classes.join(0, 3), Some((0, 1)), "the larger class stays");
        assert_eq!(classes.join(1, 0), None);
        assert_eq!(classes.join(2, 4), Some((4, 2)));
        assert_eq!(classes.join(4, 3), Some((2, 1)));
    }
}
