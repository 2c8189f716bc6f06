//! Alarms that follow the verdicts of an overlay, through the whole program: raised, kept while
//! nobody knows, over reloads, restarts and a killed process, logged, and demanded by `busbar check`.

use std::path::Path;
use std::time::{Duration, Instant};

use busbar_scene_loader::LoadedScene;
use busbar_types::{Quality, Reason, Value as TagValue};
use busbar_viewer::reload::PreparedReload;
use busbar_viewer::{AlarmAction, AlarmState, AlarmStats, HostTagValue, RendererOptions, Viewer};
use e2e::{Scene, busbar, finish, wait_for};
use rustix::process::{Pid, Signal, kill_process};
use serde_json::{Value, json};

const SIZE: [u32; 2] = [64, 48];
const PATIENCE: Duration = Duration::from_secs(30);
/// Time in which an alarm that is to stay would have gone.
const A_WHILE: Duration = Duration::from_secs(2);
const TRANSFORMER: &str = "=T1-TA1";
const BREAKER: &str = "=Q1-QA1";
const HOT: &str = "hot:=T1-TA1";

/// Returns a scene of two oil temperatures that the host sets, and alarms on the verdicts on them.
fn scene() -> Scene {
    let mut scene = Scene::demo(1);
    scene.add_plugin("condition");
    let tag = json!({ "type": "f64", "unit": "°C", "set_by_host": true, "freshness_seconds": 600 });
    let quantity = json!({
        "name": "Oil", "role": "oil", "unit": "°C", "attention": 80.0, "alarm": 100.0,
    });
    let directories = scene.config["plugin_directories"].clone();
    scene.config = json!({
        "version": 1,
        "plugin_directories": directories,
        "plugins": { "monitored": { "plugin": "condition", "settings": {
            "quantities": [quantity], "equipment": [TRANSFORMER, BREAKER],
        }}},
        "models": { "breaker": { "file": "models/breaker.glb" } },
        "scene": [{ "id": TRANSFORMER, "model": "breaker" }, { "id": BREAKER }],
        "tags": { "Oil": tag, "Other": tag },
        "bindings": [
            { "tag": "Oil", "node": TRANSFORMER, "role": "oil" },
            { "tag": "Other", "node": BREAKER, "role": "oil" },
        ],
        "overlays": ["monitored"],
        "alarms": {
            "hot": { "verdict": { "instance": "monitored" }, "priority": "high",
                     "message": "Oil hot" },
            "T1": { "verdict": { "instance": "monitored", "equipment": TRANSFORMER,
                                 "severity": "alarm" },
                    "priority": "critical", "message": "Oil far too hot" },
        },
        "alarm_handling": { "log_directory": "log" },
        "supervision": { "restart_seconds": 0.05 },
        "graphics": { "samples": 1, "quality": "low" },
        "window": { "size": SIZE },
    });
    scene
}

struct View {
    viewer: Viewer,
    started: Instant,
}

impl View {
    fn open(path: &Path) -> Self {
        let loaded = LoadedScene::load(path, &|_, _, _| {}).unwrap_or_else(|e| panic!("{e}"));
        let options = RendererOptions { samples: 1, ..RendererOptions::default() };
        let viewer = Viewer::new_offscreen(loaded, options, SIZE).expect("there is a device");
        Self { viewer, started: Instant::now() }
    }

    fn set(&mut self, tag: &str, celsius: f64, quality: Quality) {
        let value = HostTagValue {
            value: Some(TagValue::F64(celsius)),
            quality,
            source_time: None,
            waited: Duration::ZERO,
        };
        self.viewer.set_tag(tag, value).expect("it is the host's");
    }

    fn frame(&mut self) {
        let input = self.viewer.headless_input(self.started.elapsed().as_secs_f64());
        self.viewer.frame(input).expect("a frame is drawn");
    }

    fn alarm(&self, id: &str) -> Option<AlarmStats> {
        self.viewer.stats().alarms.into_iter().find(|alarm| alarm.id == id)
    }

