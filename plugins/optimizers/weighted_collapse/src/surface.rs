//! The mesh under collapse: current corners of its triangles, and the triangles
//! around each vertex.

use busbar_plugin_sdk::Mesh;

/// A mesh whose edges are being collapsed.
pub(crate) struct Surface<'m> {
    pub(crate) mesh: Mesh<'m>,
    /// Corners of each triangle; those of a dead one are meaningless.
    triangles: Vec<[u32; 3]>,
    /// Live triangles around each vertex.
    around: Vec<Vec<u32>>,
}

/// The edges around a vertex, with the triangles at each, in ascending order of
/// the other vertex.
#[derive(Clone, Debug, Default)]
pub(crate) struct Ring {
    spokes: Vec<Spoke>,
}

/// One triangle at one of the edges around a vertex.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Spoke {
    /// The edge's other vertex.
    pub(crate) neighbour: u32,
    /// The triangle's corner that is not on the edge.
    pub(crate) opposite: u32,
    /// The edge's side in the triangle, see [`Surface::side_count`].
    pub(crate) side: usize,
}

impl<'m> Surface<'m> {
    /// Builds the surface of the whole mesh.
    pub(crate) fn new(mesh: Mesh<'m>) -> Self {
        let mut counts = vec![0; mesh.positions.len()];
        mesh.triangles.iter().flatten().for_each(|&v| counts[v as usize] += 1);
        let mut around: Vec<Vec<u32>> = counts.into_iter().map(Vec::with_capacity).collect();
        for (triangle, corners) in (0..).zip(mesh.triangles) {
            corners.iter().for_each(|&v| around[v as usize].push(triangle));
        }
        Self { mesh, triangles: mesh.triangles.to_vec(), around }
    }

    /// Sides of all triangles: three each, numbered by triangle and by the
    /// corner opposite.
    pub(crate) fn side_count(&self) -> usize {
        self.triangles.len() * 3
    }

    /// Counts the triangles around a vertex.
    pub(crate) fn valence(&self, vertex: u32) -> usize {
        self.around[vertex as usize].len()
    }

    /// Looks up the edges around a vertex.
    pub(crate) fn ring(&self, vertex: u32, ring: &mut Ring) {
        ring.spokes.clear();
        for &triangle in &self.around[vertex as usize] {
            let corners = self.triangles[triangle as usize];
            let at = corners.iter().position(|&v| v == vertex).unwrap_or(0);
            let (next, last) = ((at + 1) % 3, (at + 2) % 3);
            let spoke = |neighbour: usize, opposite: usize| Spoke {
                neighbour: corners[neighbour],
                opposite: corners[opposite],
                side: triangle as usize * 3 + opposite,
            };
            ring.spokes.extend([spoke(next, last), spoke(last, next)]);
        }
        ring.spokes.sort_unstable();
    }

    /// Moves one vertex onto another. Triangles that have both die.
    pub(crate) fn collapse(&mut self, removed: u32, kept: u32) {
        for triangle in std::mem::take(&mut self.around[removed as usize]) {
            let corners = &mut self.triangles[triangle as usize];
            if corners.contains(&kept) {
                for &corner in corners.iter().filter(|&&corner| corner != removed) {
                    self.around[corner as usize].retain(|&other| other != triangle);
                }
            } else {
                *corners = corners.map(|corner| if corner == removed { kept } else { corner });
                self.around[kept as usize].push(triangle);
            }
        }
    }
}

impl Ring {
    /// Iterates over the edges: for each other vertex the triangles at it.
    pub(crate) fn edges(&self) -> impl Iterator<Item = &[Spoke]> {
        self.spokes.chunk_by(|a, b| a.neighbour == b.neighbour)
    }

    /// Iterates over the triangles at the edge to a neighbour.
    pub(crate) fn edge_to(&self, neighbour: u32) -> &[Spoke] {
        let start = self.spokes.partition_point(|spoke| spoke.neighbour < neighbour);
        let end = self.spokes.partition_point(|spoke| spoke.neighbour <= neighbour);
        &self.spokes[start..end]
    }

    /// Iterates over the other two corners of each triangle, once.
    pub(crate) fn triangles(&self) -> impl Iterator<Item = [u32; 2]> {
        let once = self.spokes.iter().filter(|spoke| spoke.neighbour < spoke.opposite);
        once.map(|spoke| [spoke.neighbour, spoke.opposite])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two triangles on the edge 1-2; vertex 2 moves onto 0.
    #[test]
    fn a_collapse_moves_corners_and_kills() {
        let positions = [[0.0; 3]; 5];
        let triangles = [[0, 1, 2], [2, 1, 3], [2, 3, 4]];
        let mut surface =
            Surface::new(Mesh { positions: &positions, triangles: &triangles, wedges: None });
        let ring_of = |surface: &Surface<'_>, vertex| {
            let mut ring = Ring::default();
            surface.ring(vertex, &mut ring);
            let edges = ring.edges().map(|edge| (edge[0].neighbour, edge.len()));
            edges.collect::<Vec<_>>()
        };
        assert_eq!(ring_of(&surface, 2), [(0, 1), (1, 2), (3, 2), (4, 1)]);
        surface.collapse(2, 0);
        assert_eq!(ring_of(&surface, 2), []);
        assert_eq!(ring_of(&surface, 0), [(1, 1), (3, 2), (4, 1)]);
        assert_eq!(surface.valence(1), 1);
        let mut ring = Ring::default();
        surface.ring(0, &mut ring);
        assert_eq!(ring.triangles().collect::<Vec<_>>(), [[1, 3], [3, 4]]);
        // The side from 0, once 2, to 3 in triangle 1 is opposite its corner 1.
        let sides: Vec<usize> = ring.edge_to(3).iter().map(|spoke| spoke.side).collect();
        assert_eq!(sides, [3 + 1, 6 + 2]);
        assert!(ring.edge_to(2).is_empty());
    }
}
