//! Energisation by switches of a real server: live, dead, earthed and unknown equipment, judged by
//! the picture.

use std::time::{Duration, Instant};

use busbar_scene_loader::LoadedScene;
use busbar_viewer::{Picture, RendererOptions, Viewer};
use e2e::Scene;
use e2e::peer::Peer;
use serde_json::{Value, json};

const SIZE: [u32; 2] = [480, 270];
const BREAKER: &str = "=S12D1Q1-QA1-L1";
const DISCONNECTOR: &str = "=S12D1Q1-QB9-L1";
const TRANSFORMER: &str = "=S12D1T1-TA1";
/// Bits of a double-point, first and second as they lie in the table.
const OPEN: [u16; 2] = [1, 0];
const CLOSED: [u16; 2] = [0, 1];
const TRAVELLING: [u16; 2] = [0, 0];
/// Longest time until a change is in the picture.
const PATIENCE: Duration = Duration::from_secs(10);
/// Least visible change in a mean of a colour, of 255.
const SEEN: f64 = 6.0;

/// Returns a scene of one phase of a line that feeds a transformer through a disconnector and a
/// breaker.
fn scene(port: u16) -> Scene {
    let mut scene = Scene::demo(port);
    let position = |register: u32| {
        json!({
            "type": "double_point",
            "freshness_seconds": 1.5,
            "source": {
                "instance": "bay",
                "address": { "table": "discrete", "register": register },
            },
        })
    };
    let config = &mut scene.config;
    config["plugins"]["energised"] = json!({ "plugin": "energisation", "settings": {
        "levels": [{ "name": "220 kV", "color": "#2040ff" }],
        "nodes": [
            { "id": "line", "level": "220 kV" },
            { "id": "bay", "level": "220 kV" },
            { "id": "winding", "level": "220 kV", "equipment": [TRANSFORMER] },
        ],
        "branches": [
            { "equipment": DISCONNECTOR, "between": ["line", "bay"], "switch": true },
            { "equipment": BREAKER, "between": ["bay", "winding"], "switch": true },
        ],
        "sources": [{ "node": "line" }],
    }});
    config["tags"] = json!({ "QA1": position(0), "QB9": position(2) });
    let bound = |tag: &str, node: &str| json!({ "tag": tag, "node": node, "role": "position" });
    config["bindings"] = json!([bound("QA1", BREAKER), bound("QB9", DISCONNECTOR)]);
    config["overlays"] = json!(["energised"]);
    config["plugins"].as_object_mut().expect("an object").remove("values");
    config["graphics"] = json!({ "samples": 1 });
    config["window"] = json!({ "size": SIZE });
    config["camera"] = json!({ "start": "bay" });
    scene
}

struct View {
    viewer: Viewer,
    /// The pixels of each piece of equipment.
    shapes: Vec<Vec<usize>>,
    start: Instant,
}

/// Mean red, green and blue of a shape, and the spread of its grey.
#[derive(Clone, Copy, Debug)]
struct RegionColor {
    mean: [f64; 3],
    spread: f64,
}

impl RegionColor {
    fn differs(&self, other: &Self) -> bool {
        let mean = self.mean.iter().zip(other.mean).any(|(a, b)| (a - b).abs() > SEEN);
        mean || (self.spread - other.spread).abs() > SEEN
    }

    /// Returns the excess of blue over red.
    fn blue(&self) -> f64 {
        self.mean[2] - self.mean[0]
    }
}

