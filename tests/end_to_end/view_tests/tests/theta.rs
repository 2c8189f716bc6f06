//! Theta by the distance of the camera: a walk along a row of breakers and back, in one view, and
//! the same through the command line.

use std::path::Path;
use std::time::{Duration, Instant};

use busbar_scene_loader::LoadedScene;
use busbar_viewer::{Picture, RendererOptions, Viewer};
use e2e::{Scene, Stats, busbar, finish};
use serde_json::{Value, json};

const SIZE: [u32; 2] = [320, 180];
/// Positions of the breakers along x, metres; the last has a theta of its own.
const PLACES: [f32; 4] = [0.0, 50.0, 200.0, 210.0];
const OWN_THETA: f64 = 0.3;
/// Distances beyond which these thetas hold.
const LEVELS: [(f32, f64); 3] = [(0.0, 0.0), (30.0, 0.5), (100.0, 0.85)];
/// Eyes of a walk along the row, where no distance is within the hysteresis.
const WALK: [f32; 7] = [-60.0, -5.0, 15.0, 58.0, 85.0, 165.0, 320.0];
/// Longest time of mesh resolution beside the frames, loaded machines included.
const MAX_WAIT: Duration = Duration::from_secs(30);

fn policy() -> Value {
    let level = |(beyond, theta): (f32, f64)| json!({ "beyond": beyond, "theta": theta });
    json!({ "distance": LEVELS.map(level), "hysteresis": 0.1 })
}

/// Returns a row of breakers along x.
fn row() -> Scene {
    let mut scene = Scene::without_tags();
    let mut breaker = scene.config["models"]["breaker"].take();
    breaker["theta"] = policy();
    scene.config["models"] = json!({ "breaker": breaker });
    let place = |x: f32| json!({ "translation": [x, 0, 0] });
    let copy = |i: usize| json!({ "id": format!("=Q{i}"), "transform": place(PLACES[i]) });
    let mut node = copy(0);
    node["model"] = "breaker".into();
    let mut own = copy(3);
    own["theta"] = OWN_THETA.into();
    node["instances"] = json!([copy(1), copy(2), own]);
    scene.config["scene"] = json!([node]);
    scene.config["graphics"] = json!({ "samples": 1 });
    scene.config["window"] = json!({ "size": SIZE });
    scene
}

/// View without a window.
struct View {
    viewer: Viewer,
    frames: u32,
}

/// Triangles and picture of one frame.
#[derive(Debug, PartialEq)]
struct FrameResult {
    triangles: u64,
    picture: Picture,
}

impl View {
    fn open(config: &Path) -> Self {
        let scene = LoadedScene::load(config, &|_, _, _| {}).expect("the scene loads");
        let options = RendererOptions { samples: 1, validation: true, ..Default::default() };
        let viewer = Viewer::new_headless(scene, options, SIZE).expect("there is a device");
        Self { viewer, frames: 0 }
    }

    fn draw(&mut self) -> FrameResult {
        self.frames += 1;
        let input = self.viewer.headless_input(f64::from(self.frames) / 60.0);
        self.viewer.frame(input).expect("a frame is drawn");
        let picture = self.viewer.read_picture().expect("the picture is there");
        FrameResult { triangles: self.viewer.stats().triangles, picture }
    }

    fn go_to(&mut self, x: f32) {
        self.viewer.look_from([x, 6.0, 14.0], [100.0, 2.0, 0.0]);
    }

    /// Draws from this far along the row.
    fn at(&mut self, x: f32) -> FrameResult {
        self.go_to(x);
        self.draw()
    }

    /// Returns the triangles of one breaker at a theta.
    fn triangles_of_one(&mut self, theta: f64) -> u64 {
        self.viewer.set_theta(theta);
        let triangles = self.draw().triangles;
        self.viewer.use_policies();
        assert_eq!(triangles % PLACES.len() as u64, 0);
        triangles / PLACES.len() as u64
    }
}

impl Drop for View {
    fn drop(&mut self) {
        if !std::thread::panicking() {
            assert_eq!(self.viewer.stats().validation_messages, Vec::<String>::new());
        }
    }
}

/// Returns the thetas of the row seen from x; the eye is some 15 m beside it.
fn expected_thetas(x: f32) -> [f64; 4] {
    let mut thetas = PLACES.map(|place| {
        let distance = (place - x).abs();
        LEVELS.iter().rfind(|(beyond, _)| distance >= *beyond).expect("a level").1
    });
    thetas[3] = OWN_THETA;
    thetas
}

/// Returns the share of pixels of which some channel differs by more than a fourth of its range.
fn differing(a: &Picture, b: &Picture) -> f64 {
    let pixels = a.rgba8.chunks_exact(4).zip(b.rgba8.chunks_exact(4));
    let differs = |(a, b): &(&[u8], &[u8])| a.iter().zip(*b).any(|(a, b)| a.abs_diff(*b) > 64);
    pixels.filter(differs).count() as f64 / (a.rgba8.len() / 4) as f64
}

#[test]
fn an_error_within_half_a_pixel_saves_triangles_and_is_hardly_seen() {
    let mut scene = row();
    scene.config["models"]["breaker"]["theta"] = json!({ "max_error_px": 0.5 });
    let mut view = View::open(&scene.write());
    let full = {
        view.viewer.set_theta(0.0);
        WALK.map(|x| view.at(x))
    };
    view.viewer.use_policies();
    let there = WALK.map(|x| view.at(x));
    for ((x, full), shown) in WALK.into_iter().zip(&full).zip(&there) {
        let share = shown.triangles as f64 / full.triangles as f64;
        let differing = differing(&full.picture, &shown.picture);
        println!("at {x}: {:.1} % of triangles, {:.3} % of pixels", share * 1e2, differing * 1e2);
        assert!(share < 0.75, "{share} at {x}");
        assert!(differing < 0.002, "{differing} at {x}");
    }
    // But of the one with a theta of its own.
    assert!(view.at(1e5).triangles < full[0].triangles / 5, "far away hardly anything is left");
    assert_eq!(view.at(WALK[0]), there[0], "and all of it returns");
}

