use std::f32::consts::TAU;

use super::*;
use crate::{RawPrimitive, weld};

const RADIUS: f32 = 0.011;

/// Makes an open, sagging tube of `sides` along x with `rings`.
fn tube(sides: u32, rings: u32, length: f32, radius: f32) -> RawPrimitive {
    let mut primitive = RawPrimitive::default();
    for ring in 0..rings {
        let t = ring as f32 / (rings - 1) as f32;
        let sag = 0.04 * length * t * (1.0 - t);
        for side in 0..sides {
            let (sin, cos) = (TAU * side as f32 / sides as f32).sin_cos();
            let at = Vec3::new(length * t, radius * cos - sag, radius * sin);
            primitive.positions.push(at);
        }
    }
    for ring in 1..rings {
        for side in 0..sides {
            let [a, b] = [side, (side + 1) % sides].map(|side| (ring - 1) * sides + side);
            let [c, d] = [a + sides, b + sides];
            primitive.triangles.extend([[a, b, d], [a, d, c]]);
        }
    }
    primitive
}

fn points(primitives: &[RawPrimitive]) -> Vec<SlenderPoint> {
    weld(primitives).expect("it is a mesh").0.slender_points()
}

#[test]
fn a_wire_is_found_with_its_radius_and_what_is_beside_it_is_not() {
    let wire = tube(6, 9, 12.0, RADIUS);
    let mut post = tube(6, 3, 2.0, 0.15);
    post.positions.iter_mut().for_each(|at| at.z += 5.0);
    let found = points(&[wire, post]);
    assert_eq!(found.len(), 6 * 9);
    for point in found {
        // Six flat sides are narrower than the circle around them.
        assert!((point.radius / RADIUS - 0.955).abs() < 0.02, "{}", point.radius);
        assert!((point.outward.length() - 1.0).abs() < 1e-5);
        assert!(point.outward.x.abs() < 0.1, "across the wire: {}", point.outward);
    }
}

#[test]
fn points_lead_away_from_the_axis() {
    let wire = tube(8, 5, 6.0, RADIUS);
    let mesh = weld(&[wire]).expect("it is a mesh").0;
    for point in mesh.slender_points() {
        let at = mesh.positions[point.position as usize];
        let t = at.x / 6.0;
        let axis = Vec3::new(at.x, -0.04 * 6.0 * t * (1.0 - t), 0.0);
        let away = (at - axis).normalize();
        assert!(away.dot(point.outward) > 0.97, "{away} {}", point.outward);
    }
}

#[test]
fn laths_ribbons_and_short_rods_are_not_slender_and_round() {
    let lath = tube(4, 3, 6.0, 0.02);
    assert_eq!(points(&[lath]), []);
    let rod = tube(8, 3, 50.0 * RADIUS, RADIUS);
    assert_eq!(points(&[rod]), []);
    let ribbon = RawPrimitive {
        positions: vec![Vec3::ZERO, Vec3::X * 8.0, Vec3::new(8.0, 0.0, 0.03), Vec3::Z * 0.03],
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        ..Default::default()
    };
    assert_eq!(points(&[ribbon]), []);
    assert_eq!(points(&[]), []);
}
