//! Turned shells in the greedy orders: what is regular stays regular.

use busbar_plugin_sdk::{Collapse, Mesh};
use glam::DVec3;
use mesh_shells::{Shells, coarse_cost, regular_order};

/// Bits of the fraction that a coarse weight keeps: steps of an eighth. More would let rounding choose
/// among the edges of a ring, fewer take edges of different rings for equal.
const FRACTION_BITS: u32 = 3;

/// A mesh whose turned shells are numbered anew: within each of them, the vertices that are to stay
/// longest come first.
pub(crate) struct RegularMesh {
    positions: Vec<[f32; 3]>,
    triangles: Vec<[u32; 3]>,
    /// Number of each vertex in the mesh that it was made of.
    numbers: Vec<u32>,
    /// Vertices of turned shells.
    is_turned: Vec<bool>,
}

impl RegularMesh {
    /// Numbers a mesh anew; `None` if it has no turned shell.
    pub(crate) fn new(mesh: &Mesh<'_>) -> Option<Self> {
        let shells = Shells::find(mesh);
        let mut numbers: Vec<u32> = (0..mesh.positions.len() as u32).collect();
        let mut is_turned = vec![false; numbers.len()];
        for shell in 0..shells.len() {
            let vertices = &shells.vertices[shells.vertex_range(shell)];
            let position =
                |&vertex: &u32| DVec3::from(mesh.positions[vertex as usize].map(f64::from));
            let positions: Vec<DVec3> = vertices.iter().map(position).collect();
            let triangles = shells.triangles[shells.triangle_range(shell)].iter();
            let place = |vertex: u32| shells.place[vertex as usize];
            let triangles = triangles.map(|&triangle| mesh.triangles[triangle as usize].map(place));
            let Some(order) = regular_order(&positions, triangles) else { continue };
            for (&number, &place) in vertices.iter().zip(order.vertices.iter().rev()) {
                numbers[number as usize] = vertices[place as usize];
                is_turned[number as usize] = true;
            }
        }
        if !is_turned.contains(&true) {
            return None;
        }
        let mut new_numbers = vec![0; numbers.len()];
        for (&number, new_number) in numbers.iter().zip(0..) {
            new_numbers[number as usize] = new_number;
        }
        Some(Self {
            positions: numbers.iter().map(|&number| mesh.positions[number as usize]).collect(),
            triangles: mesh.triangles.iter().map(|t| t.map(|v| new_numbers[v as usize])).collect(),
            numbers,
            is_turned,
        })
    }

    /// Returns the mesh, without attributes.
    pub(crate) fn mesh(&self) -> Mesh<'_> {
        Mesh { positions: &self.positions, triangles: &self.triangles, wedges: None }
    }

    /// Returns the weight that decides the order of an edge. Those of turned shells are coarse, and
    /// among equal ones that goes first whose vertex is to stay least.
    pub(crate) fn ordering_weight(&self, weight: f64, [_, larger]: [u32; 2]) -> f64 {
        match self.is_turned[larger as usize] {
            // The coarse weight leaves the lower bits free.
            true => {
                let coarse = coarse_cost(weight, FRACTION_BITS).to_bits();
                // The coarse weight leaves the lower bits free.
                f64::from_bits(coarse | u64::from(u32::MAX - larger))
            }
            false => weight,
        }
    }

    /// Numbers collapses as the mesh was.
    pub(crate) fn restore_numbers(&self, collapses: &mut [Collapse]) {
        for Collapse { removed, kept, .. } in collapses {
            [*removed, *kept] = [*removed, *kept].map(|number| self.numbers[number as usize]);
        }
    }
}

#[cfg(test)]
mod tests {
    use std::f32::consts::TAU;

    use super::*;
    use crate::{Interpretation, Order, Progress, collapse_list};

    const SEGMENTS: u32 = 12;

    /// Sheds, large and small in turn, on a leaning axis: positions ring by ring, and triangles.
    fn column(sheds: u32) -> (Vec<[f32; 3]>, Vec<[u32; 3]>) {
        let mut profile = Vec::new();
        for shed in 0..sheds {
            let reach = if shed % 2 == 0 { 0.065 } else { 0.047 };
            let root = 0.08 * shed as f32;
            profile.extend([(0.08, root), (0.08 + reach, root - 0.008)]);
        }
        let (sine, cosine) = 0.7_f32.sin_cos();
        let mut positions = Vec::new();
        for &(radius, y) in &profile {
            for step in 0..SEGMENTS {
                let angle = TAU * step as f32 / SEGMENTS as f32;
                let [x, z] = [radius * angle.cos(), radius * angle.sin()];
                positions.push([x * cosine - y * sine, x * sine + y * cosine, z]);
            }
        }
        let mut triangles = Vec::new();
        for ring in 0..profile.len() as u32 - 1 {
            for step in 0..SEGMENTS {
                let [a, b] = [step, (step + 1) % SEGMENTS].map(|step| ring * SEGMENTS + step);
                triangles.extend([[a, a + SEGMENTS, b], [b, a + SEGMENTS, b + SEGMENTS]]);
            }
        }
        (positions, triangles)
    }

    /// Rings alike, away from the ends, lose the same vertices; a few are under way.
    #[test]
    fn rings_alike_are_left_alike() {
        let (positions, triangles) = column(20);
        let mesh = Mesh { positions: &positions, triangles: &triangles, wedges: None };
        for order in [Order::Guarded, Order::Reweighted] {
            let progress = &mut Progress::detached();
            let list = collapse_list(mesh, &Interpretation::BUSBAR, order, 1, progress).unwrap();
            for theta in [0.3, 0.5, 0.7] {
                let count = (theta * positions.len() as f64) as usize;
                let mut is_left = vec![true; positions.len()];
                list.collapses[..count].iter().for_each(|c| is_left[c.removed as usize] = false);
                let rings: Vec<&[bool]> = is_left.chunks(SEGMENTS as usize).collect();
                // Two sheds are a period: four rings.
                let inner = &rings[8..rings.len() - 8];
                let alike = inner.windows(5).filter(|rings| rings[0] == rings[4]).count();
                let share = alike as f64 / (inner.len() - 4) as f64;
                assert!(share > 0.8, "{order:?} {theta}: {share} {inner:?}");
            }
        }
    }

    #[test]
    fn a_plate_keeps_its_numbers() {
        let positions = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0, 1.0, 0.0]];
        let triangles = [[0, 1, 2], [2, 1, 3]];
        let mesh = Mesh { positions: &positions, triangles: &triangles, wedges: None };
        assert!(RegularMesh::new(&mesh).is_none());
    }
}
