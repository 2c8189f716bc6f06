//! Surfaces through rings of points: lathes, cylinders, tori.

use glam::{DVec3, Vec3};

use super::{MIN_SEGMENTS, turn};
use crate::Solid;

/// Closure of the first and last ring of a loft.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ends {
    /// Closure of each end by triangles to a point at its centre.
    Capped,
    /// Joint of the last ring with the first.
    Joined,
}

/// Builds the surface through `rings`, which have equal numbers of points and turn
/// counter-clockwise about the direction of travel.
///
/// R rings of N points give, capped, V = R N + 2 and T = 2 R N (genus 0);
/// joined, V = R N and T = 2 R N (genus 1). Rings of unequal length are cut
/// to the shortest.
pub fn loft(rings: &[Vec<Vec3>], ends: Ends) -> Solid {
    let n = rings.iter().map(Vec::len).min().unwrap_or(0);
    if n < MIN_SEGMENTS || rings.len() < 2 {
        return Solid::default();
    }
    let mut solid = Solid::default();
    for ring in rings {
        solid.points.extend(&ring[..n]);
    }
    let point = |ring: usize, i: usize| (ring * n + i % n) as u32;
    let spans = match ends {
        Ends::Capped => rings.len() - 1,
        Ends::Joined => rings.len(),
    };
    for ring in 0..spans {
        let next = (ring + 1) % rings.len();
        for i in 0..n {
            let (a, b) = (point(ring, i), point(ring, i + 1));
            let (c, d) = (point(next, i + 1), point(next, i));
            solid.triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    if ends == Ends::Capped {
        let last = rings.len() - 1;
        let start = add_point(&mut solid, centre(&rings[0][..n]));
        let end = add_point(&mut solid, centre(&rings[last][..n]));
        for i in 0..n {
            solid.triangles.push([start, point(0, i + 1), point(0, i)]);
            solid.triangles.push([end, point(last, i), point(last, i + 1)]);
        }
    }
    solid
}

fn add_point(solid: &mut Solid, point: Vec3) -> u32 {
    solid.points.push(point);
    solid.points.len() as u32 - 1
}

fn centre(ring: &[Vec3]) -> Vec3 {
    let sum: DVec3 = ring.iter().map(|p| p.as_dvec3()).sum();
    (sum / ring.len() as f64).as_vec3()
}

/// Revolves a profile of (radius, height) about the y axis, bottom to top.
pub fn lathe(profile: &[(f32, f32)], segments: usize) -> Solid {
    loft(&turned_rings(profile, segments), Ends::Capped)
}

/// Revolves a closed profile of (radius, height) about the y axis to a hollow ring. The profile
/// turns counter-clockwise with radius to the right.
pub fn ring_of_profile(profile: &[(f32, f32)], segments: usize) -> Solid {
    loft(&turned_rings(profile, segments), Ends::Joined)
}

fn turned_rings(profile: &[(f32, f32)], segments: usize) -> Vec<Vec<Vec3>> {
    let n = segments.max(MIN_SEGMENTS);
    let ring = |&(radius, height): &(f32, f32)| {
        let on_circle = |i| {
            let c = turn(i, n);
            Vec3::new(radius * c.x, height, -radius * c.y)
        };
        (0..n).map(on_circle).collect()
    };
    profile.iter().map(ring).collect()
}

/// Builds a cylinder standing on the origin.
pub fn cylinder(radius: f32, height: f32, segments: usize) -> Solid {
    lathe(&[(radius, 0.0), (radius, height)], segments)
}

/// Builds a torus about the y axis: `segments` around, `sides` around the tube.
pub fn torus(radius: f32, tube_radius: f32, segments: usize, sides: usize) -> Solid {
    let sides = sides.max(MIN_SEGMENTS);
    let profile: Vec<(f32, f32)> =
        (0..sides).map(|i| turn(i, sides) * tube_radius).map(|p| (radius + p.x, p.y)).collect();
    ring_of_profile(&profile, segments)
}
