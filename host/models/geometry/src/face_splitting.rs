//! Face splitting: islands split into flat faces, so that a lattice can be simplified face by face.
//!
//! An optimiser that keeps a surface a surface stops at a tube of three sides around each bar of
//! a lattice, say, until the whole dies. Where all of it is a few pixels, its faces may go one by
//! one ([`crate::CollapseStacks::simplified_stochastically`]).

use std::cmp::Reverse;

use glam::Vec3;

use crate::Mesh;

/// The cosine of the angle between two triangles of a face, at least.
const FLAT: f32 = 0.9;
/// Number of an element that has none yet.
const NONE: u32 = u32::MAX;

impl Mesh {
    /// Makes islands of the faces of some islands. A face is a triangle, or two beside each other
    /// that are nearly flat and of one section, over their longest edges first: pieces of any
    /// other shape could not be made larger in place of others. Their positions come after all
    /// that there were, and those that they had are left without triangles.
    pub(crate) fn split_into_faces(&mut self, island_of: &[u32], is_split: impl Fn(u32) -> bool) {
        let is_split = |&triangle: &u32| {
            let [position, ..] = self.corner_positions(self.triangles[triangle as usize]);
            is_split(island_of[position as usize])
        };
        let split: Vec<u32> = (0..self.triangles.len() as u32).filter(is_split).collect();
        let faces = self.find_faces(&split);
        let mut by_face: Vec<(u32, u32)> = faces.into_iter().zip(split).collect();
        by_face.sort_unstable();
        let mut positions = FaceNumbers::new(self.positions.len());
        let mut wedges = FaceNumbers::new(self.wedges.len());
        for (face, triangle) in by_face {
            let corners = self.triangles[triangle as usize];
            self.triangles[triangle as usize] = corners.map(|wedge| {
                let position = self.wedges.position[wedge as usize];
                let moved = positions.number_in(face, position, self.positions.len());
                if moved as usize == self.positions.len() {
                    self.positions.push(self.positions[position as usize]);
                    if let Some(&feature) = self.features.get(position as usize) {
                        self.features.push(feature);
                    }
                }
                let own = wedges.number_in(face, wedge, self.wedges.len());
                if own as usize == self.wedges.len() {
                    self.wedges.duplicate(wedge, moved);
                }
                own
            });
        }
    }

    /// Returns for each triangle the first triangle of its face.
    fn find_faces(&self, triangles: &[u32]) -> Vec<u32> {
        let at = |position: u32| self.positions[position as usize];
        let corners = |triangle: u32| self.corner_positions(self.triangles[triangle as usize]);
        let normal = |&triangle: &u32| {
            let [a, b, c] = corners(triangle).map(at);
            (b - a).cross(c - a)
        };
        let normals: Vec<Vec3> = triangles.iter().map(normal).collect();
        let section = |index: u32| {
            let [wedge, ..] = self.triangles[triangles[index as usize] as usize];
            self.wedges.section[wedge as usize]
        };
        let is_flat = |one: u32, other: u32| {
            let [a, b] = [one, other].map(|index| normals[index as usize]);
            a.dot(b) >= FLAT * a.length() * b.length() && section(one) == section(other)
        };
        let mut edges: Vec<(Reverse<u32>, [u32; 2], u32)> = (0..)
            .zip(triangles)
            .flat_map(|(index, &triangle)| {
                let [a, b, c] = corners(triangle);
                [[a, b], [b, c], [c, a]].map(|[from, to]| {
                    // As whole numbers these are in the same order.
                    let length = at(from).distance_squared(at(to)).to_bits();
                    (Reverse(length), [from.min(to), from.max(to)], index)
                })
            })
            .collect();
        edges.sort_unstable();
        let mut faces: Vec<u32> = (0..triangles.len() as u32).collect();
        let mut is_alone = vec![true; triangles.len()];
        for pair in edges.windows(2) {
            let [(_, edge, one), (_, same, other)] = [pair[0], pair[1]];
            let are_alone = is_alone[one as usize] && is_alone[other as usize];
            if edge == same && are_alone && is_flat(one, other) {
                faces[other as usize] = one;
                is_alone[one as usize] = false;
                is_alone[other as usize] = false;
            }
        }
        faces
    }
}

