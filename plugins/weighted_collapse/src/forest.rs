//! The paper's order: edges ascending by W, joined into a spanning forest.

use busbar_plugin_sdk::{Collapse, Mesh};

use crate::edges::Edges;
use crate::vector::{norm, point, sub};

/// Edges looked up at a time, ahead of their collapse: the lookups wait for
/// memory together.
const LOOKAHEAD: usize = 128;

/// Collapses edges in the given order.
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
pub(crate) fn collapse(mesh: &Mesh<'_>, edges: &Edges, sorted: &[u32]) -> Vec<Collapse> {
    let mut classes = Classes::new(mesh.positions.len());
    let mut errors = Errors::new(mesh.positions.len());
    let mut collapses = Vec::with_capacity(mesh.positions.len());
    let mut ends = [[0; 2]; LOOKAHEAD];
    for block in sorted.chunks(LOOKAHEAD) {
        for (ends, &edge) in ends.iter_mut().zip(block) {
            *ends = edges.ends[edge as usize];
        }
        for &[v1, v2] in &ends[..block.len()] {
            if let Some((removed, kept)) = classes.join(v1, v2) {
                collapses.push(Collapse { removed, kept, error: errors.join(mesh, removed, kept) });
            }
        }
    }
    collapses
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

    /// Each vertex by itself; at most [`Self::MAX_VERTICES`].
    pub(crate) fn new(count: usize) -> Self {
        Self { link: vec![Self::SURVIVES | 1; count] }
    }

    /// The survivor of a vertex.
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

    /// Of two survivors the one that is to move, then the one that is to stay.
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

/// How far vertices have moved.
pub(crate) struct Errors {
    /// Bound on how far any vertex of a class is from its survivor.
    radius: Vec<f32>,
    largest: f32,
}

impl Errors {
    pub(crate) fn new(count: usize) -> Self {
        Self { radius: vec![0.0; count], largest: 0.0 }
    }

    /// The error after a class has joined another one: the greatest distance
    /// that any vertex of a removed class has moved so far.
    pub(crate) fn join(&mut self, mesh: &Mesh<'_>, removed: u32, kept: u32) -> f32 {
        let distance = norm(sub(point(mesh, removed), point(mesh, kept))) as f32;
        // Finite positions can be farther apart than f32 reaches.
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
