//! Mirrored alarms of an independent OPC UA server, asyncua, as the view shows them: each state as
//! the server has it, and never as current where the server or its connection is gone.

use std::path::Path;
use std::process::Command;
use std::time::{Duration, Instant};

use busbar_scene_loader::LoadedScene;
use busbar_viewer::reload::{ReloadOutcome, Reloader};
use busbar_viewer::{AlarmState, AlarmStats, RendererOptions, Viewer};
use e2e::peer::python;
use e2e::{Process, Scene, busbar, finish, wait_for, workspace_path};
use egui::{Event, Key, Modifiers};
use rustix::process::{Pid, Signal, kill_process};
use serde_json::{Value, json};

const SIZE: [u32; 2] = [480, 270];
/// Longest wait for an expected alarm.
const MAX_WAIT: Duration = Duration::from_secs(60);
/// Silence of the server after which the plugin gives it up.
const SILENCE: Duration = Duration::from_secs(1);
/// Additional time until that state shows, on a loaded machine.
const SLACK: Duration = Duration::from_secs(10);
/// The address in the example of the page.
const EXAMPLE_PORT: &str = ":4840/";
const TRANSFORMER: &str = "=S12D1T1-TA1";
const RELAY: &str = "=S12D1T1-TA1/buchholz relay";
/// Ids of the states of a shelf (OPC 10000-6, Annex A).
const UNSHELVED: u32 = 2930;
const TIMED_SHELVED: u32 = 2929;

struct Server {
    process: Process,
    port: u16,
}

impl Server {
    fn start(port: u16, alarms: &Value) -> Option<Self> {
        let python = python("asyncua")?;
        let names: Vec<&String> = alarms.as_object().expect("alarms by node").keys().collect();
        let spec = json!({ "conditions": names, "alarms": alarms });
        let mut command = Command::new(python);
        command.arg(workspace_path("tests/end_to_end/peers/opcua_asyncua.py"));
        command.args(["--port", &port.to_string()]).arg(spec.to_string());
        let process = Process::start(&mut command);
        let port = process.wait_for_line(|line| line.strip_prefix("READY ")?.parse().ok());
        Some(Self { process, port })
    }

    fn change(&mut self, alarm: &str, fields: &Value) {
        let command = json!({ "alarm": format!("ns=2;s={alarm}"), "fields": fields });
        self.process.write_line(&command.to_string());
    }
}

/// Returns an alarm of the transformer.
fn hot(active: bool, acked: bool, shelf: u32) -> Value {
    json!({
        "ActiveState/Id": active, "AckedState/Id": acked, "SuppressedState/Id": false,
        "ShelvingState/CurrentState/Id": shelf, "Retain": active || !acked, "Severity": 700,
        "SourceName": "S12D1T1.Oil", "ConditionName": "OilHot", "Message": "Top oil hot",
    })
}

fn only_hot(active: bool, acked: bool) -> Value {
    json!({ "ns=2;s=Hot": hot(active, acked, UNSHELVED) })
}

/// Returns the configuration under a heading of the plugin's page.
fn example() -> Value {
    let page = std::fs::read_to_string(workspace_path("plugins/telemetry/opcua/README.md"));
    let page = page.expect("it is there");
    let (_, rest) = page.split_once("### Mirrored alarms: an example").expect("it has an example");
    let lines = rest.lines().skip_while(|line| !line.starts_with("    "));
    let text: String = lines.take_while(|line| line.starts_with("    ")).collect();
    serde_json::from_str(&text).expect("it is JSON")
}

/// Returns a scene of the demo's equipment with the page's example.
fn scene(port: u16, isolation: &str) -> Scene {
    let mut scene = Scene::without_tags();
    scene.add_plugin("opcua");
    let example = example();
    scene.config["isolation"] = json!(isolation);
    scene.config["plugins"]["plc"] = example["plugins"]["plc"].clone();
    scene.config["alarm_sources"] = example["alarm_sources"].clone();
    let settings = &mut scene.config["plugins"]["plc"]["settings"];
    let url = settings["url"].as_str().expect("a text");
    assert!(url.contains(EXAMPLE_PORT), "{url}");
    settings["url"] = json!(url.replace(EXAMPLE_PORT, &format!(":{port}/")));
    settings["silence_seconds"] = json!(SILENCE.as_secs_f64());
    settings["reconnect"] = json!({ "min_seconds": 1, "max_seconds": 1 });
    scene.config["graphics"] = json!({ "samples": 1 });
    scene.config["window"] = json!({ "size": SIZE });
    scene
}

struct View {
    viewer: Viewer,
    seconds: f64,
}

