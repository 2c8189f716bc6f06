//! Tests of the shapes: every shape is closed, faces outward, and has the counts of its formula.

use std::collections::HashMap;

use demo_model::shapes::{
    block, cuboid, cylinder, lathe, pipe, ring_of_profile, rounded_path, strut, sweep, torus,
};
use demo_model::{Sheds, Solid, insulator_profile};
use glam::{Mat4, Vec2, Vec3};

/// Expected counts and volume of a shape; cubic metres, with a relative tolerance.
struct Expected {
    points: usize,
    triangles: usize,
    euler: i64,
    volume: f64,
    tolerance: f64,
}

fn check(solid: &Solid, expected: Expected) {
    let mut uses: HashMap<(u32, u32), i32> = HashMap::new();
    for &[a, b, c] in &solid.triangles {
        for edge in [(a, b), (b, c), (c, a)] {
            *uses.entry(edge).or_default() += 1;
        }
    }
    for (&(a, b), &count) in &uses {
        assert_eq!(count, 1, "edge {a}-{b} is walked {count} times in one direction");
        assert_eq!(uses.get(&(b, a)), Some(&1), "edge {a}-{b} has no neighbour the other way");
    }
    assert_eq!(solid.points.len(), expected.points);
    assert_eq!(solid.triangles.len(), expected.triangles);
    let euler = solid.points.len() as i64 - uses.len() as i64 / 2 + solid.triangles.len() as i64;
    assert_eq!(euler, expected.euler);
    let volume = solid.signed_volume();
    let error = (volume / expected.volume - 1.0).abs();
    assert!(error <= expected.tolerance, "volume {volume}, expected {}", expected.volume);
}

/// Returns the area of a regular polygon divided by that of its circle.
fn polygon_share(n: usize) -> f64 {
    let step = std::f64::consts::TAU / n as f64;
    step.sin() / step
}

#[test]
fn cuboid_has_8_points() {
    let solid = cuboid(Vec3::new(2.0, 3.0, 4.0));
    check(&solid, Expected { points: 8, triangles: 12, euler: 2, volume: 24.0, tolerance: 1e-6 });
}

#[test]
fn block_loses_its_edges() {
    let (size, bevel) = (Vec3::new(2.0, 3.0, 4.0), 0.3_f32);
    // Along every axis four prisms of b^2 / 2 go; at each of the eight corners
    // a cube of side b keeps only its innermost tetrahedron, a sixth of it.
    let b = f64::from(bevel);
    let edges = 4.0 * 0.5 * b * b * ((2.0 - 2.0 * b) + (3.0 - 2.0 * b) + (4.0 - 2.0 * b));
    let corner = b * b * b * (1.0 - 1.0 / 6.0);
    let expected = 24.0 - edges - 8.0 * corner;
    let solid = block(size, bevel);
    check(
        &solid,
        Expected { points: 24, triangles: 44, euler: 2, volume: expected, tolerance: 1e-5 },
    );
}

#[test]
fn bevels_that_do_not_fit_are_reduced_or_left_out() {
    let thin = block(Vec3::new(1.0, 0.03, 1.0), 0.5);
    assert!(thin.signed_volume() > 0.02);
    assert_eq!(block(Vec3::ONE, 0.0), cuboid(Vec3::ONE));
}

#[test]
fn strut_keeps_its_volume_in_any_direction() {
    for to in [Vec3::X, Vec3::NEG_Y, Vec3::Z, Vec3::new(1.0, 2.0, -3.0)] {
        let from = Vec3::new(0.5, -0.25, 0.125);
        let volume = 0.2 * 0.1 * f64::from(to.length());
        let solid = strut(from, from + to, 0.2, 0.1);
        check(&solid, Expected { points: 8, triangles: 12, euler: 2, volume, tolerance: 1e-5 });
    }
}

#[test]
fn lathe_of_r_rings_and_n_segments() {
    for (rings, n) in [(2, 6), (3, 12), (7, 16), (40, 9)] {
        let profile: Vec<(f32, f32)> = (0..rings).map(|i| (0.5, i as f32 * 0.25)).collect();
        let volume = std::f64::consts::PI * 0.25 * polygon_share(n) * 0.25 * (rings - 1) as f64;
        check(
            &lathe(&profile, n),
            Expected {
                points: rings * n + 2,
                triangles: 2 * rings * n,
                euler: 2,
                volume,
                tolerance: 1e-5,
            },
        );
    }
}

