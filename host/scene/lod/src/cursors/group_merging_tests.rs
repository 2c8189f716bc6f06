//! Groups of a row of strips, drawn as one or not.

use std::collections::BTreeSet;
use std::ops::Range;
use std::sync::Arc;

use super::cursor_state::NOT_SHOWN;
use super::tests::{cursors_of, eye_at, loaded, row_of, strip};
use super::*;
use crate::instance_groups::Group;
use crate::proxies::{HlodGroup, Proxies};
use crate::screen_error::ScreenError;
use crate::theta_policy::ThetaPolicy;

/// Errors that the proxies have: seen as half a pixel from 20 m and from 100 m.
const INNER_ERROR: f64 = 0.01;
const OUTER_ERROR: f64 = 0.05;

/// Four strips at 0 m; two groups of two in one of four.
pub(super) fn groups() -> LodCursors {
    grouped([(0..4, 3, 1, OUTER_ERROR), (0..2, 2, 2, INNER_ERROR), (2..4, 3, 2, INNER_ERROR)])
}

/// Four strips at 0 m in groups: instances, the group after, proxy, error.
fn grouped<const N: usize>(groups: [(Range<u32>, u32, usize, f64); N]) -> LodCursors {
    let policy = ThetaPolicy::ScreenError(ScreenError::new(0.5, 0.1));
    let (graph, mut models) = row_of(&[0.0; 4], false);
    models.extend([loaded(strip()), loaded(strip())]);
    let group = |(instances, after, model, base_error): (Range<u32>, _, _, _)| HlodGroup {
        group: Arc::new(Group {
            nodes: instances.start * 2..instances.end * 2,
            instances,
            after,
            bounds: graph.bounds().unwrap(),
            world_from_group: glam::Mat4::IDENTITY,
            kind: 0,
        }),
        after,
        model,
        base_error,
        policy: Arc::new(policy.clone()),
    };
    let proxies = Proxies { groups: groups.map(group).into(), ..Proxies::default() };
    cursors_of((&graph, &models, &[]), policy.clone(), &proxies)
}

fn drawn(cursors: &LodCursors) -> Vec<DrawItem> {
    let mut all = Vec::new();
    cursors.for_each_drawn(|drawn, place, _| {
        assert_ne!(place.cursor, NOT_SHOWN, "{drawn:?} is drawn and nowhere");
        all.push(drawn);
    });
    all
}

/// A step with an eye so many metres before the strips.
fn step(
    cursors: &mut LodCursors,
    metres: f32,
    ready: &dyn Fn(MeshCursor) -> bool,
) -> Vec<DrawItem> {
    cursors.choose_levels(eye_at(-metres), false);
    cursors
        .advance(false, 0.0, |(LodRequest::Mesh(place) | LodRequest::Morph(place))| ready(place));
    drawn(cursors)
}

const ALL: [DrawItem; 4] =
    [DrawItem::Instance(0), DrawItem::Instance(1), DrawItem::Instance(2), DrawItem::Instance(3)];

#[test]
fn groups_merge_with_distance_and_split_again() {
    let mut cursors = groups();
    let mut at = |metres| step(&mut cursors, metres, &|_| true);
    for _ in 0..2 {
        assert_eq!(at(1.0), ALL);
        assert_eq!(at(30.0), [DrawItem::Group(1), DrawItem::Group(2)]);
        assert_eq!(at(200.0), [DrawItem::Group(0)]);
        assert_eq!(at(30.0), [DrawItem::Group(1), DrawItem::Group(2)]);
        assert_eq!(at(1.0), ALL);
        assert_eq!(at(200.0), [DrawItem::Group(0)]);
    }
}

#[test]
fn proxies_of_a_group_replace_each_other_in_order() {
    let mut cursors = grouped([(0..4, 2, 1, OUTER_ERROR), (0..4, 2, 2, INNER_ERROR)]);
    let mut at = |metres, ready: fn(MeshCursor) -> bool| step(&mut cursors, metres, &ready);
    for _ in 0..2 {
        assert_eq!(at(1.0, |_| true), ALL);
        assert_eq!(at(30.0, |_| true), [DrawItem::Group(1)]);
        assert_eq!(at(200.0, |_| false), [DrawItem::Group(1)], "until the other is there");
        assert_eq!(at(201.0, |_| true), [DrawItem::Group(0)]);
        assert_eq!(at(30.0, |_| false), [DrawItem::Group(0)]);
        assert_eq!(at(31.0, |_| true), [DrawItem::Group(1)]);
    }
    assert_eq!(at(200.0, |_| true), [DrawItem::Group(0)]);
    assert_eq!(at(1.0, |_| true), ALL, "past the one between");
}

