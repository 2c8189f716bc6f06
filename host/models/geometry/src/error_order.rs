//! Error order: a collapse sequence sorted by the error that each collapse may show.

use crate::stacks::removal_cursors;
use crate::surface_deviation::SurfaceDeviation;
use crate::{Collapse, CollapseSequence, Mesh};

/// The fewest triangles that an island has while it counts as there: a tetrahedron's.
pub(crate) const MIN_VISIBLE_TRIANGLES: usize = 4;

impl CollapseSequence {
    /// Sorts the collapses of a mesh by the error that each may show. The error of a collapse is
    /// the optimiser's own, or the root mean square distance of the moved surface from the original
    /// if that is less. A surface that gets thinner or thicker counts for more than one that gets
    /// rough. The error counts at least half the greatest distance and the shading error, and
    /// all of the greatest distance for slender islands. It is no less than the errors of earlier
    /// collapses around it. Collapses elsewhere need not wait: an optimiser that goes by areas does
    /// not keep a small part from going before a large one is touched.
    ///
    /// That an island vanishes is an error as large as a square of the area that it shows
    /// at most: a long conductor is seen for longer than it is thick. No error is greater.
    ///
    /// Entries that join islands of which nothing is left are dropped: they change
    /// nothing that is seen.
    pub fn ordered_by_error(&self, mesh: &Mesh) -> Self {
        let island_of = mesh.island_roots();
        let ends = self.island_ends(mesh, &island_of);
        let mut deviation = SurfaceDeviation::new(mesh);
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
        let sorted = Self::new(entries, self.position_count());
        sorted.map_or_else(
            |_| self.clone(),
            |sorted| sorted.with_theta_by_mesh(self.is_theta_by_mesh()),
        )
    }
}

/// Cursor at which an island vanishes, and the area that vanishes with it.
#[derive(Clone)]
struct IslandEnd {
    /// Removal cursors of its triangles that live longest; 0 for none.
    last_removals: [u32; MIN_VISIBLE_TRIANGLES],
    area: f32,
    /// The side of a square that shows as much as the island does at most, metres of the
    /// mesh.
    seen: f32,
}

impl IslandEnd {
    /// Returns the cursor from which on the island has fewer than [`MIN_VISIBLE_TRIANGLES`].
    fn vanishes_at(&self) -> u32 {
        self.last_removals.iter().copied().filter(|&removal| removal > 0).min().unwrap_or(u32::MAX)
    }

    fn add(&mut self, removal: u32, area: f32) {
        self.area += area;
        if let Some(first) = self.last_removals.iter_mut().min()
            && *first < removal
        {
            *first = removal;
        }
    }
}

impl CollapseSequence {
    /// Computes the ends of islands, by their root positions.
    fn island_ends(&self, mesh: &Mesh, island_of: &[u32]) -> Vec<IslandEnd> {
        let none = IslandEnd { last_removals: [0; MIN_VISIBLE_TRIANGLES], area: 0.0, seen: 0.0 };
        let mut ends = vec![none; mesh.positions.len()];
        for (&corners, removal) in mesh.triangles.iter().zip(removal_cursors(mesh, self)) {
            let positions = mesh.corner_positions(corners);
            let [a, b, c] = positions.map(|position| mesh.positions[position as usize]);
            let area = 0.5 * (b - a).cross(c - a).length();
            ends[island_of[positions[0] as usize] as usize].add(removal, area);
        }
        // From no side more than half of a surface is seen.
        ends.iter_mut().for_each(|end| end.seen = (end.area * 0.5).sqrt());
        ends
    }
}

#[cfg(test)]
#[path = "error_order_tests.rs"]
mod tests;