#[test]
fn detail_goes_and_returns_along_a_walk() {
    let scene = row();
    let mut view = View::open(&scene.write());
    let one: Vec<(f64, u64)> = [0.0, 0.3, 0.5, 0.85]
        .into_iter()
        .map(|theta| (theta, view.triangles_of_one(theta)))
        .collect();
    assert!(one.windows(2).all(|pair| pair[0].1 > pair[1].1), "{one:?}");
    let of = |theta: f64| one.iter().find(|(t, _)| *t == theta).expect("it was drawn").1;
    let mut way_out = Vec::new();
    for x in WALK {
        let shown = view.at(x);
        let thetas = expected_thetas(x);
        let expected: u64 = thetas.iter().map(|&theta| of(theta)).sum();
        assert_eq!(shown.triangles, expected, "at {x} m: {thetas:?}");
        let stats = view.viewer.stats();
        let [least, greatest] = stats.theta_span["breaker"];
        assert_eq!(least, thetas.into_iter().fold(1.0, f64::min), "at {x} m");
        assert_eq!(greatest, thetas.into_iter().fold(0.0, f64::max), "at {x} m");
        assert_eq!((stats.theta["breaker"], stats.waiting), (greatest, 0));
        way_out.push((x, shown));
    }
    let counts: Vec<u64> = way_out.iter().map(|(_, shown)| shown.triangles).collect();
    assert!(counts.windows(2).any(|pair| pair[0] < pair[1]), "walked towards some: {counts:?}");
    assert!(counts.windows(2).any(|pair| pair[0] > pair[1]), "and from others: {counts:?}");
    for (x, shown) in way_out.into_iter().rev() {
        assert!(view.at(x) == shown, "at {x} m on the way back");
    }
}

#[test]
fn between_leaving_and_returning_the_past_decides() {
    let scene = row();
    let mut view = View::open(&scene.write());
    // 28 m from the second: nearer than it left, not near enough to return.
    let (near, between, far) = (55.0, 76.4, 88.0);
    view.at(near);
    let coming_from_near = view.at(between).triangles;
    view.at(far);
    let coming_from_far = view.at(between).triangles;
    assert!(coming_from_far < coming_from_near, "{coming_from_far} {coming_from_near}");
    assert_eq!(view.at(between).triangles, coming_from_far, "and stays so");
}

#[test]
fn a_scale_of_zero_shows_full_detail() {
    let mut scene = row();
    let mut view = View::open(&scene.write());
    let scaled_by_one = view.at(0.0);
    view.viewer.set_theta_scale(0.0);
    let full = view.at(0.0);
    assert_eq!(full.triangles, view.viewer.stats().triangles_full);
    assert!(scaled_by_one.triangles < full.triangles);
    view.viewer.set_theta_scale(1.5);
    assert!(view.at(0.0).triangles < scaled_by_one.triangles);
    view.viewer.set_theta_scale(1.0);
    assert!(view.at(0.0) == scaled_by_one, "nothing is lost");

    scene.config["graphics"]["theta_scale"] = 0.into();
    let mut view = View::open(&scene.write());
    assert!(view.at(0.0) == full, "configured");
}

#[test]
fn a_frame_that_does_not_wait_ends_at_the_same_picture() {
    let scene = row();
    let mut view = View::open(&scene.write());
    let settled = WALK.map(|x| view.at(x));
    drop(view);
    let mut view = View::open(&scene.write());
    view.viewer.set_settles(false);
    view.viewer.set_morph_seconds(0.0);
    let first = view.at(WALK[0]);
    assert!(first == settled[0], "there is nothing to show before");
    let mut frames_waited = 0;
    for (x, settled) in WALK.into_iter().zip(&settled) {
        let start = Instant::now();
        let mut shown = view.at(x);
        while view.viewer.stats().waiting > 0 {
            assert!(shown.triangles != settled.triangles, "drawn with what is there");
            assert!(start.elapsed() < MAX_WAIT, "{:#?}", view.viewer.stats());
            frames_waited += 1;
            shown = view.draw();
        }
        assert!(shown == *settled, "at {x} m");
    }
    // What is not on the device when the eye moves cannot be in that frame.
    assert!(frames_waited > 0);
}

#[test]
fn the_program_follows_the_configuration() {
    let mut scene = row();
    scene.config["cameras"] = json!({ "near": { "eye": [0, 6, 14], "target": [100, 2, 0] } });
    scene.config["camera"]["start"] = "near".into();
    let render = |more: &[&str]| {
        let mut command = busbar();
        command.arg("render").arg(scene.write()).arg("--out").arg(scene.path("picture.png"));
        command.arg("--stats").arg(scene.path("stats.json")).args(more);
        finish(&mut command).expect_code(0);
        Stats::read(&scene.path("stats.json"))
    };
    let stats = render(&[]);
    assert_eq!(stats.0["theta_span"]["breaker"], json!([0.0, 0.85]));
    assert_eq!(stats.count("waiting"), 0);
    assert!(stats.count("triangles") < stats.count("triangles_full"));
    let stats = render(&["--theta", "0"]);
    assert_eq!(stats.0["theta_span"]["breaker"], json!([0.0, 0.0]));
    assert_eq!(stats.count("triangles"), stats.count("triangles_full"));
}
