//! Work orders and the asset register on the faceplate of a breaker, from plugins in processes of
//! their own, with faults of their sources.

use std::fs::File;
use std::path::Path;
use std::time::{Duration, SystemTime};

use busbar_scene_loader::LoadedScene;
use busbar_viewer::{PluginStats, RecordStats, RendererOptions, Viewer};
use e2e::display::{Display, LEFT_BUTTON};
use e2e::peer::{Peer, normal_values};
use e2e::window::Window;
use e2e::{Scene, picture, wait_for};
use rustix::process::{Pid, Signal, kill_process};
use serde_json::json;
use substation::{AssetRow, StationRecords, WorkRow};

const SIZE: [u32; 2] = [1280, 720];
/// Longest time until a change of a source shows.
const MAX_WAIT: Duration = Duration::from_secs(60);
const POLE: &str = "=S12D1Q1-QA1-L2";
/// Positions of the breaker's middle pole and of its work button, pixels.
const PICKED: [i32; 2] = [921, 262];
const WORK_BUTTON: [i32; 2] = [1090, 51];
const DAY: Duration = Duration::from_secs(86_400);

fn work(number: usize, equipment: &str, text: &'static str, reported: &str) -> WorkRow {
    WorkRow {
        kind: "Defect",
        number,
        equipment: equipment.into(),
        text,
        status: "planned",
        reported: reported.into(),
        priority: "2",
    }
}

/// Returns records of a pole and of another breaker.
fn records() -> StationRecords {
    let closed = WorkRow {
        kind: "Inspection",
        status: "closed",
        priority: "",
        ..work(3, POLE, "Timing", "2026-11-20")
    };
    let critical = WorkRow { priority: "1", ..work(4, "2211", "Closing coil open", "2026-10-01") };
    StationRecords {
        work: vec![
            work(1, POLE, "Counter sticks", "2025-03-01"),
            work(2, "=S12D1Q9-QA1", "Of another", "2026-11-01"),
            closed,
            critical,
        ],
        assets: vec![AssetRow {
            equipment: POLE.into(),
            made: ["Nordwind Switchgear".into(), "NS-B 50".into()],
            serial: "QA07-43356".into(),
            year: 2007,
            voltage: 252.0,
            rating: "4000 A, 50 kA".into(),
            criticality: "A",
        }],
        dispatch: [(POLE.to_owned(), "2211".to_owned())].into(),
    }
}

/// Returns the demo scene with records.
fn scene(port: u16) -> Scene {
    let mut scene = Scene::demo(port);
    for model in ["transformer", "breaker", "disconnector"] {
        scene.config["models"][model]["theta"] = json!(0.7);
    }
    scene.config["graphics"] = json!({ "samples": 1 });
    scene.config["window"] = json!({ "size": SIZE });
    scene.config["camera"] = json!({ "start": "bay", "transition_seconds": 0 });
    ["csv_records", "sqlite_records"].iter().for_each(|plugin| scene.add_plugin(plugin));
    let folder = scene.path("");
    records().add_to(&mut scene.config, &folder);
    records().write(&scene.path("")).expect("they can be written");
    scene
}

struct View {
    viewer: Viewer,
    scene: Scene,
}

impl View {
    /// Opens a view of the breaker with its faceplate.
    fn open() -> Self {
        let scene = scene(1);
        let loaded = LoadedScene::load(&scene.write(), &|_, _, _| {});
        let loaded = loaded.unwrap_or_else(|error| panic!("{error}"));
        let options = RendererOptions { samples: 1, ..Default::default() };
        let mut viewer =
            Viewer::new_headless(loaded, options, [64, 64]).expect("there is a device");
        assert!(viewer.select_equipment("2211"), "it is known by its number in dispatch");
        Self { viewer, scene }
    }

    /// Waits until work and register are as expected.
    fn until(
        &mut self,
        what: &str,
        holds: impl Fn(&RecordStats, &RecordStats) -> bool,
    ) -> [RecordStats; 2] {
        wait_for(what, MAX_WAIT, || {
            let input = self.viewer.headless_input(0.0);
            self.viewer.frame(input).expect("a frame is drawn");
            let lists = self.viewer.stats().faceplate?.records;
            let [work, register] = lists.try_into().ok()?;
            holds(&work, &register).then_some([work, register])
        })
    }

    fn plugin(&self, name: &str) -> PluginStats {
        let plugins = self.viewer.stats().plugins;
        plugins.into_iter().find(|plugin| plugin.name == name).expect("it is configured")
    }

    fn pid(&self, plugin: &str) -> Option<Pid> {
        Pid::from_raw(self.plugin(plugin).pid? as i32)
    }
}

fn age(file: &Path, age: Duration) {
    let file = File::options().append(true).open(file).expect("it is there");
    file.set_modified(SystemTime::now() - age).expect("its time can be set");
}

