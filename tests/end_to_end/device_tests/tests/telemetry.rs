//! Live values from an independent server: they are in the statistics and on the picture, and those
//! that it no longer confirms are shown as bad.

use std::path::PathBuf;
use std::process::Command;

use e2e::peer::{Peer, f32_registers};
use e2e::picture::{self, Region};
use e2e::relay::Relay;
use e2e::stats::Tag;
use e2e::{Process, Scene, Stats, busbar, finish};
use image::{Rgb, RgbImage};
use rustix::process::Signal;
use serde_json::{Value, json};

/// Greatest number of requests in one poll of the demo; after these answers every tag has a value.
const ANSWERS_TO_ALL: usize = 12;
/// Distance between the stripes of the hatching, pixels.
const HATCH_STEP: u32 = 5;
/// Difference between stripes and their darker ground, at least, of 255.
const MIN_STRIPE_DIFFERENCE: u8 = 16;
/// Variation of the ground, at most, of 255.
const MAX_GROUND_DIFFERENCE: u8 = 4;
/// Grey of labels, which is no ground of hatching.
const PAPER: u8 = 240;
/// Least number of pixels of hatched ground for a value.
const MIN_HATCHED_PIXELS: usize = 60;

/// Returns the tables of the demo as a server has them.
fn demo_values() -> Value {
    let floats = |values: &[f32]| values.iter().flat_map(|&v| f32_registers(v)).collect::<Vec<_>>();
    json!({
        "holding": {
            // U12, two others, I1, two others, P, Q, one other, load.
            "0": floats(&[231.5, 0.0, 0.0, 412.25, 0.0, 0.0, -118.5, 34.75, 0.0, 71.5]),
            // Top oil, hot-spot, one other, oil level, tap, fans, SF6.
            "100": [559, (-125_i16) as u16, 0, 583, (-3_i16) as u16, 2, 644]
        },
        // Breaker on, disconnector off, Buchholz.
        "discrete": {"0": [0, 1, 1, 0, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0]}
    })
}

fn top_oil_of(stats: &Stats) -> Tag {
    stats.tag("T1.TopOil")
}

/// Renders a scene for some seconds; returns the picture and the statistics.
fn render(scene: &Scene, seconds: f64) -> (RgbImage, Stats) {
    let (picture, stats) = outputs(scene);
    finish(&mut rendering(scene, seconds)).expect_code(0);
    (picture::load(&picture), Stats::read(&stats))
}

fn rendering(scene: &Scene, seconds: f64) -> Command {
    let (picture, stats) = outputs(scene);
    let mut command = busbar();
    command.arg("render").arg(scene.write()).args(["--size", "960x540"]);
    command.arg("--out").arg(picture).arg("--stats").arg(stats);
    command.args(["--seconds", &seconds.to_string()]);
    command
}

fn outputs(scene: &Scene) -> (PathBuf, PathBuf) {
    (scene.path("picture.png"), scene.path("stats.json"))
}

/// Returns the demo scene with one label: the top oil temperature.
fn one_label(port: u16) -> Scene {
    let mut scene = Scene::demo(port);
    let binding = scene.config["bindings"][0].take();
    assert_eq!(binding["tag"], "T1.TopOil");
    scene.config["bindings"] = json!([binding]);
    scene
}

/// Returns the region of the scene's only label: the difference from a picture without labels.
fn label_region(with_label: &RgbImage) -> Region {
    let mut scene = Scene::demo(1);
    scene.config["bindings"] = json!([]);
    let (without, _) = render(&scene, 0.0);
    let region = picture::difference(with_label, &without).expect("there is a label");
    let [width, height] = region.size();
    assert!(width < 400 && height < 200, "the label takes {width}x{height} pixels");
    region
}

