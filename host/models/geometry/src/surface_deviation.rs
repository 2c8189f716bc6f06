//! Surface deviation: distance between a mesh after collapses and the mesh before all of them.

use glam::Vec3;

use crate::{Collapse, Mesh};

/// The end of a list.
const END: u32 = u32::MAX;
/// A corner of a triangle that died.
const REMOVED: u32 = u32::MAX;
/// Greatest ratio of the deviation of a surface point to the error of the collapse.
pub(crate) const MAX_ERROR_RATIO: f32 = 2.0;

/// Weight of the squared mean height of the original above the moved surface, against the mean
/// square distance. Points that are all on one side make a shape thinner or thicker, which shows
/// more than points on both sides.
const SHIFT_WEIGHT: f32 = 1.0;

/// Weight of shading against shape.
const SHADING_WEIGHT: f32 = 0.05;

/// Something slender keeps sides no farther apart, radians: it is drawn a pixel wide from all
/// of them, however thin it is.
const MAX_SPREAD_RADIANS: f32 = std::f32::consts::FRAC_PI_3 * 1.01;

/// Follows the collapses of a mesh and measures how far its surface moves.
///
/// A position that is gone is *held* by a triangle: the nearest of those that took the place
/// of the one that held it before. So it is never farther from what is left than measured, and
/// hardly nearer. One between sections is held by a triangle of each, for colours show where
/// they end.
pub(crate) struct SurfaceDeviation<'a> {
    mesh: &'a Mesh,
    /// Positions that the corners of each triangle stand on by now.
    corners: Vec<[u32; 3]>,
    /// Section of each triangle.
    section: Vec<u32>,
    /// The area of the surface that each position stands for.
    area: Vec<f32>,
    /// Outward direction of each slender position; zero of others.
    outward: Vec<Vec3>,
    /// Greatest angle between the outward direction of each position and those of the positions it
    /// stands for.
    spread: Vec<f32>,
    /// The greatest error of the collapses around each position.
    errors: Vec<f32>,
    /// Corners at each position, as triangle times three and corner.
    at: LinkedLists,
    /// Wedges at each position that are released with it.
    wedges: LinkedLists,
    /// Wedges held by each triangle.
    attached: LinkedLists,
    /// Triangles that the current collapse moves, as they were. `after` lists those that live on,
    /// `released` the wedges to be held anew.
    before: Vec<[u32; 3]>,
    after: Vec<u32>,
    released: Vec<u32>,
    /// Sections and normals of the wedges of the kept position.
    normals: Vec<(u32, Vec3)>,
}

impl<'a> SurfaceDeviation<'a> {
    pub(crate) fn new(mesh: &'a Mesh) -> Self {
        let positions = mesh.positions.len();
        let mut section = vec![0; mesh.triangles.len()];
        for (number, of) in (0..).zip(&mesh.sections) {
            let first = of.first_triangle as usize;
            section[first..first + of.triangle_count as usize].fill(number);
        }
        let corners: Vec<[u32; 3]> =
            mesh.triangles.iter().map(|&corners| mesh.corner_positions(corners)).collect();
        let mut area = vec![0.0; positions];
        for &triangle in &corners {
            let [a, b, c] = triangle.map(|position| mesh.positions[position as usize]);
            let third = (b - a).cross(c - a).length() / 6.0;
            triangle.into_iter().for_each(|position| area[position as usize] += third);
        }
        let mut outward = vec![Vec3::ZERO; positions];
        for point in mesh.slender_points() {
            outward[point.position as usize] = point.outward;
        }
        Self {
            at: LinkedLists::from_assignment(positions, corners.as_flattened()),
            wedges: LinkedLists::from_assignment(positions, &mesh.wedges.position),
            attached: LinkedLists::empty(corners.len(), mesh.wedges.len()),
            mesh,
            corners,
            section,
            area,
            outward,
            spread: vec![0.0; positions],
            errors: vec![0.0; positions],
            before: Vec::new(),
            after: Vec::new(),
            released: Vec::new(),
            normals: Vec::new(),
        }
    }

    /// Performs a collapse and returns its error in units of the mesh. The error is the root mean
    /// square distance of the moved surface from the original, greater where the original is all
    /// on one side, or half the greatest distance or the shading error if that is more. For slender
    /// islands it is the greatest distance, and infinite where the island becomes flat. It is at
    /// most the collapse's own error and `most`, and at least that of earlier collapses around it.
    pub(crate) fn collapse(
        &mut self,
        &Collapse { removed, kept, error }: &Collapse,
        most: f32,
    ) -> f32 {
        self.move_corners(removed, kept);
        self.release_wedges(removed);
        let around = self.errors[removed as usize].max(self.errors[kept as usize]);
        // What goes with the whole need not be measured.
        let own = if around < most { self.measure(removed, kept).min(error) } else { most };
        let error = own.max(around).min(most);
        let Self { errors, before, .. } = self;
        errors[kept as usize] = error;
        for &position in before.as_flattened() {
            let known = &mut errors[position as usize];
            *known = known.max(error);
        }
        error
    }

