//! Occluder extraction: large convex flat faces of meshes.

use std::collections::HashMap;
use std::ops::Range;

use busbar_geometry::Mesh;
use glam::{Vec3, Vec4};

/// Live triangles of a mesh in which faces are looked for: those of more take as long as
/// they would spare.
const MAX_MESH_TRIANGLES: usize = 65_536;
/// Corners that a face has at most.
pub const MAX_CORNERS: usize = 12;
/// Faces of a mesh, the largest ones.
const MAX_FACES: usize = 16;
/// Triangles that they are made of.
const MAX_TRIANGLES: usize = 2 * MAX_FACES;
/// Triangles that are kept in mind until only those are.
const MAX_CANDIDATES: usize = 16 * MAX_TRIANGLES;
/// Least share of the largest triangle's area; smaller triangles are left out.
const LEAST_SHARE: f32 = 1.0 / 16.0;
/// Off a plane by this share of a triangle's edge, its corner is still on it; and so little of
/// a turn is none.
const FLAT: f32 = 1e-5;

/// A convex flat face, mesh space.
pub struct Occluder {
    /// Plane of the face: a point in front of it has a positive product.
    pub plane: Vec4,
    /// Counter-clockwise where it shows its front.
    pub corners: Box<[Vec3]>,
    /// Square units of the mesh.
    pub area: f32,
    /// The section that it is of.
    pub section: u32,
}

/// Finds the large flat faces among a mesh's live triangles, the largest first. `sections` are
/// ranges of `triangles`, one for each section of the mesh; those in none are left out.
pub fn occluders_of(
    mesh: &Mesh,
    triangles: &[[u32; 3]],
    sections: impl Iterator<Item = Range<u32>>,
) -> Box<[Occluder]> {
    if triangles.len() > MAX_MESH_TRIANGLES {
        return Box::default();
    }
    let candidates = largest(mesh, triangles, sections);
    let by_edge: HashMap<[u32; 2], usize> = candidates
        .iter()
        .enumerate()
        .flat_map(|(index, of)| of.edges().map(|edge| (edge, index)))
        .collect();
    let mut is_used = vec![false; candidates.len()];
    let mut faces = Vec::new();
    for first in 0..candidates.len() {
        if std::mem::replace(&mut is_used[first], true) {
            continue;
        }
        let mut face = GrowingFace::new(mesh, &candidates[first]);
        while let Some(added) = face.grow(&candidates, &by_edge, &is_used) {
            is_used[added] = true;
        }
        faces.push(face.finish(candidates[first].section));
    }
    faces.sort_by(|a, b| b.area.total_cmp(&a.area));
    faces.truncate(MAX_FACES);
    faces.into()
}

/// Returns the memory of occluders, bytes.
pub fn occluder_bytes(faces: &[Occluder]) -> u64 {
    let corners: usize = faces.iter().map(|face| face.corners.len()).sum();
    (size_of_val(faces) + corners * size_of::<Vec3>()) as u64
}

/// A triangle that may be part of a face.
struct Candidate {
    /// Positions of the mesh.
    corners: [u32; 3],
    area: f32,
    section: u32,
}

impl Candidate {
    fn edges(&self) -> [[u32; 2]; 3] {
        let [a, b, c] = self.corners;
        [[a, b], [b, c], [c, a]]
    }
}

/// Returns the triangles of the largest areas, the largest first.
fn largest(
    mesh: &Mesh,
    triangles: &[[u32; 3]],
    sections: impl Iterator<Item = Range<u32>>,
) -> Vec<Candidate> {
    let mut candidates: Vec<Candidate> = Vec::new();
    let mut most = 0.0_f32;
    for (section, range) in (0..).zip(sections) {
        for &wedges in &triangles[range.start as usize..range.end as usize] {
            let corners = mesh.corner_positions(wedges);
            let [a, b, c] = corners.map(|position| mesh.positions[position as usize]);
            let area = 0.5 * (b - a).cross(c - a).length();
            if area > 0.0 && area.is_finite() && area >= most * LEAST_SHARE {
                most = most.max(area);
                candidates.push(Candidate { corners, area, section });
            }
            if candidates.len() == MAX_CANDIDATES {
                keep_largest(&mut candidates);
            }
        }
    }
    keep_largest(&mut candidates);
    candidates.sort_by(|a, b| b.area.total_cmp(&a.area));
    let least = candidates.first().map_or(0.0, |largest| largest.area * LEAST_SHARE);
    candidates.retain(|candidate| candidate.area >= least);
    candidates
}

