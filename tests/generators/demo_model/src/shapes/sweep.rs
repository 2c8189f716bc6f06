//! Cross-sections swept along a path: bars, pipes with elbows.

use glam::{Quat, Vec2, Vec3};

use super::{Ends, MIN_SEGMENTS, loft, turn};
use crate::Solid;

/// Number of points that round off one corner of a path.
const ELBOW_STEPS: usize = 4;
/// Greatest share of either leg that a bend takes.
const MAX_LEG_SHARE: f32 = 0.49;

/// Sweeps a convex `section` (counter-clockwise) along `path`, mitred at its corners and capped.
/// `up` is the direction of the section's y axis at the start.
pub fn sweep(path: &[Vec3], section: &[Vec2], up: Vec3) -> Solid {
    let mut path = path.to_vec();
    path.dedup();
    if path.len() < 2 || section.len() < MIN_SEGMENTS {
        return Solid::default();
    }
    let legs: Vec<Vec3> =
        path.windows(2).map(|leg| (leg[1] - leg[0]).normalize_or(Vec3::Y)).collect();
    let mut y_axis = (up - legs[0] * up.dot(legs[0]))
        .try_normalize()
        .unwrap_or_else(|| legs[0].any_orthonormal_vector());
    let mut rings = Vec::with_capacity(path.len());
    for (i, &centre) in path.iter().enumerate() {
        let incoming = legs[i.saturating_sub(1)];
        let outgoing = legs[i.min(legs.len() - 1)];
        let mitre = (incoming + outgoing).try_normalize().unwrap_or(incoming);
        let x_axis = y_axis.cross(incoming);
        let ring = section.iter().map(|s| {
            let offset = x_axis * s.x + y_axis * s.y;
            centre + offset - incoming * (offset.dot(mitre) / incoming.dot(mitre))
        });
        rings.push(ring.collect());
        y_axis = Quat::from_rotation_arc(incoming, outgoing) * y_axis;
    }
    loft(&rings, Ends::Capped)
}

/// Builds a round pipe along `path`, its corners bent to `bend_radius`.
pub fn pipe(path: &[Vec3], radius: f32, bend_radius: f32, sides: usize) -> Solid {
    let sides = sides.max(MIN_SEGMENTS);
    let section: Vec<Vec2> = (0..sides).map(|i| turn(i, sides) * radius).collect();
    sweep(&rounded_path(path, bend_radius), &section, Vec3::new(0.3, 1.0, 0.2))
}

/// Returns the path with each corner replaced by an arc of four steps.
pub fn rounded_path(path: &[Vec3], bend_radius: f32) -> Vec<Vec3> {
    if path.len() < 3 || bend_radius <= 0.0 {
        return path.to_vec();
    }
    let mut rounded = vec![path[0]];
    for corner in path.windows(3) {
        let (back, ahead) = (corner[0] - corner[1], corner[2] - corner[1]);
        let reach = bend_radius.min(back.length().min(ahead.length()) * MAX_LEG_SHARE);
        let start = corner[1] + back.normalize_or_zero() * reach;
        let end = corner[1] + ahead.normalize_or_zero() * reach;
        for step in 0..=ELBOW_STEPS {
            // A quadratic Bezier: tangent to both legs, close to an arc.
            let t = step as f32 / ELBOW_STEPS as f32;
            rounded.push(start.lerp(corner[1], t).lerp(corner[1].lerp(end, t), t));
        }
    }
    rounded.extend(path.last());
    rounded
}
