//! Search for a viewing direction from which a box is not occluded.

use std::f32::consts::PI;

use busbar_geometry::Bounds;
use glam::Vec3;

use super::Camera;

/// Turns that are tried, the nearest to the present direction first, radians about y.
const TURNS: [f32; 8] = [0.0, PI / 4.0, -PI / 4.0, PI / 2.0, -PI / 2.0, PI * 0.75, -PI * 0.75, PI];
/// Pitches that are tried after the present one, radians.
const PITCHES: [f32; 4] = [0.35, 0.7, 1.05, 1.4];
/// Share of a box, from its center, that must be visible.
const LOOKED_AT: f32 = 0.7;

/// A camera that has a box in view and nothing before it, turned as little as need be. Of
/// what touches or holds the box nothing can be kept clear of, nor seen from nowhere: then
/// the direction before which the least stands.
pub(super) fn find_unoccluded_view(camera: Camera, bounds: Bounds, equipment: &[Bounds]) -> Camera {
    let candidate = |pitch: f32, turn: f32| {
        let mut moved = camera;
        (moved.yaw, moved.pitch) = (camera.yaw + turn, pitch);
        moved.frame(Some(bounds));
        moved
    };
    let own = [camera.pitch];
    let pitches = || own.into_iter().chain(PITCHES);
    let reach = pitches().map(|pitch| candidate(pitch, 0.0).distance).fold(0.0, f32::max);
    let near: Vec<&Bounds> = equipment
        .iter()
        .filter(|other| !overlap(other, &bounds) && distance(other, bounds.center()) < reach)
        .collect();
    let mut best: Option<(usize, Camera)> = None;
    for (pitch, turn) in pitches().flat_map(|pitch| TURNS.map(|turn| (pitch, turn))) {
        let moved = candidate(pitch, turn);
        let eye = moved.eye();
        let is_hidden = |point: &Vec3| near.iter().any(|other| crosses(other, eye, *point));
        let hidden = points_of(&bounds).iter().filter(|point| is_hidden(point)).count();
        if hidden == 0 {
            return moved;
        }
        if best.is_none_or(|(least, _)| hidden < least) {
            best = Some((hidden, moved));
        }
    }
    best.map_or_else(|| candidate(camera.pitch, 0.0), |(_, moved)| moved)
}

/// The middle of a box, and points before its corners.
fn points_of(bounds: &Bounds) -> [Vec3; 9] {
    let center = bounds.center();
    let corners = bounds.corners();
    std::array::from_fn(|index| {
        corners.get(index).map_or(center, |corner| center.lerp(*corner, LOOKED_AT))
    })
}

fn overlap(a: &Bounds, b: &Bounds) -> bool {
    a.min.cmple(b.max).all() && b.min.cmple(a.max).all()
}

fn distance(bounds: &Bounds, point: Vec3) -> f32 {
    point.distance(point.clamp(bounds.min, bounds.max))
}

/// Reports whether a segment intersects a box (slab method).
fn crosses(bounds: &Bounds, from: Vec3, to: Vec3) -> bool {
    let way = to - from;
    let [a, b] = [bounds.min, bounds.max].map(|corner| (corner - from) / way);
    let (mut enters, mut leaves) = (0.0_f32, 1.0_f32);
    for axis in 0..3 {
        if way[axis] == 0.0 {
            if from[axis] < bounds.min[axis] || from[axis] > bounds.max[axis] {
                return false;
            }
            continue;
        }
        enters = enters.max(a[axis].min(b[axis]));
        leaves = leaves.min(a[axis].max(b[axis]));
    }
    enters <= leaves
}

#[cfg(test)]
mod tests {
    use glam::vec3;

    use super::*;

    fn cube(center: Vec3, size: f32) -> Bounds {
        Bounds { min: center - size * 0.5, max: center + size * 0.5 }
    }

    #[test]
    fn an_occluded_target_is_viewed_around_the_wall_and_a_visible_one_from_the_same_side() {
        let target = cube(vec3(0.0, 1.0, 0.0), 2.0);
        let camera = Camera::look_at(vec3(0.0, 1.0, 30.0), target.center(), 0.8);
        let free = find_unoccluded_view(camera, target, &[]);
        assert!(free.forward().distance(camera.forward()) < 1e-3);
        let mut framed = camera;
        framed.frame(Some(target));
        let wall = Bounds { min: vec3(-9.0, 0.0, 1.5), max: vec3(9.0, 9.0, 1.7) };
        let around = find_unoccluded_view(camera, target, &[wall]);
        let eye = around.eye();
        let sees = |point: &Vec3| !crosses(&wall, eye, *point);
        assert!(points_of(&target).iter().all(sees), "from {eye}");
        assert!(crosses(&wall, framed.eye(), target.center()), "the wall is in the way at first");
    }

    #[test]
    fn a_fully_enclosed_target_still_gets_a_view() {
        let target = cube(Vec3::ZERO, 1.0);
        let camera = Camera::look_at(vec3(0.0, 0.0, 9.0), Vec3::ZERO, 0.8);
        let walls: Vec<Bounds> = (0..6)
            .map(|side| {
                let mut at = Vec3::ZERO;
                at[side / 2] = if side % 2 == 0 { 0.9 } else { -0.9 };
                let mut size = Vec3::splat(2.0);
                size[side / 2] = 0.1;
                Bounds { min: at - size * 0.5, max: at + size * 0.5 }
            })
            .collect();
        let seen = find_unoccluded_view(camera, target, &walls);
        assert!(seen.eye().is_finite());
    }
}
