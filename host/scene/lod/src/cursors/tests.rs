//! Cursors of a row of strips along x, without a device.

use std::collections::BTreeSet;
use std::sync::Arc;
use std::time::{Duration, Instant};

use busbar_geometry::{
    Bounds, Collapse, CollapseSequence, CollapseStacks, Mesh, RawPrimitive, weld,
};
use busbar_scene::{Model, ModelIndex, ModelNode, Placement, PolicyIndex, SceneGraph, Transform};
use glam::{DMat4, DVec3, Vec3};

use super::active_morphs::MAX_MORPHS;
use super::*;
use crate::lod_camera::{LodCamera, PixelSize};
use crate::proxies::{MeshProxy, Proxies};
use crate::screen_error::ScreenError;
use crate::theta_policy::{
    DistanceLevel, DistanceTable, InstancePolicies, ThetaPolicy, distance_to_bounds,
};

/// A strip of ten quads, one metre long, whose positions collapse one by one.
pub(super) fn strip() -> Mesh {
    let point = |i: u32| Vec3::new((i / 2) as f32 * 0.1, (i % 2) as f32, 0.0);
    let triangles = (0..20).map(|i| [i, i + 1, i + 2]).collect();
    let primitive =
        RawPrimitive { positions: (0..22).map(point).collect(), triangles, ..Default::default() };
    weld(&[primitive]).unwrap().0
}

/// Positions go from the last to the first, each with so much more error, metres.
fn stacks(mesh: Mesh, error: f32) -> CollapseStacks {
    let count = mesh.positions.len() as u32;
    let entry = |removed: u32| Collapse {
        removed,
        kept: removed - 1,
        error: error * (count - removed) as f32,
    };
    let entries = (1..count).rev().map(entry).collect();
    let sequence = CollapseSequence::new(entries, count).unwrap();
    CollapseStacks::build(mesh, &sequence)
}

/// Models with one mesh each.
pub(super) type Models = Vec<Arc<CollapseStacks>>;

pub(super) fn loaded(mesh: Mesh) -> Arc<CollapseStacks> {
    Arc::new(stacks(mesh, 0.0))
}

/// Cursors whose models have one policy each, and the last placement perhaps one of its own.
pub(super) fn cursors_of(
    (graph, models, of_placements): (&SceneGraph, &Models, &[ThetaPolicy]),
    policy: ThetaPolicy,
    proxies: &Proxies,
) -> LodCursors {
    let meshes: Vec<&[Arc<CollapseStacks>]> = models.iter().map(std::slice::from_ref).collect();
    let policies =
        InstancePolicies { of_models: vec![policy], of_placements: of_placements.into() };
    let budget = MorphBudget { max_bytes: 64 << 20, vertex_bytes: 32 };
    LodCursors::new(graph, &meshes, &policies, proxies, 1.0, budget)
}

/// Strips beginning at these x; the last one may have a policy of its own.
pub(super) fn row_of(places: &[f32], last_has_policy: bool) -> (SceneGraph, Models) {
    let node = ModelNode {
        name: "mesh".into(),
        parent: None,
        parent_from_node: DMat4::IDENTITY,
        mesh: Some(0),
    };
    let model = Model { meshes: vec![strip()], nodes: vec![node], ..Default::default() };
    let placement = |(index, &x): (usize, &f32)| Placement {
        id: index.to_string(),
        parent: None,
        transform: Transform { translation: DVec3::X * f64::from(x), ..Default::default() },
        model: Some(ModelIndex(0)),
        theta: (last_has_policy && index + 1 == places.len()).then_some(PolicyIndex(0)),
    };
    let placements: Vec<_> = places.iter().enumerate().map(placement).collect();
    let graph = SceneGraph::build(&placements, std::slice::from_ref(&model)).unwrap();
    (graph, vec![loaded(strip())])
}

