//! Islands (connected components), and the division of a mesh into pieces along them.
//!
//! Collapses follow edges, so they never leave an island (a connected component): its
//! pieces can go down and up each for itself, and the mesh stays whole.

use std::collections::BTreeMap;

use glam::Vec3;

use crate::{Bounds, Mesh, Section, Wedges};

/// Marker of an index that is in no piece yet.
const ABSENT: u32 = u32::MAX;

/// Limits beyond which a mesh, or a piece of it, is divided further.
#[derive(Clone, Copy, Debug)]
pub struct PieceLimits {
    /// Greatest number of triangles of a piece.
    pub triangles: u32,
    /// With more triangles, if it is wide.
    pub triangles_if_wide: u32,
    /// So far across, units of the mesh, it is wide.
    pub wide: f32,
}

/// The triangles of an island and where they are.
#[derive(Clone, Copy)]
struct Island {
    bounds: Bounds,
    triangles: u32,
    /// A bit for each material that it has, by its number; of many some share one.
    materials: u64,
}

impl Mesh {
    /// Splits the mesh into pieces of whole islands that lie near each other and share materials.
    /// Each piece is within the limits unless it is one island; triangles keep their order within
    /// it. A mesh within `triangles`, or of one island, is a single piece. Positions without
    /// triangles are in the first piece.
    pub fn into_pieces(self, limits: PieceLimits) -> Vec<Self> {
        if self.triangles.len() <= limits.triangles as usize {
            return vec![self];
        }
        let (island_of, islands) = self.find_islands();
        let (piece_of, pieces) = group_islands(&islands, limits);
        if pieces <= 1 {
            return vec![self];
        }
        let of_position = |&island: &u32| piece_of.get(island as usize).copied().unwrap_or(0);
        let piece_of_position: Vec<u32> = island_of.iter().map(of_position).collect();
        self.split_by_position(&piece_of_position, pieces)
    }

    /// Returns for each position the root position of its island.
    pub(crate) fn island_roots(&self) -> Vec<u32> {
        let mut above: Vec<u32> = (0..self.positions.len() as u32).collect();
        for &corners in &self.triangles {
            let [a, b, c] = self.corner_positions(corners).map(|p| find_root(&mut above, p));
            let least = a.min(b).min(c);
            [a, b, c].into_iter().for_each(|root| above[root as usize] = least);
        }
        (0..above.len() as u32).map(|position| find_root(&mut above, position)).collect()
    }

    /// Returns the island of each position, numbered from 0, and the number of islands. A position
    /// without triangles is an island by itself.
    pub(crate) fn island_numbers(&self) -> (Vec<u32>, usize) {
        let mut numbers = self.island_roots();
        let mut count = 0;
        for position in 0..numbers.len() {
            // A root is the least of its island: it has its number before the others come.
            let root = numbers[position] as usize;
            numbers[position] = if root == position { count } else { numbers[root] };
            count += u32::from(root == position);
        }
        (numbers, count as usize)
    }

    /// Returns the island of each position, or [`ABSENT`] without triangles, and the islands in
    /// order of their first triangles.
    fn find_islands(&self) -> (Vec<u32>, Vec<Island>) {
        let roots = self.island_roots();
        let mut island_of_root = vec![ABSENT; roots.len()];
        let mut found: Vec<(Bounds, u32, u64)> = Vec::new();
        for &corners in &self.triangles {
            let positions = self.corner_positions(corners);
            let root = roots[positions[0] as usize] as usize;
            let points = positions.map(|position| self.positions[position as usize]);
            let around = Bounds {
                min: points[0].min(points[1]).min(points[2]),
                max: points[0].max(points[1]).max(points[2]),
            };
            if island_of_root[root] == ABSENT {
                island_of_root[root] = found.len() as u32;
                found.push((around, 0, 0));
            }
            let (bounds, triangles, materials) = &mut found[island_of_root[root] as usize];
            *bounds = bounds.union(around);
            *triangles += 1;
            let section = self.wedges.section[corners[0] as usize];
            let material = self.sections[section as usize].material;
            *materials |= 1 << (material.map_or(0, |material| material + 1) % u64::BITS);
        }
        let island_of = roots.iter().map(|&root| island_of_root[root as usize]).collect();
        let island = |(bounds, triangles, materials): (Bounds, u32, u64)| Island {
            bounds,
            triangles,
            materials,
        };
        (island_of, found.into_iter().map(island).collect())
    }