    fn until(&mut self, id: &str, state: AlarmState) -> Option<AlarmStats> {
        wait_for(&format!("{id} in {state:?}"), PATIENCE, || {
            self.frame();
            let alarm = self.alarm(id);
            let found = alarm.as_ref().map_or(AlarmState::Normal, |alarm| alarm.state);
            (found == state).then_some(alarm)
        })
    }

    /// Draws frames for a while, in each of which an alarm has a state.
    fn stays(&mut self, id: &str, state: AlarmState) -> AlarmStats {
        let end = Instant::now() + A_WHILE;
        while Instant::now() < end {
            self.frame();
            let found = self.alarm(id).map(|alarm| alarm.state);
            assert_eq!(found, Some(state), "{id}");
            std::thread::sleep(Duration::from_millis(10));
        }
        self.alarm(id).expect("it is open")
    }

    fn reload(&mut self, scene: &Scene) {
        let reload = PreparedReload::load(self.viewer.scene(), &scene.write());
        let reload = reload.unwrap_or_else(|e| panic!("{e}")).expect("something changed");
        self.viewer.apply_reload(reload).expect("the device is there");
    }

    fn kill_plugin(&self) {
        let stats = self.viewer.stats();
        let pid = stats.plugins.iter().find_map(|plugin| plugin.pid).expect("it runs");
        let pid = Pid::from_raw(pid.cast_signed()).expect("a process");
        kill_process(pid, Signal::KILL).expect("it is ours");
    }
}

#[test]
fn an_alarm_follows_its_verdict_and_never_clears_for_want_of_one() {
    let mut scene = scene();
    let mut view = View::open(&scene.write());
    let bad = Quality::Bad(Reason::Communication);
    view.set("Oil", 60.0, Quality::Good);
    view.set("Other", 60.0, Quality::Good);
    view.until("T1", AlarmState::Normal);
    view.set("Oil", 90.0, Quality::Good);
    let hot = view.until(HOT, AlarmState::Unacknowledged).expect("it is open");
    assert_eq!(
        (hot.overlay.as_deref(), hot.certain, hot.priority),
        (Some("monitored"), true, "high")
    );
    assert!(hot.reason.as_deref().is_some_and(|reason| reason.contains("90")), "{hot:?}");
    assert_eq!(view.alarm("T1").map(|alarm| alarm.state), None, "it is a warning so far");
    view.set("Oil", 120.0, Quality::Good);
    view.until("T1", AlarmState::Unacknowledged);
    assert_eq!(view.alarm("hot:=Q1-QA1").map(|alarm| alarm.state), None);

    view.set("Oil", 120.0, bad);
    let unknown = view.stays(HOT, AlarmState::Unacknowledged);
    assert!(!unknown.certain, "{unknown:?}");
    assert!(unknown.uncertainty.is_some_and(|why| why.contains("Oil")));
    assert!(view.viewer.set_layer_shown("monitored", false), "it is a layer");
    view.stays(HOT, AlarmState::Unacknowledged);
    view.kill_plugin();
    view.stays(HOT, AlarmState::Unacknowledged);
    // Neither other settings nor other equipment before it clear it; nor that it is judged no more.
    scene.config["plugins"]["monitored"]["settings"]["quantities"][0]["attention"] = json!(85.0);
    scene.config["scene"][1] = json!({ "id": "=A0", "children": [{ "id": BREAKER }] });
    view.reload(&scene);
    view.stays(HOT, AlarmState::Unacknowledged);
    view.viewer.act_on_alarm(HOT, AlarmAction::Acknowledge, "A. Operator").expect("it is open");
    scene.config["plugins"]["monitored"]["settings"]["equipment"] = json!([BREAKER]);
    scene.config["bindings"] = json!([{ "tag": "Other", "node": BREAKER, "role": "oil" }]);
    view.reload(&scene);
    let unjudged = view.stays(HOT, AlarmState::Acknowledged);
    assert!(unjudged.uncertainty.is_some_and(|why| why.contains("does not judge")));

    // After a restart it is there before anything is judged, by the log.
    drop(view);
    let mut view = View::open(&scene.write());
    view.frame();
    assert_eq!(view.alarm(HOT).map(|alarm| alarm.state), Some(AlarmState::Acknowledged));
    scene.config["plugins"]["monitored"]["settings"]["equipment"] = json!([TRANSFORMER, BREAKER]);
    scene.config["bindings"] = json!([
        { "tag": "Oil", "node": TRANSFORMER, "role": "oil" },
        { "tag": "Other", "node": BREAKER, "role": "oil" },
    ]);
    view.reload(&scene);
    view.stays(HOT, AlarmState::Acknowledged);
    view.set("Oil", 60.0, Quality::Good);
    view.until(HOT, AlarmState::Normal);
    view.set("Other", 90.0, Quality::Good);
    view.until("hot:=Q1-QA1", AlarmState::Unacknowledged);
    drop(view);
    let log = std::fs::read_to_string(scene.path("log").join("alarms.jsonl")).expect("a log");
    let of = |id: &str| log.lines().filter(|line| line.contains(id)).count();
    assert!(of(HOT) >= 3 && of("hot:=Q1-QA1") == 1, "{log}");
    assert!(log.contains("\"reason\":\"Oil: "), "{log}");
}