/// Counts the pixels of a region that look like the ground of hatching: grey, the same again one
/// stripe to the right and along the stripe, darker in between.
fn hatched_pixels(picture: &RgbImage, region: Region) -> usize {
    let grey = |x: u32, y: u32| {
        let Rgb([r, g, b]) = *picture.get_pixel_checked(x, y)?;
        (r == g && g == b && r < PAPER).then_some(r)
    };
    let is_hatched = |&[x, y]: &[u32; 2]| {
        let ground = grey(x, y)?;
        let same = |other: u8| other.abs_diff(ground) <= MAX_GROUND_DIFFERENCE;
        let repeats = same(grey(x + HATCH_STEP, y)?) && same(grey(x.checked_sub(1)?, y + 1)?);
        let mut between = (x + 1..x + HATCH_STEP).filter_map(|x| grey(x, y));
        (repeats && between.any(|g| g + MIN_STRIPE_DIFFERENCE < ground)).then_some(())
    };
    region.pixels().filter(|pixel| is_hatched(pixel).is_some()).count()
}

#[track_caller]
fn assert_all_bad(stats: &Stats, reason: &str) {
    for (id, tag) in stats.tags() {
        assert_eq!((tag.quality.as_str(), tag.reason.as_deref()), ("bad", Some(reason)), "{id}");
    }
    let (count, counts) = (stats.tags().count(), &stats.0["quality"]);
    assert_eq!(*counts, json!({"good": 0, "uncertain": 0, "bad": count}));
}

#[test]
fn values_are_those_of_the_server() {
    for isolation in ["process", "none"] {
        assert_values_of_server(isolation);
    }
}

fn assert_values_of_server(isolation: &str) {
    let mut values = demo_values();
    // Tables and types that the demo does not use: 1e300 as f64, -70000 as i32.
    values["input"] = json!({"10": [0x7E37, 0xE43C, 0x8800, 0x759C, 0xEE90, 0xFFFE]});
    values["coil"] = json!({"0": [0, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0]});
    let Some(peer) = Peer::start(&values) else { return };
    let mut scene = Scene::demo(peer.port);
    scene.config["isolation"] = json!(isolation);
    let mut add = |id: &str, kind: &str, address: Value| {
        scene.config["tags"][id] =
            json!({"type": kind, "source": {"instance": "bay", "address": address}});
    };
    add("X.F64", "f64", json!({"table": "input", "register": 10, "type": "f64"}));
    let little = json!({"table": "input", "register": 14, "type": "i32", "word_order": "little"});
    add("X.I32", "i64", little);
    add("X.Coil", "bool", json!({"table": "coil", "register": 1}));

    let (_, stats) = render(&scene, 3.0);

    let expected = [
        ("T1.U12", json!(231.5)),
        ("T1.I1", json!(412.25)),
        ("T1.P", json!(-118.5)),
        ("T1.Q", json!(34.75)),
        ("T1.Load", json!(71.5)),
        ("T1.TopOil", json!(55.9)),
        ("T1.HotSpot", json!(-12.5)),
        ("T1.OilLevel", json!(58.3)),
        ("T1.Tap", json!(-3)),
        ("T1.Fans", json!(2)),
        ("T1.Buchholz", json!(true)),
        ("Q1.Position", json!("closed")),
        ("QB9.Position", json!("open")),
        ("Q1.SF6", json!(6.44)),
        ("X.F64", json!(1e300)),
        ("X.I32", json!(-70_000)),
        ("X.Coil", json!(true)),
    ];
    assert_eq!(stats.tags().count(), expected.len(), "every tag is tested");
    for (id, value) in expected {
        let tag = stats.tag(id);
        // Scaling rounds; everything else is exact.
        let same = match (value.as_f64(), tag.value.as_f64()) {
            (Some(wanted), Some(shown)) => (wanted - shown).abs() <= 1e-9 * wanted.abs(),
            _ => tag.value == value,
        };
        assert!(same, "{id}: {:?} instead of {value}", tag.value);
        // The tap position is below its range, 1 to 19.
        let quality = if id == "T1.Tap" { "uncertain" } else { "good" };
        assert_eq!(tag.quality, quality, "{id}");
        assert!(tag.age.is_some_and(|age| age < 3.0), "{id}: age {:?}", tag.age);
    }
}