    /// Moves the corners at a position onto another one, and releases the wedges of their
    /// triangles.
    fn move_corners(&mut self, removed: u32, kept: u32) {
        let Self { corners, at, attached, before, after, released, .. } = self;
        before.clear();
        after.clear();
        released.clear();
        while let Some(corner) = at.pop(removed) {
            let [number, place] = [corner / 3, corner % 3].map(|of| of as usize);
            let triangle = &mut corners[number];
            // It may have died by another corner.
            if triangle[place] != removed {
                continue;
            }
            before.push(*triangle);
            released.extend(std::iter::from_fn(|| attached.pop(number as u32)));
            if triangle.contains(&kept) {
                *triangle = [REMOVED; 3];
            } else {
                triangle[place] = kept;
                at.push(kept, corner);
                after.push(number as u32);
            }
        }
    }

    /// Adds the wedges of a position to those to be held, one of each section.
    fn release_wedges(&mut self, position: u32) {
        let own = self.released.len();
        let of = &self.mesh.wedges;
        while let Some(wedge) = self.wedges.pop(position) {
            let same = |&other: &u32| {
                let [a, b] = [wedge, other].map(|wedge| wedge as usize);
                of.position[a] == of.position[b] && of.section[a] == of.section[b]
            };
            if !self.released[own..].iter().any(same) {
                self.released.push(wedge);
            }
        }
    }

    /// Attaches all released wedges again; returns the error of the moved surface.
    fn measure(&mut self, removed: u32, kept: u32) -> f32 {
        // Of what stays where it is, a third is on the triangles that moved; each is at two.
        let stays = self.before.as_flattened().iter().filter(|&&position| position != removed);
        let mut area: f32 = stays.map(|&position| self.area[position as usize] / 6.0).sum();
        let (mut sum, mut greatest) = (0.0, self.max_growth());
        let mut shift = 0.0;
        for index in 0..self.released.len() {
            let wedge = self.released[index];
            let Attachment { distance, side } = self.attach_wedge(wedge, kept);
            let own = self.area[self.mesh.wedges.position[wedge as usize] as usize];
            area += own;
            sum += own * distance;
            shift += own * side;
            greatest = greatest.max(distance);
        }
        if self.outward[kept as usize] != Vec3::ZERO {
            let flattens = self.outward_spread(removed, kept) > MAX_SPREAD_RADIANS;
            return if flattens { f32::INFINITY } else { greatest.sqrt() };
        }
        let (mean, shift) = if area > 0.0 { (sum / area, shift / area) } else { (0.0, 0.0) };
        (mean + SHIFT_WEIGHT * shift * shift)
            .sqrt()
            .max(greatest.sqrt() / MAX_ERROR_RATIO)
            .max(self.shading_error(kept))
    }

    /// Updates and returns the greatest angle between the kept position's outward direction and
    /// those of all that it stands for.
    fn outward_spread(&mut self, removed: u32, kept: u32) -> f32 {
        let [removed, kept] = [removed, kept].map(|position| position as usize);
        let turn = self.outward[removed].dot(self.outward[kept]).clamp(-1.0, 1.0).acos();
        self.spread[kept] = self.spread[kept].max(turn + self.spread[removed]);
        self.spread[kept]
    }

    /// Attaches a wedge to the nearest moved triangle of its section. Where there is none, one at the
    /// kept position takes its place.
    fn attach_wedge(&mut self, wedge: u32, kept: u32) -> Attachment {
        let point = self.point(self.mesh.wedges.position[wedge as usize]);
        let section = self.mesh.wedges.section[wedge as usize];
        let mut nearest = self.nearest(point, section, self.after.iter().copied());
        if nearest.1 == END {
            nearest = self.nearest(point, section, self.around(kept));
        }
        if nearest.1 == END {
            // Of its section nothing is left here.
            let onto = point.distance_squared(self.point(kept));
            nearest = (onto, self.around(kept).next().unwrap_or(END));
        }
        let (distance, triangle) = nearest;
        if triangle == END {
            self.wedges.push(kept, wedge);
            return Attachment { distance, side: distance.sqrt() };
        }
        self.attached.push(triangle, wedge);
        Attachment { distance, side: height(point, self.points(self.corners[triangle as usize])) }
    }

    /// Returns the squared distance of the nearest triangle of a section, and the triangle.
    fn nearest(
        &self,
        point: Vec3,
        section: u32,
        triangles: impl Iterator<Item = u32>,
    ) -> (f32, u32) {
        let mut nearest = (f32::INFINITY, END);
        for triangle in triangles {
            if self.section[triangle as usize] == section {
                let distance =
                    distance_squared(point, self.points(self.corners[triangle as usize]));
                if distance < nearest.0 {
                    nearest = (distance, triangle);
                }
            }
        }
        nearest
    }