/// The cursors of such a row, by distance.
fn row(places: &[f32], last_theta: Option<f64>) -> (LodCursors, Models) {
    let (graph, models) = row_of(places, last_theta.is_some());
    let levels = [(0.0, 0.0), (10.0, 0.5), (100.0, 0.9)];
    let levels = levels.map(|(beyond, theta)| DistanceLevel { beyond, theta }).to_vec();
    let policy = ThetaPolicy::Distance(DistanceTable::new(levels, 0.1));
    let own: Vec<_> = last_theta.into_iter().map(ThetaPolicy::Fixed).collect();
    (cursors_of((&graph, &models, &own), policy, &Proxies::default()), models)
}

/// Pixel size of a narrow perspective picture.
const PERSPECTIVE: PixelSize = PixelSize::PerMetre { ahead: 1e-3, corner: 1.0 };

pub(super) fn eye_at(x: f32) -> LodCamera {
    LodCamera { position: Vec3::X * x, ahead: Vec3::NEG_X, pixel: PERSPECTIVE }
}

/// Chooses levels for an eye at x, shows ready meshes, and returns the cursors.
fn step(cursors: &mut LodCursors, models: &Models, x: f32, is_ready: bool) -> Vec<u32> {
    cursors.choose_levels(eye_at(x), false);
    cursors.advance(false, 0.0, |_| is_ready);
    cursors.count_moved(|place| Some(models[place.model].live_triangles(place.cursor) as u32));
    shown(cursors)
}

fn shown(cursors: &LodCursors) -> Vec<u32> {
    let mut shown = Vec::new();
    cursors.for_each_drawn(|_, place, _| shown.push(place.cursor));
    shown
}

#[test]
fn each_instance_follows_its_own_distance_both_ways() {
    let (mut cursors, models) = row(&[0.0, 50.0, 200.0, 0.0], Some(0.25));
    // Of 22 positions: 11 and 20 at theta 0.5 and 0.9, 6 at 0.25.
    let mut at = |x| step(&mut cursors, &models, x, true);
    assert_eq!(at(0.0), [0, 11, 20, 6]);
    assert_eq!(at(50.0), [11, 0, 20, 6]);
    assert_eq!(at(200.0), [20, 20, 0, 6]);
    assert_eq!(at(105.0), [20, 11, 11, 6], "back, but not far enough for the first");
    assert_eq!(at(50.0), [11, 0, 20, 6]);
    assert_eq!(at(0.0), [0, 11, 20, 6]);
}

#[test]
fn a_cursor_stays_until_its_mesh_is_ready() {
    let (mut cursors, models) = row(&[0.0, 0.0, 200.0], None);
    assert_eq!(step(&mut cursors, &models, 0.0, false), [0, 0, 20], "the first time settles");
    assert_eq!(step(&mut cursors, &models, 50.0, false), [0, 0, 20]);
    let place = MeshCursor { model: 0, mesh: 0, cursor: 11 };
    assert_eq!(cursors.waiting().collect::<Vec<_>>(), [LodRequest::Mesh(place); 2]);
    assert_eq!(step(&mut cursors, &models, 150.0, false), [0, 0, 20]);
    assert_eq!(cursors.waiting_count(), 3, "one more, none twice");
    assert_eq!(step(&mut cursors, &models, 0.0, false), [0, 0, 20], "back before it came");
    assert_eq!(cursors.waiting_count(), 0);
    assert_eq!(step(&mut cursors, &models, 50.0, true), [11, 11, 20]);
    cursors.choose_levels(eye_at(0.0), true);
    cursors.advance(true, 0.0, |_| false);
    assert!(shown(&cursors).iter().all(|&cursor| cursor != 11), "settled");
}

#[test]
fn manual_theta_and_scale_override_policies_until_cleared() {
    let (mut cursors, models) = row(&[0.0, 50.0, 200.0], Some(0.25));
    assert_eq!(step(&mut cursors, &models, 0.0, true), [0, 11, 6]);
    cursors.set_scale(0.0);
    assert_eq!(step(&mut cursors, &models, 0.0, true), [0, 0, 0]);
    cursors.set_scale(2.0);
    assert_eq!(step(&mut cursors, &models, 0.0, true), [0, 21, 11]);
    cursors.set_manual_theta(0, Some(0.5));
    assert_eq!(step(&mut cursors, &models, 0.0, true), [11; 3], "a hand is not scaled");
    assert_eq!(step(&mut cursors, &models, 500.0, true), [11; 3]);
    cursors.set_scale(1.0);
    cursors.set_manual_theta(0, None);
    assert_eq!(step(&mut cursors, &models, 0.0, true), [0, 11, 6]);
}

