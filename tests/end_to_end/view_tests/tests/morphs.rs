//! Slow dolly: levels of detail change without a visible difference.

use std::path::Path;
use std::time::Duration;

use busbar_scene_loader::LoadedScene;
use busbar_viewer::{Picture, RendererOptions, Stats, Viewer};
use e2e::Scene;
use glam::{Vec3, vec3};
use serde_json::{Value, json};

const SIZE: [u32; 2] = [480, 270];
/// Number of frames of a dolly in one direction.
const FRAMES: usize = 120;
/// Number of frames along the yards, which take longer to draw.
const YARD_FRAMES: usize = 40;
const FRAMES_A_SECOND: f64 = 60.0;
/// Distances of the dolly's start and end before the breakers, metres; the level changes on the
/// way.
const DOLLY: [f32; 2] = [11.0, 12.0];
/// Greatest difference between neighbouring frames beyond that of the camera's motion at full
/// detail: mean over all channels, of 255.
const MEAN_BOUND: f64 = 0.06;
/// Greatest share of pixels of which some channel differs by more than an eighth of its range.
const SHARE_BOUND: f64 = 0.0015;

/// Returns a scene of two breakers side by side whose detail changes along the way.
fn breakers() -> Scene {
    let mut scene = Scene::without_tags();
    let mut breaker = scene.config["models"]["breaker"].take();
    let level = |(beyond, theta): (f64, f64)| json!({ "beyond": beyond, "theta": theta });
    let levels = [(0.0, 0.0), (11.4, 0.7)].map(level);
    breaker["theta"] = json!({ "distance": levels, "hysteresis": 0.01 });
    scene.config["models"] = json!({ "breaker": breaker });
    let place = |number: i32| {
        let transform = json!({ "translation": [4 * number - 2, 0, 0] });
        json!({ "id": format!("=Q{number}"), "model": "breaker", "transform": transform })
    };
    scene.config["scene"] = (0..2).map(place).collect::<Value>();
    scene.config["graphics"] = json!({ "samples": 4 });
    scene.config["window"] = json!({ "size": SIZE });
    scene
}

/// Opens a view of a scene whose frames do not wait.
fn open(config: &Path) -> Viewer {
    let scene = LoadedScene::load(config, &|_, _, _| {}).expect("the scene loads");
    let options = RendererOptions { samples: 4, validation: true, ..Default::default() };
    let mut viewer = Viewer::new_headless(scene, options, SIZE).expect("there is a device");
    viewer.set_settles(false);
    viewer
}

/// Draws frames between two eyes, there and back; returns each with the result of `count`.
fn dolly(
    mut viewer: Viewer,
    (frames, [near, far]): (usize, [Vec3; 2]),
    target: Vec3,
    count: impl Fn(&Stats) -> u64,
) -> Vec<(Picture, u64)> {
    let there = (0..frames).map(|frame| frame as f32 / frames as f32);
    let back = (0..=frames).rev().map(|frame| frame as f32 / frames as f32);
    let draw = |(frame, share): (usize, f32)| {
        viewer.look_from(near.lerp(far, share).into(), target.into());
        let input = viewer.headless_input(frame as f64 / FRAMES_A_SECOND);
        viewer.frame(input).expect("a frame is drawn");
        // Time for what is worked out beside the frames.
        std::thread::sleep(Duration::from_millis(3));
        (viewer.read_picture().expect("the picture is there"), count(&viewer.stats()))
    };
    let shown = there.chain(back).enumerate().map(draw).collect();
    assert_eq!(viewer.stats().validation_messages, Vec::<String>::new());
    shown
}

/// Returns the difference of two frames: its mean, and the share of pixels that show it.
fn difference(a: &Picture, b: &Picture) -> [f64; 2] {
    let (mut sum, mut visible) = (0, 0);
    for (a, b) in a.rgba8.chunks_exact(4).zip(b.rgba8.chunks_exact(4)) {
        let of_channels = [0, 1, 2].map(|channel| a[channel].abs_diff(b[channel]));
        sum += of_channels.iter().map(|&of| u64::from(of)).sum::<u64>();
        visible += u64::from(of_channels.iter().any(|&of| of > 32));
    }
    let pixels = (a.rgba8.len() / 4) as f64;
    [sum as f64 / 3.0 / pixels, visible as f64 / pixels]
}