#[test]
fn a_breaker_has_its_work_and_its_register_whatever_it_is_called_there() {
    let mut view = View::open();
    let [work, register] = view.until("records", |work, _| work.rows.len() == 3);
    assert_eq!((work.title.as_str(), work.source.as_str()), ("Work", "work.csv"));
    assert_eq!(
        work.rows,
        [
            ["", "critical", "open", "2026-10-01", "Defect", "4", "Closing coil open", "planned"],
            ["", "serious", "open", "2025-03-01", "Defect", "1", "Counter sticks", "planned"],
            ["", "", "closed", "2026-11-20", "Inspection", "3", "Timing", "closed"],
        ]
    );
    assert_eq!((work.open, work.left_out, work.uncertainty), (2, 0, None));
    assert_eq!((register.source.as_str(), register.uncertainty), ("register.db", None));
    let made = ["Nordwind Switchgear", "NS-B 50", "QA07-43356", "2007", "252 kV"];
    assert_eq!(register.rows[0][4..9], made);
    assert!(view.viewer.stats().faceplate.is_some_and(|f| !f.tags.is_empty()), "live values too");
}

#[test]
fn a_source_that_changes_is_read_and_one_that_is_lost_or_old_says_so() {
    let mut view = View::open();
    let good = |work: &RecordStats, register: &RecordStats| {
        work.rows.len() == 3 && work.uncertainty.is_none() && register.uncertainty.is_none()
    };
    view.until("records", good);
    let (file, mut more) = (view.scene.path("work.csv"), records());
    more.work.push(work(5, "2211", "Painted", "2026-11-22"));
    let mut bad = work(6, "", "of nothing", "2026-11-22");
    bad.priority = "";
    more.work.push(bad);
    more.write(&view.scene.path("")).expect("they can be written");
    let [work, _] = view.until("a new row", |work, _| work.rows.len() == 4);
    assert_eq!((work.rows[0][6].as_str(), work.left_out), ("Painted", 1));

    age(&file, 5 * DAY);
    let words = "old, nothing came for 5 days";
    view.until("that it is old", |work, _| work.uncertainty.as_deref() == Some(words));
    std::fs::remove_file(&file).expect("it is there");
    let is_lost = |work: &RecordStats, _: &RecordStats| {
        work.uncertainty.as_ref().is_some_and(|uncertainty| uncertainty.contains("No such file"))
    };
    let [work, _] = view.until("that it is lost", is_lost);
    assert_eq!(work.rows.len(), 4, "the last rows stay");

    std::fs::write(view.scene.path("register.db"), "no database").expect("it can be written");
    let is_lost = |_: &RecordStats, register: &RecordStats| register.uncertainty.is_some();
    view.until("that the register is none", is_lost);
    records().write(&view.scene.path("")).expect("they can be written");
    view.until("that both are back", good);
}

#[test]
fn a_plugin_that_is_lost_takes_its_records_into_doubt_and_brings_them_back() {
    let mut view = View::open();
    view.until("records", |work, register| work.rows.len() == 3 && register.rows.len() == 1);
    // Once it comes back by itself; too often, and it is left alone.
    wait_for("its quarantine", MAX_WAIT, || {
        if let Some(pid) = view.pid("work") {
            kill_process(pid, Signal::KILL).expect("it runs");
        }
        view.until("a frame", |_, _| true);
        (view.plugin("work").state == "quarantined").then_some(())
    });
    let [work, register] = view.until("doubt", |work, _| work.uncertainty.is_some());
    assert_eq!((work.rows.len(), register.uncertainty), (3, None), "the rows stay, in doubt");
    view.viewer.start_plugin("work");
    let is_back =
        |work: &RecordStats, _: &RecordStats| work.uncertainty.is_none() && work.rows.len() == 3;
    view.until("that it is back", is_back);
}

#[test]
fn a_click_on_a_breaker_shows_its_work_in_a_window() {
    let (Some(peer), Some(display)) = (Peer::start(&normal_values()), Display::start(SIZE)) else {
        return;
    };
    let window = Window::open(scene(peer.port), display, 24);
    let click = |button, name: &str| {
        window.display.click_button(LEFT_BUTTON, button);
        window.display.xdotool("sleep 1");
        window.screenshot(name)
    };
    let picked = click(PICKED, "records_picked");
    let work = click(WORK_BUTTON, "records_work");
    assert!(picture::difference(&picked, &work).is_some(), "its work comes into view");
    let stats = window.close().0;
    let lists = &stats["faceplate"]["records"];
    assert_eq!(stats["faceplate"]["id"], POLE);
    assert_eq!([&lists[0]["title"], &lists[1]["title"]], ["Work", "Asset register"]);
    assert_eq!(lists[0]["rows"][0][1], "critical");
}

#[test]
fn a_plugin_without_records_is_told_where_it_is_named() {
    let mut scene = scene(1);
    scene.config["records"] = json!(["work", "optimizer"]);
    let error = LoadedScene::load(&scene.write(), &|_, _, _| {}).err().expect("it is refused");
    let text = error.to_string();
    assert!(text.contains("/records/1") && text.contains("busbar.records/1-draft"), "{text}");
}
