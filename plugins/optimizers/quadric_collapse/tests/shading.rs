//! Shading of what is left: narrow rounded edges must not spoil the walls beside them.

#[allow(dead_code, reason = "not every test needs every shape")]
mod common;

use std::f32::consts::FRAC_PI_2;

use busbar_geometry::{CollapseStacks, Mesh, RawPrimitive};
use common::*;
use glam::Vec3;

/// Half of the width of the bar, metres.
const HALF: f32 = 0.5;
const LENGTH: f32 = 1.0;
/// Steps of each rounded edge, and along the bar.
const STEPS: u32 = 4;

/// A square bar with rounded edges of a radius in metres, smooth normals throughout.
fn rounded_bar(radius: f32) -> Mesh {
    let mut bar = RawPrimitive::default();
    let ring = 4 * (STEPS + 1);
    for along in 0..=STEPS {
        for (edge, step) in (0..4).flat_map(|edge| (0..=STEPS).map(move |step| (edge, step))) {
            let angle = FRAC_PI_2 * (edge as f32 + step as f32 / STEPS as f32);
            let middle = FRAC_PI_2 * (edge as f32 + 0.5);
            let normal = Vec3::new(angle.cos(), angle.sin(), 0.0);
            let sign = |x: f32| x.signum() * (HALF - radius);
            let center = Vec3::new(sign(middle.cos()), sign(middle.sin()), 0.0);
            let z = Vec3::Z * LENGTH * along as f32 / STEPS as f32;
            bar.positions.push(center + normal * radius + z);
            bar.normals.push(normal);
        }
    }
    for (along, side) in (0..STEPS).flat_map(|along| (0..ring).map(move |side| (along, side))) {
        let [a, b] = [side, (side + 1) % ring].map(|side| along * ring + side);
        bar.triangles.extend([[a, b, a + ring], [b, b + ring, a + ring]]);
    }
    welded(&[bar])
}

/// Mean angle between the triangles and their normals at the corners, by area, degrees.
fn mean_lean(stacks: &CollapseStacks, theta: f64) -> f32 {
    let mesh = stacks.mesh();
    let (mut sum, mut area) = (0.0, 0.0);
    for corners in stacks.resolve(stacks.cursor_for_theta(theta)).triangles {
        let [a, b, c] = mesh.corner_positions(corners).map(|p| mesh.positions[p as usize]);
        let normal = (b - a).cross(c - a);
        for wedge in corners {
            sum += normal.length() * normal.angle_between(mesh.wedges.normal[wedge as usize]);
        }
        area += 3.0 * normal.length();
    }
    (sum / area).to_degrees()
}

#[test]
fn walls_keep_their_shading_beside_narrow_rounded_edges() {
    for radius in [0.02, 0.04, 0.08] {
        let lean = mean_lean(&stacks(&rounded_bar(radius)), 0.8);
        assert!(lean < 5.0, "{lean} degrees at {radius} m");
    }
}