/// Returns the greatest difference of a frame from the one before, beyond that in `full`.
fn worst(shown: &[(Picture, u64)], full: &[(Picture, u64)]) -> [f64; 2] {
    let mut worst = [0.0; 2];
    for (shown, full) in shown.windows(2).zip(full.windows(2)) {
        let by_all = difference(&shown[0].0, &shown[1].0);
        let by_motion = difference(&full[0].0, &full[1].0);
        for (worst, (all, motion)) in worst.iter_mut().zip(by_all.into_iter().zip(by_motion)) {
            *worst = f64::max(*worst, all - motion);
        }
    }
    worst
}

/// Returns the counts without consecutive duplicates.
fn changes(shown: &[(Picture, u64)]) -> Vec<u64> {
    let mut counts: Vec<u64> = shown.iter().map(|(_, count)| *count).collect();
    counts.dedup();
    counts
}

#[test]
fn in_a_slow_dolly_nothing_pops() {
    let scene = breakers();
    let config = scene.write();
    let path = |viewer| {
        let eyes = DOLLY.map(|z| vec3(1.0, 3.0, z));
        dolly(viewer, (FRAMES, eyes), vec3(0.0, 2.0, 0.0), |stats| stats.triangles)
    };
    let mut full = open(&config);
    full.set_theta(0.0);
    let full = path(full);
    let by_degrees = path(open(&config));
    let mut at_once = open(&config);
    at_once.set_morph_seconds(0.0);
    let at_once = path(at_once);
    for shown in [&by_degrees, &at_once] {
        let counts = changes(shown);
        let turn = counts.iter().position(|of| of == counts.iter().min().expect("frames"));
        let turn = turn.expect("the least is among them");
        assert!(counts[..=turn].is_sorted_by(|a, b| a > b), "{counts:?}");
        assert!(counts[turn..].is_sorted(), "{counts:?}");
        assert!(counts.len() >= 5, "part after part, there and back: {counts:?}");
    }
    let [mean, share] = worst(&by_degrees, &full);
    let [popping_mean, popping_share] = worst(&at_once, &full);
    println!("by degrees: mean {mean:.4}, share {share:.5}");
    println!("at once: mean {popping_mean:.4}, share {popping_share:.5}");
    assert!(mean < MEAN_BOUND && share < SHARE_BOUND, "{mean} {share}");
    assert!(popping_mean > 2.0 * MEAN_BOUND, "the bound tells: {popping_mean}");
    assert!(popping_share > SHARE_BOUND, "the bound tells: {popping_share}");
}

/// A slow dolly past the switch to a group's proxy, which is within half a pixel of the group.
#[test]
fn nor_does_a_group_that_is_drawn_as_one() {
    let mut scene = Scene::yards();
    scene.config["graphics"] = json!({ "samples": 4 });
    scene.config["window"] = json!({ "size": SIZE });
    let config = scene.write();
    let target = vec3(60.0, 0.0, 10.0);
    let eye = |z: f32| vec3(60.0, z / 10.0, z);
    let as_one = |stats: &Stats| stats.groups_as_one as u64;
    // Where the first becomes one.
    let mut settled = open(&config);
    settled.set_settles(true);
    let first = (8..200).map(|i| i as f32 * 5.0).find(|&z| {
        settled.look_from(eye(z).into(), target.into());
        let input = settled.headless_input(f64::from(z));
        settled.frame(input).expect("a frame is drawn");
        as_one(&settled.stats()) > 0
    });
    drop(settled);
    let first = first.expect("far away a yard is one");
    let way = (YARD_FRAMES, [first - 7.0, first + 1.0].map(eye));
    let mut full = open(&config);
    full.set_theta(0.0);
    let full = dolly(full, way, target, as_one);
    let shown = dolly(open(&config), way, target, as_one);
    let counts = changes(&shown);
    assert!(counts.len() >= 3, "one, and by its breakers again: {counts:?}");
    let [mean, share] = worst(&shown, &full);
    println!("groups from {first} m, {counts:?}: mean {mean:.4}, share {share:.5}");
    assert!(mean < MEAN_BOUND && share < SHARE_BOUND, "{mean} {share}");
}
