//! A sequence in the order of its errors.

use crate::deviation::Deviation;
use crate::stacks::removal_cursors;
use crate::{Collapse, CollapseSequence, Mesh};

/// The fewest triangles that an island has while it counts as there: a tetrahedron's.
pub(crate) const LAST_TRIANGLES: usize = 4;

impl CollapseSequence {
    /// The same collapses of a mesh in the order of how far what is seen may differ. The
    /// error of each is the optimiser's own, or the root mean square distance between the
    /// surface that it moves and the one before all collapses if that is less (half the greatest
    /// distance at least, or what its shading comes to, and all of it of something slender);
    /// and no less than those of the collapses around it before. What is not around it need
    /// not wait for it: an optimiser that goes by areas, say, does not keep a small part from
    /// going before a large one is touched.
    ///
    /// That an island vanishes is an error as large as a square of the area that it shows
    /// at most: a long conductor is seen for longer than it is thick. No error is greater.
    ///
    /// Entries that join islands of which nothing is left are dropped: they change
    /// nothing that is seen.
    pub fn ordered_by_error(&self, mesh: &Mesh) -> Self {
        let island_of = mesh.island_roots();
        let ends = self.ends(mesh, &island_of);
        let mut deviation = Deviation::new(mesh);
        let mut entries: Vec<Collapse> = Vec::with_capacity(self.entries().len());
        for (done, entry) in (1..).zip(self.entries()) {
            let [removed, kept] =
                [entry.removed, entry.kept].map(|position| island_of[position as usize]);
            if removed != kept {
                continue;
            }
            let end = &ends[kept as usize];
            let measured = deviation.collapse(entry, end.seen);
            let error = if done >= end.vanishes_at() { end.seen } else { measured };
            entries.push(Collapse { error, ..*entry });
        }
        // Stable: of those around each other, none goes before one that it waits for.
        entries.sort_by(|a, b| a.error.total_cmp(&b.error));
        Self::new(entries, self.position_count()).unwrap_or_else(|_| self.clone())
    }
}

/// Cursor at which an island vanishes, and the area that vanishes with it.
#[derive(Clone)]
struct End {
    /// Removal cursors of its triangles that live longest; 0 for none.
    last_deaths: [u32; LAST_TRIANGLES],
    area: f32,
    /// The side of a square that shows as much as the island does at most, metres of the
    /// mesh.
    seen: f32,
}

impl End {
    /// The cursor from which on it has fewer than [`LAST_TRIANGLES`].
    fn vanishes_at(&self) -> u32 {
        self.last_deaths.iter().copied().filter(|&death| death > 0).min().unwrap_or(u32::MAX)
    }

    fn add(&mut self, death: u32, area: f32) {
        self.area += area;
        if let Some(first) = self.last_deaths.iter_mut().min()
            && *first < death
        {
            *first = death;
        }
    }
}

impl CollapseSequence {
    /// The ends of islands, by the positions that stand for them.
    fn ends(&self, mesh: &Mesh, island_of: &[u32]) -> Vec<End> {
        let none = End { last_deaths: [0; LAST_TRIANGLES], area: 0.0, seen: 0.0 };
        let mut ends = vec![none; mesh.positions.len()];
        for (&corners, death) in mesh.triangles.iter().zip(removal_cursors(mesh, self)) {
            let positions = mesh.corner_positions(corners);
            let [a, b, c] = positions.map(|position| mesh.positions[position as usize]);
            let area = 0.5 * (b - a).cross(c - a).length();
            ends[island_of[positions[0] as usize] as usize].add(death, area);
        }
        // From no side more than half of a surface is seen.
        ends.iter_mut().for_each(|end| end.seen = (end.area * 0.5).sqrt());
        ends
    }
}

#[cfg(test)]
#[path = "error_order_tests.rs"]
mod tests;
