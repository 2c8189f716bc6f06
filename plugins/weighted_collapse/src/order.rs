//! From weights to a collapse sequence.

use busbar_plugin_sdk::{Collapse, Mesh};

use crate::edges::Edges;

/// Edge indices in ascending order of W. Equal weights keep edge order, which
/// is that of (smaller, larger) vertex index.
pub(crate) fn sort(weights: &[f64]) -> Vec<u32> {
    let mut sorted: Vec<u32> = (0..weights.len() as u32).collect();
    sorted.sort_by(|&a, &b| weights[a as usize].total_cmp(&weights[b as usize]));
    sorted
}

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
    let mut collapses = Vec::with_capacity(mesh.positions.len());
    let mut error = 0.0_f32;
    for &edge in sorted {
        let [v1, v2] = edges.ends[edge as usize];
        if let Some((removed, kept)) = classes.join(v1, v2) {
            let moved = distance(mesh, removed, kept) + classes.radius[removed as usize];
            // Finite positions can be farther apart than f32 reaches.
            let moved = moved.min(f32::MAX);
            let radius = &mut classes.radius[kept as usize];
            *radius = radius.max(moved);
            error = error.max(moved);
            collapses.push(Collapse { removed, kept, error });
        }
    }
    collapses
}

/// Union-find by size; the representative of a class is its surviving vertex.
struct Classes {
    parent: Vec<u32>,
    size: Vec<u32>,
    /// Bound on how far any vertex of a class is from its survivor.
    radius: Vec<f32>,
}

impl Classes {
    fn new(count: usize) -> Self {
        let parent = (0..count as u32).collect();
        Self { parent, size: vec![1; count], radius: vec![0.0; count] }
    }

    fn survivor(&mut self, mut vertex: u32) -> u32 {
        while self.parent[vertex as usize] != vertex {
            let grandparent = self.parent[self.parent[vertex as usize] as usize];
            self.parent[vertex as usize] = grandparent;
            vertex = grandparent;
        }
        vertex
    }

    /// Joins the classes of two vertices: (removed, kept) survivors, or `None`
    /// if they are one already.
    fn join(&mut self, v1: u32, v2: u32) -> Option<(u32, u32)> {
        let (a, b) = (self.survivor(v1), self.survivor(v2));
        if a == b {
            return None;
        }
        let rank = |v: u32| (self.size[v as usize], std::cmp::Reverse(v));
        let (removed, kept) = if rank(a) < rank(b) { (a, b) } else { (b, a) };
        self.parent[removed as usize] = kept;
        self.size[kept as usize] += self.size[removed as usize];
        Some((removed, kept))
    }
}

fn distance(mesh: &Mesh<'_>, a: u32, b: u32) -> f32 {
    let (a, b) = (mesh.positions[a as usize], mesh.positions[b as usize]);
    let squares = (0..3).map(|i| (f64::from(a[i]) - f64::from(b[i])).powi(2));
    squares.sum::<f64>().sqrt() as f32
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::{edges, weights};

    fn sequence(mesh: &Mesh<'_>) -> Vec<Collapse> {
        let edges = edges::find(mesh);
        let weights = weights::weigh(mesh, &edges, true);
        collapse(mesh, &edges, &sort(&weights))
    }

    #[test]
    fn the_smaller_class_joins_the_larger_and_ties_go_by_index() {
        let mut classes = Classes::new(5);
        assert_eq!(classes.join(3, 1), Some((3, 1)), "equal sizes: the smaller index stays");
        assert_eq!(classes.join(0, 3), Some((0, 1)), "the larger class stays");
        assert_eq!(classes.join(1, 0), None);
        assert_eq!(classes.join(2, 4), Some((4, 2)));
        assert_eq!(classes.join(4, 3), Some((2, 1)));
    }

    #[test]
    fn equal_weights_keep_edge_order() {
        assert_eq!(sort(&[1.0, 0.5, 1.0, 0.5]), [1, 3, 0, 2]);
    }

    #[test]
    fn two_components_leave_two_vertices() {
        let positions: Vec<[f32; 3]> =
            (0..8).map(|i| [i as f32, (i % 3) as f32, (i / 4 * 10) as f32]).collect();
        let triangles = [[0, 1, 2], [1, 2, 3], [4, 5, 6], [5, 6, 7]];
        let collapses =
            sequence(&Mesh { positions: &positions, triangles: &triangles, wedges: None });
        assert_eq!(collapses.len(), 8 - 2);
        let removed = |v| collapses.iter().any(|c| c.removed == v);
        assert_eq!((0..4).filter(|&v| !removed(v)).count(), 1);
        assert_eq!((4..8).filter(|&v| !removed(v)).count(), 1);
    }

    proptest! {
        /// Any triangle soup gives a forest with V - components entries, errors
        /// that never decrease, and chains no longer than log2 of V.
        #[test]
        fn any_mesh_gives_a_spanning_forest(
            positions in prop::collection::vec(prop::array::uniform3(-9_i8..9), 3..40),
            picks in prop::collection::vec(prop::array::uniform3(any::<u32>()), 0..80),
        ) {
            let positions: Vec<[f32; 3]> =
                positions.iter().map(|p| p.map(f32::from)).collect();
            let n = positions.len() as u32;
            let triangles: Vec<[u32; 3]> = picks
                .iter()
                .map(|t| t.map(|v| v % n))
                .filter(|[a, b, c]| a != b && b != c && c != a)
                .collect();
            let mesh = Mesh { positions: &positions, triangles: &triangles, wedges: None };
            let collapses = sequence(&mesh);

            let mut parent: Vec<u32> = (0..n).collect();
            let mut depth = vec![0_u32; n as usize];
            for c in &collapses {
                prop_assert_eq!(parent[c.removed as usize], c.removed);
                prop_assert_eq!(parent[c.kept as usize], c.kept);
                parent[c.removed as usize] = c.kept;
            }
            for c in collapses.iter().rev() {
                depth[c.removed as usize] = depth[c.kept as usize] + 1;
            }
            prop_assert!(depth.iter().all(|&d| d <= n.ilog2()));
            prop_assert!(collapses.is_sorted_by(|a, b| a.error <= b.error));

            let mut component: Vec<u32> = (0..n).collect();
            for _ in 0..n {
                for t in &triangles {
                    let least = t.map(|v| component[v as usize]).into_iter().min().unwrap();
                    for &v in t { component[v as usize] = least; }
                }
            }
            let count = (0..n).filter(|&v| component[v as usize] == v).count();
            prop_assert_eq!(collapses.len(), n as usize - count);
        }
    }
}