fn keep_largest(candidates: &mut Vec<Candidate>) {
    if candidates.len() > MAX_TRIANGLES {
        candidates.select_nth_unstable_by(MAX_TRIANGLES, |a, b| b.area.total_cmp(&a.area));
        candidates.truncate(MAX_TRIANGLES);
    }
}

/// A face that grows from a triangle.
struct GrowingFace<'a> {
    mesh: &'a Mesh,
    /// Positions of the mesh around it.
    ring: Vec<u32>,
    normal: Vec3,
    area: f32,
    section: u32,
}

impl<'a> GrowingFace<'a> {
    fn new(mesh: &'a Mesh, first: &Candidate) -> Self {
        let mut face = Self {
            mesh,
            ring: first.corners.to_vec(),
            normal: Vec3::ZERO,
            area: first.area,
            section: first.section,
        };
        let [a, b, c] = first.corners.map(|position| face.at(position));
        face.normal = (b - a).cross(c - a).normalize_or_zero();
        face
    }

    fn at(&self, position: u32) -> Vec3 {
        self.mesh.positions[position as usize]
    }

    /// Merges a neighbouring triangle that keeps the face flat and convex; returns its index.
    fn grow(
        &mut self,
        candidates: &[Candidate],
        by_edge: &HashMap<[u32; 2], usize>,
        is_used: &[bool],
    ) -> Option<usize> {
        if self.ring.len() == MAX_CORNERS {
            return None;
        }
        for index in 0..self.ring.len() {
            let [from, to] = [self.ring[index], self.ring[(index + 1) % self.ring.len()]];
            let Some(&beside) = by_edge.get(&[to, from]) else { continue };
            let candidate = &candidates[beside];
            let apex = candidate.corners.into_iter().find(|corner| ![from, to].contains(corner));
            if let (false, Some(apex)) = (is_used[beside], apex)
                && candidate.section == self.section
                && self.stays_flat_and_convex(index, apex)
            {
                self.ring.insert(index + 1, apex);
                self.area += candidate.area;
                return Some(beside);
            }
        }
        None
    }

    /// Reports whether the face stays flat and convex with an apex inserted after a corner.
    fn stays_flat_and_convex(&self, index: usize, apex: u32) -> bool {
        let count = self.ring.len();
        let around = [count - 1, 0, 1, 2].map(|step| self.at(self.ring[(index + step) % count]));
        let [before, from, to, after] = around;
        let apex = self.at(apex);
        let extent = from.distance(to).max(apex.distance(from));
        let is_flat = (apex - from).dot(self.normal).abs() <= FLAT * extent;
        let turns_left = |a: Vec3, b: Vec3, c: Vec3| {
            (b - a).cross(c - b).dot(self.normal) >= -FLAT * (b - a).length() * (c - b).length()
        };
        // A triangle that lies over the face turns its edge back.
        let is_beyond = (to - from).cross(apex - from).dot(self.normal) < 0.0;
        is_flat
            && is_beyond
            && turns_left(before, from, apex)
            && turns_left(from, apex, to)
            && turns_left(apex, to, after)
    }

    fn finish(self, section: u32) -> Occluder {
        let corners: Box<[Vec3]> = self.ring.iter().map(|&position| self.at(position)).collect();
        let plane = self.normal.extend(-self.normal.dot(corners[0]));
        Occluder { plane, corners, area: self.area, section }
    }
}

#[cfg(test)]
mod tests {
    use busbar_geometry::{RawPrimitive, weld};

    use super::*;

    fn mesh(positions: &[[f32; 3]], triangles: &[[u32; 3]]) -> Mesh {
        let primitive = RawPrimitive {
            positions: positions.iter().map(|&position| position.into()).collect(),
            triangles: triangles.to_vec(),
            ..RawPrimitive::default()
        };
        weld(&[primitive]).unwrap().0
    }

    fn faces_of(mesh: &Mesh) -> Box<[Occluder]> {
        let all = 0..mesh.triangles.len() as u32;
        occluders_of(mesh, &mesh.triangles, std::iter::once(all))
    }

