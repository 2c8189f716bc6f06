//! Hot reload: an edit of the configuration shows within a moment, unrelated parts continue
//! undisturbed, and one with errors changes nothing.

use std::collections::BTreeMap;
use std::fs;
use std::path::PathBuf;
use std::time::{Duration, Instant};

use busbar_scene_loader::LoadedScene;
use busbar_viewer::reload::{ReloadOutcome, Reloader, SETTLE_TIME};
use busbar_viewer::{AlarmAction, AlarmState, Picture, Stats, Viewer, renderer_options};
use e2e::peer::{Peer, normal_values};
use e2e::{Scene, wait_for};
use serde_json::{Value, json};

/// Overlay with the values.
const LABELS: &str = "values";
const SIZE: [u32; 2] = [480, 270];
/// Longest wait for an edit, a value or an alarm.
const MAX_WAIT: Duration = Duration::from_secs(60);
/// Number of timed edits.
const TIMED: usize = 20;
/// Longest time of an edit from its writing to the picture, where other tests keep the machine
/// busy. On an idle machine the promise is 250 ms after it settled.
const MAX_LATENCY: Duration = Duration::from_secs(3);

/// Returns the demo scene with alarms.
fn scene(port: u16) -> Scene {
    let mut scene = Scene::demo(port);
    scene.config["alarms"] = json!({
        "Fans": {
            "tag": "T1.Fans", "condition": { "equals": 2 }, "priority": "high",
            "message": "All fans run"
        },
        "SF6": {
            "tag": "Q1.SF6", "condition": { "high": 6.0, "deadband": 0.1 }, "priority": "low",
            "message": "SF6 pressure high"
        },
        "Oil": {
            "tag": "T1.TopOil", "condition": { "high": 50 }, "message": "Top oil hot"
        }
    });
    scene.config["alarm_handling"] = json!({ "log_directory": "log" });
    scene.config["graphics"] = json!({ "samples": 1, "quality": "low", "morph_seconds": 0 });
    scene.config["window"] = json!({ "size": SIZE });
    scene.config["camera"] = json!({ "start": "bay" });
    scene
}

struct View {
    scene: Scene,
    path: PathBuf,
    viewer: Viewer,
    reloader: Reloader,
    started: Instant,
}

impl View {
    /// Opens an operator's view without a window of its own.
    fn open(scene: Scene) -> Self {
        let path = scene.write();
        let loaded = LoadedScene::load(&path, &|_, _, _| {}).unwrap_or_else(|e| panic!("{e}"));
        let options = renderer_options(&loaded);
        let mut viewer = Viewer::new_offscreen(loaded, options, SIZE).expect("there is a device");
        viewer.set_operator("A. Operator");
        let reloader = Reloader::start(&path, || {}).expect("a file can be watched");
        let mut view = Self { scene, path, viewer, reloader, started: Instant::now() };
        view.wait_for("all values", |stats| stats.quality.bad == 0);
        view
    }

    fn frame(&mut self) {
        let input = self.viewer.headless_input(self.started.elapsed().as_secs_f64());
        self.viewer.frame(input).expect("a frame is drawn");
    }

    fn stats(&self) -> Stats {
        self.viewer.stats()
    }

    fn act(&mut self, alarm: &str, action: AlarmAction) {
        self.viewer.act_on_alarm(alarm, action, "A. Operator").expect("it can be done");
    }

    fn wait_for(&mut self, what: &str, is_so: impl Fn(&Stats) -> bool) {
        wait_for(what, MAX_WAIT, || {
            self.frame();
            is_so(&self.stats()).then_some(())
        });
    }

    /// Draws frames until the edit is shown or refused.
    fn outcome(&mut self) -> ReloadOutcome {
        wait_for("the file to be read again", MAX_WAIT, || {
            self.frame();
            self.reloader.step(&mut self.viewer)
        })
    }

    /// Changes the configuration, and requires that the change is shown.
    fn edit(&mut self, change: impl FnOnce(&mut Value)) {
        change(&mut self.scene.config);
        self.scene.write();
        assert_eq!(self.outcome(), ReloadOutcome::Shown);
        self.frame();
    }

    /// Draws the scene without labels, whose places depend on their former ones.
    fn picture(&mut self) -> Picture {
        assert!(self.viewer.set_layer_shown(LABELS, false));
        // Overlays answer from processes of their own.
        for _ in 0..4 {
            self.frame();
        }
        let picture = self.viewer.read_picture().expect("a frame was drawn");
        self.viewer.set_layer_shown(LABELS, true);
        picture
    }

