//! Switch positions of a real server move a blade: it is seen, picked and outlined at its place. An
//! unknown position is shown neither open nor closed.

use std::time::{Duration, Instant};

use busbar_geometry::{RawPrimitive, weld};
use busbar_gltf_export::write_glb;
use busbar_scene::{Material, Model, ModelNode};
use busbar_scene_loader::LoadedScene;
use busbar_viewer::{Picture, RendererOptions, Viewer};
use e2e::Scene;
use e2e::peer::Peer;
use glam::{DMat4, Vec3};
use serde_json::{Value, json};

/// Size of the picture, wide enough for the field of view to be that of its height.
const SIZE: [u32; 2] = [480, 270];
const SWITCH: &str = "=Q1-QB9";
const BLADE: &str = "=Q1-QB9/blade";
/// Bits of a double-point, first and second as they lie in the table.
const OPEN: [u16; 2] = [1, 0];
const CLOSED: [u16; 2] = [0, 1];
const TRAVELLING: [u16; 2] = [0, 0];
const CONTRADICTION: [u16; 2] = [1, 1];
const PATIENCE: Duration = Duration::from_secs(10);
/// Length of the blade, along x from its hinge at the origin of the model's node, metres.
const LENGTH: f32 = 2.0;
const HALF: f32 = 0.1;
/// Hinge of the blade, in metres; a fixed pedestal stands there.
const HINGE: Vec3 = Vec3::new(-0.5, 1.0, 0.0);

