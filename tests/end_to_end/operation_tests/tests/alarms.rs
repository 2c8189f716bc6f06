//! Alarms from an independent server to the operator and back: states, the way to the equipment,
//! detail, keys in a window, and the entries of the audit log.

use std::path::Path;
use std::time::Duration;

use busbar_scene_loader::LoadedScene;
use busbar_viewer::{AlarmState, RendererOptions, Stats, Viewer};
use e2e::display::Display;
use e2e::peer::{Peer, normal_values};
use e2e::picture;
use e2e::{Process, Scene, busbar, wait_for};
use egui::{Event, Key, Modifiers};
use serde_json::{Value, json};

const SIZE: [u32; 2] = [480, 270];
const SCREEN: [u32; 2] = [1280, 720];
/// Longest wait for an alarm, an answer or a picture.
const MAX_WAIT: Duration = Duration::from_secs(60);
const RELAY: &str = "=S12D1T1-TA1/buchholz relay";
/// Addresses of the Buchholz relay among the discrete inputs, and of the SF6 pressure among the
/// registers.
const RELAY_INPUT: u16 = 4;
const SF6_REGISTER: u16 = 106;

/// Returns the demo scene with alarms, at theta 0.7 unless set otherwise.
fn scene(port: u16) -> Scene {
    let mut scene = Scene::demo(port);
    let config = &mut scene.config;
    for model in ["transformer", "breaker", "disconnector"] {
        config["models"][model]["theta"] = json!(0.7);
    }
    config["alarms"] = json!({
        "Trip": {
            "tag": "T1.Buchholz", "condition": { "equals": true }, "priority": "critical",
            "latched": true, "message": "Buchholz trip", "equipment": RELAY
        },
        "SF6": {
            "tag": "Q1.SF6", "condition": { "low": 5.5, "deadband": 0.1 }, "priority": "high",
            "message": "SF6 pressure low"
        },
        "Grid": { "mirrored": true, "message": "Load shedding is armed" }
    });
    config["alarm_handling"] = json!({ "log_directory": "log", "max_shelving_seconds": 3600 });
    config["graphics"] = json!({ "samples": 1 });
    config["window"] = json!({ "size": SIZE });
    config["camera"] = json!({ "start": "bay" });
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
        let mut viewer = Viewer::new_headless(scene, options, SIZE).expect("there is a device");
        viewer.set_operator("A. Operator");
        Self { viewer, seconds: 0.0 }
    }

    fn frame(&mut self, events: Vec<Event>) {
        self.seconds += 0.1;
        let mut input = self.viewer.headless_input(self.seconds);
        input.events = events;
        self.viewer.frame(input).expect("a frame is drawn");
    }

    fn key(&mut self, key: Key, modifiers: Modifiers) {
        let event =
            |pressed| Event::Key { key, physical_key: None, pressed, repeat: false, modifiers };
        self.frame(vec![event(true)]);
        self.frame(vec![event(false)]);
    }

    fn state(&self, id: &str) -> AlarmState {
        let stats = self.viewer.stats();
        let alarm = stats.alarms.into_iter().find(|alarm| alarm.id == id);
        alarm.map_or(AlarmState::Normal, |alarm| alarm.state)
    }

    fn until(&mut self, what: &str, holds: impl Fn(&Stats) -> bool) -> Stats {
        wait_for(what, MAX_WAIT, || {
            self.frame(Vec::new());
            Some(self.viewer.stats()).filter(&holds)
        })
    }

    fn until_state(&mut self, id: &str, state: AlarmState) {
        self.until(&format!("{id} in state {state:?}"), |stats| {
            let alarm = stats.alarms.iter().find(|alarm| alarm.id == id);
            alarm.map_or(AlarmState::Normal, |alarm| alarm.state) == state
        });
    }
}

fn all_good(stats: &Stats) -> bool {
    stats.quality.bad == 0 && stats.quality.uncertain == 0
}

#[test]
fn an_alarm_leads_to_its_equipment_in_full_detail_and_back() {
    let Some(mut peer) = Peer::start(&normal_values()) else { return };
    let scene = scene(peer.port);
    let mut view = View::open(&scene.write());
    let calm = view.until("good tags", all_good);
    assert_eq!((calm.alarms.len(), view.viewer.stats().theta_span["transformer"]), (0, [0.7; 2]));

    peer.set("discrete", RELAY_INPUT, &[1]);
    view.until_state("Trip", AlarmState::Unacknowledged);
    let theta = view.viewer.stats().theta_span["transformer"];
    assert_eq!(theta, [0.0, 0.7], "the relay in full detail, the rest as before");

    // Beyond the transformer, and low: the relay is not to be seen from there.
    view.viewer.look_from([0.0, 1.0, -40.0], [0.0, 1.0, 0.0]);
    view.key(Key::F8, Modifiers::NONE);
    let found = view.viewer.stats();
    assert_eq!(found.selected_alarm.as_deref(), Some("Trip"));
    assert_eq!(found.picked.as_deref(), Some(RELAY));
    let near: Vec<[u32; 2]> =
        (0..27).flat_map(|y| (0..48).map(move |x| [x * 10 + 5, y * 10 + 5])).collect();
    let ids = view.viewer.pick_many(&near).expect("ids are drawn");
    let share = ids.iter().flatten().filter(|id| *id == RELAY).count() as f64 / ids.len() as f64;
    assert!(share > 0.05, "{:.1} % of the picture is the relay", share * 100.0);

    view.key(Key::F9, Modifiers::NONE);
    assert_eq!(view.state("Trip"), AlarmState::Acknowledged);
    view.frame(Vec::new());
    let theta = view.viewer.stats().theta_span["transformer"];
    assert_eq!(theta, [0.7; 2], "acknowledged: as the policy has it");

    peer.set("discrete", RELAY_INPUT, &[0]);
    view.until_state("Trip", AlarmState::LatchedAcknowledged);
    view.key(Key::F10, Modifiers::NONE);
    assert_eq!(view.state("Trip"), AlarmState::Shelved);
    view.key(Key::F10, Modifiers::SHIFT);
    assert_eq!(
        view.state("Trip"),
        AlarmState::LatchedUnacknowledged,
        "the latch outlived the shelf"
    );
    let messages = view.viewer.stats().validation_messages;
    assert_eq!(messages, Vec::<String>::new());
}