impl crate::Wedges {
    /// Adds one that is as another, on a position.
    fn duplicate(&mut self, wedge: u32, position: u32) {
        self.position.push(position);
        self.normal.push(self.normal[wedge as usize]);
        self.uv.push(self.uv[wedge as usize]);
        self.section.push(self.section[wedge as usize]);
    }
}

/// Numbers that things have in the face at hand.
struct FaceNumbers {
    /// Last face and number of each element.
    last: Vec<(u32, u32)>,
}

impl FaceNumbers {
    fn new(count: usize) -> Self {
        Self { last: vec![(NONE, NONE); count] }
    }

    /// Returns the number of an element in a face: `next` if it has none there.
    fn number_in(&mut self, face: u32, of: u32, next: usize) -> u32 {
        let last = &mut self.last[of as usize];
        if last.0 != face {
            *last = (face, next as u32);
        }
        last.1
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{RawPrimitive, weld};

    /// Makes a tube with square sides of a metre, so many metres long, and a plate beside it.
    fn tube_and_plate(length: u32) -> Mesh {
        let corner = |along: u32, side: u32| {
            let [y, z] = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]][side as usize % 4];
            Vec3::new(along as f32, y, z)
        };
        let mut tube = RawPrimitive::default();
        for (along, side) in (0..length).flat_map(|along| (0..4).map(move |side| (along, side))) {
            let first = tube.positions.len() as u32;
            let at = [(along, side), (along + 1, side), (along + 1, side + 1), (along, side + 1)];
            tube.positions.extend(at.map(|(along, side)| corner(along, side)));
            tube.triangles.extend([[0, 1, 2], [0, 2, 3]].map(|t| t.map(|of: u32| first + of)));
        }
        tube.features = vec![7; tube.positions.len()];
        let plate = RawPrimitive {
            positions: [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]
                .map(|at| Vec3::from(at) - Vec3::Y)
                .to_vec(),
            triangles: vec![[0, 1, 2]],
            features: vec![8; 3],
            ..RawPrimitive::default()
        };
        weld(&[tube, plate]).unwrap().0
    }

    /// Returns the triangles as points, which splitting does not move.
    fn points(mesh: &Mesh) -> Vec<[Vec3; 3]> {
        let at = |&corners: &[u32; 3]| {
            mesh.corner_positions(corners).map(|position| mesh.positions[position as usize])
        };
        mesh.triangles.iter().map(at).collect()
    }

    fn split(mesh: &Mesh) -> Mesh {
        let roots = mesh.island_roots();
        let [of_plate, ..] = mesh.corner_positions(*mesh.triangles.last().unwrap());
        let mut split_mesh = mesh.clone();
        split_mesh.split_into_faces(&roots, |island| island != roots[of_plate as usize]);
        split_mesh
    }

    fn islands(mesh: &Mesh) -> usize {
        let roots = mesh.island_roots();
        let of = |&corners: &[u32; 3]| roots[mesh.corner_positions(corners)[0] as usize];
        mesh.triangles.iter().map(of).collect::<std::collections::BTreeSet<_>>().len()
    }

    #[test]
    fn a_tube_becomes_squares_and_nothing_else_changes() {
        let mesh = tube_and_plate(3);
        assert_eq!(islands(&mesh), 2);
        let split_mesh = split(&mesh);
        assert_eq!(points(&split_mesh), points(&mesh));
        assert_eq!(islands(&split_mesh), 4 * 3 + 1, "three squares on each side, and the plate");
        assert_eq!(split_mesh.positions[..mesh.positions.len()], mesh.positions);
        assert_eq!(split_mesh.triangles.last(), mesh.triangles.last());
        for (&before, &after) in mesh.triangles.iter().zip(&split_mesh.triangles) {
            assert_eq!(split_mesh.feature(after), mesh.feature(before));
            for (before, after) in before.into_iter().zip(after) {
                let [before, after] = [before, after].map(|wedge| wedge as usize);
                assert_eq!(split_mesh.wedges.normal[after], mesh.wedges.normal[before]);
                assert_eq!(split_mesh.wedges.section[after], mesh.wedges.section[before]);
            }
        }
    }
}