    /// Returns the processes of plugins.
    fn processes(&self) -> BTreeMap<String, u32> {
        let plugins = self.stats().plugins.into_iter();
        plugins.filter_map(|plugin| Some((plugin.name, plugin.pid?))).collect()
    }

    /// Returns a number as it is shown, with its quality.
    fn value(&self, tag: &str) -> (String, &'static str) {
        let stats = self.stats();
        let found = stats.tags.iter().find(|one| one.id == tag).expect("there is such a tag");
        (format!("{:.1}", found.value.as_f64().expect("a number")), found.quality)
    }

    /// Waits until the picture is this one, except for flashing and settling parts.
    fn wait_for_picture(&mut self, what: &str, wanted: &Picture) {
        wait_for(what, MAX_WAIT, || is_same(&self.picture(), wanted).then_some(()));
    }

    fn alarm(&self, id: &str) -> Option<AlarmState> {
        self.stats().alarms.into_iter().find(|alarm| alarm.id == id).map(|alarm| alarm.state)
    }
}

fn is_same(a: &Picture, b: &Picture) -> bool {
    (a.width, a.height) == (b.width, b.height) && a.rgba8 == b.rgba8
}

#[test]
fn a_good_edit_shows_and_what_it_does_not_touch_goes_on() {
    let Some(peer) = Peer::start(&normal_values()) else { return };
    let mut view = View::open(scene(peer.port));
    view.wait_for("the alarms", |stats| stats.alarms.len() == 3);
    view.act("Fans", AlarmAction::Acknowledge);
    view.act("Oil", AlarmAction::Acknowledge);
    view.act("SF6", AlarmAction::Shelve(Duration::from_secs(600)));
    assert!(view.viewer.select_equipment("=S12D1T1-TA1"));
    view.viewer.look_from([14.0, 6.0, 15.0], [0.0, 2.0, 0.0]);
    view.viewer.set_theta(0.5);
    view.frame();
    let (processes, camera) = (view.processes(), view.stats().camera.eye);
    let first = view.picture();
    let goes_on = |view: &View| {
        assert_eq!(view.alarm("Fans"), Some(AlarmState::Acknowledged), "acknowledged");
        assert_eq!(view.alarm("SF6"), Some(AlarmState::Shelved), "shelved");
        assert_eq!(view.alarm("Oil"), Some(AlarmState::Acknowledged), "acknowledged");
        let stats = view.stats();
        assert_eq!(stats.camera.eye, camera);
        assert_eq!(stats.selected, ["=S12D1T1-TA1"]);
        assert!(stats.theta.values().all(|theta| *theta == 0.5), "{:?}", stats.theta);
        assert_eq!(stats.quality.bad, 0, "no value is lost");
        assert_eq!(view.value("T1.TopOil"), ("55.9".into(), "good"));
    };
    goes_on(&view);

    // What it looks like.
    view.edit(|config| config["theme"]["background"] = json!("#303030"));
    goes_on(&view);
    assert_eq!(view.processes(), processes);
    assert!(!is_same(&view.picture(), &first), "another background");

    // Tags before all others: the rest have other numbers, and plugins know the old ones.
    view.edit(|config| {
        config["tags"]["A.Double"] =
            json!({ "type": "f64", "unit": "°C", "expression": "{T1.TopOil} * 2" });
    });
    goes_on(&view);
    assert_eq!(view.processes(), processes);
    assert_eq!(view.value("A.Double"), ("111.8".into(), "good"));

    // A limit of an alarm, which returns to normal by it.
    view.edit(|config| config["alarms"]["Oil"]["condition"]["high"] = json!(60));
    view.frame();
    assert!(matches!(view.alarm("Oil"), None | Some(AlarmState::Normal)));
    view.edit(|config| config["alarms"]["Oil"]["condition"]["high"] = json!(50));
    view.frame();
    assert_eq!(view.alarm("Oil"), Some(AlarmState::Unacknowledged), "it is news");
    view.act("Oil", AlarmAction::Acknowledge);
    assert_eq!(view.processes(), processes);

    // One more piece of equipment, which the others stand before.
    view.edit(|config| {
        let more = json!({ "id": "=A0", "model": "breaker",
            "transform": { "translation": [0, 0, -12] } });
        config["scene"].as_array_mut().expect("a list").insert(0, more);
    });
    view.viewer.set_theta(0.5);
    view.frame();
    goes_on(&view);
    assert_eq!(view.processes(), processes);

    // Another address: its plugin starts anew, and the values of others stay.
    view.edit(|config| {
        config["tags"]["T1.OilLevel"]["source"]["address"]["register"] = json!(101);
    });
    view.wait_for("the value there", |stats| stats.quality.bad == 0);
    assert_ne!(view.processes()["bay"], processes["bay"]);
    assert_eq!(view.processes()["values"], processes["values"]);

    // All as it was.
    view.edit(|config| {
        *config = scene(peer.port).config;
    });
    view.wait_for("all values", |stats| stats.quality.bad == 0);
    view.viewer.set_theta(0.5);
    view.frame();
    goes_on(&view);
    view.wait_for_picture("the first picture", &first);
    assert_eq!(view.stats().reloads.bad, 0);
}

