//! Monitor of dissolved gases behind an independent server: its gases become a verdict and a line
//! of the chart; stale gases have no verdict.

use std::time::Duration;

use busbar_scene_loader::LoadedScene;
use busbar_viewer::{ChartStats, RendererOptions, Viewer};
use e2e::peer::{Peer, f32_registers};
use e2e::{Scene, wait_for};
use serde_json::{Value, json};

const SIZE: [u32; 2] = [320, 180];
/// Longest wait for values, a record or an answer.
const MAX_WAIT: Duration = Duration::from_secs(60);
const ID: &str = "=S12D1T1-TA1";
const GASES: [&str; 9] = ["H2", "CH4", "C2H6", "C2H4", "C2H2", "CO", "CO2", "O2", "N2"];
/// Gases of quiet oil in a sealed transformer, ppm; those with discharges of low energy follow.
const CALM: [f32; 9] = [14.0, 7.0, 9.0, 5.0, 0.1, 150.0, 1300.0, 2400.0, 62_000.0];
const ARCING: [f32; 9] = [550.0, 100.0, 20.0, 50.0, 240.0, 150.0, 1300.0, 2400.0, 62_000.0];

fn registers(ppm: [f32; 9]) -> Vec<u16> {
    ppm.into_iter().flat_map(f32_registers).collect()
}

fn scene(port: u16) -> Scene {
    let mut scene = Scene::demo(port);
    let tags = GASES.iter().enumerate().map(|(at, gas)| {
        let address = json!({ "table": "holding", "register": 2 * at, "type": "f32" });
        let tag = json!({
            "name": gas, "type": "f64", "unit": "ppm", "freshness_seconds": 2,
            "source": { "instance": "bay", "address": address }
        });
        (format!("DGA.{gas}"), tag)
    });
    let role = |gas: &str| format!("gas_{}", gas.to_lowercase());
    let binding =
        |gas: &&str| json!({ "tag": format!("DGA.{gas}"), "node": ID, "role": role(gas) });
    let config = &mut scene.config;
    config["tags"] = Value::Object(tags.collect());
    config["bindings"] = GASES.iter().map(binding).collect();
    config["plugins"]["gases"] = json!({
        "plugin": "gas_analysis",
        "settings": { "monitors": { "equipment": [ID], "record_minutes": 0.01 } }
    });
    config["overlays"] = json!(["gases"]);
    config["chart"] = json!({ "instance": "gases", "position": [0, 8, 0], "size": [20, 6, 8] });
    config["graphics"] = json!({ "samples": 1 });
    config["window"] = json!({ "size": SIZE });
    scene
}

struct View {
    viewer: Viewer,
    seconds: f64,
}

impl View {
    /// Waits until the chart is as expected.
    fn until(&mut self, what: &str, holds: impl Fn(&ChartStats) -> bool) -> ChartStats {
        wait_for(what, MAX_WAIT, || {
            self.seconds += 0.1;
            let input = self.viewer.headless_input(self.seconds);
            self.viewer.frame(input).expect("a frame is drawn");
            self.viewer.stats().chart.filter(&holds)
        })
    }

    fn until_state(&mut self, words: &str) -> ChartStats {
        self.until(words, |chart| {
            let state = chart.states.get(ID).cloned().flatten();
            state.is_some_and(|state| state.contains(words))
        })
    }
}

#[test]
fn gases_over_modbus_are_judged_and_not_once_they_are_stale() {
    let values = json!({ "holding": { "0": registers(CALM) } });
    let Some(mut peer) = Peer::start(&values) else { return };
    let loaded = LoadedScene::load(&scene(peer.port).write(), &|_, _, _| {});
    let scene = loaded.unwrap_or_else(|error| panic!("{error}"));
    let options = RendererOptions { samples: 1, validation: true, ..Default::default() };
    let viewer = Viewer::new_headless(scene, options, SIZE).expect("there is a device");
    let mut view = View { viewer, seconds: 0.0 };
    let calm = view.until_state("normal");
    assert!(calm.records >= 1);
    peer.set("holding", 0, &registers(ARCING));
    let arcing = view.until_state("status 3");
    assert!(arcing.states[ID].as_ref().is_some_and(|state| state.contains("discharges")));
    let before = arcing.records;
    // The server ends, and with it the values.
    drop(peer);
    let stale = view.until_state("not judged");
    assert!(stale.records > before, "that it is not judged is a record of its own");
    let stats = view.viewer.stats();
    assert!(stats.quality.bad > 0, "{:?}", stats.quality);
    assert_eq!(stats.validation_messages, Vec::<String>::new());
}
