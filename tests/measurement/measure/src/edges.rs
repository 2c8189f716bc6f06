//! Edge and triangle counts that show the defects of a surface.

use serde::Serialize;

use crate::DisjointSets;

/// Counts of border and non-manifold edges.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct EdgeCounts {
    /// Number of edges with exactly one triangle.
    pub border: u64,
    /// Number of edges with more than two triangles.
    pub non_manifold: u64,
    /// Number of connected sets of border edges.
    pub border_loops: u64,
}

impl EdgeCounts {
    /// Counts the edges of triangles over so many positions.
    pub fn count(position_count: usize, triangles: &[[u32; 3]]) -> Self {
        let sides = triangles.iter().flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]);
        let mut edges: Vec<[u32; 2]> = sides.map(|[a, b]| [a.min(b), a.max(b)]).collect();
        edges.sort_unstable();
        let mut counts = Self::default();
        let mut loops = DisjointSets::new(position_count);
        let mut joins = 0;
        let mut ends = Vec::new();
        for run in edges.chunk_by(|a, b| a == b) {
            counts.non_manifold += u64::from(run.len() > 2);
            if let &[[a, b]] = run {
                counts.border += 1;
                joins += u64::from(loops.join(a, b));
                ends.extend([a, b]);
            }
        }
        ends.sort_unstable();
        ends.dedup();
        counts.border_loops = ends.len() as u64 - joins;
        counts
    }
}

/// Counts the triangles on the same three vertices as another, either way round: all but one of
/// each such group.
pub fn duplicates(triangles: &[[u32; 3]]) -> u64 {
    let ordered = |triangle: &[u32; 3]| {
        let mut triangle = *triangle;
        triangle.sort_unstable();
        triangle
    };
    let mut sorted: Vec<_> = triangles.iter().map(ordered).collect();
    sorted.sort_unstable();
    sorted.chunk_by(|a, b| a == b).map(|run| run.len() as u64 - 1).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_fan_on_one_edge_is_not_manifold() {
        let edges = EdgeCounts::count(5, &[[0, 1, 2], [1, 0, 3], [0, 1, 4]]);
        assert_eq!(edges, EdgeCounts { border: 6, non_manifold: 1, border_loops: 1 });
        let tetrahedron = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]];
        assert_eq!(EdgeCounts::count(4, &tetrahedron), EdgeCounts::default());
        assert_eq!(EdgeCounts::count(6, &[[0, 1, 2], [3, 4, 5]]).border_loops, 2);
    }

    #[test]
    fn duplicates_are_found_either_way_round() {
        assert_eq!(duplicates(&[[0, 1, 2], [2, 1, 0], [1, 2, 0], [0, 1, 3]]), 2);
        assert_eq!(duplicates(&[[0, 1, 2], [0, 1, 3]]), 0);
    }
}
