//! Topology of shells under simplification: those that stay three-dimensional, flatten or vanish.
//!
//! A *shell* is a connected component of the mesh at theta 0, where equal points count as one. No
//! collapse makes a new point, so shells are followed by the points of their triangles: one may
//! keep its three dimensions, flatten, or vanish.

use std::collections::HashMap;

use busbar_geometry::{CollapseStacks, Topology};
use glam::{DVec3, Vec3};
use measure::{DisjointSets, EdgeCounts, vertices_in_use};
use serde::Serialize;

/// Greatest distance of a flat set of points from its plane, as a share of the diagonal of its
/// shell at theta 0.
pub const FLAT_SHARE: f64 = 1e-4;

/// Least tolerance, from the rounding of coordinates: units in the last place of the largest.
const ROUNDING_UNITS: f64 = 4.0;

/// Topology of a mesh at one cursor.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct TopologyCounts {
    /// Number of surviving vertices (welded positions).
    pub vertices: u64,
    /// Number of those vertices that no live triangle uses.
    pub unused_vertices: u64,
    /// Number of live triangles.
    pub triangles: u64,
    /// Value of 2V - T, from which shells and holes are counted.
    pub two_v_minus_t: i64,
    /// Number of connected sets of edges with exactly one live triangle.
    pub border_loops: u64,
    /// Number of edges with exactly one live triangle.
    pub border_edges: u64,
    /// Number of edges with more than two live triangles.
    pub non_manifold_edges: u64,
    /// Number of shells that have three dimensions at theta 0.
    pub shells: u64,
    /// Number of shells with a live piece that is not flat.
    pub solid_shells: u64,
    /// Number of shells whose live pieces are all flat.
    pub flattened_shells: u64,
    /// Number of shells without a live triangle.
    pub vanished_shells: u64,
}

/// Shells of a mesh at theta 0.
pub struct Shells {
    /// Distinct points of the mesh.
    points: Vec<DVec3>,
    /// Number of each point, by its bits.
    numbers: HashMap<[u32; 3], u32>,
    /// Shell of each point.
    of_point: Vec<u32>,
    shells: Vec<Shell>,
}

#[derive(Clone, Copy, Debug)]
struct Shell {
    /// Greatest distance of flat points from their plane, metres.
    tolerance: f64,
    solid: bool,
}

impl Shells {
    /// Finds the shells of a mesh, and those with three dimensions.
    pub fn new(full: &Topology) -> Self {
        let mut shells = Self {
            points: Vec::new(),
            numbers: HashMap::with_capacity(full.positions.len()),
            of_point: Vec::new(),
            shells: Vec::new(),
        };
        for &position in &full.positions {
            let next = shells.points.len() as u32;
            if *shells.numbers.entry(bits(position)).or_insert(next) == next {
                shells.points.push(position.as_dvec3());
            }
        }
        let pieces = Pieces::new(shells.points.len(), &shells.by_points(full));
        shells.shells = pieces.points.iter().map(|piece| measure(&shells.points, piece)).collect();
        shells.of_point = pieces.of_position;
        shells
    }

    /// Counts the topology of the simplified mesh: triangles between points that it had, and
    /// `surviving` vertices.
    pub fn count(&self, live: &Topology, surviving: u32) -> TopologyCounts {
        let edges = EdgeCounts::count(live.positions.len(), &live.triangles);
        let pieces = Pieces::new(self.points.len(), &self.by_points(live));
        let triangles = live.triangles.len();
        let mut counts = TopologyCounts {
            vertices: u64::from(surviving),
            unused_vertices: u64::from(surviving)
                .saturating_sub(vertices_in_use(&live.triangles) as u64),
            triangles: triangles as u64,
            two_v_minus_t: 2 * i64::from(surviving) - triangles as i64,
            border_loops: edges.border_loops,
            border_edges: edges.border,
            non_manifold_edges: edges.non_manifold,
            ..TopologyCounts::default()
        };
        self.count_states(&pieces, &mut counts);
        counts
    }

