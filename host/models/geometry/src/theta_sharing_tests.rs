use super::*;
use crate::{Collapse, CollapseSequence, RawPrimitive, weld};
use glam::Vec3;

/// A strip of `triangles` whose vertices go from its far end, with these errors.
fn strip(triangles: u32, error: impl Fn(u32) -> f32) -> Arc<CollapseStacks> {
    build(triangles, error, false)
}

fn build(triangles: u32, error: impl Fn(u32) -> f32, by_mesh: bool) -> Arc<CollapseStacks> {
    let point = |index: u32| Vec3::new((index / 2) as f32, (index % 2) as f32, 0.0);
    let primitive = RawPrimitive {
        positions: (0..triangles + 2).map(point).collect(),
        triangles: (0..triangles).map(|first| [first, first + 1, first + 2]).collect(),
        ..RawPrimitive::default()
    };
    let mesh = weld(&[primitive]).expect("the strip is sound").0;
    let count = mesh.positions.len() as u32;
    let entry = |index: u32| Collapse {
        removed: count - 1 - index,
        kept: count - 2 - index,
        error: error(index),
    };
    let sequence = CollapseSequence::new((0..count - 1).map(entry).collect(), count);
    let sequence = sequence.expect("it is a sequence").with_theta_by_mesh(by_mesh);
    Arc::new(CollapseStacks::build(mesh, &sequence))
}

fn cursors(stacks: &[Arc<CollapseStacks>], theta: f64) -> Vec<u32> {
    stacks.iter().map(|stacks| stacks.cursor_for_theta(theta)).collect()
}

#[test]
fn vertices_go_where_they_show_least() {
    // A plate whose every vertex shows, and a rounding of very many that do not.
    let mut stacks = vec![strip(12, |_| 1.0), strip(400, |index| 1e-4 * index as f32)];
    share_theta(&mut stacks, &[1.0, 1.0]);
    let total: u32 = stacks.iter().map(|stacks| stacks.position_count()).sum();
    for theta in [0.0, 0.1, 0.3, 0.5, 0.7, 0.85, 0.95] {
        let [plate, round] = cursors(&stacks, theta)[..] else { panic!("two meshes") };
        assert_eq!(plate, 0, "at {theta}");
        let wanted = theta * f64::from(total);
        assert!((f64::from(round) - wanted).abs() <= 1.5, "at {theta}: {round} of {wanted}");
    }
}

#[test]
fn no_mesh_is_empty_before_all_are_at_their_least() {
    // By its errors alone the plate would be gone at once.
    let mut stacks = vec![strip(2, |_| 0.0), strip(60, |index| 1.0 + index as f32)];
    share_theta(&mut stacks, &[1.0, 1.0]);
    for step in 0..=100 {
        let theta = f64::from(step) / 100.0;
        let live: Vec<u64> = stacks
            .iter()
            .map(|stacks| stacks.live_triangles(stacks.cursor_for_theta(theta)))
            .collect();
        assert!(live[0] > 0 || live[1] <= 1, "at {theta}: {live:?}");
    }
    assert_eq!(cursors(&stacks, 1.0), [3, 61]);
}

#[test]
fn cursors_only_grow_and_equal_meshes_go_together() {
    let mut stacks: Vec<_> = (0..5).map(|_| strip(40, |index| (index / 8) as f32)).collect();
    let scales = [1.0; 5];
    share_theta(&mut stacks, &scales);
    let mut before = vec![0; 5];
    for step in 0..=1000 {
        let now = cursors(&stacks, f64::from(step) / 1000.0);
        assert!(now.iter().zip(&before).all(|(now, before)| now >= before));
        assert!(now.iter().all(|&cursor| cursor == now[0]), "{now:?}");
        before = now;
    }
}

#[test]
fn errors_count_in_metres_of_the_model() {
    // The same shape in millimetres and in metres: the large one waits.
    let error = |index: u32| 0.1 * index as f32;
    let mut stacks = vec![strip(100, error), strip(100, error)];
    share_theta(&mut stacks, &[0.001, 1.0]);
    let [small, large] = cursors(&stacks, 0.4)[..] else { panic!("two meshes") };
    assert!(small > 70 && large < 10, "{small} {large}");
}

#[test]
fn a_mesh_keeps_a_theta_of_its_own() {
    let mut stacks = vec![build(100, |_| 0.0, true), strip(10, |_| 1.0), strip(10, |_| 0.5)];
    share_theta(&mut stacks, &[1.0; 3]);
    assert_eq!(cursors(&stacks, 0.5), [51, 3, 9], "the tenth would leave no triangle");
    // One alone shares with none.
    let mut alone = vec![strip(100, |_| 0.0)];
    share_theta(&mut alone, &[1.0]);
    assert_eq!(cursors(&alone, 0.5), [51]);
}