impl View {
    fn open(config: &Path) -> Self {
        let scene = LoadedScene::load(config, &|_, _, _| {}).expect("the scene loads");
        let options = RendererOptions { samples: 1, validation: true, ..Default::default() };
        let viewer = Viewer::new_headless(scene, options, SIZE).expect("there is a device");
        Self { viewer, seconds: 0.0 }
    }

    fn frame(&mut self, events: Vec<Event>) {
        self.seconds += 0.1;
        let mut input = self.viewer.headless_input(self.seconds);
        input.events = events;
        self.viewer.frame(input).expect("a frame is drawn");
    }

    fn key(&mut self, key: Key) {
        let modifiers = Modifiers::NONE;
        let event =
            |pressed| Event::Key { key, physical_key: None, pressed, repeat: false, modifiers };
        self.frame(vec![event(true)]);
        self.frame(vec![event(false)]);
    }

    /// Returns the process of the plugin, if it has one now.
    fn plugin_pid(&self) -> Option<Pid> {
        let stats = self.viewer.stats();
        let plugin = stats.plugins.iter().find(|plugin| plugin.name == "plc")?;
        Pid::from_raw(plugin.pid? as i32)
    }

    /// Draws until the alarms satisfy a condition.
    fn until(&mut self, what: &str, holds: impl Fn(&[AlarmStats]) -> bool) -> Vec<AlarmStats> {
        wait_for(what, MAX_WAIT, || {
            self.frame(Vec::new());
            Some(self.viewer.stats().alarms).filter(|alarms| holds(alarms))
        })
    }

    /// Draws until there is one alarm in a state, and it is current.
    fn until_current(&mut self, state: AlarmState) -> AlarmStats {
        let is_so = |alarms: &[AlarmStats]| {
            alarms.len() == 1 && alarms[0].state == state && alarms[0].certain
        };
        self.until(&format!("an alarm in state {state:?}"), is_so).remove(0)
    }

    /// Draws until the alarm is stale; returns the reason.
    fn until_stale(&mut self) -> String {
        let mut alarms = self.until("a stale alarm", |alarms| {
            assert_eq!(alarms.len(), 1, "it is kept");
            !alarms[0].certain
        });
        alarms.remove(0).uncertainty.expect("it says why")
    }
}

#[test]
fn each_state_is_shown_as_the_server_has_it() {
    for isolation in ["process", "none"] {
        let Some(mut server) = Server::start(0, &only_hot(true, false)) else { return };
        let mut view = View::open(&scene(server.port, isolation).write());
        let alarm = view.until_current(AlarmState::Unacknowledged);
        assert_eq!(alarm.id, "plc:nsu=urn:busbar:test;s=Hot", "{isolation}");
        assert_eq!((alarm.priority, alarm.source.as_deref()), ("high", Some("plc")));
        assert_eq!(alarm.uncertainty, None);

        view.key(Key::F8);
        let found = view.viewer.stats();
        assert_eq!(found.selected_alarm.as_deref(), Some(alarm.id.as_str()));
        assert_eq!(found.picked.as_deref(), Some(TRANSFORMER), "the way to the equipment");
        // Acknowledging is the server's.
        view.key(Key::F9);
        view.until_current(AlarmState::Unacknowledged);

        for (fields, state) in [
            (hot(true, true, UNSHELVED), AlarmState::Acknowledged),
            (hot(true, true, TIMED_SHELVED), AlarmState::Shelved),
            (hot(false, false, UNSHELVED), AlarmState::ReturnedUnacknowledged),
        ] {
            server.change("Hot", &fields);
            view.until_current(state);
        }
        server.change("Hot", &json!({ "Quality": 0x8031_0000_u32 }));
        assert_eq!(view.until_stale(), "bad at its source");
        server.change("Hot", &json!({ "Quality": 0 }));
        view.until_current(AlarmState::ReturnedUnacknowledged);
        server.change("Hot", &hot(false, true, UNSHELVED));
        view.until("no alarm", <[AlarmStats]>::is_empty);
    }
}

#[test]
fn alarms_of_a_server_that_is_killed_are_stale_until_the_next_one_tells_its_own() {
    let Some(server) = Server::start(0, &only_hot(true, false)) else { return };
    let mut view = View::open(&scene(server.port, "process").write());
    view.until_current(AlarmState::Unacknowledged);
    let port = server.port;
    server.process.signal(Signal::KILL);
    let killed = Instant::now();
    let uncertainty = view.until_stale();
    assert!(killed.elapsed() < SILENCE + SLACK, "{:?}", killed.elapsed());
    assert!(uncertainty.starts_with("stale "), "{uncertainty}");
    drop(server);
    // Acknowledged, and another one is new.
    let mut alarms = only_hot(true, true);
    alarms["ns=2;s=Low"] = hot(true, false, UNSHELVED);
    let _next = Server::start(port, &alarms).expect("it was there before");
    let alarms = view.until("the alarms of the next one", |alarms| {
        alarms.len() == 2 && alarms.iter().all(|alarm| alarm.certain)
    });
    let mut states: Vec<_> = alarms.iter().map(|alarm| alarm.state).collect();
    states.sort_unstable();
    assert_eq!(states, [AlarmState::Unacknowledged, AlarmState::Acknowledged]);
}