#[test]
fn detail_is_summed_over_instances_and_reported_once() {
    let (mut cursors, models) = row(&[0.0, 50.0], None);
    step(&mut cursors, &models, 0.0, true);
    let detail = cursors.changed_detail().unwrap();
    let live = [0, 11].map(|cursor| models[0].live_triangles(cursor));
    let expected = ModelDetail {
        theta: [0.0, 0.5],
        by_policy: true,
        s1: 21 + 10,
        s2: 11,
        triangles: live[0] + live[1],
    };
    assert_eq!(detail, [expected]);
    assert!(live[1] < live[0]);
    step(&mut cursors, &models, 0.5, true);
    assert_eq!(cursors.changed_detail(), None);
    cursors.set_manual_theta(0, Some(0.0));
    step(&mut cursors, &models, 0.5, true);
    let detail = cursors.changed_detail().unwrap()[0];
    assert_eq!((detail.theta, detail.by_policy, detail.s2), ([0.0; 2], false, 0));
}

#[test]
fn without_perspective_screen_error_detail_is_independent_of_distance() {
    let (graph, mut models) = row_of(&[0.0, 50.0, 5000.0], false);
    models[0] = Arc::new(stacks(strip(), 0.01));
    let policy = ThetaPolicy::ScreenError(ScreenError::new(1.0, 0.0));
    let mut cursors = cursors_of((&graph, &models, &[]), policy, &Proxies::default());
    let mut at = |pixel| {
        cursors.choose_levels(LodCamera { position: Vec3::NEG_X, ahead: Vec3::X, pixel }, true);
        cursors.advance(true, 0.0, |_| true);
        shown(&cursors)
    };
    let perspective = at(PERSPECTIVE);
    assert!(perspective[0] < perspective[2], "{perspective:?}");
    assert_eq!(at(PixelSize::Metres(1e-6)), [0; 3]);
    let coarse = at(PixelSize::Metres(0.1));
    assert!(coarse[0] > 0 && coarse.iter().all(|cursor| *cursor == coarse[0]), "{coarse:?}");
}

#[test]
fn a_pixel_covers_less_at_the_edge_of_the_view_than_at_its_centre() {
    let pixel = PixelSize::PerMetre { ahead: 1e-3, corner: 0.75 };
    let eye = LodCamera { position: Vec3::X, ahead: Vec3::NEG_Z, pixel };
    let check = |center: Vec3, metres: f32| {
        let around = Bounds { min: center - Vec3::ONE, max: center + Vec3::ONE };
        let found = eye.pixel_at(&around, distance_to_bounds(eye.position, &around));
        assert!((found - metres * 1e-3).abs() < 1e-6, "{found} for {center}");
    };
    check(Vec3::new(1.0, 0.0, -11.0), 10.0);
    check(Vec3::new(6.0, 0.0, -11.0), 10.0);
    // Only what is in the picture counts, however deep the box reaches beside it.
    check(Vec3::new(12.0, 0.0, 0.0), 7.5);
    check(Vec3::X, 0.0);
}

/// Prints what choosing costs; a loaded machine in a debug build is slow, so
/// the bound is loose.
#[test]
fn cursors_of_ten_thousand_instances_are_chosen_within_the_time_limit() {
    let places: Vec<f32> = (0..10_000).map(|i| (i % 400) as f32).collect();
    let (mut cursors, models) = row(&places, None);
    step(&mut cursors, &models, 0.0, true);
    let frames = 1..=100;
    let mut least = Duration::MAX;
    for frame in frames {
        let start = Instant::now();
        cursors.choose_levels(eye_at(frame as f32), true);
        least = least.min(start.elapsed());
        cursors.advance(true, 0.0, |_| true);
    }
    println!("10000 instances: {least:?}");
    assert!(shown(&cursors).iter().any(|&cursor| cursor > 0));
    assert!(least < Duration::from_millis(5), "{least:?}");
}

