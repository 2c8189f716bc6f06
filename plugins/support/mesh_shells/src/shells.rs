//! Shells: the connected components of a mesh.

use std::ops::Range;

use busbar_plugin_sdk::Mesh;

/// Vertices and triangles in order of the shell (connected piece) they belong
/// to; within a shell as in the mesh. A vertex without triangles is a shell.
#[derive(Debug, Default)]
pub struct Shells {
    /// Vertices of the mesh, shell by shell.
    pub vertices: Vec<u32>,
    /// Triangles of the mesh, shell by shell.
    pub triangles: Vec<u32>,
    /// Place of each vertex within its shell.
    pub place: Vec<u32>,
    /// Starts of the vertices and triangles of each shell, and the totals.
    starts: Vec<[u32; 2]>,
}

impl Shells {
    /// Finds the shells, in order of their first vertex.
    pub fn find(mesh: &Mesh<'_>) -> Self {
        let shell_of = label(mesh);
        let count = shell_of.iter().max().map_or(0, |&last| last as usize + 1);
        let mut starts = vec![[0_u32; 2]; count + 1];
        for &shell in &shell_of {
            starts[shell as usize + 1][0] += 1;
        }
        let shell_of_triangle = |t: &[u32; 3]| shell_of[t[0] as usize] as usize;
        for triangle in mesh.triangles {
            starts[shell_of_triangle(triangle) + 1][1] += 1;
        }
        for shell in 0..count {
            let [vertices, triangles] = starts[shell];
            starts[shell + 1][0] += vertices;
            starts[shell + 1][1] += triangles;
        }
        let mut next = starts.clone();
        let mut vertices = vec![0; shell_of.len()];
        let mut place = vec![0; shell_of.len()];
        for (vertex, &shell) in shell_of.iter().enumerate() {
            let slot = &mut next[shell as usize][0];
            vertices[*slot as usize] = vertex as u32;
            place[vertex] = *slot - starts[shell as usize][0];
            *slot += 1;
        }
        let mut triangles = vec![0; mesh.triangles.len()];
        for (index, triangle) in mesh.triangles.iter().enumerate() {
            let slot = &mut next[shell_of_triangle(triangle)][1];
            triangles[*slot as usize] = index as u32;
            *slot += 1;
        }
        Self { vertices, triangles, place, starts }
    }

    /// Returns the number of shells.
    pub fn len(&self) -> usize {
        self.starts.len() - 1
    }

    /// Returns the vertices of a shell, as a range of `vertices`.
    pub fn vertex_range(&self, shell: usize) -> Range<usize> {
        self.starts[shell][0] as usize..self.starts[shell + 1][0] as usize
    }

    /// Returns the triangles of a shell, as a range of `triangles`.
    pub fn triangle_range(&self, shell: usize) -> Range<usize> {
        self.starts[shell][1] as usize..self.starts[shell + 1][1] as usize
    }
}

/// Numbers each vertex's shell, by union-find towards smaller indices.
fn label(mesh: &Mesh<'_>) -> Vec<u32> {
    let mut parent: Vec<u32> = (0..mesh.positions.len() as u32).collect();
    for &[a, b, c] in mesh.triangles {
        join(&mut parent, a, b);
        join(&mut parent, b, c);
    }
    // A parent is smaller than its child, so one pass suffices.
    let mut count = 0;
    for vertex in 0..parent.len() {
        if parent[vertex] as usize == vertex {
            parent[vertex] = count;
            count += 1;
        } else {
            parent[vertex] = parent[parent[vertex] as usize];
        }
    }
    parent
}

fn join(parent: &mut [u32], a: u32, b: u32) {
    let (a, b) = (root(parent, a), root(parent, b));
    parent[a.max(b) as usize] = a.min(b);
}

fn root(parent: &mut [u32], mut vertex: u32) -> u32 {
    while parent[vertex as usize] != vertex {
        parent[vertex as usize] = parent[parent[vertex as usize] as usize];
        vertex = parent[vertex as usize];
    }
    vertex
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shells_keep_the_order_of_the_mesh() {
        let triangles = [[6, 4, 5], [0, 3, 1], [6, 5, 7], [1, 3, 8]];
        let mesh = Mesh { positions: &[[0.0; 3]; 9], triangles: &triangles, wedges: None };
        let shells = Shells::find(&mesh);
        let vertices: Vec<_> =
            (0..shells.len()).map(|s| &shells.vertices[shells.vertex_range(s)]).collect();
        assert_eq!(vertices, [&[0, 1, 3, 8][..], &[2], &[4, 5, 6, 7]]);
        let triangles: Vec<_> =
            (0..shells.len()).map(|s| &shells.triangles[shells.triangle_range(s)]).collect();
        assert_eq!(triangles, [&[1, 3][..], &[], &[0, 2]]);
        assert_eq!(shells.place, [0, 1, 0, 2, 0, 1, 2, 3, 3]);
    }

    #[test]
    fn an_empty_mesh_has_no_shells() {
        assert_eq!(Shells::find(&Mesh { positions: &[], triangles: &[], wedges: None }).len(), 0);
    }
}
