//! Verdicts of an overlay through the whole program: given in every frame, also while the
//! overlay is hidden, taken back with a bad value, remembered, and demanded by `busbar check`.

use std::time::{Duration, Instant};

use busbar_scene_loader::LoadedScene;
use busbar_types::{Quality, Reason};
use busbar_viewer::{HostTagValue, RendererOptions, Viewer};
use e2e::{Scene, busbar, finish, wait_for};
use serde_json::{Value, json};

const SIZE: [u32; 2] = [480, 270];
const TRANSFORMER: &str = "=S12D1T1-TA1";
const BREAKER: &str = "=S12D1Q1-QA1-L1";
/// Longest time until the verdict on a value is seen.
const PATIENCE: Duration = Duration::from_secs(30);

/// Returns a scene of an oil temperature at the transformer, which the test sets.
fn scene() -> Scene {
    let mut scene = Scene::demo(1);
    scene.add_plugin("condition");
    let quantity = json!({
        "name": "Oil", "role": "oil", "unit": "°C", "attention": 80.0, "alarm": 90.0,
    });
    let config = &mut scene.config;
    config["plugins"] = json!({
        "monitored": { "plugin": "condition", "settings": {
            "quantities": [quantity], "equipment": [TRANSFORMER],
        }},
        "optimizer": config["plugins"]["optimizer"],
    });
    config["tags"] = json!({ "Oil": {
        // Kelvins: the overlay converts them.
        "type": "f64", "unit": "K", "freshness_seconds": 60,
        "set_by_host": true,
    }});
    config["bindings"] = json!([{ "tag": "Oil", "node": TRANSFORMER, "role": "oil" }]);
    config["overlays"] = json!(["monitored"]);
    config["graphics"] = json!({ "samples": 1, "quality": "low" });
    config["window"] = json!({ "size": SIZE });
    config["camera"] = json!({ "start": "bay" });
    for key in ["alarms", "alarm_handling", "records"] {
        config.as_object_mut().expect("an object").remove(key);
    }
    scene
}

#[test]
fn a_verdict_is_given_taken_back_and_remembered_also_while_hidden() {
    let scene = scene();
    let loaded = LoadedScene::load(&scene.write(), &|_, _, _| {}).unwrap_or_else(|e| panic!("{e}"));
    let options = RendererOptions { samples: 1, ..Default::default() };
    let mut viewer = Viewer::new_offscreen(loaded, options, SIZE).expect("there is a device");
    let set = |viewer: &mut Viewer, kelvins: f64, quality: Quality| {
        let value = HostTagValue { quality, ..HostTagValue::from_number(kelvins) };
        viewer.set_tag("Oil", value).expect("the tag is the host's");
    };
    let started = Instant::now();
    let wait_until = |viewer: &mut Viewer, verdict: &str, was_abnormal: bool| {
        wait_for(verdict, PATIENCE, || {
            let input = viewer.headless_input(started.elapsed().as_secs_f64());
            viewer.frame(input).expect("a frame is drawn");
            let verdicts = viewer.stats().verdicts;
            let own = verdicts.into_iter().find(|own| own.equipment == TRANSFORMER);
            let own = own.expect("every piece described has a verdict in every frame");
            assert_eq!(own.overlay, "monitored");
            (own.verdict == verdict && own.was_abnormal == was_abnormal).then_some(own.reason)
        })
    };
    // Far above its alarm, then bad, then cool.
    set(&mut viewer, 368.15, Quality::Good);
    let reason = wait_until(&mut viewer, "abnormal", false);
    assert!(reason.contains("95"), "in the unit of the thresholds: {reason}");
    assert!(viewer.set_layer_shown("monitored", false), "there is such a layer");
    set(&mut viewer, 368.15, Quality::Bad(Reason::Sensor));
    let reason = wait_until(&mut viewer, "unknown", true);
    assert!(reason.contains("Oil") && reason.contains("abnormal when last known"), "{reason}");
    set(&mut viewer, 333.15, Quality::Good);
    wait_until(&mut viewer, "normal", false);
}

#[test]
fn check_refuses_equipment_that_no_tag_speaks_for_unless_it_is_declared() {
    let mut scene = scene();
    let checked = |scene: &Scene| finish(busbar().arg("check").arg(scene.write()));
    checked(&scene).expect_code(0);
    let settings = "/plugins/monitored/settings";
    let change = |scene: &mut Scene, name: &str, value: Value| {
        scene.config.pointer_mut(settings).expect("it is there")[name] = value;
    };
    change(&mut scene, "equipment", json!([TRANSFORMER, BREAKER]));
    let refused = checked(&scene);
    assert_eq!(refused.code, Some(1), "{refused:?}");
    let said = format!("{}{}", refused.stdout, refused.stderr);
    assert!(said.contains(BREAKER) && said.contains("monitored"), "{said}");
    change(&mut scene, "untelemetered", json!([BREAKER]));
    checked(&scene).expect_code(0);
    // Volts are no temperature.
    scene.config["tags"]["Oil"]["unit"] = json!("V");
    let refused = checked(&scene);
    assert_eq!(refused.code, Some(1), "{refused:?}");
    let said = format!("{}{}", refused.stdout, refused.stderr);
    assert!(said.contains("'Oil'") && said.contains("'V'"), "{said}");
}
