//! A sequence in the order of its errors.

use glam::Vec3;

use crate::stacks::death_indices;
use crate::{Bounds, Collapse, CollapseSequence, Mesh};

/// The fewest triangles that an island has while it counts as there: a tetrahedron's.
const LAST_TRIANGLES: usize = 4;

impl CollapseSequence {
    /// The same collapses of a mesh in the order of how far what is seen may differ. The
    /// error of each is the optimiser's own, or how far the vertices that move onto the
    /// kept one are from where they began, if that is less; and no less than those of its
    /// island before it. Islands do not touch, so that an optimiser which goes by their
    /// areas, say, does not keep a small one from going before a large one is touched.
    ///
    /// That an island vanishes is an error as large as a square of the area that it shows
    /// at most: a long conductor is seen for longer than it is thick.
    ///
    /// Entries that join islands of which nothing is left are dropped: they change
    /// nothing that is seen.
    pub fn by_error(&self, mesh: &Mesh) -> Self {
        let island_of = mesh.island_roots();
        let ends = self.ends(mesh, &island_of);
        // What each position stands for.
        let mut boxes: Vec<Bounds> =
            mesh.positions.iter().map(|&point| Bounds { min: point, max: point }).collect();
        let mut greatest = vec![0.0_f32; mesh.positions.len()];
        let mut entries: Vec<Collapse> = Vec::with_capacity(self.entries().len());
        for (done, entry) in (1..).zip(self.entries()) {
            let [removed, kept] = [entry.removed, entry.kept].map(|position| position as usize);
            if island_of[removed] != island_of[kept] {
                continue;
            }
            boxes[kept] = boxes[kept].union(boxes[removed]);
            let moved = farthest(mesh.positions[kept], &boxes[kept]);
            let error = &mut greatest[island_of[kept] as usize];
            *error = error.max(entry.error.min(moved));
            let end = &ends[island_of[kept] as usize];
            if done >= end.vanishes_at() {
                *error = error.max(end.seen);
            }
            entries.push(Collapse { error: *error, ..*entry });
        }
        // Stable: those of an island stay in their order.
        entries.sort_by(|a, b| a.error.total_cmp(&b.error));
        Self::new(entries, self.position_count()).unwrap_or_else(|_| self.clone())
    }
}

