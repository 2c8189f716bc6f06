//! Arbitrary meshes: the sequence is a forest, deterministic, and bounded in time and memory.

#[allow(dead_code, reason = "not every test needs every shape")]
mod common;

use std::time::{Duration, Instant};

use busbar_geometry::{CollapseSequence, Mesh, RawPrimitive};
use busbar_plugin_sdk::testing::stopping_after;
use common::*;
use glam::Vec3;
use proptest::prelude::*;
use quadric_collapse::Settings;

fn soup(positions: Vec<Vec3>, triangles: Vec<[u32; 3]>) -> Mesh {
    welded(&[RawPrimitive { positions, triangles, ..Default::default() }])
}

/// A tree that leaves one vertex.
fn check(mesh: &Mesh) {
    let collapses = optimize(mesh);
    let count = mesh.positions.len() as u32;
    let sequence = CollapseSequence::new(collapses, count).expect("it is a sequence");
    assert_eq!(sequence.len(), count.saturating_sub(1));
}

proptest! {
    #[test]
    fn any_soup_gives_a_spanning_tree(
        positions in prop::collection::vec(prop::array::uniform3(-3_i8..3), 3..40),
        picks in prop::collection::vec(prop::array::uniform3(any::<u32>()), 1..120),
    ) {
        let n = positions.len() as u32;
        let positions = positions.iter().map(|p| Vec3::from(p.map(f32::from))).collect();
        let triangles = picks.iter().map(|t| t.map(|v| v % n)).collect();
        check(&soup(positions, triangles));
    }
}

#[test]
fn hostile_shapes_are_taken_down() {
    let line: Vec<Vec3> = (0..9).map(|i| Vec3::new(i as f32, 0.0, 0.0)).collect();
    check(&soup(line.clone(), vec![[0, 1, 2], [2, 3, 4], [4, 5, 6], [0, 4, 8]]));
    let square = vec![Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::new(1.0, 1.0, 0.0)];
    check(&soup(square.clone(), vec![[0, 1, 2], [1, 3, 2]]));
    check(&soup(square.clone(), vec![[0, 1, 2]; 9]));
    check(&soup(square, vec![[0, 1, 2], [2, 1, 0], [1, 3, 2], [2, 3, 1]]));
    // Nine leaves of a book on one edge.
    let book = (0..11).map(|i| Vec3::new((i as f32).cos(), (i as f32).sin(), i as f32)).collect();
    check(&soup(book, (2..11).map(|i| [0, 1, i]).collect()));
    let far = [Vec3::ZERO, Vec3::X * f32::MAX, Vec3::Y * -f32::MAX, Vec3::Z * f32::MAX];
    check(&soup(far.to_vec(), vec![[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]]));
    let near: Vec<Vec3> = far.iter().map(|p| p.normalize_or_zero() * 1e-38).collect();
    check(&soup(near, vec![[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]]));
    check(&Mesh::default());
}

/// A hub of very many triangles, and two of them face to face.
#[test]
fn hubs_cost_bounded_time() {
    let start = Instant::now();
    let n = 30_000_u32;
    let rim = |i: u32| {
        let angle = i as f32 * std::f32::consts::TAU / n as f32;
        Vec3::new(angle.cos(), angle.sin(), 0.01 * (50.0 * angle).sin())
    };
    let mut positions: Vec<Vec3> = (0..n).map(rim).collect();
    positions.extend([Vec3::Z, -Vec3::Z]);
    let side = |hub: u32| (0..n).map(move |i| [i, (i + 1) % n, hub]);
    check(&soup(positions.clone(), side(n).collect()));
    check(&soup(positions, side(n).chain(side(n + 1)).collect()));
    assert!(start.elapsed() < Duration::from_secs(60), "{:?}", start.elapsed());
}

/// More shells than a thread takes at once: threads race, the result does not.
#[test]
fn the_same_mesh_gives_the_same_sequence() {
    let ball = sphere(12);
    let mut primitives = Vec::new();
    for i in 0..40 {
        let at = Vec3::new(3.0 * (i % 7) as f32, 3.0 * (i / 7) as f32, 0.1 * i as f32);
        primitives.push(RawPrimitive {
            positions: ball.positions.iter().map(|&p| p + at).collect(),
            triangles: ball.topology().triangles,
            ..Default::default()
        });
    }
    let mesh = welded(&primitives);
    assert!(mesh.positions.len() > 3 * 8192);
    check(&mesh);
    let first = optimize(&mesh);
    for _ in 0..3 {
        assert!(optimize(&mesh) == first);
    }
}

#[test]
fn the_host_can_stop_it() {
    let mesh = sphere(60);
    for reports in [1, 2, 5] {
        let result =
            stopping_after(reports, |progress| optimize_with(&mesh, Settings::default(), progress));
        assert_eq!(result.unwrap_err().message(), "cancelled");
    }
}

#[test]
fn weights_out_of_range_are_refused() {
    for weight in [-1.0, f64::NAN, f64::INFINITY, 2e6] {
        let settings = Settings { border_weight: weight, ..Settings::default() };
        let mut progress = busbar_plugin_sdk::Progress::detached();
        let error = optimize_with(&grid(2), settings, &mut progress).unwrap_err();
        assert!(error.message().contains("border_weight"), "{error}");
    }
}
