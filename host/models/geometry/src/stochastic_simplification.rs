//! Stochastic simplification: a share of the islands below a pixel stands in for all of them.
//!
//! Stochastic simplification (Cook, Halstead, Planck and Ryu, "Stochastic Simplification of
//! Aggregate Detail", SIGGRAPH 2007): of islands that show less than a given area only a
//! share is kept, and these are as much larger, so that together they cover what all did.
//! What is left is bounded by the area that is shown, not by the number of parts, nor by that
//! of their triangles: what is long and thin shows few pixels, and collapses within a pixel
//! leave it more triangles than those.

use std::cmp::Reverse;

use glam::Vec3;

use crate::error_order::MIN_VISIBLE_TRIANGLES;
use crate::{Bounds, Collapse, CollapseSequence, CollapseStacks, Mesh, SequenceError};

/// Least thickness of an island, as a share of a square's side, for it to count as visible.
const LEAST_THICKNESS: f32 = 1.0 / 16.0;
/// Errors of the collapses that leave an island few triangles, in sides of a square.
const MAX_ERROR_SIDES: f32 = 0.5;
/// Greatest distance that widening moves a point, in sides of a square. Bent or flat islands would
/// stand out of the picture without this limit.
const MAX_MOVE_SIDES: f32 = 0.6;
/// Least share that an island is narrowed to, to show what it did.
const LEAST_SHARE: f32 = 0.25;
/// Least change of the shown area that stretching is worth, as a share.
const LEAST_STRETCH: f32 = 0.01;
/// Triangles that an island may have for each square that it shows; of more it is taken apart.
const MAX_TRIANGLES_A_SQUARE: usize = 8;
/// The island of a position without triangles.
const NOWHERE: u32 = u32::MAX;
/// Pieces of [`Mesh::split_by_position`]: what stays, and what goes.
const KEPT: u32 = 0;
const DROPPED: u32 = 1;

/// An island that has triangles.
#[derive(Clone)]
struct Island {
    section: u32,
    bounds: Bounds,
    /// Area that it shows at most, square metres: from no side more than half of a surface.
    shown: f32,
    first: FarthestPoint,
    second: FarthestPoint,
    /// Greatest distance from the axis through its middle, metres.
    reach: f32,
}

impl Island {
    /// Island without a triangle.
    const EMPTY: Self = Self {
        section: NOWHERE,
        bounds: Bounds { min: Vec3::ZERO, max: Vec3::ZERO },
        shown: 0.0,
        first: FarthestPoint::NONE,
        second: FarthestPoint::NONE,
        reach: 0.0,
    };

    /// Returns the unit vector from one end to the other.
    fn axis(&self) -> Vec3 {
        (self.second.point - self.first.point).normalize_or_zero()
    }

    /// Reaches as far from its axis as a point.
    fn extend_reach(&mut self, point: Vec3) {
        let offset = point - self.bounds.center();
        self.reach = self.reach.max(offset.cross(self.axis()).length());
    }

    /// Returns the least area that is visible where a pixel is a square with this side.
    fn least_shown(&self, side: f32) -> f32 {
        side * side.max(self.second.metres * LEAST_THICKNESS)
    }
}

/// Decision of stochastic simplification for an island.
#[derive(Clone, Copy, Debug, PartialEq)]
struct IslandDecision {
    /// Area that it is to show, square metres; zero where other islands stand in for it.
    shows: f32,
    /// The most triangles that it should have.
    max_triangles: usize,
}

impl IslandDecision {
    /// Decides for all islands where a pixel is a square with this side.
    fn decide_all<'a>(
        islands: impl Iterator<Item = &'a Island>,
        sections: usize,
        side: f32,
    ) -> Vec<Self> {
        // Of what each section lost so far, in islands.
        let mut owed = vec![0.0_f32; sections];
        let decide = |island: &Island| {
            let least = island.least_shown(side);
            let is_small = island.shown < least;
            let owed = &mut owed[island.section as usize];
            *owed += if is_small { island.shown / least } else { 0.0 };
            let stays = !is_small || *owed >= 0.5;
            *owed -= f32::from(is_small && stays);
            let shows = if is_small { least } else { island.shown };
            let max_triangles = (shows / (side * side)).ceil() as usize;
            Self { shows: if stays { shows } else { 0.0 }, max_triangles }
        };
        islands.map(decide).collect()
    }
}