    /// Makes a grid of squares in the plane z = 2, two triangles each.
    fn wall(columns: u32, rows: u32) -> Mesh {
        let positions: Vec<[f32; 3]> = (0..=rows)
            .flat_map(|y| (0..=columns).map(move |x| [x as f32, y as f32, 2.0]))
            .collect();
        let at = |x: u32, y: u32| y * (columns + 1) + x;
        let square = |x: u32, y: u32| {
            let [a, b, c, d] = [at(x, y), at(x + 1, y), at(x + 1, y + 1), at(x, y + 1)];
            [[a, b, c], [a, c, d]]
        };
        let triangles: Vec<[u32; 3]> =
            (0..rows).flat_map(|y| (0..columns).flat_map(move |x| square(x, y))).collect();
        mesh(&positions, &triangles)
    }

    #[test]
    fn triangles_in_a_plane_become_one_face() {
        let faces = faces_of(&wall(1, 1));
        let [face] = &*faces else { panic!("{}", faces.len()) };
        assert_eq!(face.corners.len(), 4);
        assert!((face.area - 1.0).abs() < 1e-6);
        assert_eq!(face.plane, Vec4::new(0.0, 0.0, 1.0, -2.0));
    }

    /// Merged faces are convex, and their areas add up to the whole.
    #[test]
    fn a_tiled_wall_is_covered_once_by_convex_faces() {
        let faces = faces_of(&wall(5, 3));
        let area: f32 = faces.iter().map(|face| face.area).sum();
        assert!((area - 15.0).abs() < 1e-4, "{area}");
        assert!(faces.len() < 30 / 2, "{} faces", faces.len());
        for face in &faces {
            let count = face.corners.len();
            let mut around = 0.0;
            for index in 0..count {
                let [a, b, c] = [0, 1, 2].map(|step| face.corners[(index + step) % count]);
                assert!((b - a).cross(c - b).z >= -1e-5, "not convex: {:?}", face.corners);
                around += a.cross(b).z * 0.5;
            }
            assert!((around - face.area).abs() < 1e-4, "{around} {}", face.area);
        }
    }

    #[test]
    fn faces_end_at_edges_corners_and_small_things() {
        // Two squares at a right angle, and a speck.
        let mesh = mesh(
            &[
                [0.0, 0.0, 0.0],
                [1.0, 0.0, 0.0],
                [1.0, 1.0, 0.0],
                [0.0, 1.0, 0.0],
                [1.0, 0.0, -1.0],
                [1.0, 1.0, -1.0],
                [5.0, 0.0, 0.0],
                [5.1, 0.0, 0.0],
                [5.0, 0.1, 0.0],
            ],
            &[[0, 1, 2], [0, 2, 3], [1, 4, 5], [1, 5, 2], [6, 7, 8]],
        );
        let faces = faces_of(&mesh);
        assert_eq!(faces.len(), 2);
        assert!(faces.iter().all(|face| face.corners.len() == 4));
        assert_ne!(faces[0].plane, faces[1].plane);
    }

    #[test]
    fn there_are_no_more_than_so_many_and_what_is_in_no_section_is_none() {
        // Apart from each other.
        let corners = (0..60).flat_map(|number| {
            let x = 3.0 * number as f32;
            [[x, 0.0, 0.0], [x + 1.0, 0.0, 0.0], [x, 1.0 + x, 0.0]]
        });
        let triangles: Vec<[u32; 3]> =
            (0..60).map(|number| [0, 1, 2].map(|corner| 3 * number + corner)).collect();
        let faces = faces_of(&mesh(&corners.collect::<Vec<_>>(), &triangles));
        assert_eq!(faces.len(), MAX_FACES);
        assert!(faces.is_sorted_by(|a, b| a.area >= b.area));
        assert!((faces[0].area - 0.5 * (1.0 + 3.0 * 59.0)).abs() < 1e-3, "the largest");
        assert!(faces_of(&wall(200, 200)).is_empty(), "too many to look at");
        let mesh = wall(40, 40);
        let faces = occluders_of(&mesh, &mesh.triangles, std::iter::once(0..2));
        assert!((faces.iter().map(|face| face.area).sum::<f32>() - 1.0).abs() < 1e-6);
        assert!(occluders_of(&mesh, &[], std::iter::empty()).is_empty());
    }

    #[test]
    fn what_has_no_area_is_no_face() {
        let mesh = mesh(&[[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [2.0, 0.0, 0.0]], &[[0, 1, 2]]);
        assert!(faces_of(&mesh).is_empty());
    }
}
