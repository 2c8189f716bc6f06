//! Templates compared with the same scene written out.

use busbar_scene_loader::LoadedScene;
use busbar_viewer::{Picture, RendererOptions, Viewer};
use e2e::Scene;
use serde_json::{Value, json};

const SIZE: [u32; 2] = [320, 180];

/// Bays by prefix and place along x, each with two breakers and a disconnector.
const BAYS: [(&str, f32); 3] = [("=S1Q1", 0.0), ("=S1Q2", 14.0), ("=S1Q3", 28.0)];

fn at(x: f32, z: f32) -> Value {
    json!({ "translation": [x, 0, z] })
}

/// Returns the nodes of a bay, with a prefix before their ids.
fn bay(prefix: &str) -> Value {
    let id = |id: &str| format!("{prefix}{id}");
    json!([
        { "id": id("-QA1-L1"), "model": "breaker",
          "instances": [{ "id": id("-QA1-L2"), "transform": at(4.0, 0.0) }] },
        { "id": id("-QB9"), "model": "disconnector", "transform": at(2.0, -7.0),
          "children": [{ "id": id("-QB9-earth"), "model": "breaker", "transform": at(0.0, -8.0) }] },
    ])
}

fn scene_of(nodes: Value, templates: Value) -> Scene {
    let mut scene = Scene::without_tags();
    let models = scene.config["models"].take();
    scene.config["models"] =
        json!({ "breaker": models["breaker"], "disconnector": models["disconnector"] });
    scene.config["templates"] = templates;
    scene.config["scene"] = nodes;
    scene.config["graphics"] = json!({ "samples": 1 });
    scene.config["window"] = json!({ "size": SIZE });
    scene
}

/// Returns the picture, and the equipment at every third pixel.
fn shown(scene: &Scene) -> (Picture, Vec<Option<String>>) {
    let loaded = LoadedScene::load(&scene.write(), &|_, _, _| {}).expect("the scene loads");
    let options = RendererOptions { samples: 1, validation: true, ..Default::default() };
    let mut viewer = Viewer::new_headless(loaded, options, SIZE).expect("there is a device");
    viewer.look_from([14.0, 14.0, 30.0], [14.0, 1.0, -4.0]);
    let input = viewer.headless_input(0.0);
    viewer.frame(input).expect("a frame is drawn");
    let pixels: Vec<[u32; 2]> = (0..SIZE[1])
        .step_by(3)
        .flat_map(|y| (0..SIZE[0]).step_by(3).map(move |x| [x, y]))
        .collect();
    let ids = viewer.pick_many(&pixels).expect("ids are read");
    assert_eq!(viewer.stats().validation_messages, Vec::<String>::new());
    (viewer.read_picture().expect("the picture is there"), ids)
}

#[test]
fn a_template_shows_what_it_stands_for() {
    let written_out =
        BAYS.map(|(id, x)| json!({ "id": id, "transform": at(x, 0.0), "children": bay(id) }));
    let [first, rest @ ..] = BAYS;
    let copies = rest.map(|(id, x)| json!({ "id": id, "transform": at(x, 0.0) }));
    let placed = json!([{ "id": first.0, "template": "bay", "instances": copies }]);
    let by_template = shown(&scene_of(placed, json!({ "bay": bay("") })));
    let (picture, ids) = shown(&scene_of(json!(written_out), json!({})));
    assert!(by_template.0 == picture, "the pictures differ");
    assert_eq!(by_template.1, ids);
    for wanted in ["=S1Q1-QA1-L1", "=S1Q2-QA1-L2", "=S1Q3-QB9", "=S1Q2-QB9-earth"] {
        let part = format!("{wanted}/");
        assert!(
            ids.iter().flatten().any(|id| id.starts_with(&part)),
            "{wanted} is nowhere to be seen"
        );
    }
}
