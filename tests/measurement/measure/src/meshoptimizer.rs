//! Simplifiers of meshoptimizer behind one interface.

use anyhow::{Result, ensure};
use busbar_geometry::Topology;
use meshopt::{SimplifyOptions, VertexDataAdapter};

use crate::levels::{search, vertices_in_use};

/// Error bound above any error, so that the target alone ends a call.
const ANY_ERROR: f32 = f32::MAX;
/// Weight of a normal that turns by one radian, as in meshoptimizer's own demonstration.
const NORMAL_WEIGHT: f32 = 0.5;
/// Greatest number of calls in the search for a number of vertices.
const MAX_CALLS: usize = 8;

/// Mesh in the form of meshoptimizer's input.
pub struct Input<'a> {
    triangles: &'a [[u32; 3]],
    vertices: VertexDataAdapter<'a>,
    /// Three floats a vertex, or none.
    normals: &'a [f32],
}

/// Simplification function of meshoptimizer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Simplifier {
    /// Function `simplify`: positions alone.
    Plain,
    /// Function `simplify_with_attributes`: normals too.
    WithNormals,
    /// Function `simplify_sloppy`: any topology.
    Sloppy,
}

impl<'a> Input<'a> {
    /// Takes welded positions without attributes.
    ///
    /// # Errors
    /// When there is none.
    pub fn new(mesh: &'a Topology) -> Result<Self> {
        Ok(Self { triangles: &mesh.triangles, vertices: adapter(&mesh.positions)?, normals: &[] })
    }

    /// Takes vertices with normals, as many as positions.
    ///
    /// # Errors
    /// When there is none, or the numbers differ.
    pub fn with_normals(
        triangles: &'a [[u32; 3]],
        positions: &'a [glam::Vec3],
        normals: &'a [f32],
    ) -> Result<Self> {
        ensure!(
            normals.len() == positions.len() * 3,
            "{} coordinates of normals for {} vertices: give each vertex a normal",
            normals.len(),
            positions.len()
        );
        Ok(Self { triangles, vertices: adapter(positions)?, normals })
    }

    /// Simplifies the mesh to a number of triangles by one call.
    ///
    /// # Errors
    /// When normals are to be kept and there are none.
    pub fn simplify(&self, kind: Simplifier, triangles: usize) -> Result<Vec<[u32; 3]>> {
        let (indices, wanted) = (self.triangles.as_flattened(), triangles * 3);
        let (vertices, options) = (&self.vertices, SimplifyOptions::None);
        let left = match kind {
            Simplifier::Plain => {
                meshopt::simplify(indices, vertices, wanted, ANY_ERROR, options, None)
            }
            Simplifier::Sloppy => {
                meshopt::simplify_sloppy(indices, vertices, wanted, ANY_ERROR, None)
            }
            Simplifier::WithNormals => {
                ensure!(!self.normals.is_empty(), "the mesh has no normals: give each vertex one");
                meshopt::simplify_with_attributes_and_locks(
                    indices,
                    vertices,
                    self.normals,
                    &[NORMAL_WEIGHT; 3],
                    size_of::<[f32; 3]>(),
                    &vec![false; vertices.vertex_count],
                    wanted,
                    ANY_ERROR,
                    options,
                    None,
                )
            }
        };
        Ok(left.as_chunks().0.to_vec())
    }

    /// Searches for the level whose number of vertices in use is nearest to `wanted`, within a
    /// limited number of calls.
    ///
    /// # Errors
    /// Returns the errors of [`Input::simplify`].
    pub fn at_vertices(&self, kind: Simplifier, wanted: usize) -> Result<Vec<[u32; 3]>> {
        let full = [self.triangles.len(), vertices_in_use(self.triangles)];
        let target = search(full, None, wanted, MAX_CALLS, |triangles| {
            anyhow::Ok(vertices_in_use(&self.simplify(kind, triangles)?))
        })?;
        self.simplify(kind, target)
    }
}

fn adapter(positions: &[glam::Vec3]) -> Result<VertexDataAdapter<'_>> {
    // Three floats, packed: Vec3 is repr(C).
    let bytes = meshopt::typed_to_bytes(positions);
    Ok(VertexDataAdapter::new(bytes, size_of::<glam::Vec3>(), 0)?)
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;

    /// Returns a bumpy grid of n by n squares.
    fn grid(n: u32) -> Topology {
        let at = |i: u32| {
            let (x, y) = ((i % (n + 1)) as f32, (i / (n + 1)) as f32);
            Vec3::new(x, y, (x * 0.7).sin() * (y * 0.4).cos())
        };
        let quad = |i: u32| {
            let a = i / n * (n + 1) + i % n;
            [[a, a + 1, a + n + 2], [a, a + n + 2, a + n + 1]]
        };
        Topology {
            positions: (0..(n + 1) * (n + 1)).map(at).collect(),
            triangles: (0..n * n).flat_map(quad).collect(),
        }
    }

    #[test]
    fn levels_have_the_vertices_asked_for() {
        let mesh = grid(40);
        let normals = [0.0, 0.0, 1.0].repeat(mesh.positions.len());
        let input = Input::with_normals(&mesh.triangles, &mesh.positions, &normals).unwrap();
        for kind in [Simplifier::Plain, Simplifier::WithNormals] {
            for wanted in [840, 168] {
                let found = vertices_in_use(&input.at_vertices(kind, wanted).unwrap());
                assert!(found.abs_diff(wanted) <= wanted / 20, "{found} for {wanted}");
            }
        }
        assert!(Input::new(&mesh).unwrap().simplify(Simplifier::WithNormals, 100).is_err());
        let sloppy = input.simplify(Simplifier::Sloppy, 500).unwrap();
        assert!(!sloppy.is_empty() && sloppy.len() <= 500, "{}", sloppy.len());
    }
}
