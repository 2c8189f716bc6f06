//! Large shells that are simplified in parts.

#[allow(dead_code, reason = "not every test needs every shape")]
mod common;

use busbar_geometry::{Collapse, CollapseSequence, CollapseStacks, Mesh};
use busbar_plugin_sdk::Progress;
use busbar_plugin_sdk::testing::stopping_after;
use common::*;
use glam::{Vec2, Vec3};
use quadric_collapse::{Limits, Settings};

fn in_parts(mesh: &Mesh, part_triangles: usize, threads: usize) -> CollapseSequence {
    let limits = Limits { threads, part_triangles };
    let progress = &mut Progress::detached();
    let list = optimize_within(&limits, mesh, Settings::default(), progress).expect("it ends");
    let entries = list.collapses.iter();
    let entries = entries.map(|c| Collapse { removed: c.removed, kept: c.kept, error: c.error });
    CollapseSequence::new(entries.collect(), mesh.positions.len() as u32).expect("a sequence")
}

/// A ball with waves, and a sheet with a texture and a border.
fn shapes() -> [Mesh; 2] {
    let mut ball = sphere(40);
    for point in &mut ball.positions {
        *point *= 1.0 + 0.02 * (9.0 * point.x).sin() * (7.0 * point.y).cos();
    }
    let hill = |u: f32, v: f32| Vec3::new(u, 0.1 * (9.0 * u).sin() * (8.0 * v).sin(), v);
    let sheet = welded(&[patch(90, hill, |u, v| (Vec3::Y, Vec2::new(u, v)))]);
    [ball, sheet]
}

#[test]
fn threads_do_not_change_the_sequence() {
    for mesh in shapes() {
        for part_triangles in [700, 5000] {
            let alone = in_parts(&mesh, part_triangles, 1);
            for threads in [2, 3, 8] {
                assert!(in_parts(&mesh, part_triangles, threads) == alone, "{threads} threads");
            }
        }
    }
}

#[test]
fn parts_of_any_size_give_a_spanning_tree() {
    for mesh in shapes() {
        let count = mesh.positions.len() as u32;
        for part_triangles in [0, 1, 40, 1000] {
            assert_eq!(in_parts(&mesh, part_triangles, 4).len(), count - 1);
        }
    }
}

/// Cuts become no borders, and flat surfaces between cuts stay closed.
#[test]
fn cuts_leave_no_trace_in_the_topology() {
    let [ball, _] = shapes();
    let sequence = in_parts(&ball, 900, 4);
    let stacks = CollapseStacks::build(ball, &sequence);
    for theta in [0.3, 0.6, 0.8, 0.9] {
        let found = statistics(&stacks, stacks.cursor_for_theta(theta));
        assert_eq!(found.border_edges, 0, "theta {theta}");
        assert_eq!(found.euler_characteristic(), 2, "theta {theta}");
    }
}

/// The error that a sequence has at 80 % hardly depends on the cuts.
#[test]
fn parts_are_as_good_as_the_whole() {
    for mesh in shapes() {
        let count = mesh.positions.len() as u32;
        let error = |part_triangles| {
            let sequence = in_parts(&mesh, part_triangles, 4);
            sequence.entries()[count as usize * 8 / 10].error
        };
        let (whole, parts) = (error(usize::MAX), error(2000));
        assert!(parts < 1.3 * whole, "{parts} against {whole}");
    }
}

#[test]
fn work_in_parts_can_be_stopped() {
    let [ball, _] = shapes();
    let limits = Limits { threads: 2, part_triangles: 500 };
    for reports in [1, 2] {
        let result = stopping_after(reports, |progress| {
            optimize_within(&limits, &ball, Settings::default(), progress)
        });
        let message = result.err().map(|error| error.message().to_owned());
        assert_eq!(message.as_deref(), Some("cancelled"));
    }
}
