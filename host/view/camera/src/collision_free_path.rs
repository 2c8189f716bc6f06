//! The way of an eye from one place to another, around what stands between.
//!
//! Obstacles are equipment bounds grown by a clearance. If the straight segment is not free, the
//! path rises vertically at both ends and passes level above the obstacles. Bounds that contain an
//! end are ignored.

use busbar_geometry::Bounds;
use glam::{Vec3, vec3};

/// Clearance between the eye and the equipment it passes, metres.
pub(crate) const CLEARANCE: f32 = 1.0;
/// Margin on the clearance against rounding, metres.
const SLACK: f32 = 0.05;
/// Lateral offsets tried for a vertical column where the space above an end is occupied, metres.
const DETOURS: [f32; 7] = [0.0, 3.0, 8.0, 20.0, 50.0, 120.0, 300.0];
/// Directions tried at each of these.
const DIRECTIONS: usize = 12;
/// Largest number of rises of the level part before it passes over everything.
const MAX_RISES: usize = 32;
/// Metres of a leg that rounding a corner takes at most, and pieces of the curve.
const MAX_ROUNDING: f32 = 12.0;
const CORNER_PIECES: usize = 8;
/// Times that a rounding is halved before a corner stays sharp.
const MAX_HALVINGS: usize = 5;

/// A way as straight pieces, each of which is free.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct CameraPath {
    points: Vec<Vec3>,
    /// Arc length from the start to each point, metres.
    lengths: Vec<f32>,
}

impl CameraPath {
    /// A free way; `None` where none was found.
    pub(crate) fn between(from: Vec3, to: Vec3, equipment: &[Bounds]) -> Option<Self> {
        let obstacles: Vec<Bounds> =
            equipment.iter().filter_map(|bounds| obstacle(*bounds, [from, to])).collect();
        if is_free(from, to, &obstacles) {
            return Some(Self::through_points(vec![from, to]));
        }
        let tops = obstacles.iter().map(|obstacle| obstacle.max.y);
        let over_all = tops.fold(from.y.max(to.y), f32::max) + SLACK;
        let [up, down] = [from, to].map(|end| column(end, over_all, &obstacles));
        let (up, down) = (up?, down?);
        let level = level_over(up, down, over_all, &obstacles);
        let mut corners = vec![from, up, vec3(up.x, level, up.z), vec3(down.x, level, down.z)];
        corners.extend([down, to]);
        corners.dedup();
        Some(Self::through_points(rounded(&corners, &obstacles)))
    }

    fn through_points(points: Vec<Vec3>) -> Self {
        let mut length = 0.0;
        let mut last = None;
        let lengths = points.iter().map(|&point| {
            length += last.replace(point).map_or(0.0, |last: Vec3| last.distance(point));
            length
        });
        Self { lengths: lengths.collect(), points }
    }

    /// The place at a share of its length, 0 to 1.
    pub(crate) fn at(&self, share: f32) -> Vec3 {
        let along = share.clamp(0.0, 1.0) * self.lengths.last().copied().unwrap_or(0.0);
        let after = self.lengths.partition_point(|&length| length < along);
        let (Some(&to), Some(&until)) = (self.points.get(after), self.lengths.get(after)) else {
            return self.points.last().copied().unwrap_or(Vec3::ZERO);
        };
        let Some(before) = after.checked_sub(1) else { return to };
        let (from, since) = (self.points[before], self.lengths[before]);
        from.lerp(to, (along - since) / (until - since).max(f32::MIN_POSITIVE))
    }
}

/// Returns the bounds to keep clear of; `None` if they contain an end.
fn obstacle(bounds: Bounds, ends: [Vec3; 2]) -> Option<Bounds> {
    let grown = |by: f32| Bounds { min: bounds.min - by, max: bounds.max + by };
    let holds_an_end = |bounds: Bounds| ends.iter().any(|end| holds(&bounds, *end));
    if holds_an_end(grown(CLEARANCE)) {
        return None;
    }
    let wide = grown(CLEARANCE + SLACK);
    Some(if holds_an_end(wide) { grown(CLEARANCE) } else { wide })
}

pub(crate) fn holds(bounds: &Bounds, point: Vec3) -> bool {
    (point.cmpge(bounds.min) & point.cmple(bounds.max)).all()
}

