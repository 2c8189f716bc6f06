//! Operator input on a view without a window: clicks, rectangles, distances, labels and cameras,
//! against known ids and geometry.

use std::collections::BTreeSet;
use std::path::Path;
use std::time::{Duration, Instant};

use busbar_scene_loader::LoadedScene;
use busbar_viewer::{RendererOptions, Stats, Viewer};
use e2e::Scene;
use e2e::glb::{self, WeldedMesh};
use egui::{Event, Key, Modifiers, PointerButton, Pos2, Rect, pos2, vec2};
use glam::{DVec3, dvec3};
use serde_json::json;

const SIZE: [u32; 2] = [480, 270];
/// Greatest number of frames until an answer.
const MAX_FRAMES: usize = 40;
/// Longest time until the device tells which labels are hidden.
const ANSWER_TIMEOUT: Duration = Duration::from_secs(20);
/// Seconds between frames; clicks in different ones make no double click.
const FRAME_SECONDS: f64 = 0.5;

struct View {
    viewer: Viewer,
    seconds: f64,
    modifiers: Modifiers,
}

impl View {
    fn open(config: &Path) -> Self {
        let scene = LoadedScene::load(config, &|_, _, _| {}).expect("the scene loads");
        let options = RendererOptions { samples: 1, validation: true, ..Default::default() };
        let viewer = Viewer::new_headless(scene, options, SIZE).expect("there is a device");
        Self { viewer, seconds: 0.0, modifiers: Modifiers::NONE }
    }

    fn frame(&mut self, events: Vec<Event>) {
        self.seconds += FRAME_SECONDS;
        let mut input = self.viewer.headless_input(self.seconds);
        input.events = events;
        self.viewer.frame(input).expect("a frame is drawn");
    }

    /// Presses or releases modifiers.
    fn hold(&mut self, modifiers: Modifiers) {
        self.modifiers = modifiers;
        self.frame(vec![Event::ModifiersChanged(modifiers)]);
    }

    fn button(&self, pos: Pos2, pressed: bool) -> Event {
        let modifiers = self.modifiers;
        Event::PointerButton { pos, button: PointerButton::Primary, pressed, modifiers }
    }

    /// Clicks in one frame; the answer comes in a later one.
    fn click(&mut self, pos: Pos2) {
        self.frame(vec![Event::PointerMoved(pos)]);
        self.frame(vec![self.button(pos, true), self.button(pos, false)]);
    }

    fn drag(&mut self, from: Pos2, to: Pos2) {
        self.frame(vec![Event::PointerMoved(from)]);
        self.frame(vec![self.button(from, true)]);
        self.frame(vec![Event::PointerMoved(from.lerp(to, 0.5))]);
        self.frame(vec![Event::PointerMoved(to)]);
        self.frame(vec![self.button(to, false)]);
    }

    fn key(&mut self, key: Key) {
        for pressed in [true, false] {
            let modifiers = self.modifiers;
            let physical_key = None;
            let event = Event::Key { key, physical_key, pressed, repeat: false, modifiers };
            self.frame(vec![event]);
        }
    }

    /// Draws until a condition holds.
    fn until(&mut self, what: &str, holds: impl Fn(&Stats) -> bool) -> Stats {
        for _ in 0..MAX_FRAMES {
            let stats = self.viewer.stats();
            if holds(&stats) {
                assert_eq!(stats.validation_messages, Vec::<String>::new());
                return stats;
            }
            self.frame(Vec::new());
        }
        let stats = self.viewer.stats();
        panic!("no {what}: {:?} {:?} {:?}", stats.selected, stats.hovered, stats.measured)
    }

    fn rest(&mut self) {
        (0..4).for_each(|_| self.frame(Vec::new()));
    }
}

fn demo() -> Scene {
    let mut scene = Scene::without_tags();
    scene.config["graphics"] = json!({ "samples": 1 });
    scene.config["window"] = json!({ "size": SIZE });
    scene.config["camera"] = json!({ "start": "bay" });
    scene
}

/// Returns pixels spread over the picture.
fn pixels() -> Vec<[u32; 2]> {
    (0..6).flat_map(|y| (0..8).map(move |x| [30 + x * 60, 20 + y * 45])).collect()
}

fn middle([x, y]: [u32; 2]) -> Pos2 {
    pos2(x as f32 + 0.5, y as f32 + 0.5)
}

#[test]
fn a_click_names_what_a_pick_that_waits_names_at_any_theta() {
    let scene = demo();
    let mut view = View::open(&scene.write());
    let mut named = 0;
    for theta in [0.0, 0.8] {
        view.viewer.set_theta(theta);
        view.rest();
        let pixels: Vec<[u32; 2]> = pixels().into_iter().step_by(3).collect();
        let expected = view.viewer.pick_many(&pixels).expect("ids are drawn");
        for (pixel, expected) in pixels.into_iter().zip(expected) {
            view.click(middle(pixel));
            view.rest();
            let picked = view.viewer.stats().picked;
            assert_eq!(picked, expected, "at {pixel:?}, theta {theta}");
            assert_eq!(view.viewer.hovered(), expected, "the pointer is there");
            named += usize::from(picked.is_some());
        }
    }
    assert!(named > 10, "{named} of them named something");
}

