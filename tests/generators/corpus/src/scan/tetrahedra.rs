//! The field's zero surface, by tetrahedra: each cell of an uneven, jittered
//! grid is cut into six along its diagonal (Kuhn 1960), so that neighbours agree
//! and the surface is closed wherever it ends inside the grid.

use std::collections::HashMap;

use glam::{IVec3, Vec3};

use crate::random::{signed_vector, unit};
use crate::scan::Surface;
use crate::scan::field::{HEIGHT, REACH, field};

/// Number of cells along each axis.
const CELLS: [usize; 3] = [52, 144, 52];
/// Greatest displacement of a grid point by jitter, as a share of a cell.
const JITTER: f32 = 0.22;
/// Relative variation of the sampling density along each axis.
const UNEVEN: f32 = 0.3;
/// Least distance of a crossing from the ends of its edge, as a share of the edge, so that points
/// stay apart.
const MARGIN: f32 = 0.06;

/// Paths from a cell's lowest to its highest corner, by single axes.
const PATHS: [[usize; 3]; 6] = [[0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]];

/// Extracts the whole zero surface of the field.
pub(crate) fn surface() -> Surface {
    let points = grid();
    let values: Vec<f32> = points.iter().map(|&point| field(point)).collect();
    let mut mesher = Mesher {
        points: &points,
        values: &values,
        crossings: HashMap::new(),
        found: Surface::default(),
    };
    for x in 0..CELLS[0] {
        for y in 0..CELLS[1] {
            for z in 0..CELLS[2] {
                mesher.cell([x, y, z]);
            }
        }
    }
    mesher.found
}

fn index([x, y, z]: [usize; 3]) -> usize {
    (x * (CELLS[1] + 1) + y) * (CELLS[2] + 1) + z
}

/// Returns grid points, uneven along each axis, each a little off its place.
fn grid() -> Vec<Vec3> {
    let low = Vec3::new(-REACH, -0.03, -REACH);
    let high = Vec3::new(REACH, HEIGHT + 0.15, REACH);
    let axes: [Vec<f32>; 3] = std::array::from_fn(|axis| lines(axis, low[axis], high[axis]));
    let cell = (high - low) / IVec3::from_array(CELLS.map(|n| n as i32)).as_vec3();
    let mut points = Vec::with_capacity(CELLS.iter().map(|n| n + 1).product());
    for &x in &axes[0] {
        for &y in &axes[1] {
            for &z in &axes[2] {
                let stray = signed_vector(points.len() as u64) * JITTER * (1.0 - UNEVEN) * cell;
                points.push(Vec3::new(x, y, z) + stray);
            }
        }
    }
    points
}

/// Returns the coordinates of grid lines along an axis, with a varying density.
fn lines(axis: usize, low: f32, high: f32) -> Vec<f32> {
    let spacing = |i: usize| 1.0 + UNEVEN * (2.0 * unit((i as u64 / 9) << 2 | axis as u64) - 1.0);
    let total: f32 = (0..CELLS[axis]).map(spacing).sum();
    let mut reached = 0.0;
    let line = |i: usize| {
        let at = low + (high - low) * reached / total;
        reached += spacing(i);
        at
    };
    (0..=CELLS[axis]).map(line).collect()
}

struct Mesher<'a> {
    points: &'a [Vec3],
    values: &'a [f32],
    /// Points at which edges cross the surface, by inner and outer end.
    crossings: HashMap<[u32; 2], u32>,
    found: Surface,
}

impl Mesher<'_> {
    fn cell(&mut self, lowest: [usize; 3]) {
        let highest = index(lowest.map(|c| c + 1));
        for path in PATHS {
            let mut at = lowest;
            let mut corners = [index(lowest), 0, 0, highest];
            for (corner, axis) in corners[1..3].iter_mut().zip(path) {
                at[axis] += 1;
                *corner = index(at);
            }
            // Odd orders of the axes turn the tetrahedron inside out.
            if !matches!(path, [0, 1, 2] | [1, 2, 0] | [2, 0, 1]) {
                corners.swap(1, 2);
            }
            self.tetrahedron(corners.map(|c| c as u32));
        }
    }

    /// Adds the part of the surface in a tetrahedron whose corners b, c, d turn
    /// counter-clockwise seen from a's far side.
    fn tetrahedron(&mut self, corners: [u32; 4]) {
        // Even orders, by which of the corners are inside.
        let inside = |corner: u32| self.values[corner as usize] < 0.0;
        let mask = (0..4).fold(0, |mask, i| mask | usize::from(inside(corners[i])) << i);
        let order = |order: [usize; 4]| order.map(|i| corners[i]);
        match mask {
            1 => self.tip(order([0, 1, 2, 3]), true),
            2 => self.tip(order([1, 0, 3, 2]), true),
            4 => self.tip(order([2, 0, 1, 3]), true),
            8 => self.tip(order([3, 0, 2, 1]), true),
            14 => self.tip(order([0, 1, 2, 3]), false),
            13 => self.tip(order([1, 0, 3, 2]), false),
            11 => self.tip(order([2, 0, 1, 3]), false),
            7 => self.tip(order([3, 0, 2, 1]), false),
            3 => self.band(order([0, 1, 2, 3])),
            5 => self.band(order([0, 2, 3, 1])),
            9 => self.band(order([0, 3, 1, 2])),
            6 => self.band(order([1, 2, 0, 3])),
            10 => self.band(order([1, 3, 2, 0])),
            12 => self.band(order([2, 3, 0, 1])),
            _ => {}
        }
    }

    /// Adds the triangle that cuts off one corner, alone inside or alone outside.
    fn tip(&mut self, [a, b, c, d]: [u32; 4], inside: bool) {
        let [p, q, r] = [b, c, d].map(|other| match inside {
            true => self.crossing(a, other),
            false => self.crossing(other, a),
        });
        self.found.triangles.push(if inside { [p, q, r] } else { [p, r, q] });
    }

    /// Adds the quadrilateral that separates the first two corners, which are inside, from the
    /// others.
    fn band(&mut self, [a, b, c, d]: [u32; 4]) {
        let [p, q, r, s] = [(a, c), (a, d), (b, d), (b, c)].map(|(i, o)| self.crossing(i, o));
        self.found.triangles.extend([[p, q, r], [p, r, s]]);
    }

    fn crossing(&mut self, inside: u32, outside: u32) -> u32 {
        let next = self.found.points.len() as u32;
        let found = *self.crossings.entry([inside, outside]).or_insert(next);
        if found == next {
            let [low, high] = [inside, outside].map(|end| self.values[end as usize]);
            let share = (low / (low - high)).clamp(MARGIN, 1.0 - MARGIN);
            let [from, to] = [inside, outside].map(|end| self.points[end as usize]);
            self.found.points.push(from.lerp(to, share));
        }
        found
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The undamaged surface is closed, and turns outward.
    #[test]
    fn every_edge_has_a_neighbour_the_other_way() {
        let surface = surface();
        let sides = surface.triangles.iter().flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]);
        let mut sides: Vec<_> = sides.collect();
        sides.sort_unstable();
        assert!(sides.windows(2).all(|pair| pair[0] != pair[1]), "walked twice one way");
        let open = sides.iter().find(|&&[a, b]| sides.binary_search(&[b, a]).is_err());
        assert_eq!(open, None);
        let corners = surface.triangles.iter().map(|t| t.map(|v| surface.points[v as usize]));
        let volume: f32 = corners.map(|[a, b, c]| a.dot(b.cross(c)) / 6.0).sum();
        assert!((0.04..0.08).contains(&volume), "{volume} cubic metres");
    }
}