#[test]
fn no_value_of_another_device_goes_on() {
    let Some(peer) = Peer::start(&normal_values()) else { return };
    let mut view = View::open(scene(peer.port));
    let good = view.stats().quality.good;
    // Nobody answers there: all that would be shown is what the device before said.
    let silent = std::net::TcpListener::bind("127.0.0.1:0").expect("a free port");
    let port = silent.local_addr().expect("it is bound").port();
    view.edit(|config| config["plugins"]["bay"]["settings"]["port"] = json!(port));
    let stats = view.stats();
    assert_eq!((stats.quality.good, stats.quality.bad), (0, good));
    assert!(stats.tags.iter().all(|tag| tag.value.is_null()), "none is carried over");
    view.edit(|config| *config = scene(peer.port).config);
    view.wait_for("all values", |stats| stats.quality.bad == 0);
}

#[test]
fn a_live_view_that_leaves_its_quality_open_goes_by_the_device_and_a_picture_does_not() {
    let mut scene = Scene::without_tags();
    scene.config["window"] = json!({ "size": SIZE });
    scene.config["camera"] = json!({ "start": "bay" });
    scene.config["graphics"] = json!({ "ground": true, "morph_seconds": 0 });
    let mut view = View::open(scene);
    let shown = |view: &mut View| {
        view.wait_for("all meshes", |stats| stats.waiting == 0);
        view.viewer.read_picture().expect("a frame was drawn")
    };
    let left_open = shown(&mut view);
    view.edit(|config| config["graphics"]["quality"] = json!("low"));
    let low = shown(&mut view);
    view.edit(|config| config["graphics"]["quality"] = json!("medium"));
    let medium = shown(&mut view);
    assert!(!is_same(&low, &medium));
    let by_device = if view.stats().gpu.contains("llvmpipe") { &low } else { &medium };
    assert!(is_same(&left_open, by_device), "it goes by the device");
    view.edit(|config| {
        config["graphics"].as_object_mut().expect("an object").remove("quality");
    });
    assert!(is_same(&shown(&mut view), by_device), "after an edit, too");

    let loaded = LoadedScene::load(&view.path, &|_, _, _| {}).unwrap_or_else(|e| panic!("{e}"));
    let options = renderer_options(&loaded);
    let mut still = Viewer::new_headless(loaded, options, SIZE).expect("there is a device");
    still.frame(still.headless_input(0.0)).expect("a frame is drawn");
    let picture = still.read_picture().expect("a frame was drawn");
    assert!(is_same(&picture, &medium), "a picture is the same wherever it is drawn");
}