    /// Returns the greatest squared distance of the moved triangles' centres from the surface
    /// before. A triangle that covers a hole is far from it, though all that was there is near.
    fn max_growth(&self) -> f32 {
        let middle = |&triangle: &u32| {
            let [a, b, c] = self.points(self.corners[triangle as usize]);
            (a + b + c) / 3.0
        };
        let before = |middle: Vec3| {
            let distances = self.before.iter().map(|&c| distance_squared(middle, self.points(c)));
            distances.fold(f32::INFINITY, f32::min)
        };
        self.after.iter().map(middle).map(before).fold(0.0, f32::max)
    }

    /// Returns the error of shading the moved triangles like the kept position. An angle counts
    /// like a surface that leans by it, as wide as the triangle, times a weight.
    fn shading_error(&mut self, kept: u32) -> f32 {
        let of = &self.mesh.wedges;
        self.normals.clear();
        for wedge in self.wedges.iter_list(kept).map(|wedge| wedge as usize) {
            if of.position[wedge] == kept {
                self.normals.push((of.section[wedge], of.normal[wedge].normalize_or_zero()));
            }
        }
        let of_triangle = |&triangle: &u32| {
            let corners = self.corners[triangle as usize];
            let place = corners.iter().position(|&corner| corner == kept).unwrap_or(0);
            let wedge = self.mesh.triangles[triangle as usize][place] as usize;
            let normal = of.normal[wedge].normalize_or_zero();
            let same = self.normals.iter().filter(|(section, _)| *section == of.section[wedge]);
            let nearest = same.map(|(_, other)| other.dot(normal)).fold(-1.0, f32::max);
            let [a, b, c] = self.points(corners);
            // The root of what cosines lack goes with the angle.
            (2.0 * (1.0 - nearest.min(1.0))).sqrt() * (b - a).cross(c - a).length().sqrt()
        };
        self.after.iter().map(of_triangle).fold(0.0, f32::max) * SHADING_WEIGHT
    }

    /// Iterates over the triangles at a position.
    fn around(&self, position: u32) -> impl Iterator<Item = u32> + '_ {
        let stands =
            move |&corner: &u32| self.corners[corner as usize / 3][corner as usize % 3] == position;
        self.at.iter_list(position).filter(stands).map(|corner| corner / 3)
    }

    fn point(&self, position: u32) -> Vec3 {
        self.mesh.positions[position as usize]
    }

    fn points(&self, corners: [u32; 3]) -> [Vec3; 3] {
        corners.map(|position| self.point(position))
    }
}

/// Place of a position beside the triangle that holds it.
struct Attachment {
    /// Squared distance from the triangle.
    distance: f32,
    /// Height above the plane of the triangle, negative behind it.
    side: f32,
}

/// Lists of numbers, each number in one of them at most.
struct LinkedLists {
    first: Vec<u32>,
    next: Vec<u32>,
}

impl LinkedLists {
    fn empty(lists: usize, numbers: usize) -> Self {
        Self { first: vec![END; lists], next: vec![END; numbers] }
    }

    /// Builds the lists from the list that each number is in.
    fn from_assignment(lists: usize, list_of: &[u32]) -> Self {
        let mut all = Self::empty(lists, list_of.len());
        (0..).zip(list_of).for_each(|(number, &list)| all.push(list, number));
        all
    }

    fn push(&mut self, list: u32, number: u32) {
        self.next[number as usize] = std::mem::replace(&mut self.first[list as usize], number);
    }

    fn pop(&mut self, list: u32) -> Option<u32> {
        let first = &mut self.first[list as usize];
        let number = (*first != END).then_some(*first)?;
        *first = self.next[number as usize];
        Some(number)
    }

    fn iter_list(&self, list: u32) -> impl Iterator<Item = u32> + '_ {
        let some = |number: u32| (number != END).then_some(number);
        std::iter::successors(some(self.first[list as usize]), move |&number| {
            some(self.next[number as usize])
        })
    }
}

/// Computes the height of a point above the plane of a triangle, negative behind its face; 0 for a
/// triangle without area.
fn height(point: Vec3, [a, b, c]: [Vec3; 3]) -> f32 {
    (point - a).dot((b - a).cross(c - a).normalize_or_zero())
}

/// Computes the squared distance from a point to a triangle.
pub(crate) fn distance_squared(point: Vec3, [a, b, c]: [Vec3; 3]) -> f32 {
    let (ab, ac, ap) = (b - a, c - a, point - a);
    let normal = ab.cross(ac);
    let area = normal.length_squared();
    // Where the foot of the point on the plane is, by the areas of the parts at two corners.
    let [at_b, at_c] = [ap.cross(ac), ab.cross(ap)].map(|part| part.dot(normal));
    if area > 0.0 && at_b >= 0.0 && at_c >= 0.0 && at_b + at_c <= area {
        let height = ap.dot(normal);
        return height * height / area;
    }
    let sides = [(ab, ap), (ac, ap), (c - b, point - b)];
    let distances = sides.map(|(along, offset)| {
        let length = along.length_squared();
        let share = if length > 0.0 { (offset.dot(along) / length).clamp(0.0, 1.0) } else { 0.0 };
        (offset - along * share).length_squared()
    });
    distances[0].min(distances[1]).min(distances[2])
}