#[test]
fn a_changed_register_changes_the_picture_at_its_label() {
    let Some(mut peer) = Peer::start(&demo_values()) else { return };
    let scene = one_label(peer.port);
    let (first, stats) = render(&scene, 1.5);
    assert_eq!(top_oil_of(&stats).value.as_f64().map(f64::round), Some(56.0));
    let (same, _) = render(&scene, 1.5);
    assert_eq!(picture::difference(&first, &same), None, "the same values, the same picture");

    peer.set("holding", 100, &[748]);
    let (changed, stats) = render(&scene, 1.5);
    assert_eq!(top_oil_of(&stats).value.as_f64().map(f64::round), Some(75.0));
    let label = label_region(&first).grow(8);
    let difference = picture::difference(&first, &changed).expect("the picture changes");
    assert!(label.contains(difference), "{difference:?} is at the label {label:?}");

    peer.set("holding", 100, &[559]);
    let (back, _) = render(&scene, 1.5);
    assert_eq!(picture::difference(&first, &back), None, "the old value, the old picture");
}

#[test]
fn without_a_server_tags_are_bad_and_hatched() {
    let Some(peer) = Peer::start(&demo_values()) else { return };
    let scene = one_label(peer.port);
    let (good, stats) = render(&scene, 1.5);
    assert_eq!(top_oil_of(&stats).quality, "good");
    let label = label_region(&good);
    drop(peer);

    let (bad, stats) = render(&scene, 0.5);

    for (id, tag) in stats.tags() {
        assert_eq!((tag.quality.as_str(), tag.value), ("bad", Value::Null), "{id}");
        assert!(tag.reason.is_some(), "{id}");
    }
    assert_hatched(&good, &bad, label.grow(60));
}

#[test]
fn a_server_killed_under_way_makes_tags_bad_and_hatched() {
    let Some(peer) = Peer::start(&demo_values()) else { return };
    let relay = Relay::start(peer.port);
    let scene = one_label(relay.port);
    let (good, _) = render(&scene, 1.5);
    let label = label_region(&good);

    let relay = Relay::start(peer.port);
    let scene = one_label(relay.port);
    let running = Process::start(&mut rendering(&scene, 4.0));
    relay.wait_for_answers(ANSWERS_TO_ALL);
    peer.process.signal(Signal::KILL);
    running.finish().expect_code(0);

    let (picture, stats) = outputs(&scene);
    assert_all_bad(&Stats::read(&stats), "communication");
    let top_oil = top_oil_of(&Stats::read(&stats));
    assert!(top_oil.value.is_f64(), "the last value stays, as bad");
    assert_hatched(&good, &picture::load(&picture), label.grow(60));
}

#[test]
fn a_stopped_server_makes_tags_stale_within_their_own_limits() {
    let Some(peer) = Peer::start(&demo_values()) else { return };
    let relay = Relay::start(peer.port);
    let mut scene = one_label(relay.port);
    // The adapter waits on; the host does not.
    scene.config["plugins"]["bay"]["settings"]["timeout_seconds"] = json!(600);
    for tag in scene.config["tags"].as_object_mut().expect("tags").values_mut() {
        tag["freshness_seconds"] = json!(1);
    }
    scene.config["tags"]["T1.U12"]["freshness_seconds"] = json!(86_400);
    let running = Process::start(&mut rendering(&scene, 4.0));
    relay.wait_for_answers(ANSWERS_TO_ALL);
    peer.process.signal(Signal::STOP);
    running.finish().expect_code(0);

    let stats = Stats::read(&outputs(&scene).1);
    for (id, tag) in stats.tags() {
        let age = tag.age.expect("a value came");
        assert!(age > 1.0, "{id}: the server answered {age} s before the end");
        let (quality, reason) =
            if id == "T1.U12" { ("good", None) } else { ("bad", Some("stale")) };
        assert_eq!((tag.quality.as_str(), tag.reason.as_deref()), (quality, reason), "{id}");
        assert!(!tag.value.is_null(), "{id}: the last value stays");
    }
}

/// Asserts that a label's value stands on hatched ground, where before it stood on paper.
#[track_caller]
fn assert_hatched(good: &RgbImage, bad: &RgbImage, region: Region) {
    let [before, after] = [good, bad].map(|picture| hatched_pixels(picture, region));
    assert!(after > before + MIN_HATCHED_PIXELS, "hatching: {before}, then {after} pixels");
}