    /// Splits the mesh into one mesh a piece. The corners of a triangle are in one piece.
    pub(crate) fn split_by_position(self, piece_of_position: &[u32], pieces: u32) -> Vec<Self> {
        let mut divided = vec![Self::default(); pieces as usize];
        let mut new_position = Vec::with_capacity(self.positions.len());
        for (index, (&position, &piece)) in self.positions.iter().zip(piece_of_position).enumerate()
        {
            let piece = &mut divided[piece as usize];
            new_position.push(piece.positions.len() as u32);
            piece.positions.push(position);
            piece.features.extend(self.features.get(index));
        }
        // Sections of a piece are those that it has triangles of.
        let mut new_section = vec![vec![ABSENT; self.sections.len()]; pieces as usize];
        for (section, old) in self.sections.iter().enumerate() {
            let end = old.first_triangle + old.triangle_count;
            for &corners in &self.triangles[old.first_triangle as usize..end as usize] {
                let number = piece_of_position[self.corner_positions(corners)[0] as usize] as usize;
                let piece = &mut divided[number];
                if new_section[number][section] == ABSENT {
                    new_section[number][section] = piece.sections.len() as u32;
                    let first_triangle = piece.triangles.len() as u32;
                    let material = old.material;
                    piece.sections.push(Section { material, first_triangle, triangle_count: 0 });
                }
                if let Some(section) = piece.sections.last_mut() {
                    section.triangle_count += 1;
                }
                piece.triangles.push(corners);
            }
        }
        let mut new_wedge = Vec::with_capacity(self.wedges.len());
        let Wedges { position, normal, uv, section } = &self.wedges;
        for wedge in 0..position.len() {
            let number = piece_of_position[position[wedge] as usize] as usize;
            let wedges = &mut divided[number].wedges;
            new_wedge.push(wedges.position.len() as u32);
            wedges.position.push(new_position[position[wedge] as usize]);
            wedges.normal.push(normal[wedge]);
            wedges.uv.push(uv[wedge]);
            let of_section = new_section[number].get(section[wedge] as usize);
            // Of a wedge that no triangle uses it says nothing.
            wedges.section.push(of_section.copied().filter(|&new| new != ABSENT).unwrap_or(0));
        }
        for corner in divided.iter_mut().flat_map(|piece| piece.triangles.as_flattened_mut()) {
            *corner = new_wedge[*corner as usize];
        }
        divided
    }
}

/// Finds the root of a position (union-find), halving the path.
pub(crate) fn find_root(above: &mut [u32], mut position: u32) -> u32 {
    while above[position as usize] != position {
        above[position as usize] = above[above[position as usize] as usize];
        position = above[position as usize];
    }
    position
}

/// Groups islands of the same materials into pieces, halved along the longest axis until each is
/// within the limits. Returns the piece of each island, and the number of pieces.
fn group_islands(islands: &[Island], limits: PieceLimits) -> (Vec<u32>, u32) {
    let mut piece_of = vec![0; islands.len()];
    let mut pieces = 0;
    let mut of_materials: BTreeMap<u64, Vec<u32>> = BTreeMap::new();
    for (number, island) in (0..).zip(islands) {
        of_materials.entry(island.materials).or_default().push(number);
    }
    let mut open: Vec<Vec<u32>> = of_materials.into_values().collect();
    while let Some(mut members) = open.pop() {
        let of = |&member: &u32| islands[member as usize];
        let total: u64 = members.iter().map(|member| u64::from(of(member).triangles)).sum();
        let boxes = members.iter().map(|member| of(member).bounds);
        let across = boxes.reduce(Bounds::union).map_or(0.0, |bounds| bounds.radius() * 2.0);
        let PieceLimits { triangles, triangles_if_wide, wide } = limits;
        let most = if across > wide { triangles_if_wide } else { triangles };
        if total <= u64::from(most) || members.len() <= 1 {
            members.iter().for_each(|&member| piece_of[member as usize] = pieces);
            pieces += 1;
            continue;
        }
        let centers = Bounds::from_points(members.iter().map(|member| of(member).bounds.center()));
        let size = centers.map_or(Vec3::ONE, |bounds| bounds.max - bounds.min).to_array();
        let axis = (0..3).max_by(|&a, &b| size[a].total_cmp(&size[b])).unwrap_or(0);
        let along = |member: &u32| of(member).bounds.center().to_array()[axis];
        members.sort_unstable_by(|a, b| along(a).total_cmp(&along(b)).then(a.cmp(b)));
        let mut before = 0;
        let half = members.iter().position(|member| {
            before += u64::from(of(member).triangles);
            before * 2 > total
        });
        // Both halves have a member, and so in the end each piece has.
        let upper = members.split_off(half.unwrap_or(1).clamp(1, members.len() - 1));
        open.push(upper);
        open.push(members);
    }
    (piece_of, pieces)
}

#[cfg(test)]
mod tests {
    use glam::Vec2;
    use proptest::prelude::*;

    use super::*;
    use crate::{RawPrimitive, weld};

    /// Strips of quads, each an island, at places, in two materials.
    fn strips(places: &[(i8, i8, u8)]) -> Mesh {
        let strip = |&(x, z, quads): &(i8, i8, u8)| {
            let at = |i: u32, y| Vec3::new(f32::from(x) * 300.0 + i as f32, y, f32::from(z) * 3.0);
            let quads = u32::from(quads) + 1;
            RawPrimitive {
                positions: (0..=quads).flat_map(|i| [at(i, 0.0), at(i, 1.0)]).collect(),
                triangles: (0..quads)
                    .flat_map(|i| {
                        [[2 * i, 2 * i + 2, 2 * i + 1], [2 * i + 1, 2 * i + 2, 2 * i + 3]]
                    })
                    .collect(),
                material: Some(u32::from(x.unsigned_abs() % 2)),
                ..Default::default()
            }
        };
        weld(&places.iter().map(strip).collect::<Vec<_>>()).unwrap().0
    }