    /// Returns triangles as numbers of points.
    fn by_points(&self, mesh: &Topology) -> Vec<[u32; 3]> {
        let number = |&p: &Vec3| self.numbers.get(&bits(p)).copied().unwrap_or(u32::MAX);
        let numbers: Vec<u32> = mesh.positions.iter().map(number).collect();
        mesh.triangles.iter().map(|t| t.map(|v| numbers[v as usize])).collect()
    }

    fn count_states(&self, pieces: &Pieces, counts: &mut TopologyCounts) {
        let (mut alive, mut solid) =
            (vec![false; self.shells.len()], vec![false; self.shells.len()]);
        for points in &pieces.points {
            let Some(&first) = points.first() else { continue };
            let shell = self.of_point[first as usize] as usize;
            alive[shell] = true;
            if !solid[shell] {
                let tolerance = self.shells[shell].tolerance;
                solid[shell] = thickness(&self.points, points) > tolerance;
            }
        }
        for (shell, _) in self.shells.iter().enumerate().filter(|(_, shell)| shell.solid) {
            counts.shells += 1;
            match (alive[shell], solid[shell]) {
                (_, true) => counts.solid_shells += 1,
                (true, false) => counts.flattened_shells += 1,
                (false, false) => counts.vanished_shells += 1,
            }
        }
    }
}

/// Returns the bits of a point's coordinates, with -0 read as 0.
fn bits(point: Vec3) -> [u32; 3] {
    (point + Vec3::ZERO).to_array().map(f32::to_bits)
}

fn measure(positions: &[DVec3], points: &[u32]) -> Shell {
    let corners = points.iter().map(|&p| positions[p as usize]);
    let (low, high) = corners
        .fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(low, high), p| (low.min(p), high.max(p)));
    let rounding =
        ROUNDING_UNITS * f64::from(f32::EPSILON) * low.abs().max(high.abs()).max_element();
    let tolerance = (FLAT_SHARE * low.distance(high)).max(rounding);
    Shell { tolerance, solid: thickness(positions, points) > tolerance }
}

/// Returns the greatest distance of the points from a plane through three of them that span it
/// widely: the first, the farthest from it, and the farthest from their line.
fn thickness(positions: &[DVec3], points: &[u32]) -> f64 {
    let Some(&first) = points.first() else { return 0.0 };
    let origin = positions[first as usize];
    let offsets = || points.iter().map(|&p| positions[p as usize] - origin);
    let longest = |best: DVec3, next: DVec3| {
        if next.length_squared() > best.length_squared() { next } else { best }
    };
    let along = offsets().fold(DVec3::ZERO, longest).normalize_or_zero();
    let across = offsets().map(|o| o - along * o.dot(along)).fold(DVec3::ZERO, longest);
    let normal = along.cross(across).normalize_or_zero();
    offsets().map(|o| o.dot(normal).abs()).fold(0.0, f64::max)
}

/// Returns the live mesh after `cursor` collapses.
pub fn live(stacks: &CollapseStacks, cursor: u32) -> Topology {
    Topology {
        positions: stacks.mesh().positions.clone(),
        triangles: stacks.resolve(cursor).position_triangles().collect(),
    }
}

/// Connected components of triangles, by the positions that they use.
struct Pieces {
    /// Component of each position; without meaning where no triangle uses it.
    of_position: Vec<u32>,
    points: Vec<Vec<u32>>,
}

impl Pieces {
    fn new(position_count: usize, triangles: &[[u32; 3]]) -> Self {
        let mut sets = DisjointSets::new(position_count);
        let mut used = vec![false; position_count];
        for &[a, b, c] in triangles {
            sets.join(a, b);
            sets.join(b, c);
            for corner in [a, b, c] {
                used[corner as usize] = true;
            }
        }
        let mut pieces = Self { of_position: vec![u32::MAX; position_count], points: Vec::new() };
        for position in (0..position_count as u32).filter(|&p| used[p as usize]) {
            let root = sets.root(position) as usize;
            if pieces.of_position[root] == u32::MAX {
                pieces.of_position[root] = pieces.points.len() as u32;
                pieces.points.push(Vec::new());
            }
            let piece = pieces.of_position[root];
            pieces.of_position[position as usize] = piece;
            pieces.points[piece as usize].push(position);
        }
        pieces
    }
}