#[test]
fn a_click_is_about_the_picture_that_was_on_the_screen() {
    let scene = demo();
    let mut view = View::open(&scene.write());
    view.rest();
    let candidates = pixels();
    let ids = view.viewer.pick_many(&candidates).expect("ids are drawn");
    let (pixel, expected) = candidates
        .into_iter()
        .zip(ids)
        .find(|(_, id)| id.is_some())
        .expect("something is in the picture");
    view.frame(vec![Event::PointerMoved(middle(pixel))]);
    // The camera turns away in the very frame that brings the click.
    view.viewer.look_from([0.0, 500.0, 0.0], [0.0, 900.0, 1.0]);
    let at = middle(pixel);
    view.frame(vec![view.button(at, true), view.button(at, false)]);
    view.rest();
    assert_eq!(view.viewer.stats().picked, expected);
}

#[test]
fn a_rectangle_selects_all_that_shows_in_it_and_escape_clears_it() {
    let scene = demo();
    let mut view = View::open(&scene.write());
    view.rest();
    let area = Rect::from_min_max(pos2(90.0, 60.0), pos2(300.0, 200.0));
    let inside: Vec<[u32; 2]> = (60..200).flat_map(|y| (90..300).map(move |x| [x, y])).collect();
    let ids = view.viewer.pick_many(&inside).expect("ids are drawn");
    let expected: BTreeSet<String> = ids.into_iter().flatten().collect();
    assert!(expected.len() > 2, "{expected:?}");
    view.hold(Modifiers::COMMAND | Modifiers::CTRL);
    view.drag(area.min, area.max);
    view.hold(Modifiers::NONE);
    let stats = view.until("selection", |stats| !stats.selected.is_empty());
    assert_eq!(stats.selected.into_iter().collect::<BTreeSet<_>>(), expected);
    assert_eq!(stats.picked, None, "no single one");
    view.key(Key::Escape);
    assert!(view.viewer.stats().selected.is_empty());
}

/// Returns a scene of two slabs of known size, the second 2.5 m higher, at some theta far from 0.
fn slabs(camera: serde_json::Value) -> Scene {
    let mut scene = demo();
    let corner = |i: usize| [(i & 1, 8.0), (i >> 1 & 1, 0.4), (i >> 2, 8.0)];
    let positions = (0..8).map(|i| corner(i).map(|(side, length)| side as f32 * length));
    let sides = [[0, 2, 1], [4, 5, 6], [0, 1, 4], [2, 6, 3], [0, 4, 2], [1, 3, 5]];
    let triangles = sides.into_iter().flat_map(|[a, b, c]| [[a, b, c], [b, b + c - a, c]]);
    let slab = WeldedMesh { positions: positions.collect(), triangles: triangles.collect() };
    std::fs::write(scene.path("slab.glb"), glb::write(&slab)).expect("the folder can be written");
    scene.config["models"] = json!({"slab": {"file": "slab.glb"}});
    let at = |x: f32, y: f32| json!({"translation": [x, y, 100]});
    scene.config["scene"] = json!([
        {"id": "low", "model": "slab", "transform": at(100.0, 0.0)},
        {"id": "high", "model": "slab", "transform": at(112.0, 2.5)},
    ]);
    scene.config["cameras"] = json!({ "here": camera });
    scene.config["camera"]["start"] = json!("here");
    scene
}

/// Heights of the slabs' tops, metres.
const TOPS: [f64; 2] = [0.4, 2.9];
/// Greatest error of a measured distance, metres.
const MAX_ERROR: f64 = 1e-3;

fn measure(view: &mut View, at: [Pos2; 2]) -> [DVec3; 2] {
    view.rest();
    view.key(Key::M);
    at.into_iter().for_each(|at| view.click(at));
    let stats = view.until("distance", |stats| stats.measured.len() == 2);
    let points = [stats.measured[0], stats.measured[1]].map(DVec3::from);
    view.key(Key::Escape);
    assert!(view.viewer.stats().measured.is_empty());
    points
}

#[test]
fn distances_on_a_plan_are_those_of_the_geometry() {
    // 480 x 270 pixels of 0.1 m.
    let scene = slabs(json!({"eye": [110, 60, 104.001], "target": [110, 0, 104],
        "projection": "orthographic", "height": 27}));
    let mut view = View::open(&scene.write());
    view.key(Key::F5);
    let pixels = [[180, 120], [300, 150]];
    // Straight down: F5 frames both slabs, 20 m wide, and 480 pixels are 16:9.
    let stats = view.viewer.stats();
    assert!(stats.camera.orthographic && stats.camera.direction[1] < -0.9999);
    let points = measure(&mut view, pixels.map(middle));
    for (point, top) in points.iter().zip(TOPS) {
        assert!((point.y - top).abs() < MAX_ERROR, "{point}");
    }
    let [dx, dz] = [points[1].x - points[0].x, points[1].z - points[0].z];
    // What both pixels are apart, in one scale for both axes.
    let metres_per_pixel = dx / 120.0;
    assert!((dz - 30.0 * metres_per_pixel).abs() < MAX_ERROR, "{dx} {dz}");
    assert!((0.03..0.2).contains(&metres_per_pixel), "{metres_per_pixel}");
}