/// When an island ends, and what is gone with it.
#[derive(Clone)]
struct End {
    /// Of its triangles that live longest, the cursors at which they die; 0 of none.
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
        for (&corners, death) in mesh.triangles.iter().zip(death_indices(mesh, self)) {
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

/// From a point to the farthest point of a box.
fn farthest(point: Vec3, bounds: &Bounds) -> f32 {
    (point - bounds.min).max(bounds.max - point).length()
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::{CollapseStacks, RawPrimitive, weld};

    /// Fans of different sizes, each an island about a hub of its own.
    fn fans(sizes: &[f32]) -> Mesh {
        let fan = |(place, &size): (usize, &f32)| {
            let hub = Vec3::X * place as f32 * 1000.0;
            let rim = |i: u32| hub + Vec3::new((i as f32).cos(), (i as f32).sin(), 0.0) * size;
            RawPrimitive {
                positions: std::iter::once(hub).chain((0..6).map(rim)).collect(),
                triangles: (1..6).map(|i| [0, i, i + 1]).collect(),
                ..Default::default()
            }
        };
        weld(&sizes.iter().enumerate().map(fan).collect::<Vec<_>>()).unwrap().0
    }

    /// Each fan onto its hub, in the order of fans, then all hubs onto the first.
    fn onto_hubs(mesh: &Mesh, error: f32) -> CollapseSequence {
        let hub_of = |position: usize| position / 7 * 7;
        let onto = |removed: usize, kept: usize| Collapse {
            removed: removed as u32,
            kept: kept as u32,
            error,
        };
        let count = mesh.positions.len();
        let spokes = (0..count).filter(|p| p % 7 != 0).map(|p| onto(p, hub_of(p)));
        let hubs = (7..count).step_by(7).map(|p| onto(p, 0));
        CollapseSequence::new(spokes.chain(hubs).collect(), count as u32).unwrap()
    }

    #[test]
    fn small_islands_go_first_and_errors_are_their_sizes() {
        let mesh = fans(&[4.0, 1.0, 2.0]);
        let sequence = onto_hubs(&mesh, 100.0).by_error(&mesh);
        assert_eq!(sequence.len(), 18, "hubs stay");
        let islands: Vec<u32> = sequence.entries().iter().map(|e| e.kept / 7).collect();
        assert_eq!(islands, [[1; 6], [2; 6], [0; 6]].concat());
        let stacks = CollapseStacks::build(mesh, &sequence);
        let left =
            [0.5, 1.5, 3.0, 6.0].map(|error| stacks.live_triangles(stacks.cursor_within(error)));
        assert_eq!(left, [15, 10, 5, 0]);
    }

    #[test]
    fn the_optimisers_error_counts_where_it_is_less() {
        let mesh = fans(&[4.0, 1.0]);
        let sequence = onto_hubs(&mesh, 0.25).by_error(&mesh);
        // Two of the five triangles go; what is left vanishes with the whole.
        let least = |fan: u32| sequence.entries().iter().filter(move |e| e.kept / 7 == fan);
        for (fan, size) in [(0, 4.0), (1, 1.0_f32)] {
            let errors: Vec<f32> = least(fan).map(|entry| entry.error).collect();
            let seen = *errors.last().unwrap();
            assert!(seen > size * 0.8 && seen < size * 1.3, "{seen}");
            assert!(errors.iter().all(|&error| error == 0.25 || error == seen));
            assert_eq!(errors[0], 0.25);
        }
    }

    #[test]
    fn a_long_strut_outlives_its_thickness() {
        // 10 m long, 0.1 m thick: both ends shrink to a point at little error.
        let at = |i: u32| {
            let end = if i < 3 { 0.0 } else { 10.0 };
            Vec3::new(end, (i % 3) as f32 * 0.1, ((i % 3) * (i % 3)) as f32 * 0.05)
        };
        let side = |a: u32, b: u32| [[a, b, b + 3], [a, b + 3, a + 3]];
        let sides = [side(0, 1), side(1, 2), side(2, 0)].concat();
        let triangles = [&sides[..], &[[0, 2, 1], [3, 4, 5]]].concat();
        let strut =
            RawPrimitive { positions: (0..6).map(at).collect(), triangles, ..Default::default() };
        let mesh = weld(&[strut]).unwrap().0;
        let number = |i| mesh.positions.iter().position(|&p| p == at(i)).unwrap() as u32;
        let onto =
            |removed, kept| Collapse { removed: number(removed), kept: number(kept), error: 10.0 };
        let entries = vec![onto(1, 0), onto(4, 3), onto(2, 0), onto(5, 3), onto(3, 0)];
        let sequence = CollapseSequence::new(entries, 6).unwrap().by_error(&mesh);
        let stacks = CollapseStacks::build(mesh, &sequence);
        let left = |error| stacks.live_triangles(stacks.cursor_within(error));
        assert!(left(0.01) == 8 && left(0.5) >= 4, "{} {}", left(0.01), left(0.5));
        assert_eq!(left(2.0), 0);
    }

    proptest! {
        /// No vertex is farther from where it stands than its entry says, and every
        /// island goes through the same meshes as before.
        #[test]
        fn vertices_stay_within_the_error(
            sizes in prop::collection::vec(0.1_f32..9.0, 1..6),
            picks in prop::collection::vec((any::<u32>(), any::<u32>()), 0..60),
        ) {
            let mesh = fans(&sizes);
            let mut alive: Vec<u32> = (0..mesh.positions.len() as u32).collect();
            let mut entries = Vec::new();
            for (a, b) in picks {
                if alive.len() < 2 { break; }
                let removed = alive.swap_remove(a as usize % alive.len());
                let kept = alive[b as usize % alive.len()];
                entries.push(Collapse { removed, kept, error: 1e6 });
            }
            let sequence = CollapseSequence::new(entries, mesh.positions.len() as u32).unwrap();
            let sorted = sequence.by_error(&mesh);
            let mut stands: Vec<u32> = (0..mesh.positions.len() as u32).collect();
            for entry in sorted.entries() {
                stands.iter_mut().filter(|s| **s == entry.removed).for_each(|s| *s = entry.kept);
                for (position, &stands) in stands.iter().enumerate() {
                    let [from, to] = [position, stands as usize].map(|p| mesh.positions[p]);
                    prop_assert!(from.distance(to) <= entry.error * 1.0001);
                }
            }
            for island in 0..sizes.len() as u32 {
                let of = |s: &CollapseSequence| -> Vec<(u32, u32)> {
                    let pairs = s.entries().iter().map(|e| (e.removed, e.kept));
                    pairs.filter(|&(r, k)| r / 7 == island && k / 7 == island).collect()
                };
                prop_assert_eq!(of(&sequence), of(&sorted));
            }
        }
    }
}
