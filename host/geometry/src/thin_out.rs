//! A few islands for many, where each is less than a pixel.
//!
//! Stochastic simplification (Cook, Halstead, Planck and Ryu, "Stochastic Simplification of
//! Aggregate Detail", SIGGRAPH 2007): of islands that show less than a given area only a
//! share is kept, and these are as much larger, so that together they cover what all did.
//! What is left is bounded by the area that is shown, not by the number of parts.

use glam::Vec3;

use crate::{Bounds, Mesh};

/// How much thinner than the side of a square an island may be that shows as much as it.
const LEAST_THICKNESS: f32 = 1.0 / 16.0;
/// The island of a position without triangles.
const NOWHERE: u32 = u32::MAX;
/// Pieces of [`Mesh::divide`]: what stays, and what goes.
const KEPT: u32 = 0;
const DROPPED: u32 = 1;

/// An island that has triangles.
#[derive(Clone)]
struct Island {
    section: u32,
    bounds: Bounds,
    /// What it shows at most, square metres: from no side more than half of a surface.
    shown: f32,
    first: Far,
    second: Far,
}

impl Island {
    /// What it shows at least, if it is to be seen where a pixel is a square with this side.
    fn least_shown(&self, side: f32) -> f32 {
        side * side.max(self.second.metres * LEAST_THICKNESS)
    }
}

impl Mesh {
    /// The mesh without most of the islands that show less than a square with a side of so
    /// many metres, or are thinner than a sixteenth of that; the others of these are widened
    /// to be as large. Section by section they cover what all covered, to within half a
    /// square, or what the longest of them shows.
    #[must_use]
    pub fn thinned(mut self, side: f32) -> Self {
        let (island_of, islands) = self.shown_islands();
        // Of what each section lost so far, in islands.
        let mut owed = vec![0.0_f32; self.sections.len()];
        let mut pieces = vec![KEPT; islands.len()];
        let mut stretches: Vec<Option<Stretch>> = Vec::with_capacity(islands.len());
        for (island, piece) in islands.iter().zip(&mut pieces) {
            let least = island.least_shown(side);
            let owed = &mut owed[island.section as usize];
            let is_small = island.shown < least;
            *owed += if is_small { island.shown / least } else { 0.0 };
            let stays = is_small && *owed >= 0.5;
            *owed -= f32::from(stays);
            stretches.push(stays.then(|| Stretch::of(island, least)));
            if is_small && !stays {
                *piece = DROPPED;
            }
        }
        self.stretch(&island_of, &stretches);
        let piece_of = |&island: &u32| pieces.get(island as usize).copied().unwrap_or(DROPPED);
        let piece_of_position: Vec<u32> = island_of.iter().map(piece_of).collect();
        let mut thinned = self.divide(&piece_of_position, 2).swap_remove(KEPT as usize);
        thinned.shrink_to_fit();
        thinned
    }

    /// The island of each position, [`NOWHERE`] of one without triangles; and the islands,
    /// in the order of their first triangles.
    fn shown_islands(&self) -> (Vec<u32>, Vec<Island>) {
        let roots = self.island_roots();
        let mut of_root = vec![NOWHERE; roots.len()];
        let mut islands: Vec<Island> = Vec::new();
        for (section, range) in (0..).zip(&self.sections) {
            let first = range.first_triangle as usize;
            for &corners in &self.triangles[first..first + range.triangle_count as usize] {
                let positions = self.corner_positions(corners);
                let [a, b, c] = positions.map(|position| self.positions[position as usize]);
                let bounds = Bounds { min: a.min(b).min(c), max: a.max(b).max(c) };
                let index = &mut of_root[roots[positions[0] as usize] as usize];
                if *index == NOWHERE {
                    *index = islands.len() as u32;
                    let [first, second] = [Far::default(); 2];
                    islands.push(Island { section, bounds, shown: 0.0, first, second });
                }
                let island = &mut islands[*index as usize];
                island.bounds = island.bounds.union(bounds);
                island.shown += 0.25 * (b - a).cross(c - a).length();
            }
        }
        let island_of: Vec<u32> = roots.iter().map(|&root| of_root[root as usize]).collect();
        self.find_ends(&island_of, &mut islands);
        (island_of, islands)
    }

    /// The farthest from the middle, then the farthest from there: near enough its length.
    fn find_ends(&self, island_of: &[u32], islands: &mut [Island]) {
        for (&point, &island) in self.positions.iter().zip(island_of) {
            if let Some(island) = islands.get_mut(island as usize) {
                island.first.reach(island.bounds.center(), point);
            }
        }
        for (&point, &island) in self.positions.iter().zip(island_of) {
            if let Some(island) = islands.get_mut(island as usize) {
                island.second.reach(island.first.point, point);
            }
        }
    }

    fn stretch(&mut self, island_of: &[u32], stretches: &[Option<Stretch>]) {
        let of_position = |position: usize| stretches.get(island_of[position] as usize)?.as_ref();
        for (position, point) in self.positions.iter_mut().enumerate() {
            if let Some(stretch) = of_position(position) {
                *point = stretch.point(*point);
            }
        }
        let wedges = &mut self.wedges;
        for (normal, &position) in wedges.normal.iter_mut().zip(&wedges.position) {
            if let Some(stretch) = of_position(position as usize) {
                *normal = stretch.normal(*normal);
            }
        }
    }
}