#[test]
fn distances_in_perspective_are_those_of_the_geometry() {
    let (eye, target, fov) = (dvec3(104.0, 14.0, 130.0), dvec3(110.0, 1.0, 104.0), 40.0_f64);
    let scene = slabs(json!({"eye": eye.to_array(), "target": target.to_array(),
        "fov_degrees": fov}));
    let mut view = View::open(&scene.write());
    let forward = (target - eye).normalize();
    let right = forward.cross(DVec3::Y).normalize();
    let up = right.cross(forward);
    let tan = (fov.to_radians() / 2.0).tan();
    let pixels = [[150, 150], [300, 120]];
    // Where lines of sight meet the planes of the slabs' tops.
    let expected: Vec<DVec3> = pixels
        .iter()
        .zip(TOPS)
        .map(|([x, y], top)| {
            let [x, y] = [(f64::from(*x) + 0.5) / 240.0 - 1.0, 1.0 - (f64::from(*y) + 0.5) / 135.0];
            let ray = forward + right * (x * tan * 480.0 / 270.0) + up * (y * tan);
            eye + ray * ((top - eye.y) / ray.y)
        })
        .collect();
    let points = measure(&mut view, pixels.map(middle));
    for (point, expected) in points.iter().zip(&expected) {
        assert!(point.distance(*expected) < MAX_ERROR, "{point} is not {expected}");
    }
    let [measured, known] = [points[0].distance(points[1]), expected[0].distance(expected[1])];
    assert!((measured - known).abs() < MAX_ERROR, "{measured} m, not {known} m");
}

#[test]
fn keys_walk_store_and_go_back() {
    let scene = demo();
    let mut view = View::open(&scene.write());
    view.rest();
    let start = view.viewer.stats().camera;
    view.hold(Modifiers::COMMAND | Modifiers::CTRL);
    view.key(Key::Num7);
    view.hold(Modifiers::NONE);
    view.key(Key::C);
    let on_foot = view.viewer.stats().camera;
    assert_eq!(on_foot.mode, "walk");
    assert!(on_foot.eye[1] < start.eye[1]);
    let event = |pressed| Event::Key {
        key: Key::W,
        physical_key: None,
        pressed,
        repeat: false,
        modifiers: Modifiers::NONE,
    };
    view.frame(vec![event(true)]);
    view.rest();
    view.frame(vec![event(false)]);
    let ahead = view.viewer.stats().camera;
    let way = [0, 1, 2].map(|axis| (ahead.eye[axis] - on_foot.eye[axis]) as f32);
    assert!(way[1].abs() < 1e-4 && vec2(way[0], way[2]).length() > 0.5, "{way:?}");
    view.key(Key::Num7);
    let back = view.viewer.stats().camera;
    let apart: f64 = (0..3).map(|axis| (back.eye[axis] - start.eye[axis]).abs()).sum();
    assert!(apart < 1e-3, "{apart} m off the stored view");
    view.key(Key::O);
    assert!(view.viewer.stats().camera.orthographic);
}

#[test]
fn labels_know_what_stands_before_their_equipment() {
    // Nobody answers there: labels say so, and stand where they would.
    let mut scene = Scene::demo(1);
    scene.config["camera"] = json!({});
    scene.config["graphics"] = json!({ "samples": 1 });
    scene.config["window"] = json!({ "size": SIZE });
    let mut view = View::open(&scene.write());
    // As in a window: pictures without one show all labels alike.
    view.viewer.set_settles(false);
    let breaker = "=S12D1Q1-QA1-L2/interrupter";
    // The transformer lies between the first eye and the breakers, not before the second.
    for (eye, is_hidden) in [([0.0, 2.0, 14.0], true), ([0.0, 2.0, -40.0], false)] {
        view.viewer.look_from(eye, [0.0, 2.5, -13.0]);
        // The device answers in its own time; frames that show the same do not wait for it.
        let deadline = Instant::now() + ANSWER_TIMEOUT;
        let stats = loop {
            (0..MAX_FRAMES).for_each(|_| view.frame(Vec::new()));
            let stats = view.viewer.stats();
            let knows = stats.hidden_labels.iter().any(|id| id == breaker) == is_hidden;
            if knows || Instant::now() > deadline {
                break stats;
            }
        };
        let hidden = stats.hidden_labels;
        assert_eq!(hidden.iter().any(|id| id == breaker), is_hidden, "{eye:?}: {hidden:?}");
        assert_eq!(stats.validation_messages, Vec::<String>::new());
    }
}