#[test]
fn alarms_of_a_frozen_server_are_stale_within_its_limit_and_current_once_it_goes_on() {
    let Some(mut server) = Server::start(0, &only_hot(true, false)) else { return };
    let mut view = View::open(&scene(server.port, "process").write());
    view.until_current(AlarmState::Unacknowledged);
    server.process.signal(Signal::STOP);
    let frozen = Instant::now();
    let uncertainty = view.until_stale();
    assert!(frozen.elapsed() < 2 * SILENCE + SLACK, "{:?}", frozen.elapsed());
    assert!(uncertainty.starts_with("stale "), "{uncertainty}");
    server.process.signal(Signal::CONT);
    view.until_current(AlarmState::Unacknowledged);
    server.change("Hot", &hot(true, true, UNSHELVED));
    view.until_current(AlarmState::Acknowledged);
}

#[test]
fn alarms_of_a_plugin_that_dies_are_stale_until_it_is_back() {
    let Some(server) = Server::start(0, &only_hot(true, false)) else { return };
    let mut scene = scene(server.port, "process");
    // Long enough to be seen.
    scene.config["supervision"] = json!({ "restart_seconds": 3 });
    let mut view = View::open(&scene.write());
    view.until_current(AlarmState::Unacknowledged);
    let pid = view.plugin_pid().expect("it has a process");
    kill_process(pid, Signal::KILL).expect("it runs");
    let uncertainty = view.until_stale();
    assert!(uncertainty.starts_with("stale "), "{uncertainty}");
    view.until_current(AlarmState::Unacknowledged);

    // One that is started anew while the server is away knows nothing of them.
    server.process.signal(Signal::KILL);
    view.until_stale();
    let second = view.plugin_pid().expect("it has a process");
    kill_process(second, Signal::KILL).expect("it runs");
    let mut polls_after = 20;
    wait_for("polls of a third process", MAX_WAIT, || {
        view.until_stale();
        std::thread::sleep(Duration::from_millis(100));
        let is_third = view.plugin_pid().is_some_and(|pid| pid != second);
        polls_after -= i32::from(is_third);
        (polls_after == 0).then_some(())
    });
}

#[test]
fn a_source_that_has_no_alarms_is_told_where_it_is_named() {
    let mut scene = scene(1, "process");
    scene.config["alarm_sources"][0]["instance"] = json!("optimizer");
    let mut command = busbar();
    command.arg("check").arg(scene.write());
    let said = finish(&mut command).expect_code(1);
    let said = said.stdout + &said.stderr;
    assert!(said.contains("busbar.alarms/1-draft"), "{said}");
    scene.config["alarm_sources"][0]["instance"] = json!("plk");
    let mut command = busbar();
    command.arg("check").arg(scene.write());
    let said = finish(&mut command).expect_code(1);
    let said = said.stdout + &said.stderr;
    assert!(said.contains("no plugin 'plk'") && said.contains("'plc'"), "{said}");
}

#[test]
fn a_reload_drops_no_alarm_and_places_it_by_the_new_rules() {
    let Some(server) = Server::start(0, &only_hot(true, false)) else { return };
    let mut scene = scene(server.port, "process");
    let path = scene.write();
    let mut view = View::open(&path);
    view.until_current(AlarmState::Unacknowledged);
    let before = view.plugin_pid();
    let mut reloader = Reloader::start(&path, || {}).expect("a file can be watched");
    let source = &mut scene.config["alarm_sources"][0];
    source["severities"] = json!({ "critical": 700, "high": 600, "medium": 500 });
    source["equipment"] = json!({ "S12D1T1.Oil": RELAY });
    scene.write();
    let outcome = wait_for("the edit", MAX_WAIT, || {
        view.frame(Vec::new());
        assert_eq!(view.viewer.stats().alarms.len(), 1, "it is kept");
        reloader.step(&mut view.viewer)
    });
    assert_eq!(outcome, ReloadOutcome::Shown);
    let alarm = view.until_current(AlarmState::Unacknowledged);
    assert_eq!(alarm.priority, "critical");
    assert_eq!(view.plugin_pid(), before, "the plugin goes on");
    view.key(Key::F8);
    assert_eq!(view.viewer.stats().picked.as_deref(), Some(RELAY));
}
