//! The window under a display in memory, with a hand on the mouse.
//!
//! The program tells its state when it ends, so each test repeats its gestures
//! until then: none depends on how fast the machine is.

use e2e::display::{Display, LEFT_BUTTON, RIGHT_BUTTON, WHEEL_UP};
use e2e::glb::{self, WeldedMesh};
use e2e::window::Window;
use e2e::{Process, Scene, Stats};
use serde_json::json;

const SCREEN: [u32; 2] = [1024, 640];
const WINDOW: [i32; 2] = [800, 500];
/// Middle of the scene: right of the panels, above the status bar.
const MIDDLE: [i32; 2] = [600, 240];
/// Position of the tab with the models.
const DISPLAY_TAB: [i32; 2] = [151, 14];
/// Left end of the first model's slider; further points follow.
const SLIDER_LEFT: [i32; 2] = [52, 189];
const SLIDER_MIDDLE: [i32; 2] = [136, 189];
const SLIDER_QUARTER: [i32; 2] = [94, 189];
/// Least number of frames under validation without a single message.
const MIN_FRAMES: u64 = 200;

/// Returns a scene of one breaker pole, framed by the camera.
fn scene() -> Scene {
    let mut scene = Scene::without_tags();
    let config = &mut scene.config;
    config["scene"] = json!([{"id": "=Q1", "model": "breaker"}]);
    let breaker = config["models"]["breaker"].take();
    config["models"] = json!({ "breaker": breaker });
    config["graphics"] = json!({ "samples": 1 });
    config["camera"] = json!({});
    config["window"] = json!({ "size": WINDOW });
    scene
}

/// Opens the window, and makes gestures on it until it closes.
fn view(scene: Scene, seconds: u32, hands: impl FnOnce(&Display, &Process)) -> Option<Stats> {
    let window = Window::open(scene, Display::start(SCREEN)?, seconds);
    hands(&window.display, &window.process);
    Some(window.close())
}

#[test]
fn the_theta_slider_takes_triangles_away() {
    let scene = scene();
    let stats = view(scene, 5, |display, process| {
        display.click_button(LEFT_BUTTON, DISPLAY_TAB);
        display.drag(LEFT_BUTTON, SLIDER_LEFT, SLIDER_MIDDLE);
        while !process.is_over() {
            display.drag(LEFT_BUTTON, SLIDER_MIDDLE, SLIDER_QUARTER);
            display.drag(LEFT_BUTTON, SLIDER_QUARTER, SLIDER_MIDDLE);
        }
    });
    let Some(stats) = stats else { return };
    let theta = stats.0["theta"]["breaker"].as_f64().expect("the breaker has a theta");
    assert!((0.15..0.6).contains(&theta), "theta {theta}");
    let [live, full] = ["triangles", "triangles_full"].map(|name| stats.count(name));
    assert!(live > 0 && live < full, "{live} of {full} triangles");
}

/// Returns a scene of a flat slab, framed: seen from the side it is low and wide.
fn slab_scene() -> Scene {
    let mut scene = scene();
    scene.config["scene"] = json!([{"id": "=Q2", "model": "slab"}]);
    scene.config["models"] = json!({"slab": {"file": "slab.glb"}});
    let corner = |i: usize| [(i & 1, 8.0), (i >> 1 & 1, 0.4), (i >> 2, 8.0)];
    let positions = (0..8).map(|i| corner(i).map(|(side, length)| side as f32 * length));
    // Each side as its first corner and the two beside it; the fourth follows.
    let sides = [[0, 2, 1], [4, 5, 6], [0, 1, 4], [2, 6, 3], [0, 4, 2], [1, 3, 5]];
    let triangles = sides.into_iter().flat_map(|[a, b, c]| [[a, b, c], [b, b + c - a, c]]);
    let slab = WeldedMesh { positions: positions.collect(), triangles: triangles.collect() };
    std::fs::write(scene.path("slab.glb"), glb::write(&slab)).expect("the folder can be written");
    scene
}

#[test]
fn gestures_pick_and_move() {
    // Places where the slab is not, before it is moved there.
    let [x, y] = MIDDLE;
    let (above, right, below) = ([x, y - 65], [x + 130, y + 5], [x + 100, y + 70]);
    type Gesture<'a> = &'a dyn Fn(&Display);
    let none: Gesture<'_> = &|_| {};
    let turn_up: Gesture<'_> =
        &|display| (0..2).for_each(|_| display.drag(LEFT_BUTTON, [x, 60], [x, 440]));
    let move_right: Gesture<'_> = &|display| display.drag(RIGHT_BUTTON, MIDDLE, [x + 100, y]);
    let come_closer: Gesture<'_> =
        &|display| (0..4).for_each(|_| display.click_button(WHEEL_UP, MIDDLE));
    let cases = [
        ("a click", none, MIDDLE, true),
        ("a click above", none, above, false),
        ("a turn to the view from above", turn_up, above, true),
        ("a click to the right", none, right, false),
        ("a move to the right", move_right, right, true),
        ("a click below", none, below, false),
        ("the wheel", come_closer, below, true),
    ];
    for (name, gesture, place, expected) in cases {
        let scene = slab_scene();
        let stats = view(scene, 3, |display, process| {
            gesture(display);
            while !process.is_over() {
                display.click_button(LEFT_BUTTON, place);
                // Not so soon again as to make it a double click.
                display.xdotool("sleep 0.6");
            }
        });
        let Some(stats) = stats else { return };
        let picked = stats.0["picked"].as_str();
        assert_eq!(picked, expected.then_some("=Q2/mesh"), "{name}");
    }
}

#[test]
fn two_hundred_frames_with_resizes_are_silent() {
    let scene = scene();
    let sizes = [
        [640, 400],
        [801, 333],
        [333, 601],
        [1024, 640],
        [64, 64],
        [500, 30],
        [420, 500],
        [799, 499],
        [1000, 200],
        [800, 500],
    ];
    let stats = view(scene, 20, |display, process| {
        let window = display.xdotool("search --name Busbar").stdout;
        let window = window.trim();
        for [width, height] in sizes {
            display.xdotool(&format!("windowsize --sync {window} {width} {height}"));
            display.drag(LEFT_BUTTON, [MIDDLE[0], 100], [MIDDLE[0] + 100, 180]);
        }
        while !process.is_over() {
            display.drag(LEFT_BUTTON, MIDDLE, [MIDDLE[0] + 100, MIDDLE[1] + 50]);
            display.xdotool(&format!("click {WHEEL_UP} click --delay 20 5"));
        }
    });
    let Some(stats) = stats else { return };
    let frames = stats.count("frames");
    assert!(frames >= MIN_FRAMES, "{frames} frames");
}
