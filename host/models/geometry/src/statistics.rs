//! Topology statistics of a mesh: vertices, edges, borders and components in welded positions.

use std::collections::HashSet;

use crate::ResolvedMesh;
use crate::islands::find_root;

/// Topology of a mesh at one cursor.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct MeshStatistics {
    /// Surviving positions: imported ones less the collapses done.
    pub vertices: u64,
    /// Positions that a live triangle uses; at most `vertices`.
    pub vertices_referenced: u64,
    /// Number of live triangles.
    pub triangles: u64,
    /// Edges of live triangles.
    pub edges: u64,
    /// Edges with exactly one live triangle.
    pub border_edges: u64,
    /// Edges with more than two live triangles.
    pub non_manifold_edges: u64,
    /// Connected components of live triangles.
    pub components: u64,
}

impl MeshStatistics {
    /// Counts over a resolved mesh. `surviving` is V - k.
    pub fn from_resolved(resolved: &ResolvedMesh<'_>, surviving: u32) -> Self {
        let triangles: Vec<[u32; 3]> = resolved.position_triangles().collect();
        let mut edges: Vec<u64> = triangles
            .iter()
            .flat_map(|&[a, b, c]| [(a, b), (b, c), (c, a)])
            .map(|(a, b)| (u64::from(a.min(b)) << 32) | u64::from(a.max(b)))
            .collect();
        edges.sort_unstable();
        let mut statistics = Self {
            vertices: u64::from(surviving),
            triangles: triangles.len() as u64,
            ..Self::default()
        };
        for run in edges.chunk_by(|a, b| a == b) {
            statistics.edges += 1;
            statistics.border_edges += u64::from(run.len() == 1);
            statistics.non_manifold_edges += u64::from(run.len() > 2);
        }
        let used: HashSet<u32> = triangles.iter().flatten().copied().collect();
        statistics.vertices_referenced = used.len() as u64;
        statistics.components =
            u64::from(count_components(resolved.position_count(), &triangles).referenced);
        statistics
    }

    /// Computes the Euler characteristic V - E + F over referenced vertices.
    pub fn euler_characteristic(&self) -> i64 {
        self.vertices_referenced as i64 - self.edges as i64 + self.triangles as i64
    }
}

/// The counts of two meshes together.
impl std::ops::Add for MeshStatistics {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self {
            vertices: self.vertices + other.vertices,
            vertices_referenced: self.vertices_referenced + other.vertices_referenced,
            triangles: self.triangles + other.triangles,
            edges: self.edges + other.edges,
            border_edges: self.border_edges + other.border_edges,
            non_manifold_edges: self.non_manifold_edges + other.non_manifold_edges,
            components: self.components + other.components,
        }
    }
}

/// Connected components of a triangle set.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Components {
    /// Components over all positions; one that no triangle uses counts as one.
    pub all: u32,
    /// Components that have a triangle.
    pub referenced: u32,
}

/// Counts connected components (positions joined by triangle edges).
pub fn count_components(position_count: u32, triangles: &[[u32; 3]]) -> Components {
    let mut parent: Vec<u32> = (0..position_count).collect();
    let mut all = position_count;
    let mut referenced = vec![false; position_count as usize];
    for &[a, b, c] in triangles {
        for (x, y) in [(a, b), (b, c)] {
            let (rx, ry) = (find_root(&mut parent, x), find_root(&mut parent, y));
            if rx != ry {
                parent[rx.max(ry) as usize] = rx.min(ry);
                all -= 1;
            }
        }
        for x in [a, b, c] {
            referenced[x as usize] = true;
        }
    }
    let unused = referenced.iter().filter(|used| !**used).count() as u32;
    Components { all, referenced: all - unused }
}