fn is_free(from: Vec3, to: Vec3, obstacles: &[Bounds]) -> bool {
    !obstacles.iter().any(|obstacle| crosses(from, to, obstacle))
}

/// Reports whether a segment intersects a box (slab method: T. L. Kay and J. T. Kajiya, "Ray
/// Tracing Complex Scenes", 1986).
fn crosses(from: Vec3, to: Vec3, bounds: &Bounds) -> bool {
    let (mut enters, mut leaves) = (0.0_f32, 1.0_f32);
    for axis in 0..3 {
        let (start, way) = (from[axis], to[axis] - from[axis]);
        let [low, high] = [bounds.min[axis] - start, bounds.max[axis] - start];
        if way == 0.0 {
            if low > 0.0 || high < 0.0 {
                return false;
            }
            continue;
        }
        let [a, b] = [low / way, high / way];
        (enters, leaves) = (enters.max(a.min(b)), leaves.min(a.max(b)));
    }
    enters <= leaves
}

/// A place level with an end, and free to reach from it, with nothing above it up to a
/// height.
fn column(end: Vec3, height: f32, obstacles: &[Bounds]) -> Option<Vec3> {
    let places = DETOURS.iter().flat_map(|&reach| {
        let count = if reach == 0.0 { 1 } else { DIRECTIONS };
        (0..count).map(move |step| {
            let angle = std::f32::consts::TAU * step as f32 / DIRECTIONS as f32;
            end + vec3(angle.cos(), 0.0, angle.sin()) * reach
        })
    });
    let mut places = places;
    places.find(|&place| {
        let top = vec3(place.x, height, place.z);
        is_free(place, top, obstacles) && is_free(end, place, obstacles)
    })
}

/// The least height, as far as it is found, at which the way between two columns is free.
fn level_over(from: Vec3, to: Vec3, over_all: f32, obstacles: &[Bounds]) -> f32 {
    let mut level = from.y.max(to.y);
    for _ in 0..MAX_RISES {
        let [a, b] = [from, to].map(|place| vec3(place.x, level, place.z));
        let in_the_way = obstacles.iter().filter(|obstacle| crosses(a, b, obstacle));
        match in_the_way.map(|obstacle| obstacle.max.y + SLACK).reduce(f32::max) {
            Some(top) => level = top.max(level + SLACK),
            None => return level,
        }
    }
    over_all
}

/// The corners, rounded as far as that is free.
fn rounded(corners: &[Vec3], obstacles: &[Bounds]) -> Vec<Vec3> {
    let mut points: Vec<Vec3> = corners.first().copied().into_iter().collect();
    for around in corners.windows(3) {
        let &[before, corner, after] = around else { continue };
        let mut cut = (before.distance(corner).min(corner.distance(after)) * 0.5).min(MAX_ROUNDING);
        let near = near_to([before, corner, after], obstacles);
        let mut curve = vec![corner];
        for _ in 0..MAX_HALVINGS {
            let wide = bend(before, corner, after, cut);
            if wide.windows(2).all(|piece| is_free(piece[0], piece[1], &near)) {
                curve = wide;
                break;
            }
            cut *= 0.5;
        }
        points.extend(curve);
    }
    points.extend(corners.last().copied());
    points
}

/// Returns the obstacles that overlap the box around some points.
fn near_to(places: [Vec3; 3], obstacles: &[Bounds]) -> Vec<Bounds> {
    let Some(around) = Bounds::from_points(places) else { return Vec::new() };
    let overlaps = |obstacle: &&Bounds| {
        (obstacle.min.cmple(around.max) & obstacle.max.cmpge(around.min)).all()
    };
    obstacles.iter().filter(overlaps).copied().collect()
}

/// A parabola that begins and ends so far from a corner.
fn bend(before: Vec3, corner: Vec3, after: Vec3, cut: f32) -> Vec<Vec3> {
    let [start, end] = [before, after].map(|p| corner + (p - corner).normalize_or_zero() * cut);
    let at = |piece: usize| {
        let share = piece as f32 / CORNER_PIECES as f32;
        start.lerp(corner, share).lerp(corner.lerp(end, share), share)
    };
    (0..=CORNER_PIECES).map(at).collect()
}

#[cfg(test)]
mod tests;
