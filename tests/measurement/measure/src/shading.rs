//! Vertex normals from points and triangles alone.

use busbar_geometry::Topology;
use glam::Vec3;

/// Greatest angle between faces that are shaded smoothly in pictures, in those of originals and of
/// levels alike, degrees.
pub const CREASE_DEGREES: f32 = 40.0;

/// Computes the normal of each triangle's corners: the area-weighted sum of the faces around the
/// vertex that differ from the triangle by less than an angle.
pub fn creased_normals(mesh: &Topology, crease_degrees: f32) -> Vec<[Vec3; 3]> {
    let area_vector = |t: &[u32; 3]| {
        let [a, b, c] = t.map(|v| mesh.positions[v as usize]);
        (b - a).cross(c - a)
    };
    let faces: Vec<Vec3> = mesh.triangles.iter().map(area_vector).collect();
    let units: Vec<Vec3> = faces.iter().map(|face| face.normalize_or_zero()).collect();
    let around = VertexFaces::new(mesh);
    let least = crease_degrees.to_radians().cos();
    let normal = |(face, corners): (usize, &[u32; 3])| {
        corners.map(|vertex| {
            let smooth = around.faces(vertex).iter().map(|&other| other as usize);
            let smooth = smooth.filter(|&other| units[other].dot(units[face]) >= least);
            let sum: Vec3 = smooth.map(|other| faces[other]).sum();
            sum.try_normalize().unwrap_or(units[face])
        })
    };
    mesh.triangles.iter().enumerate().map(normal).collect()
}

/// Triangles around each vertex.
struct VertexFaces {
    starts: Vec<u32>,
    faces: Vec<u32>,
}

impl VertexFaces {
    fn new(mesh: &Topology) -> Self {
        let mut starts = vec![0_u32; mesh.positions.len() + 1];
        for &corner in mesh.triangles.as_flattened() {
            starts[corner as usize + 1] += 1;
        }
        for i in 1..starts.len() {
            starts[i] += starts[i - 1];
        }
        let mut next = starts.clone();
        let mut faces = vec![0; mesh.triangles.len() * 3];
        for (face, corners) in (0_u32..).zip(&mesh.triangles) {
            for &corner in corners {
                faces[next[corner as usize] as usize] = face;
                next[corner as usize] += 1;
            }
        }
        Self { starts, faces }
    }

    fn faces(&self, vertex: u32) -> &[u32] {
        let [start, end] = [0, 1].map(|next| self.starts[vertex as usize + next] as usize);
        &self.faces[start..end]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_right_angle_is_hard_and_a_flat_one_smooth() {
        let fold = |z: f32| Topology {
            positions: vec![Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::new(1.0, 0.0, z) - Vec3::Y],
            triangles: vec![[0, 1, 2], [1, 0, 3]],
        };
        let hard = creased_normals(&fold(-5.0), 40.0);
        assert_eq!(hard[0], [Vec3::Z; 3]);
        let smooth = creased_normals(&fold(-0.5), 40.0);
        assert_eq!(smooth[0][0], smooth[1][1], "both corners of the edge are shared");
        assert!(smooth[0][0].y.abs() > 0.1 && smooth[0][2] == Vec3::Z);
    }
}