/// Ways from the strips' cursors to those wanted at 50 m and back, in quarters of a second.
#[test]
fn a_level_change_is_gradual_and_later_requests_follow_it() {
    let (mut cursors, _) = row(&[0.0], None);
    cursors.set_morph_seconds(1.0);
    let mut at = |x: f32, now: f64| {
        cursors.choose_levels(eye_at(x), false);
        cursors.advance(false, now, |_| true);
        let mut all = Vec::new();
        cursors.for_each_drawn(|_, place, morph| {
            all.push((place.cursor, morph.map(|morph| (morph.coarser, morph.weight))));
        });
        (all[0], cursors.is_morphing(), cursors.waiting_count())
    };
    assert_eq!(at(0.0, 0.0), ((0, None), false, 0), "the first frame settles");
    assert_eq!(at(50.0, 1.0), ((0, Some((11, 0.0))), true, 1));
    assert_eq!(at(50.0, 1.25), ((0, Some((11, 0.25))), true, 1));
    // It comes back before it is there: it arrives first, then returns.
    assert_eq!(at(0.0, 1.5), ((0, Some((11, 0.5))), true, 1));
    assert_eq!(at(0.0, 2.0), ((0, Some((11, 1.0))), true, 1));
    assert_eq!(at(0.0, 2.75), ((0, Some((11, 0.25))), true, 1));
    assert_eq!(at(0.0, 3.0), ((0, None), false, 0));
    // And the same where it is wanted elsewhere still.
    assert_eq!(at(50.0, 4.0).0, (0, Some((11, 0.0))));
    assert_eq!(at(200.0, 5.0).0, (11, Some((20, 0.0))));
    assert_eq!(at(200.0, 6.0), ((20, None), false, 0));
    // A clock that is set back holds nothing up.
    assert_eq!(at(0.0, 7.0).0, (0, Some((20, 1.0))));
    assert_eq!(at(0.0, 3.0), ((0, None), false, 0));
}

#[test]
fn a_morph_waits_for_its_meshes_and_settling_skips_morphs() {
    let (mut cursors, _) = row(&[0.0], None);
    cursors.set_morph_seconds(1.0);
    let place = MeshCursor { model: 0, mesh: 0, cursor: 11 };
    cursors.choose_levels(eye_at(0.0), false);
    cursors.advance(false, 0.0, |_| true);
    cursors.choose_levels(eye_at(50.0), false);
    let needs = [LodRequest::Mesh(place), LodRequest::Morph(place)];
    for missing in needs {
        cursors.advance(false, 1.0, |needed| needed != missing);
        assert_eq!((shown(&cursors), cursors.is_morphing()), (vec![0], false), "{missing:?}");
        assert_eq!(cursors.waiting().collect::<Vec<_>>(), needs);
    }
    cursors.advance(false, 2.0, |_| true);
    assert!(cursors.is_morphing());
    assert_eq!(cursors.waiting().count(), 0, "all is there");
    cursors.advance(true, 2.1, |_| false);
    assert_eq!((shown(&cursors), cursors.is_morphing()), (vec![11], false));
    assert_eq!(cursors.waiting_count(), 0);
}

#[test]
fn changes_beyond_the_morph_limit_are_immediate() {
    let count = MAX_MORPHS + 10;
    let (mut cursors, models) = row(&vec![0.0; count], None);
    cursors.set_morph_seconds(1.0);
    step(&mut cursors, &models, 0.0, true);
    step(&mut cursors, &models, 50.0, true);
    let there =
        |cursors: &LodCursors| shown(cursors).iter().filter(|&&cursor| cursor == 11).count();
    assert_eq!(there(&cursors), 10);
    cursors.advance(false, 1.0, |_| true);
    assert_eq!((there(&cursors), cursors.is_morphing()), (count, false));
}

#[test]
fn full_detail_instances_ignore_distance_and_manual_theta() {
    let (mut cursors, models) = row(&[0.0, 50.0, 200.0], None);
    let before = step(&mut cursors, &models, 0.0, true);
    assert!(before[2] > 0);
    cursors.set_full_detail([2].into());
    assert_eq!(step(&mut cursors, &models, 0.0, true), [before[0], before[1], 0]);
    cursors.set_manual_theta(0, Some(0.9));
    assert_eq!(step(&mut cursors, &models, 0.0, true)[2], 0, "by hand");
    cursors.set_manual_theta(0, None);
    cursors.set_full_detail(BTreeSet::new());
    assert_eq!(step(&mut cursors, &models, 0.0, true), before, "as it was");
}