#[test]
fn equipment_that_leaves_the_scene_takes_its_alarm_with_it() {
    let mut scene = scene();
    let mut view = View::open(&scene.write());
    view.set("Other", 90.0, Quality::Good);
    view.until("hot:=Q1-QA1", AlarmState::Unacknowledged);
    scene.config["scene"] = json!([{ "id": TRANSFORMER, "model": "breaker" }]);
    scene.config["plugins"]["monitored"]["settings"]["equipment"] = json!([TRANSFORMER]);
    scene.config["bindings"] = json!([{ "tag": "Oil", "node": TRANSFORMER, "role": "oil" }]);
    view.reload(&scene);
    view.frame();
    assert!(view.alarm("hot:=Q1-QA1").is_none());
    view.set("Oil", 90.0, Quality::Good);
    view.until(HOT, AlarmState::Unacknowledged);
}

#[test]
fn check_refuses_what_no_overlay_judges() {
    let checked = |scene: &Scene| finish(busbar().arg("check").arg(scene.write()));
    let refused = |change: &dyn Fn(&mut Value), words: [&str; 2]| {
        let mut scene = scene();
        change(&mut scene.config);
        let output = checked(&scene);
        let said = format!("{}{}", output.stdout, output.stderr);
        assert_eq!(output.code, Some(1), "{said}");
        assert!(words.iter().all(|word| said.contains(word)), "{said}");
    };
    checked(&scene()).expect_code(0);
    refused(
        &|config| config["alarms"]["T1"]["verdict"]["instance"] = json!("monitord"),
        ["there is no overlay 'monitord'", "did you mean 'monitored'?"],
    );
    refused(
        &|config| {
            config["scene"].as_array_mut().expect("a list").push(json!({ "id": "=X1" }));
            config["alarms"]["T1"]["verdict"]["equipment"] = json!("=X1");
        },
        ["the overlay 'monitored' does not judge '=X1'", "it judges =T1-TA1, =Q1-QA1"],
    );
    refused(
        &|config| config["alarms"]["T1"]["tag"] = json!("Oil"),
        ["the alarm rests on a verdict", "remove it"],
    );
    refused(
        &|config| config["alarms"]["T1"]["equipment"] = json!(TRANSFORMER),
        ["the alarm rests on a verdict", "write it in \"verdict\""],
    );
    refused(
        &|config| {
            config["alarms"][HOT] = json!({ "mirrored": true, "message": "taken" });
        },
        ["an alarm of 'hot' on a piece of equipment may have this id", "another id"],
    );
    // An instance without the capability cannot be an overlay.
    refused(
        &|config| {
            config["plugins"]["thin"] = json!({ "plugin": "quadric_collapse" });
            config["alarms"]["T1"]["verdict"]["instance"] = json!("thin");
        },
        ["'thin' is not among the overlays", "monitored"],
    );
    refused(
        &|config| {
            config["plugins"]["thin"] = json!({ "plugin": "quadric_collapse" });
            config["overlays"] = json!(["monitored", "thin"]);
            config["alarms"]["T1"]["verdict"] = json!({ "instance": "thin" });
        },
        ["has no capability busbar.overlay", "name a plugin that has this capability"],
    );
}