#[test]
fn no_instance_disappears_while_meshes_are_prepared() {
    let mut cursors = groups();
    step(&mut cursors, 1.0, &|_| true);
    let nothing = |_: MeshCursor| false;
    assert_eq!(step(&mut cursors, 200.0, &nothing), ALL);
    let proxy = |place: MeshCursor| place.model == 1;
    assert_eq!(step(&mut cursors, 201.0, &proxy), [DrawItem::Group(0)]);
    // Half of what the way back needs.
    assert_eq!(step(&mut cursors, 30.0, &nothing), [DrawItem::Group(0)]);
    assert!(cursors.waiting_count() > 0);
    let inner = |place: MeshCursor| place.model == 2;
    let both = [DrawItem::Group(1), DrawItem::Group(2)];
    assert_eq!(step(&mut cursors, 31.0, &inner), both);
    assert_eq!(step(&mut cursors, 1.0, &nothing), both);
    // Without another step of the eye too.
    cursors.advance(false, 0.0, |_| true);
    assert_eq!(drawn(&cursors), ALL);
    assert_eq!(cursors.waiting_count(), 0);
}

#[test]
fn a_camera_that_turns_back_leaves_no_pending_changes() {
    let mut cursors = groups();
    step(&mut cursors, 200.0, &|_| true);
    let nothing = |_: MeshCursor| false;
    for metres in [1.0, 200.0, 30.0, 200.0, 1.0, 30.0, 200.0] {
        assert_eq!(step(&mut cursors, metres, &nothing), [DrawItem::Group(0)], "{metres}");
    }
    assert_eq!(step(&mut cursors, 1.0, &|_| true), ALL);
    assert_eq!(cursors.waiting_count(), 0);
}

#[test]
fn manual_theta_and_scale_split_groups() {
    let mut cursors = groups();
    let settled = |cursors: &mut LodCursors, metres: f32| {
        cursors.choose_levels(eye_at(-metres), true);
        cursors.advance(true, 0.0, |_| false);
        drawn(cursors)
    };
    assert_eq!(settled(&mut cursors, 200.0), [DrawItem::Group(0)]);
    cursors.set_manual_theta(0, Some(0.5));
    assert_eq!(settled(&mut cursors, 200.0), ALL);
    assert!(cursors.instances[..4].iter().all(|instance| instance.theta == 0.5));
    cursors.set_manual_theta(0, None);
    assert_eq!(settled(&mut cursors, 200.0), [DrawItem::Group(0)]);
    cursors.set_scale(0.0);
    assert_eq!(settled(&mut cursors, 200.0), ALL);
    assert!(cursors.instances[..4].iter().all(|instance| instance.shown == 0));
}

#[test]
fn a_group_with_a_full_detail_instance_is_split_at_any_distance() {
    let mut cursors = groups();
    let far = |cursors: &mut LodCursors| {
        step(cursors, 1_000.0, &|_| true);
        step(cursors, 1_000.0, &|_| true)
    };
    assert_eq!(far(&mut cursors), [DrawItem::Group(0)]);
    cursors.set_full_detail([3].into());
    let displaced = [DrawItem::Group(1), DrawItem::Instance(2), DrawItem::Instance(3)];
    assert_eq!(far(&mut cursors), displaced);
    cursors.for_each_drawn(|drawn, place, _| {
        assert_eq!(place.cursor == 0, drawn == DrawItem::Instance(3), "{drawn:?}");
    });
    cursors.set_full_detail(BTreeSet::new());
    assert_eq!(far(&mut cursors), [DrawItem::Group(0)]);
}

#[test]
fn a_highlighted_instance_is_drawn_individually_at_its_coarsest_allowed_level() {
    let mut cursors = groups();
    let far = |cursors: &mut LodCursors| {
        step(cursors, 1_000.0, &|_| true);
        step(cursors, 1_000.0, &|_| true)
    };
    assert_eq!(far(&mut cursors), [DrawItem::Group(0)]);
    cursors.set_individual([3].into());
    let displaced = [DrawItem::Group(1), DrawItem::Instance(2), DrawItem::Instance(3)];
    assert_eq!(far(&mut cursors), displaced);
    cursors.for_each_drawn(|drawn, place, _| assert_ne!(place.cursor, 0, "{drawn:?}"));
    cursors.set_individual(BTreeSet::new());
    assert_eq!(far(&mut cursors), [DrawItem::Group(0)]);
}