/// Builds a box from one corner to the other.
fn cuboid(least: Vec3, most: Vec3) -> busbar_geometry::Mesh {
    let corner = |index: u32| {
        let part = |axis: u32| if index >> axis & 1 == 1 { most } else { least }[axis as usize];
        Vec3::new(part(0), part(1), part(2))
    };
    let quads =
        [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    let mut primitive = RawPrimitive { material: Some(0), ..RawPrimitive::default() };
    for quad in quads {
        let corners = quad.map(corner);
        let normal = (corners[1] - corners[0]).cross(corners[3] - corners[0]).normalize();
        let first = primitive.positions.len() as u32;
        primitive.positions.extend(corners);
        primitive.normals.extend([normal; 4]);
        primitive.triangles.extend([[first, first + 1, first + 2], [first, first + 2, first + 3]]);
    }
    weld(&[primitive]).expect("it is sound").0
}

/// Builds a pedestal, and a blade that is modelled closed.
fn model() -> Model {
    let node = |name: &str, mesh, place: Vec3| ModelNode {
        name: name.into(),
        parent: None,
        parent_from_node: DMat4::from_translation(place.as_dvec3()),
        mesh: Some(mesh),
    };
    Model {
        meshes: vec![
            cuboid(Vec3::new(-0.6, 0.0, -0.1), Vec3::new(-0.4, 0.8, 0.1)),
            cuboid(Vec3::new(0.0, -HALF, -HALF), Vec3::new(LENGTH, HALF, HALF)),
        ],
        materials: vec![Material { base_color: [0.6, 0.6, 0.6, 1.0], ..Material::default() }],
        nodes: vec![node("pedestal", 0, Vec3::ZERO), node("blade", 1, HINGE)],
        ..Model::default()
    }
}

fn scene(port: u16) -> Scene {
    let mut scene = Scene::demo(port);
    let file = write_glb(&model()).expect("it can be written");
    std::fs::write(scene.path("switch.glb"), file).expect("it can be written");
    let config = &mut scene.config;
    config["models"] = json!({ "switch": {
        "file": "switch.glb",
        "moving_parts": [
            { "part": "blade", "mechanism": "blade", "axis": [0, 0, 1], "degrees": 90 },
        ],
    }});
    config["scene"] = json!([{ "id": SWITCH, "model": "switch" }]);
    for gone in ["equipment", "alarms", "chart", "templates"] {
        config.as_object_mut().expect("an object").remove(gone);
    }
    config["plugins"]["positions"] = json!({ "plugin": "switch_position", "settings": {
        "switches": [{ "equipment": SWITCH, "mechanism": "blade" }],
    }});
    config["plugins"].as_object_mut().expect("an object").remove("values");
    config["tags"] = json!({ "QB9": {
        "type": "double_point",
        "freshness_seconds": 1.5,
        "source": { "instance": "bay", "address": { "table": "discrete", "register": 0 } },
    }});
    config["bindings"] = json!([{ "tag": "QB9", "node": SWITCH, "role": "position" }]);
    config["overlays"] = json!(["positions"]);
    config["cameras"] = json!({ "front": { "eye": [0.3, 1.6, 6.0], "target": [0.3, 1.6, 0.0], "fov_degrees": 45 } });
    config["graphics"] = json!({ "samples": 1 });
    config["window"] = json!({ "size": SIZE });
    config["camera"] = json!({ "start": "front" });
    scene
}

struct View {
    viewer: Viewer,
    start: Instant,
}

/// Angles at which the blade is looked for: closed, half-way, open.
const ANGLES: [f32; 3] = [0.0, 45.0, 90.0];

impl View {
    fn open(scene: &Scene) -> Self {
        let loaded = LoadedScene::load(&scene.write(), &|_, _, _| {});
        let loaded = loaded.unwrap_or_else(|fault| panic!("{fault}"));
        let options = RendererOptions { samples: 1, validation: true, ..Default::default() };
        let viewer = Viewer::new_headless(loaded, options, SIZE).expect("there is a device");
        Self { viewer, start: Instant::now() }
    }

    fn draw(&mut self) -> Picture {
        let input = self.viewer.headless_input(self.start.elapsed().as_secs_f64());
        self.viewer.frame(input).expect("a frame is drawn");
        self.viewer.read_picture().expect("the picture is there")
    }

    /// Computes the pixel of the blade's outer half at an angle, independently of the code that
    /// moves it.
    fn pixel_at(degrees: f32) -> [u32; 2] {
        let (sin, cos) = degrees.to_radians().sin_cos();
        let place = HINGE + Vec3::new(cos, sin, 0.0) * (0.8 * LENGTH) + Vec3::Z * HALF;
        // The camera's own numbers: 45 degrees of height by default, looking along -z.
        let eye = Vec3::new(0.3, 1.6, 6.0);
        let depth = eye.z - place.z;
        let focal = 0.5 * SIZE[1] as f32 / (FOV_DEGREES.to_radians() / 2.0).tan();
        let x = 0.5 * SIZE[0] as f32 + (place.x - eye.x) / depth * focal;
        let y = 0.5 * SIZE[1] as f32 - (place.y - eye.y) / depth * focal;
        [x.round() as u32, y.round() as u32]
    }

    /// Reports whether the blade is picked at 0, 45 and 90 degrees.
    fn seen_at(&mut self) -> [bool; 3] {
        self.draw();
        let pixels = ANGLES.map(Self::pixel_at);
        let ids = self.viewer.pick_many(&pixels).expect("ids are drawn");
        [0, 1, 2].map(|at| ids[at].as_deref() == Some(BLADE))
    }

    fn until(&mut self, what: &str, expected: [bool; 3]) {
        let start = Instant::now();
        loop {
            let seen = self.seen_at();
            if seen == expected {
                return;
            }
            assert!(start.elapsed() < PATIENCE, "not {what}: {seen:?}");
            std::thread::sleep(Duration::from_millis(20));
        }
    }

    /// Returns the variation of the blade's greys around its outer half, which stripes increase.
    fn spread_at(&mut self, degrees: f32) -> f64 {
        let picture = self.draw();
        let [x, y] = Self::pixel_at(degrees);
        let near = (y - 3..=y + 3).flat_map(|y| (x - 3..=x + 3).map(move |x| (x, y)));
        let greys: Vec<f64> = near
            .map(|(x, y)| {
                let at = ((y * picture.width + x) * 4) as usize;
                picture.rgba8[at..at + 3].iter().map(|&c| f64::from(c)).sum::<f64>() / 3.0
            })
            .collect();
        let mean = greys.iter().sum::<f64>() / greys.len() as f64;
        (greys.iter().map(|grey| (grey - mean).powi(2)).sum::<f64>() / greys.len() as f64).sqrt()
    }
}

const FOV_DEGREES: f32 = 45.0;
/// Least variation of grey of a hatched blade, of 255; the greatest of a plain one follows.
const HATCHED: f64 = 20.0;
const PLAIN: f64 = 8.0;

fn bits(position: [u16; 2]) -> Value {
    json!({ "discrete": { "0": position } })
}

#[test]
fn a_blade_stands_where_its_switch_does_and_is_picked_there() {
    let Some(mut peer) = Peer::start(&bits(CLOSED)) else { return };
    let mut view = View::open(&scene(peer.port));
    view.until("closed", [true, false, false]);
    assert!(view.spread_at(0.0) < PLAIN, "it is known");

    peer.set("discrete", 0, &OPEN);
    view.until("open", [false, false, true]);
    assert!(view.spread_at(90.0) < PLAIN, "it is known");
    assert_eq!(
        view.viewer.pick(View::pixel_at(90.0)).expect("it is drawn").as_deref(),
        Some(BLADE)
    );
    view.viewer.select_equipment("");

    // It takes no time here: half-way is all that is known.
    peer.set("discrete", 0, &TRAVELLING);
    view.until("on its way", [false, true, false]);
    assert!(view.spread_at(45.0) < PLAIN, "that it travels is known");

    peer.set("discrete", 0, &CONTRADICTION);
    let start = Instant::now();
    while view.spread_at(45.0) < HATCHED {
        assert!(start.elapsed() < PATIENCE, "a contradiction is hatched");
    }
    view.until("in the middle", [false, true, false]);

    peer.set("discrete", 0, &CLOSED);
    view.until("closed again", [true, false, false]);
    // The server is gone: it may be open or closed by now.
    drop(peer);
    view.until("unknown", [false, true, false]);
    assert!(view.spread_at(45.0) > HATCHED, "what is not known is hatched");
    assert_eq!(view.viewer.stats().validation_messages, Vec::<String>::new());
}

#[test]
fn a_part_that_is_not_there_is_told_with_those_that_are() {
    let mut scene = scene(1);
    scene.config["models"]["switch"]["moving_parts"][0]["part"] = json!("arm");
    let fault =
        LoadedScene::load(&scene.write(), &|_, _, _| {}).err().expect("a fault").to_string();
    for words in ["/models/switch/moving_parts/0/part", "no node 'arm'", "'pedestal', 'blade'"] {
        assert!(fault.contains(words), "{words} in {fault}");
    }
}