impl View {
    fn open(scene: &Scene) -> Self {
        let loaded = LoadedScene::load(&scene.write(), &|_, _, _| {}).expect("it loads");
        let options = RendererOptions { samples: 1, validation: true, ..Default::default() };
        let viewer = Viewer::new_headless(loaded, options, SIZE).expect("there is a device");
        let mut view = Self { viewer, shapes: Vec::new(), start: Instant::now() };
        view.draw();
        let pixels: Vec<_> = (0..SIZE[1]).flat_map(|y| (0..SIZE[0]).map(move |x| [x, y])).collect();
        let ids = view.viewer.pick_many(&pixels).expect("ids are drawn");
        let shape = |equipment: &str| {
            let is_part = |id: &Option<String>| {
                id.as_ref().is_some_and(|id| {
                    id.strip_prefix(equipment)
                        .is_some_and(|rest| rest.is_empty() || rest.starts_with('/'))
                })
            };
            (0..ids.len()).filter(|&at| is_part(&ids[at])).collect::<Vec<_>>()
        };
        view.shapes = [DISCONNECTOR, BREAKER, TRANSFORMER].map(shape).to_vec();
        assert!(view.shapes.iter().all(|shape| shape.len() > 100), "each is seen");
        view
    }

    fn draw(&mut self) -> Picture {
        let input = self.viewer.headless_input(self.start.elapsed().as_secs_f64());
        self.viewer.frame(input).expect("a frame is drawn");
        self.viewer.read_picture().expect("the picture is there")
    }

    /// Measures the colours of disconnector, breaker and transformer.
    fn region_colors(&mut self) -> [RegionColor; 3] {
        let picture = self.draw();
        let color = |shape: &Vec<usize>| {
            let pixels = || shape.iter().map(|at| &picture.rgba8[at * 4..at * 4 + 3]);
            let count = shape.len() as f64;
            let mean = [0, 1, 2].map(|c| pixels().map(|p| f64::from(p[c])).sum::<f64>() / count);
            let grey = |p: &[u8]| p.iter().map(|&c| f64::from(c)).sum::<f64>() / 3.0;
            let middle = mean.iter().sum::<f64>() / 3.0;
            let spread = pixels().map(|p| (grey(p) - middle).powi(2)).sum::<f64>() / count;
            RegionColor { mean, spread: spread.sqrt() }
        };
        [0, 1, 2].map(|at| color(&self.shapes[at]))
    }

    /// Draws until a condition holds.
    fn until(&mut self, what: &str, holds: impl Fn(&[RegionColor; 3]) -> bool) -> [RegionColor; 3] {
        let start = Instant::now();
        loop {
            let region_colors = self.region_colors();
            if holds(&region_colors) {
                return region_colors;
            }
            assert!(start.elapsed() < PATIENCE, "not {what}: {region_colors:#?}");
            std::thread::sleep(Duration::from_millis(20));
        }
    }
}

fn bits(breaker: [u16; 2], disconnector: [u16; 2]) -> Value {
    let bits = [breaker, disconnector].concat();
    json!({ "discrete": { "0": bits } })
}

#[test]
fn switches_of_a_server_change_what_is_seen_as_energised() {
    let Some(mut peer) = Peer::start(&bits(CLOSED, CLOSED)) else { return };
    let scene = scene(peer.port);
    let mut view = View::open(&scene);
    let is_blue = |color: &RegionColor| color.blue() > 25.0;
    let live = view.until("all live", |region_colors| region_colors.iter().all(is_blue));

    peer.set("discrete", 0, &OPEN);
    let dead = view.until("a dead transformer", |[_, _, transformer]| !is_blue(transformer));
    assert!(is_blue(&dead[0]) && is_blue(&dead[1]), "up to the open breaker: {dead:#?}");

    peer.set("discrete", 0, &TRAVELLING);
    let unknown = view.until("an unknown transformer", |[_, _, transformer]| {
        transformer.differs(&dead[2]) && transformer.differs(&live[2])
    });
    assert!(is_blue(&unknown[0]), "the disconnector's ends are known: {unknown:#?}");

    peer.set("discrete", 0, &CLOSED);
    view.until("live again", |region_colors| region_colors.iter().all(is_blue));
    // The server is gone: nothing may look live, the feeding line's end included.
    drop(peer);
    let stale = view.until("stale", |region_colors| !region_colors.iter().any(is_blue));
    for (stale, live) in stale.iter().zip(&live) {
        assert!(stale.differs(live), "{stale:?} {live:?}");
    }
    assert_eq!(view.viewer.stats().validation_messages, Vec::<String>::new());
}