/// A strip whose positions go with so much error each, and a proxy of it from 0.05 m on.
fn proxied(places: &[f32]) -> (LodCursors, Models) {
    let (graph, mut models) = row_of(places, false);
    models[0] = Arc::new(stacks(strip(), 0.01));
    models.push(loaded(strip()));
    let proxy = MeshProxy { model: 1, mesh: 0, error: 0.05 };
    let proxies = Proxies { of_meshes: [((0, 0), [proxy].into())].into(), ..Proxies::default() };
    let policy = ThetaPolicy::ScreenError(ScreenError::new(0.5, 0.0));
    (cursors_of((&graph, &models, &[]), policy, &proxies), models)
}

/// Reports which instances are shown as proxies from a distance.
fn proxies_from(cursors: &mut LodCursors, metres: f32, is_ready: bool) -> Vec<bool> {
    cursors.choose_levels(eye_at(-metres), false);
    cursors.advance(false, 0.0, |_| is_ready);
    let mut shown = Vec::new();
    cursors.for_each_drawn(|_, place, _| {
        assert!(place.model == 0 || place == MeshCursor { model: 1, mesh: 0, cursor: 0 });
        shown.push(place.model == 1);
    });
    shown
}

#[test]
fn a_distant_instance_is_shown_as_its_proxy_once_the_proxy_is_ready() {
    // An error of 0.05 m is half a pixel from 100 m on.
    let (mut cursors, _) = proxied(&[0.0, 50.0]);
    let mut at = |metres, is_ready| proxies_from(&mut cursors, metres, is_ready);
    assert_eq!(at(1.0, true), [false, false]);
    assert_eq!(at(70.0, false), [false, false], "until it is ready");
    assert_eq!(at(71.0, true), [false, true]);
    assert_eq!(at(200.0, true), [true, true]);
    assert_eq!(at(1.0, false), [true, true], "until its own mesh is");
    assert_eq!(at(2.0, true), [false, false]);
}

#[test]
fn proxies_count_as_the_mesh_that_they_replace() {
    let (mut cursors, models) = proxied(&[0.0, 0.0]);
    proxies_from(&mut cursors, 200.0, true);
    cursors.count_moved(|place| Some(if place.model == 1 { 3 } else { 99 }));
    let detail = cursors.changed_detail().unwrap();
    let own = &models[0];
    let cursor = own.cursor_for_theta(detail[0].theta[0]);
    assert!(cursor > 0 && detail[0].triangles == 2 * 3);
    assert_eq!(detail[0].s2, 2 * u64::from(cursor));
    assert_eq!(detail[0].s1, 2 * u64::from(own.collapse_count() - cursor));
    assert_eq!(detail[1], ModelDetail { by_policy: true, ..ModelDetail::default() });
}

#[test]
fn highlighted_or_manual_instances_use_no_proxy_and_nothing_morphs_to_a_proxy() {
    let (mut cursors, _) = proxied(&[0.0, 0.0]);
    let far = |cursors: &mut LodCursors| proxies_from(cursors, 200.0, true);
    assert_eq!(far(&mut cursors), [true, true]);
    cursors.set_individual([1].into());
    assert_eq!(far(&mut cursors), [true, false]);
    cursors.set_individual(BTreeSet::new());
    cursors.set_full_detail([0].into());
    assert_eq!(far(&mut cursors), [false, true]);
    cursors.set_full_detail(BTreeSet::new());
    cursors.set_manual_theta(0, Some(0.5));
    assert_eq!(far(&mut cursors), [false, false]);
    cursors.set_manual_theta(0, None);
    cursors.set_scale(0.5);
    assert_eq!(far(&mut cursors), [false, false]);
    cursors.set_scale(1.0);
    cursors.set_morph_seconds(1.0);
    assert_eq!(far(&mut cursors), [true, true], "at once");
    assert!(!cursors.is_morphing());
}
