//! Edges of a mesh with the triangles at each, by sorting half-edges.

use std::ops::Range;

use busbar_plugin_sdk::Mesh;

/// All edges of a mesh in ascending order of (smaller, larger) vertex index.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct Edges {
    /// Vertex pairs, the smaller index first.
    pub(crate) ends: Vec<[u32; 2]>,
    /// Where each edge's triangles start in `triangles`, and the total.
    starts: Vec<u32>,
    /// Triangles at the edges, edge by edge, ascending.
    triangles: Vec<u32>,
}

impl Edges {
    /// Number of edges.
    pub(crate) fn len(&self) -> usize {
        self.ends.len()
    }

    /// The triangles at an edge.
    pub(crate) fn triangles_at(&self, edge: usize) -> &[u32] {
        &self.triangles[self.range(edge)]
    }

    fn range(&self, edge: usize) -> Range<usize> {
        self.starts[edge] as usize..self.starts[edge + 1] as usize
    }
}

/// Finds all edges.
pub(crate) fn find(mesh: &Mesh<'_>) -> Edges {
    let mut half_edges: Vec<(u64, u32)> = Vec::with_capacity(mesh.triangles.len() * 3);
    for (triangle, &[a, b, c]) in mesh.triangles.iter().enumerate() {
        for (v, w) in [(a, b), (b, c), (c, a)] {
            half_edges.push((u64::from(v.min(w)) << 32 | u64::from(v.max(w)), triangle as u32));
        }
    }
    half_edges.sort_unstable();
    let mut edges = Edges::default();
    for run in half_edges.chunk_by(|a, b| a.0 == b.0) {
        let key = run[0].0;
        edges.ends.push([(key >> 32) as u32, key as u32]);
        edges.starts.push(edges.triangles.len() as u32);
        edges.triangles.extend(run.iter().map(|half_edge| half_edge.1));
    }
    edges.starts.push(edges.triangles.len() as u32);
    edges
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_edge_has_its_triangles() {
        let triangles = [[0, 1, 2], [2, 1, 3], [1, 2, 4]];
        let edges = find(&Mesh { positions: &[[0.0; 3]; 5], triangles: &triangles, wedges: None });
        assert_eq!(edges.len(), 7);
        assert!(edges.ends.is_sorted());
        let shared = edges.ends.iter().position(|&e| e == [1, 2]).unwrap();
        assert_eq!(edges.triangles_at(shared), [0, 1, 2]);
        let alone = edges.ends.iter().position(|&e| e == [0, 1]).unwrap();
        assert_eq!(edges.triangles_at(alone), [0]);
    }

    #[test]
    fn an_empty_mesh_has_no_edges() {
        assert_eq!(find(&Mesh { positions: &[], triangles: &[], wedges: None }).len(), 0);
    }
}