#[test]
fn a_bad_edit_changes_nothing_and_says_what_helps() {
    let Some(peer) = Peer::start(&normal_values()) else { return };
    let mut view = View::open(scene(peer.port));
    let (first, processes) = (view.picture(), view.processes());
    let good = serde_json::to_string_pretty(&view.scene.config).expect("values are JSON");
    let with = |change: &dyn Fn(&mut Value)| {
        let mut config = scene(peer.port).config;
        change(&mut config);
        serde_json::to_string_pretty(&config).expect("values are JSON")
    };
    let faulty = [
        (good[..good.len() / 2].to_owned(), "scene.json:"),
        (String::new(), "scene.json:1:1"),
        (with(&|c| c["bindings"][0]["tag"] = json!("T1.TopOli")), "T1.TopOil"),
        (with(&|c| c["models"]["breaker"]["file"] = json!("absent.glb")), "absent.glb"),
        (with(&|c| c["plugins"]["bay"]["settings"]["port"] = json!("x")), "settings"),
        (with(&|c| c["plugins"]["new"] = json!({ "plugin": "nobody.has.it" })), "nobody.has.it"),
        (with(&|c| c["tags"]["T1.TopOil"]["source"]["address"] = json!({})), "address"),
        (with(&|c| c["graphics"]["samples"] = json!(3)), "samples"),
        (with(&|c| c["graphics"]["device"] = json!("nobody's")), "nobody's"),
    ];
    for (bad, (text, cause)) in faulty.iter().enumerate() {
        view.scene.write_text(text);
        let ReloadOutcome::Refused(fault) = view.outcome() else { panic!("{cause} is shown") };
        assert!(fault.contains(cause), "{fault}");
        if let Some(place) = fault.strip_prefix(view.path.to_str().expect("UTF-8")) {
            let mut numbers = place.split(':').skip(1).map(str::parse::<u32>);
            let line_and_column = (numbers.next(), numbers.next());
            assert!(matches!(line_and_column, (Some(Ok(_)), Some(Ok(_)))), "{fault}");
            assert!(fault.contains("remedy"), "{fault}");
        } else {
            assert_eq!(*cause, "nobody's", "a device has no place in the file");
        }
        let reloads = view.stats().reloads;
        assert_eq!((reloads.good, reloads.bad), (0, bad as u64 + 1));
        assert_eq!(reloads.fault, Some(fault));
        assert_eq!(view.processes(), processes);
        view.wait_for_picture(cause, &first);
    }
    view.scene.write_text(&good);
    assert_eq!(view.outcome(), ReloadOutcome::Same, "what is shown");
    assert_eq!(view.stats().reloads.fault, None);
}

#[test]
fn an_edited_model_shows_and_a_bad_one_changes_nothing() {
    let Some(peer) = Peer::start(&normal_values()) else { return };
    let scene = scene(peer.port);
    // Models of its own, to be written.
    let models = scene.path("models");
    let built = fs::canonicalize(&models).expect("they are built");
    fs::remove_file(&models).expect("it is a link");
    fs::create_dir(&models).expect("the folder can be written");
    let names =
        ["breaker", "disconnector", "transformer", "yard"].map(|name| format!("{name}.glb"));
    for name in &names {
        fs::copy(built.join(name), models.join(name)).expect("it can be copied");
    }
    let mut view = View::open(scene);
    let (first, processes) = (view.picture(), view.processes());
    let (edited, other) = (models.join("yard.glb"), built.join("disconnector.glb"));

    fs::copy(&other, &edited).expect("it can be written");
    assert_eq!(view.outcome(), ReloadOutcome::Shown);
    assert!(!is_same(&view.picture(), &first), "another model");
    assert_eq!(view.processes(), processes, "no plugin is started again");
    assert_eq!(view.stats().quality.bad, 0, "no value is lost");
    let second = view.picture();

    let whole = fs::read(built.join("yard.glb")).expect("it is built");
    fs::write(&edited, &whole[..whole.len() / 2]).expect("it can be written");
    let ReloadOutcome::Refused(fault) = view.outcome() else { panic!("half a model is shown") };
    assert!(fault.contains("yard.glb") && fault.contains("remedy"), "{fault}");
    view.wait_for_picture("the model before", &second);

    // As programs write that replace files.
    fs::write(models.join("new"), &whole).expect("it can be written");
    fs::rename(models.join("new"), &edited).expect("it can be replaced");
    assert_eq!(view.outcome(), ReloadOutcome::Shown);
    view.wait_for_picture("the first picture", &first);
    assert_eq!(view.stats().reloads.fault, None);
}

#[test]
fn an_edit_shows_within_a_moment() {
    let Some(peer) = Peer::start(&normal_values()) else { return };
    let mut view = View::open(scene(peer.port));
    let (mut from_writing, mut from_settling) = (Vec::new(), Vec::new());
    for number in 0..TIMED {
        let grey = format!("#{0:02x}{0:02x}{0:02x}", 60 + 8 * number);
        view.scene.config["theme"]["background"] = json!(grey);
        view.scene.write();
        let written = Instant::now();
        assert_eq!(view.outcome(), ReloadOutcome::Shown);
        view.frame();
        from_writing.push(written.elapsed());
        from_settling.push(written.elapsed().saturating_sub(SETTLE_TIME));
    }
    for (what, times) in [("writing", &mut from_writing), ("settling", &mut from_settling)] {
        times.sort_unstable();
        let [median, most] = [times[TIMED / 2], times[TIMED - 1]].map(|t| t.as_secs_f64() * 1e3);
        println!("an edit shows {median:.0} ms (median), {most:.0} ms (most) after its {what}");
    }
    assert!(from_writing[TIMED - 1] < MAX_LATENCY);
}