#[cfg(test)]
mod tests {
    use busbar_geometry::{Collapse, CollapseSequence, Mesh, RawPrimitive, weld};
    use glam::{Vec3, vec3};

    use super::*;

    /// Builds a unit cube at `x`, closed unless its top is left off.
    fn cube(x: f32, top: bool) -> RawPrimitive {
        let corner =
            |i: usize| Vec3::new((i & 1) as f32 + x, (i >> 1 & 1) as f32, (i >> 2 & 1) as f32);
        let mut quads = vec![[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [0, 4, 6, 2], [1, 3, 7, 5]];
        if top {
            quads.push([2, 6, 7, 3]);
        }
        RawPrimitive {
            positions: (0..8).map(corner).collect(),
            triangles: quads.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect(),
            ..RawPrimitive::default()
        }
    }

    fn counts_of(primitives: &[RawPrimitive], merges: &[(Vec3, Vec3)]) -> Vec<TopologyCounts> {
        let mesh: Mesh = weld(primitives).unwrap().0;
        let at = |place: Vec3| mesh.positions.iter().position(|&p| p == place).unwrap() as u32;
        let entries = merges
            .iter()
            .map(|&(from, to)| Collapse { removed: at(from), kept: at(to), error: 0.0 })
            .collect();
        let sequence = CollapseSequence::new(entries, mesh.positions.len() as u32).unwrap();
        let shells = Shells::new(&mesh.topology());
        let stacks = CollapseStacks::build(mesh, &sequence);
        let cursors = 0..=stacks.collapse_count();
        cursors.map(|k| shells.count(&live(&stacks, k), stacks.surviving(k))).collect()
    }

    #[test]
    fn a_closed_cube_has_no_border_and_an_open_one_a_loop() {
        let both = counts_of(&[cube(0.0, true), cube(3.0, false)], &[])[0];
        assert_eq!((both.vertices, both.triangles), (16, 22));
        assert_eq!(both.two_v_minus_t, 10);
        assert_eq!((both.border_edges, both.border_loops), (4, 1));
        assert_eq!((both.shells, both.solid_shells), (2, 2));
    }

    #[test]
    fn shells_flatten_and_then_vanish() {
        // The cube's far side (z = 1) moves onto its near side, corner by corner.
        let corners = [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1.0)];
        let mut merges: Vec<_> =
            corners.iter().map(|&(x, y)| (vec3(x, y, 1.0), vec3(x, y, 0.0))).collect();
        merges.push((vec3(0.0, 0.0, 0.0), vec3(1.0, 0.0, 0.0)));
        merges.push((vec3(0.0, 1.0, 0.0), vec3(1.0, 0.0, 0.0)));
        let steps = counts_of(&[cube(0.0, true)], &merges);
        let states: Vec<_> =
            steps.iter().map(|c| (c.solid_shells, c.flattened_shells, c.vanished_shells)).collect();
        assert_eq!(states[..4], [(1, 0, 0); 4]);
        assert_eq!(states[4..], [(0, 1, 0), (0, 1, 0), (0, 0, 1)]);
        let last = steps[6];
        assert_eq!((last.vertices, last.unused_vertices, last.triangles), (2, 2, 0));
        assert!(steps.iter().all(|c| c.border_edges == 0), "a closed shell never opens");
    }

    #[test]
    fn a_sheet_is_no_shell_that_could_flatten() {
        let mut sheet = cube(0.0, true);
        sheet.triangles.truncate(2);
        let counts = counts_of(&[sheet], &[])[0];
        assert_eq!((counts.shells, counts.flattened_shells, counts.border_loops), (0, 0, 1));
    }

    #[test]
    fn two_holes_are_two_loops() {
        let mut tube = cube(0.0, false);
        tube.triangles.drain(0..2);
        // The near side and the top share an edge: their borders are one loop.
        assert_eq!(counts_of(&[tube.clone()], &[])[0].border_loops, 1);
        let mut tube = cube(0.0, true);
        tube.triangles.drain(0..4);
        let counts = counts_of(&[tube], &[])[0];
        assert_eq!((counts.border_edges, counts.border_loops), (8, 2));
    }
}