    fn limits(triangles: u32, triangles_if_wide: u32) -> PieceLimits {
        PieceLimits { triangles, triangles_if_wide, wide: 100.0 }
    }

    type Corner = ([u32; 3], [u32; 3], [u32; 2], Option<u32>);

    /// Returns everything that a triangle's corners show, as bits.
    fn triangles(mesh: &Mesh) -> Vec<[Corner; 3]> {
        let bits = |v: Vec3| v.to_array().map(f32::to_bits);
        let shown = |index: u32, corners: [u32; 3]| {
            let of = |s: &&Section| {
                (s.first_triangle..s.first_triangle + s.triangle_count).contains(&index)
            };
            let section = mesh.sections.iter().position(|s| of(&s)).unwrap();
            corners.map(|wedge| {
                let wedge = wedge as usize;
                assert_eq!(mesh.wedges.section[wedge] as usize, section);
                let uv: Vec2 = mesh.wedges.uv[wedge];
                (
                    bits(mesh.positions[mesh.wedges.position[wedge] as usize]),
                    bits(mesh.wedges.normal[wedge]),
                    uv.to_array().map(f32::to_bits),
                    mesh.sections[section].material,
                )
            })
        };
        (0..).zip(&mesh.triangles).map(|(index, &corners)| shown(index, corners)).collect()
    }

    #[test]
    fn what_is_small_or_hangs_together_stays_whole() {
        let one = strips(&[(0, 0, 99)]);
        let narrow = |triangles| limits(triangles, triangles);
        assert_eq!(one.clone().into_pieces(narrow(10)), vec![one.clone()]);
        let two = strips(&[(0, 0, 9), (5, 0, 9)]);
        assert_eq!(two.clone().into_pieces(narrow(40)), vec![two.clone()]);
        assert_eq!(two.into_pieces(narrow(39)).len(), 2);
    }

    #[test]
    fn neighbours_stay_together() {
        let mesh = strips(&[(0, 0, 9), (20, 0, 9), (0, 1, 9), (20, 1, 9)]);
        let pieces = mesh.into_pieces(limits(40, 40));
        let sizes: Vec<f32> = pieces.iter().map(|p| p.bounds().unwrap().radius()).collect();
        assert_eq!(pieces.len(), 2);
        assert!(sizes.iter().all(|&radius| radius < 10.0), "{sizes:?}");
    }

    #[test]
    fn what_is_wide_is_divided_further() {
        let [near, far] = [
            strips(&[(0, 0, 9), (0, 1, 9), (0, 2, 9)]),
            strips(&[(0, 0, 9), (2, 0, 9), (4, 0, 9)]),
        ];
        let count = |mesh: &Mesh| mesh.clone().into_pieces(limits(50, 30)).len();
        assert_eq!([count(&near), count(&far)], [2, 3]);
    }

    #[test]
    fn pieces_have_one_material_where_islands_do() {
        let mesh = strips(&[(0, 0, 9), (1, 0, 9), (2, 0, 9), (3, 0, 9)]);
        let pieces = mesh.into_pieces(limits(79, 79));
        let materials: Vec<Vec<Option<u32>>> = pieces
            .iter()
            .map(|piece| piece.sections.iter().map(|section| section.material).collect())
            .collect();
        assert_eq!(materials, [[Some(1); 2], [Some(0); 2]]);
    }

    proptest! {
        /// Every triangle is in one piece, as it was, and pieces share no island.
        #[test]
        fn pieces_are_the_mesh(
            places in prop::collection::btree_map((-9_i8..9, -9_i8..9), 0_u8..20, 1..30),
            max_triangles in 1_u32..200,
            share_if_wide in 0.1_f32..1.0,
        ) {
            let places: Vec<_> = places.into_iter().map(|((x, z), quads)| (x, z, quads)).collect();
            let mesh = strips(&places);
            let mut expected = triangles(&mesh);
            let pieces = mesh.clone().into_pieces(limits(max_triangles, (max_triangles as f32 * share_if_wide) as u32));
            let mut found: Vec<_> = pieces.iter().flat_map(triangles).collect();
            expected.sort_unstable();
            found.sort_unstable();
            prop_assert_eq!(found, expected);
            let positions: usize = pieces.iter().map(|piece| piece.positions.len()).sum();
            prop_assert_eq!(positions, mesh.positions.len());
            for piece in &pieces {
                let islands = piece.find_islands().1.len();
                prop_assert!(piece.triangles.len() <= max_triangles as usize || islands == 1);
                piece.wedge_ranges();
            }
        }
    }
}