#[test]
fn insulator_is_a_lathe_of_four_rings_a_shed() {
    let sheds = Sheds { count: 24, large_overhang: 0.06, small_overhang: 0.04 };
    let profile = insulator_profile(0.3, 1.5, [0.12, 0.1], sheds);
    let rings = 4 * 24 + 2;
    assert_eq!(profile.len(), rings);
    assert_eq!((profile[0], profile[rings - 1]), ((0.12, 0.3), (0.1, 1.8)));
    let widest = |shed: usize| profile[1 + 4 * shed + 1].0;
    assert!(widest(0) > widest(1) + 0.015 && widest(2) > widest(1) + 0.015);
    let solid = lathe(&profile, 14);
    let core = cylinder(0.1, 1.5, 14).signed_volume();
    assert!(solid.signed_volume() > core && solid.signed_volume() < 2.0 * core);
    let volume = solid.signed_volume();
    check(
        &solid,
        Expected {
            points: rings * 14 + 2,
            triangles: 2 * rings * 14,
            euler: 2,
            volume,
            tolerance: 0.0,
        },
    );
}

#[test]
fn torus_and_hollow_ring_have_one_hole() {
    let volume = std::f64::consts::TAU * 2.0 * std::f64::consts::PI * 0.09;
    let exact = volume * polygon_share(64) * polygon_share(32);
    let solid = torus(2.0, 0.3, 64, 32);
    check(
        &solid,
        Expected { points: 2048, triangles: 4096, euler: 0, volume: exact, tolerance: 1e-4 },
    );

    let profile = [(1.0, 0.0), (1.5, 0.0), (1.5, 0.2), (1.0, 0.2)];
    let exact = std::f64::consts::PI * (2.25 - 1.0) * 0.2 * polygon_share(20);
    let solid = ring_of_profile(&profile, 20);
    check(
        &solid,
        Expected { points: 80, triangles: 160, euler: 0, volume: exact, tolerance: 1e-5 },
    );
}

#[test]
fn mitred_sweep_has_the_volume_of_its_centre_line() {
    let path =
        [Vec3::ZERO, Vec3::new(0.0, 2.0, 0.0), Vec3::new(3.0, 2.0, 0.0), Vec3::new(3.0, 2.0, 1.5)];
    let square = [(-0.1, -0.1), (0.1, -0.1), (0.1, 0.1), (-0.1, 0.1)].map(|(x, y)| Vec2::new(x, y));
    let solid = sweep(&path, &square, Vec3::X);
    check(
        &solid,
        Expected { points: 18, triangles: 32, euler: 2, volume: 0.04 * 6.5, tolerance: 1e-4 },
    );
}

#[test]
fn pipe_follows_its_rounded_path() {
    let path = [Vec3::ZERO, Vec3::new(0.0, 2.0, 0.0), Vec3::new(2.0, 2.0, 0.0)];
    let rounded = rounded_path(&path, 0.5);
    assert_eq!((rounded[0], rounded[rounded.len() - 1]), (path[0], path[2]));
    let length: f32 = rounded.windows(2).map(|leg| leg[0].distance(leg[1])).sum();
    assert!(length < 4.0 && length > 4.0 - 0.5);
    let volume = std::f64::consts::PI * 0.01 * polygon_share(16) * f64::from(length);
    let rings = rounded.len();
    check(
        &pipe(&path, 0.1, 0.5, 16),
        Expected {
            points: rings * 16 + 2,
            triangles: 2 * rings * 16,
            euler: 2,
            volume,
            tolerance: 1e-3,
        },
    );
}

#[test]
fn a_mirrored_solid_still_faces_outward() {
    let mirrored = block(Vec3::ONE, 0.1).transformed(Mat4::from_scale(Vec3::new(-1.0, 2.0, 1.0)));
    let volume = 2.0 * block(Vec3::ONE, 0.1).signed_volume();
    check(&mirrored, Expected { points: 24, triangles: 44, euler: 2, volume, tolerance: 1e-5 });
}

#[test]
fn shapes_without_extent_are_empty_and_do_not_panic() {
    assert!(sweep(&[Vec3::ZERO; 3], &[Vec2::ZERO; 4], Vec3::Y).triangles.is_empty());
    assert!(lathe(&[(1.0, 0.0)], 8).triangles.is_empty());
    assert_eq!(cylinder(1.0, 1.0, 0).triangles.len(), 12);
}