/// The farthest point so far.
#[derive(Clone, Copy, Default)]
struct Far {
    point: Vec3,
    metres: f32,
}

impl Far {
    fn reach(&mut self, from: Vec3, point: Vec3) {
        let metres = from.distance(point);
        if metres > self.metres {
            *self = Self { point, metres };
        }
    }
}

/// Stretches along an axis and across it, about a point.
struct Stretch {
    center: Vec3,
    axis: Vec3,
    along: f32,
    across: f32,
}

impl Stretch {
    /// Makes an island show an area: thicker as long as it is long, then to a square.
    fn of(island: &Island, area: f32) -> Self {
        let more = area / island.shown.max(f32::MIN_POSITIVE);
        let length = island.second.metres;
        let thickness = island.shown / length;
        let side = area.sqrt();
        let [along, across] = if thickness * more <= length {
            [1.0, more]
        } else if thickness < side {
            [side / length, side / thickness]
        } else {
            [more.sqrt(); 2]
        };
        let axis = (island.second.point - island.first.point).normalize_or_zero();
        Self { center: island.bounds.center(), axis, along, across }
    }

    fn point(&self, point: Vec3) -> Vec3 {
        let offset = point - self.center;
        let along = self.axis * offset.dot(self.axis);
        self.center + along * self.along + (offset - along) * self.across
    }

    fn normal(&self, normal: Vec3) -> Vec3 {
        let along = self.axis * normal.dot(self.axis);
        (along / self.along + (normal - along) / self.across).normalize_or_zero()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{RawPrimitive, weld};

    /// Two-sided plates of a length and width, in a row.
    fn plates(sizes: &[[f32; 2]]) -> Mesh {
        let mut plates = RawPrimitive::default();
        for (place, &[length, width]) in (0..).zip(sizes) {
            let corner = Vec3::X * place as f32 * 1000.0;
            let at = |x, z| corner + Vec3::new(x, 0.0, z);
            let corners = [at(0.0, 0.0), at(length, 0.0), at(length, width), at(0.0, width)];
            plates.positions.extend(corners);
            plates.normals.extend([Vec3::Y; 4]);
            let sides = [[0, 1, 2], [0, 2, 3], [0, 2, 1], [0, 3, 2]];
            plates.triangles.extend(sides.map(|side| side.map(|i: u32| place * 4 + i)));
        }
        weld(&[plates]).unwrap().0
    }

    /// Of all triangles, on one side.
    fn shown(mesh: &Mesh) -> f32 {
        let area = |&corners: &[u32; 3]| {
            let [a, b, c] = mesh.corner_positions(corners).map(|p| mesh.positions[p as usize]);
            0.25 * (b - a).cross(c - a).length()
        };
        mesh.triangles.iter().map(area).sum()
    }

    fn sizes(mesh: &Mesh) -> Vec<Vec3> {
        mesh.shown_islands().1.iter().map(|i| i.bounds.max - i.bounds.min).collect()
    }

    #[test]
    fn what_is_large_enough_stays_as_it_is() {
        let mesh = plates(&[[3.0, 1.0], [2.0, 2.0]]);
        assert_eq!(mesh.clone().thinned(1.7), mesh);
    }

    #[test]
    fn a_few_cover_what_all_did() {
        let mesh = plates(&[[10.0, 0.1]; 40]);
        let thinned = mesh.clone().thinned(8.0_f32.sqrt());
        assert_eq!(sizes(&thinned).len(), 5);
        assert!((shown(&thinned) / shown(&mesh) - 1.0).abs() < 1e-3, "{}", shown(&thinned));
        // Along the plate's diagonal, which is not quite its axis.
        assert!(sizes(&thinned).iter().all(|size| size.x < 10.2 && size.z > 0.7 && size.z < 2.0));
        for (normal, &p) in thinned.wedges.normal.iter().zip(&thinned.wedges.position) {
            assert!(normal.is_normalized() && (p as usize) < thinned.positions.len());
        }
    }

    #[test]
    fn what_is_long_and_thin_has_a_least_thickness() {
        let mesh = plates(&[[100.0, 0.1]; 32]);
        let thinned = mesh.clone().thinned(3.2);
        assert_eq!(sizes(&thinned).len(), 16, "0.1 of 0.2 m");
        assert!((shown(&thinned) / shown(&mesh) - 1.0).abs() < 1e-3, "{}", shown(&thinned));
    }

    #[test]
    fn what_is_short_becomes_a_square() {
        let thinned = plates(&[[1.0, 0.5]; 32]).thinned(8.0_f32.sqrt());
        assert_eq!(sizes(&thinned).len(), 2);
        for size in sizes(&thinned) {
            assert!(size.max_element() < 4.5, "{size}");
        }
    }

    #[test]
    fn small_ones_that_come_to_little_are_gone() {
        let thinned = plates(&[[0.1, 0.1], [50.0, 50.0]]).thinned(8.0_f32.sqrt());
        assert_eq!(sizes(&thinned), [Vec3::new(50.0, 0.0, 50.0)]);
        assert!(plates(&[[0.1, 0.1]; 3]).thinned(8.0_f32.sqrt()).triangles.is_empty());
    }
}