/// Islands, and the faces of split islands.
struct Pieces {
    /// Island of each position, or [`NOWHERE`].
    island_of: Vec<u32>,
    islands: Vec<Island>,
    decisions: Vec<IslandDecision>,
}

impl CollapseStacks {
    /// Simplifies the mesh stochastically. Most islands below a square with a side of so many
    /// metres, or thinner than a sixteenth of that, are dropped; others of these are widened to
    /// stand in. Section by section they cover the same area, to within half a square, or that of
    /// the longest island.
    ///
    /// Islands of more triangles than one a square go down further, by collapses with errors up
    /// to half of its sides; they show as much as before. Those that have many times as many even
    /// so, lattices, are taken apart into faces, of which a share is kept likewise.
    ///
    /// # Errors
    /// None where errors are numbers.
    pub fn simplified_stochastically(self, side: f32) -> Result<Mesh, SequenceError> {
        let (island_of, count) = self.mesh().number_islands();
        let islands = self.mesh().measure_islands(&island_of, count);
        let decisions =
            IslandDecision::decide_all(islands.iter(), self.mesh().sections.len(), side);
        let sequence = self.coarsening_sequence(&island_of, &decisions, MAX_ERROR_SIDES * side)?;
        let coarse = Self::build(self.into_mesh(), &sequence);
        // Their numbers are by the order of triangles, which is the same.
        let (mut island_of, _) = coarse.mesh().number_islands();
        let (mut mesh, _) = coarse.baked_at_cursor(coarse.collapse_count())?;
        island_of.truncate(mesh.positions.len());
        let Pieces { island_of, islands, decisions } =
            mesh.split_lattices(&island_of, &decisions, side);
        let stretches: Vec<Option<Stretch>> = islands
            .iter()
            .zip(&decisions)
            .map(|(island, decision)| Stretch::for_decision(island, *decision, side))
            .collect();
        mesh.stretch(&island_of, &stretches);
        let stays = |&island: &u32| decisions.get(island as usize).is_some_and(|f| f.shows > 0.0);
        let piece = |island: &u32| if stays(island) { KEPT } else { DROPPED };
        let piece_of_position: Vec<u32> = island_of.iter().map(piece).collect();
        let mut simplified =
            mesh.split_by_position(&piece_of_position, 2).swap_remove(KEPT as usize);
        simplified.shrink_to_fit();
        Ok(simplified)
    }

    /// Selects the collapses by which each island reaches its number of triangles, or comes as near
    /// as it can without vanishing.
    fn coarsening_sequence(
        &self,
        island_of: &[u32],
        decisions: &[IslandDecision],
        max_error: f32,
    ) -> Result<CollapseSequence, SequenceError> {
        let mesh = self.mesh();
        let mut deaths: Vec<(u32, Reverse<u32>)> = (mesh.triangles.iter().enumerate())
            .map(|(triangle, &corners)| {
                let [position, ..] = mesh.corner_positions(corners);
                (island_of[position as usize], Reverse(self.removal_cursor(triangle)))
            })
            .collect();
        deaths.sort_unstable();
        let last = self.cursor_for_error(max_error);
        let mut cursors = vec![0_u32; decisions.len()];
        for deaths in deaths.chunk_by(|(a, _), (b, _)| a == b) {
            let island = deaths[0].0 as usize;
            let most = decisions[island].max_triangles.max(MIN_VISIBLE_TRIANGLES);
            if let Some(&(_, Reverse(death))) = deaths.get(most) {
                let (_, Reverse(vanishes)) = deaths[MIN_VISIBLE_TRIANGLES - 1];
                cursors[island] = death.min(vanishes - 1).min(last);
            }
        }
        let is_done = |entry: u32, position: u32| {
            let island = island_of[position as usize];
            cursors.get(island as usize).is_some_and(|&cursor| entry < cursor)
        };
        let entries = (0..).zip(self.collapses());
        let entries = entries.filter(|&(entry, (removed, _))| is_done(entry, removed));
        let entries = entries.map(|(_, (removed, kept))| Collapse { removed, kept, error: 0.0 });
        CollapseSequence::new(entries.collect(), self.position_count())
    }
}