#[test]
fn a_server_that_falls_silent_clears_nothing_and_the_alarm_says_so() {
    let Some(mut peer) = Peer::start(&normal_values()) else { return };
    let scene = scene(peer.port);
    let mut view = View::open(&scene.write());
    view.until("good tags", all_good);
    peer.set("holding", SF6_REGISTER, &[540]);
    view.until_state("SF6", AlarmState::Unacknowledged);
    drop(peer);
    let stats = view.until("doubt", |stats| stats.alarms.iter().any(|alarm| !alarm.certain));
    let alarm = &stats.alarms[0];
    assert_eq!(
        (alarm.id.as_str(), alarm.state, alarm.priority),
        ("SF6", AlarmState::Unacknowledged, "high")
    );
}

#[test]
fn what_is_mirrored_is_as_the_host_says() {
    let mut view = View::open(&scene(1).write());
    view.frame(Vec::new());
    for state in [
        AlarmState::Unacknowledged,
        AlarmState::Acknowledged,
        AlarmState::ReturnedUnacknowledged,
        AlarmState::Normal,
    ] {
        view.viewer.mirror_alarm("Grid", state, None, Some("host")).expect("it is mirrored");
        view.frame(Vec::new());
        assert_eq!(view.state("Grid"), state);
    }
    let refused =
        view.viewer.mirror_alarm("SF6", AlarmState::Unacknowledged, None, None).unwrap_err();
    assert!(refused.to_string().contains("mirrored"), "{refused}");
}

/// Returns alarm, event, operator and new state of each entry of the audit log.
fn logged(log: &Path) -> Vec<[String; 4]> {
    let text = std::fs::read_to_string(log.join("alarms.jsonl")).unwrap_or_default();
    let of_line = |line: &str| {
        let record: Value = serde_json::from_str(line.get(17..)?).ok()?;
        // A file begins with a header, which is of no alarm.
        record["alarm"].as_str()?;
        let text = |key: &str| record[key].as_str().unwrap_or_default().to_owned();
        Some(["alarm", "happened", "operator", "to"].map(text))
    };
    text.lines().filter_map(of_line).collect()
}

#[test]
fn keys_in_a_window_are_in_the_log_once_they_show() {
    let Some(mut peer) = Peer::start(&normal_values()) else { return };
    let Some(display) = Display::start(SCREEN) else { return };
    let mut scene = scene(peer.port);
    scene.config["window"]["size"] = json!(SCREEN);
    let log = scene.path("log");
    let mut command = busbar();
    command.arg("view").arg(scene.write()).args(["--validation", "--seconds", "60"]);
    command.arg("--stats").arg(scene.path("stats.json"));
    command.env("DISPLAY", &display.name).env_remove("WAYLAND_DISPLAY");
    command.env_remove("WAYLAND_SOCKET").env("WINIT_X11_SCALE_FACTOR", "1");
    command.env("BUSBAR_OPERATOR", "M. Weber");
    let process = Process::start(&mut command);
    process.wait_for_line(|line| (line == "ready").then_some(()));
    let window = display.xdotool("search --name Busbar").stdout;
    display.xdotool(&format!("windowfocus --sync {}", window.trim()));
    let mut shots = vec![display.screenshot(log.parent().expect("a folder"), "alarms_calm")];
    peer.set("discrete", RELAY_INPUT, &[1]);
    let wait = |happened: &str, count: usize| {
        wait_for(happened, MAX_WAIT, || {
            let records = logged(&log);
            let count_of = records.iter().filter(|record| record[1] == happened).count();
            (count_of >= count).then_some(records)
        })
    };
    wait("occurred", 1);
    let mut shoot = |name: &str| {
        // Frames are slow on a software rasteriser under validation.
        display.xdotool("sleep 3");
        shots.push(display.screenshot(log.parent().expect("a folder"), name));
    };
    shoot("alarms_occurred");
    display.xdotool("key F8");
    shoot("alarms_shown");
    for (key, happened, name) in [
        ("F9", "acknowledged", "alarms_acknowledged"),
        ("F10", "shelved", "alarms_shelved"),
        ("shift+F10", "unshelved", "alarms_unshelved"),
    ] {
        display.xdotool(&format!("key {key}"));
        wait(happened, 1);
        shoot(name);
    }
    for pair in shots.windows(2) {
        assert!(picture::difference(&pair[0], &pair[1]).is_some(), "a step does not show");
    }
    let records = logged(&log);
    let expected = [
        ["Trip", "occurred", "", "B"],
        ["Trip", "acknowledged", "M. Weber", "C"],
        ["Trip", "shelved", "M. Weber", "G"],
        ["Trip", "unshelved", "M. Weber", "B"],
    ];
    assert_eq!(records, expected);
    drop(process);
}