impl Mesh {
    /// Numbers the islands in the order of their first triangles; positions without triangles have
    /// [`NOWHERE`]. Returns also the number of islands.
    fn number_islands(&self) -> (Vec<u32>, usize) {
        let roots = self.island_roots();
        let mut of_root = vec![NOWHERE; roots.len()];
        let mut count = 0;
        for &corners in &self.triangles {
            let [position, ..] = self.corner_positions(corners);
            let number = &mut of_root[roots[position as usize] as usize];
            if *number == NOWHERE {
                *number = count;
                count += 1;
            }
        }
        (roots.iter().map(|&root| of_root[root as usize]).collect(), count as usize)
    }

    /// Measures so many islands, by their numbers.
    fn measure_islands(&self, island_of: &[u32], count: usize) -> Vec<Island> {
        let mut islands = vec![Island::EMPTY; count];
        for (section, range) in (0..).zip(&self.sections) {
            let first = range.first_triangle as usize;
            for &corners in &self.triangles[first..first + range.triangle_count as usize] {
                let positions = self.corner_positions(corners);
                let [a, b, c] = positions.map(|position| self.positions[position as usize]);
                let bounds = Bounds { min: a.min(b).min(c), max: a.max(b).max(c) };
                let island = &mut islands[island_of[positions[0] as usize] as usize];
                if island.section == NOWHERE {
                    (island.section, island.bounds) = (section, bounds);
                }
                island.bounds = island.bounds.union(bounds);
                island.shown += 0.25 * (b - a).cross(c - a).length();
            }
        }
        self.find_ends(island_of, &mut islands);
        islands
    }

    /// Finds the ends of islands: the farthest point from the middle, then the farthest from there.
    /// Then the farthest from the axis.
    fn find_ends(&self, island_of: &[u32], islands: &mut [Island]) {
        let mut at_each_point = |note: fn(&mut Island, Vec3)| {
            for (&point, &island) in self.positions.iter().zip(island_of) {
                if let Some(island) = islands.get_mut(island as usize) {
                    note(island, point);
                }
            }
        };
        at_each_point(|island, point| island.first.update(island.bounds.center(), point));
        at_each_point(|island, point| island.second.update(island.first.point, point));
        at_each_point(Island::extend_reach);
    }

    /// Splits islands into faces that have too many triangles for the area they show.
    fn split_lattices(
        &mut self,
        island_of: &[u32],
        decisions: &[IslandDecision],
        side: f32,
    ) -> Pieces {
        let mut triangles = vec![0_usize; decisions.len()];
        for &corners in &self.triangles {
            let [position, ..] = self.corner_positions(corners);
            triangles[island_of[position as usize] as usize] += 1;
        }
        let has_too_many = |island: u32| {
            let IslandDecision { shows, max_triangles } = decisions[island as usize];
            shows > 0.0 && triangles[island as usize] > MAX_TRIANGLES_A_SQUARE * max_triangles
        };
        self.split_into_faces(island_of, has_too_many);
        let (piece_of, count) = self.number_islands();
        let mut pieces = self.measure_islands(&piece_of, count);
        let mut known = vec![None; count];
        for (&piece, &island) in piece_of.iter().zip(island_of) {
            if let Some(known) = known.get_mut(piece as usize) {
                *known = decisions.get(island as usize).copied();
            }
        }
        let is_face: Vec<bool> = known.iter().map(Option::is_none).collect();
        self.measure_faces(&piece_of, &mut pieces, &is_face);
        let faces = pieces.iter().zip(&is_face).filter(|(_, is_face)| **is_face);
        let faces = faces.map(|(face, _)| face);
        let mut of_faces = IslandDecision::decide_all(faces, self.sections.len(), side).into_iter();
        let decisions = known.into_iter().filter_map(|known| known.or_else(|| of_faces.next()));
        Pieces { decisions: decisions.collect(), island_of: piece_of, islands: pieces }
    }

    /// Measures faces: all of a face is seen from one side, and its length is that of its longer
    /// edges, not of its diagonal.
    fn measure_faces(&self, piece_of: &[u32], pieces: &mut [Island], is_face: &[bool]) {
        for (piece, _) in pieces.iter_mut().zip(is_face).filter(|(_, is_face)| **is_face) {
            piece.shown *= 2.0;
            (piece.first, piece.second, piece.reach) =
                (FarthestPoint::NONE, FarthestPoint::NONE, 0.0);
        }
        for &corners in &self.triangles {
            let positions = self.corner_positions(corners);
            let piece = piece_of[positions[0] as usize] as usize;
            if is_face[piece] {
                let [a, b, c] = positions.map(|position| self.positions[position as usize]);
                let mut edges = [(a, b), (b, c), (c, a)].map(|(a, b)| (a.distance(b), a, b));
                edges.sort_by(|a, b| a.0.total_cmp(&b.0));
                let (metres, from, to) = edges[1];
                if metres > pieces[piece].second.metres {
                    pieces[piece].first.point = from;
                    pieces[piece].second = FarthestPoint { point: to, metres };
                }
            }
        }
        for (&point, &piece) in self.positions.iter().zip(piece_of) {
            if is_face.get(piece as usize) == Some(&true) {
                pieces[piece as usize].extend_reach(point);
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
#[derive(Clone, Copy)]
struct FarthestPoint {
    point: Vec3,
    metres: f32,
}

impl FarthestPoint {
    const NONE: Self = Self { point: Vec3::ZERO, metres: 0.0 };

    fn update(&mut self, from: Vec3, point: Vec3) {
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
    /// Makes an island show its decided area: thicker up to its length, then towards a square, but
    /// no point moves by more than [`MAX_MOVE_SIDES`]. `None` without a change.
    fn for_decision(island: &Island, decision: IslandDecision, side: f32) -> Option<Self> {
        if island.shown <= 0.0 || decision.shows <= 0.0 {
            return None;
        }
        let more = (decision.shows / island.shown).max(LEAST_SHARE);
        if (more - 1.0).abs() <= LEAST_STRETCH {
            return None;
        }
        let length = island.second.metres;
        let thickness = island.shown / length;
        let square = (island.shown * more).sqrt();
        let [along, across] = if thickness * more <= length {
            [1.0, more]
        } else if thickness < square {
            [square / length, square / thickness]
        } else {
            [more.sqrt(); 2]
        };
        let most = |metres: f32| 1.0 + MAX_MOVE_SIDES * side / metres;
        Some(Self {
            center: island.bounds.center(),
            axis: island.axis(),
            along: along.min(most(0.5 * length)),
            across: across.min(most(island.reach)),
        })
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

    /// Makes two-sided plates of a length and width, in a row.
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

    /// Returns the area of all triangles, on one side.
    fn shown(mesh: &Mesh) -> f32 {
        let area = |&corners: &[u32; 3]| {
            let [a, b, c] = mesh.corner_positions(corners).map(|p| mesh.positions[p as usize]);
            0.25 * (b - a).cross(c - a).length()
        };
        mesh.triangles.iter().map(area).sum()
    }

    fn sizes(mesh: &Mesh) -> Vec<Vec3> {
        let (island_of, count) = mesh.number_islands();
        let islands = mesh.measure_islands(&island_of, count);
        islands.iter().map(|i| i.bounds.max - i.bounds.min).collect()
    }

    fn simplified(mesh: &Mesh, side: f32) -> Mesh {
        let sequence = CollapseSequence::empty(mesh.positions.len() as u32);
        CollapseStacks::build(mesh.clone(), &sequence).simplified_stochastically(side).unwrap()
    }

    #[test]
    fn what_is_large_enough_stays_as_it_is() {
        let mesh = plates(&[[3.0, 1.0], [2.0, 2.0]]);
        let simplified = simplified(&mesh, 1.7);
        assert_eq!((simplified.positions, simplified.triangles), (mesh.positions, mesh.triangles));
    }

    #[test]
    fn a_few_cover_what_all_did() {
        let mesh = plates(&[[10.0, 0.1]; 40]);
        let simplified = simplified(&mesh, 8.0_f32.sqrt());
        assert_eq!(sizes(&simplified).len(), 5);
        assert!((shown(&simplified) / shown(&mesh) - 1.0).abs() < 1e-3, "{}", shown(&simplified));
        // Along the plate's diagonal, which is not quite its axis.
        assert!(
            sizes(&simplified).iter().all(|size| size.x < 10.2 && size.z > 0.7 && size.z < 2.0)
        );
        for (normal, &p) in simplified.wedges.normal.iter().zip(&simplified.wedges.position) {
            assert!(normal.is_normalized() && (p as usize) < simplified.positions.len());
        }
    }

    #[test]
    fn what_is_long_and_thin_has_a_least_thickness() {
        let mesh = plates(&[[100.0, 0.1]; 32]);
        let simplified = simplified(&mesh, 3.2);
        assert_eq!(sizes(&simplified).len(), 16, "0.1 of 0.2 m");
        assert!((shown(&simplified) / shown(&mesh) - 1.0).abs() < 1e-3, "{}", shown(&simplified));
    }

    #[test]
    fn what_is_short_becomes_a_square() {
        let simplified = simplified(&plates(&[[1.0, 0.5]; 32]), 8.0_f32.sqrt());
        assert_eq!(sizes(&simplified).len(), 2);
        for size in sizes(&simplified) {
            assert!(size.max_element() < 4.5, "{size}");
        }
    }

    #[test]
    fn what_is_bent_is_not_blown_up() {
        // Three long arms from one corner, in all directions.
        let mut arms = RawPrimitive::default();
        for [along, across] in [[Vec3::X, Vec3::Z], [Vec3::Y, Vec3::X], [Vec3::Z, Vec3::Y]] {
            let first = arms.positions.len() as u32;
            arms.positions.extend([Vec3::ZERO, along * 30.0, along * 30.0 + across * 0.02]);
            arms.triangles.extend([[first, first + 1, first + 2], [first, first + 2, first + 1]]);
        }
        arms.normals = vec![Vec3::Y; arms.positions.len()];
        let mesh = weld(&[arms]).unwrap().0;
        let simplified = simplified(&mesh, 0.5);
        assert_ne!(simplified.positions, mesh.positions, "it is widened");
        for (&is, &was) in simplified.positions.iter().zip(&mesh.positions) {
            assert!(is.distance(was) <= 0.5 * MAX_MOVE_SIDES * 1.001, "{was} moved to {is}");
        }
    }

    #[test]
    fn small_ones_that_come_to_little_are_gone() {
        let few = simplified(&plates(&[[0.1, 0.1], [50.0, 50.0]]), 8.0_f32.sqrt());
        assert_eq!(sizes(&few), [Vec3::new(50.0, 0.0, 50.0)]);
        assert!(simplified(&plates(&[[0.1, 0.1]; 3]), 8.0_f32.sqrt()).triangles.is_empty());
    }

    /// Makes a two-sided strip of so many squares; inner vertices collapse onto one end with this
    /// error.
    fn strip(squares: u32, error: f32) -> CollapseStacks {
        let mut strip = RawPrimitive::default();
        strip
            .positions
            .extend((0..=squares).flat_map(|x| [0.0, 1.0].map(|z| Vec3::new(x as f32, 0.0, z))));
        strip.normals = vec![Vec3::Y; strip.positions.len()];
        strip.triangles.extend((0..squares).map(|x| x * 2).flat_map(|a| {
            [[a, a + 1, a + 3], [a, a + 3, a + 2], [a, a + 3, a + 1], [a, a + 2, a + 3]]
        }));
        let mesh = weld(&[strip]).unwrap().0;
        let at = |x: u32, z: u32| {
            let point = Vec3::new(x as f32, 0.0, z as f32);
            mesh.positions.iter().position(|&position| position == point).unwrap() as u32
        };
        let onto_end = |x| [0, 1].map(|z| Collapse { removed: at(x, z), kept: at(0, z), error });
        let entries = (1..squares).flat_map(onto_end).collect();
        let sequence = CollapseSequence::new(entries, mesh.positions.len() as u32).unwrap();
        CollapseStacks::build(mesh, &sequence)
    }

    #[test]
    fn triangles_are_no_more_than_what_they_show() {
        let strip = strip(40, 0.8);
        let simplified = strip.clone().simplified_stochastically(2.0).unwrap();
        let triangles = simplified.triangles.len();
        assert!((4..=10).contains(&triangles), "{triangles}, and 40 square metres are 10 squares");
        assert_eq!(sizes(&simplified), [Vec3::new(40.0, 0.0, 1.0)]);
        assert!((shown(&simplified) / 40.0 - 1.0).abs() < 1e-3, "{}", shown(&simplified));
        let beyond = strip.simplified_stochastically(1.0).unwrap();
        assert_eq!(beyond.triangles.len(), 160, "0.8 m is too much an error for squares of 1 m");
    }

    /// Makes a lattice in the plane x, z: a square with bars of 0.1 m, a metre apart both ways,
    /// without collapses.
    fn lattice(metres: u32) -> Mesh {
        let marks: Vec<f32> = (0..=metres).flat_map(|at| [at as f32, at as f32 + 0.1]).collect();
        let (count, mut lattice) = (marks.len(), RawPrimitive::default());
        lattice
            .positions
            .extend(marks.iter().flat_map(|&z| marks.iter().map(move |&x| Vec3::new(x, 0.0, z))));
        lattice.normals = vec![Vec3::Y; lattice.positions.len()];
        for (row, column) in (0..count - 1).flat_map(|row| (0..count - 1).map(move |c| (row, c))) {
            if row % 2 == 0 || column % 2 == 0 {
                let [a, b] = [row, row + 1].map(|row| (row * count + column) as u32);
                let sides = [[a, b, b + 1], [a, b + 1, a + 1], [a, b + 1, b], [a, a + 1, b + 1]];
                lattice.triangles.extend(sides);
            }
        }
        weld(&[lattice]).unwrap().0
    }

    #[test]
    fn of_a_lattice_a_share_of_its_faces_is_kept() {
        let mesh = lattice(40);
        let simplified = simplified(&mesh, 2.0);
        let [before, after] = [&mesh, &simplified].map(|mesh| mesh.triangles.len());
        assert!(after * 5 < before, "{after} of {before} triangles");
        assert!((shown(&simplified) / shown(&mesh) - 1.0).abs() < 0.02, "{}", shown(&simplified));
        // Everywhere: in each quarter of it as much as in the others.
        let quarter = |of: usize| {
            let in_it = |t: &&[u32; 3]| {
                let [a, b, c] =
                    simplified.corner_positions(**t).map(|p| simplified.positions[p as usize]);
                let middle = (a + b + c) / 3.0;
                usize::from(middle.x > 20.0) + 2 * usize::from(middle.z > 20.0) == of
            };
            simplified.triangles.iter().filter(in_it).count()
        };
        for of in 0..4 {
            let share = quarter(of) as f32 / after as f32;
            assert!((share - 0.25).abs() < 0.05, "{share} in quarter {of}");
        }
        let near = super::tests::simplified(&mesh, 0.2);
        assert_eq!(near.triangles.len(), before, "what is large enough stays as it is");
    }

    #[test]
    fn an_island_that_lost_some_of_what_it_shows_is_widened() {
        // A tent on two sides of a strip, whose ridge moves down to one of its edges.
        let at = [
            [0.0, 0.0, 0.0],
            [20.0, 0.0, 0.0],
            [0.0, 1.0, 1.0],
            [20.0, 1.0, 1.0],
            [0.0, 0.0, 2.0],
            [20.0, 0.0, 2.0],
        ];
        let sides = [[0, 1, 3], [0, 3, 2], [2, 3, 5], [2, 5, 4]];
        let backs = sides.map(|[a, b, c]| [a, c, b]);
        let tent = RawPrimitive {
            positions: at.map(Vec3::from).to_vec(),
            normals: vec![Vec3::Y; at.len()],
            triangles: [sides, backs].concat(),
            ..Default::default()
        };
        let mesh = weld(&[tent]).unwrap().0;
        let number =
            |i: usize| mesh.positions.iter().position(|&p| p == Vec3::from(at[i])).unwrap() as u32;
        let down = [(2, 0), (3, 1)];
        let entries =
            down.map(|(a, b)| Collapse { removed: number(a), kept: number(b), error: 1.0 });
        let sequence = CollapseSequence::new(entries.to_vec(), 6).unwrap();
        let before = shown(&mesh);
        let simplified =
            CollapseStacks::build(mesh, &sequence).simplified_stochastically(4.0).unwrap();
        assert_eq!(simplified.triangles.len(), 4);
        assert!(
            (shown(&simplified) / before - 1.0).abs() < 1e-3,
            "{} of {before}",
            shown(&simplified)
        );
    }
}
