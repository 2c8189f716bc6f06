//! Origin of values: those that are not live are marked, each of them and by a band across the
//! scene, whether simulated, recorded or declared so, through restarts.

use std::path::PathBuf;
use std::time::{Duration, Instant};

use busbar_chart::Action;
use busbar_scene_loader::LoadedScene;
use busbar_viewer::reload::{ReloadOutcome, Reloader};
use busbar_viewer::{ChartCommand, Stats, Viewer, renderer_options};
use e2e::relay::Relay;
use e2e::{Process, Scene, busbar, finish, picture, wait_for};
use image::RgbImage;
use rustix::process::{Pid, Signal, kill_process};
use serde_json::{Value, json};

const SIZE: [u32; 2] = [960, 540];
const TRANSFORMER: &str = "=S12D1T1-TA1";
/// Number of the band's pixel rows, below its height at every size.
const BAND_ROWS: u32 = 14;
/// Least share of the band's pixels with dark ground; that of light letters and stripes follows.
const MIN_DARK: f64 = 0.35;
const MIN_LIGHT: f64 = 0.1;
/// Least number of pixels that a mark changes at a value: the border of its tag.
const MIN_MARK_PIXELS: usize = 60;
/// Longest wait for values or a process.
const MAX_WAIT: Duration = Duration::from_secs(60);

/// Returns the demo scene at a free port, its values constant.
fn scene() -> (Scene, u16) {
    let listener = std::net::TcpListener::bind("127.0.0.1:0").expect("a port is free");
    let port = listener.local_addr().expect("it is bound").port();
    let mut scene = Scene::demo(port);
    let tags = scene.config["tags"].as_object_mut().expect("the demo has tags");
    for tag in tags.values_mut() {
        if let Some(simulate) = tag.get_mut("simulate").and_then(Value::as_object_mut) {
            simulate.insert("shape".into(), json!("constant"));
        }
        tag["freshness_seconds"] = json!(20);
    }
    scene.config["graphics"] = json!({ "samples": 1, "quality": "low" });
    scene.config["window"] = json!({ "size": SIZE });
    scene.config["camera"] = json!({ "start": "bay" });
    (scene, port)
}

fn simulate(scene: &Scene) -> Process {
    let process = Process::start(busbar().arg("simulate").arg(scene.write()));
    process.wait_for_line(|line| (line == "ready").then_some(()));
    process
}

/// Renders a picture of a scene without panels, and its statistics.
fn rendered(scene: &Scene, size: [u32; 2]) -> (RgbImage, Value) {
    let mut command = busbar();
    command.arg("render").arg(scene.write()).arg("--stats").arg(scene.path("stats.json"));
    command.arg("--size").arg(format!("{}x{}", size[0], size[1]));
    command.arg("--out").arg(scene.path("picture.png")).args(["--seconds", "3"]);
    finish(&mut command).expect_code(0);
    (picture::load(&scene.path("picture.png")), scene.stats().0)
}

/// Returns a scene with one recorded tag at the transformer.
fn replay() -> Scene {
    let mut scene = Scene::without_tags();
    scene.add_plugin("replay");
    let file = scene.path("log.csv");
    let rows: String = (0..3600).map(|second| format!("{second};55,5\n")).collect();
    std::fs::write(&file, format!("time;Oil\n{rows}")).expect("it can be written");
    scene.config["plugins"]["recording"] = json!({
        "plugin": "replay",
        "settings": {
            "file": file,
            "csv": { "time_format": "seconds", "delimiter": ";", "decimal": "," },
        },
    });
    with_value(&mut scene, "recording", json!({ "column": "Oil" }));
    scene
}

/// Binds a tag of an instance to the transformer.
fn with_value(scene: &mut Scene, plugin: &str, address: Value) {
    let config = &mut scene.config;
    config["plugins"]["values"] = json!({ "plugin": "power_overlay" });
    config["overlays"] = json!(["values"]);
    config["tags"]["T1.TopOil"] = json!({
        "type": "f64", "unit": "°C", "freshness_seconds": 20,
        "source": { "instance": plugin, "address": address }
    });
    config["bindings"] =
        json!([{ "tag": "T1.TopOil", "node": "=S12D1T1-TA1/tank", "role": "value" }]);
    config["graphics"] = json!({ "samples": 1, "quality": "low" });
    config["window"] = json!({ "size": SIZE });
    config["camera"] = json!({ "start": "bay" });
}

/// Reports whether the band lies across the top of a picture.
fn has_band(picture: &RgbImage) -> bool {
    let pixels: Vec<u8> = picture
        .enumerate_pixels()
        .filter(|(_, y, _)| *y < BAND_ROWS)
        .map(|(.., pixel)| *pixel.0.iter().max().expect("three channels"))
        .collect();
    let share = |is: &dyn Fn(u8) -> bool| {
        pixels.iter().filter(|level| is(**level)).count() as f64 / pixels.len() as f64
    };
    share(&|level| level < 60) >= MIN_DARK && share(&|level| level > 200) >= MIN_LIGHT
}

/// Counts the pixels below the band by which two pictures differ.
fn marks(a: &RgbImage, b: &RgbImage) -> usize {
    let pixels = a.enumerate_pixels().zip(b.pixels());
    pixels.filter(|((_, y, a), b)| *y > 24 && a != b).count()
}

fn origin(stats: &Value) -> Vec<&str> {
    let all = stats["origin"].as_array().expect("statistics have origins");
    all.iter().filter_map(Value::as_str).collect()
}

/// Returns the origins of all tags, the same for each.
fn origins_of_tags(stats: &Value) -> Vec<Value> {
    let tags = stats["tags"].as_array().expect("statistics have tags");
    let mut all: Vec<Value> = tags.iter().map(|tag| tag["origin"].clone()).collect();
    all.dedup();
    all
}

#[test]
fn a_simulated_device_is_marked_at_each_value_and_by_a_band() {
    let (mut scene, port) = scene();
    let simulator = simulate(&scene);
    let (direct, stats) = rendered(&scene, SIZE);
    assert_eq!(origin(&stats), ["simulated"]);
    assert_eq!(origins_of_tags(&stats), [json!(["simulated"])]);
    assert!(has_band(&direct));
    // Behind a relay nobody can tell; what the configuration says is the same then.
    let relay = Relay::start(port);
    scene.config["plugins"]["bay"]["settings"]["port"] = json!(relay.port);
    let (unknown, stats) = rendered(&scene, SIZE);
    assert_eq!((origin(&stats).len(), origins_of_tags(&stats)), (0, vec![json!([])]));
    assert!(!has_band(&unknown));
    assert!(marks(&direct, &unknown) >= MIN_MARK_PIXELS, "{}", marks(&direct, &unknown));
    scene.config["plugins"]["bay"]["simulated"] = json!(true);
    let (declared, stats) = rendered(&scene, SIZE);
    assert_eq!(origin(&stats), ["simulated"]);
    assert_eq!(origins_of_tags(&stats), [json!(["simulated"])]);
    assert!(marks(&declared, &unknown) >= MIN_MARK_PIXELS);
    assert!(has_band(&declared));
    let (small, _) = rendered(&scene, [320, 180]);
    assert!(has_band(&small));
    scene.config["theme"]["colors"] = json!("dark");
    let (dark, _) = rendered(&scene, SIZE);
    let inverted = RgbImage::from_fn(dark.width(), dark.height(), |x, y| {
        image::Rgb(dark.get_pixel(x, y).0.map(|level| 255 - level))
    });
    assert!(has_band(&inverted), "light on dark");
    simulator.signal(Signal::TERM);
    simulator.finish().expect_code(0);
}

#[test]
fn plugins_in_this_process_are_marked_by_its_own_connections() {
    let (mut scene, _) = scene();
    let simulator = simulate(&scene);
    scene.config["isolation"] = json!("none");
    let (picture, stats) = rendered(&scene, SIZE);
    assert_eq!(origin(&stats), ["simulated"]);
    assert_eq!(origins_of_tags(&stats), [json!(["simulated"])]);
    assert!(has_band(&picture));
    simulator.signal(Signal::KILL);
}

#[test]
fn a_recording_is_marked_as_replay_and_looks_otherwise_than_a_simulation() {
    let mut scene = replay();
    let (recorded, stats) = rendered(&scene, SIZE);
    assert_eq!(origin(&stats), ["recorded"]);
    assert_eq!(origins_of_tags(&stats), [json!(["recorded"])]);
    assert!(has_band(&recorded));
    scene.config["plugins"]["recording"]["simulated"] = json!(true);
    let (both, stats) = rendered(&scene, SIZE);
    assert_eq!(origin(&stats), ["simulated", "recorded"]);
    assert!(has_band(&both));
    assert!(marks(&recorded, &both) >= MIN_MARK_PIXELS, "each has a tag of its own");
    // What has ended is bad, and as little live as before.
    let file = scene.path("log.csv");
    std::fs::write(file, "time;Oil\n0;55,5\n0,2;55,5\n").expect("it can be written");
    let (ended, stats) = rendered(&scene, SIZE);
    assert_eq!(stats["tags"][0]["quality"], "bad");
    assert_eq!(origins_of_tags(&stats), [json!(["simulated", "recorded"])]);
    assert!(has_band(&ended));
}

#[test]
fn generated_samples_are_marked_as_simulated() {
    let mut scene = Scene::without_tags();
    scene.add_plugin("sample_generator");
    scene.config["plugins"]["generator"] = json!({ "plugin": "sample_generator" });
    with_value(&mut scene, "generator", json!({}));
    scene.config["alarms"] = json!({
        "Oil": {
            "tag": "T1.TopOil", "condition": { "high": -1e9 }, "priority": "high",
            "message": "Oil is hot"
        }
    });
    let (picture, stats) = rendered(&scene, SIZE);
    assert_eq!(origin(&stats), ["simulated"]);
    let alarm = &stats["alarms"][0];
    assert_eq!([&alarm["id"], &alarm["origin"]], [&json!("Oil"), &json!(["simulated"])]);
    assert_eq!(origins_of_tags(&stats), [json!(["simulated"])]);
    assert!(has_band(&picture));
}

/// Adds an overlay that judges the top oil of the transformer.
fn with_judgment(scene: &mut Scene) {
    scene.add_plugin("condition");
    let quantity = json!({
        "name": "Oil", "role": "oil", "unit": "°C", "attention": 1e9, "alarm": 1e12,
    });
    let config = &mut scene.config;
    config["plugins"]["judged"] = json!({
        "plugin": "condition",
        "settings": { "quantities": [quantity], "equipment": [TRANSFORMER] },
    });
    let list = |value: &mut Value, more: Value| value.as_array_mut().expect("a list").push(more);
    list(&mut config["overlays"], json!("judged"));
    list(
        &mut config["bindings"],
        json!({ "tag": "T1.TopOil", "node": TRANSFORMER, "role": "oil" }),
    );
}

/// Returns verdict and origins of the transformer.
fn verdict(stats: &Value) -> (String, Value) {
    let mut all = stats["verdicts"].as_array().expect("statistics have verdicts").iter();
    let own = all.find(|of| of["overlay"] == "judged" && of["equipment"] == TRANSFORMER);
    let own = own.expect("equipment that settings name has a verdict");
    (own["verdict"].as_str().expect("a text").to_owned(), own["origin"].clone())
}

#[test]
fn a_verdict_has_the_origins_of_the_values_that_it_rests_on() {
    let (mut scene, port) = scene();
    with_judgment(&mut scene);
    let simulator = simulate(&scene);
    let judged = |scene: &Scene| verdict(&rendered(scene, SIZE).1);
    assert_eq!(judged(&scene), ("normal".into(), json!(["simulated"])));
    // Behind a relay nobody can tell, until the configuration does.
    let relay = Relay::start(port);
    scene.config["plugins"]["bay"]["settings"]["port"] = json!(relay.port);
    assert_eq!(judged(&scene), ("normal".into(), json!([])));
    scene.config["plugins"]["bay"]["simulated"] = json!(true);
    assert_eq!(judged(&scene), ("normal".into(), json!(["simulated"])));
    simulator.signal(Signal::TERM);
    simulator.finish().expect_code(0);
    // Values that never came have no origin, and no verdict is made of them.
    let (verdict, _) = judged(&scene);
    assert_eq!(verdict, "unknown");
    let mut recorded = replay();
    with_judgment(&mut recorded);
    assert_eq!(judged(&recorded), ("normal".into(), json!(["recorded"])));
    recorded.config["plugins"]["recording"]["simulated"] = json!(true);
    assert_eq!(judged(&recorded), ("normal".into(), json!(["simulated", "recorded"])));
}

/// View of an operator without a window of its own.
struct View {
    scene: Scene,
    path: PathBuf,
    viewer: Viewer,
    reloader: Reloader,
    started: Instant,
}

impl View {
    fn open(scene: Scene) -> Self {
        let path = scene.write();
        let loaded = LoadedScene::load(&path, &|_, _, _| {}).unwrap_or_else(|e| panic!("{e}"));
        let options = renderer_options(&loaded);
        let viewer = Viewer::new_offscreen(loaded, options, SIZE).expect("there is a device");
        let reloader = Reloader::start(&path, || {}).expect("a file can be watched");
        Self { scene, path, viewer, reloader, started: Instant::now() }
    }

    fn frame(&mut self) {
        let input = self.viewer.headless_input(self.started.elapsed().as_secs_f64());
        self.viewer.frame(input).expect("a frame is drawn");
    }

    fn wait_for(&mut self, what: &str, is_so: impl Fn(&Stats) -> bool) {
        wait_for(what, MAX_WAIT, || {
            self.frame();
            is_so(&self.viewer.stats()).then_some(())
        });
    }

    fn edit(&mut self, change: impl FnOnce(&mut Value)) {
        change(&mut self.scene.config);
        assert_eq!(self.scene.write(), self.path);
        let outcome = wait_for("the file to be read again", MAX_WAIT, || {
            self.frame();
            self.reloader.step(&mut self.viewer)
        });
        assert_eq!(outcome, ReloadOutcome::Shown);
        self.frame();
    }

    fn picture(&mut self) -> RgbImage {
        let picture = self.viewer.read_picture().expect("a frame was drawn");
        RgbImage::from_fn(picture.width, picture.height, |x, y| {
            let at = 4 * (y * picture.width + x) as usize;
            image::Rgb([0, 1, 2].map(|channel| picture.rgba8[at + channel]))
        })
    }
}

fn is_good_and(origin: &'static str) -> impl Fn(&Stats) -> bool {
    move |stats| stats.quality.bad == 0 && stats.tags.iter().all(|tag| tag.origin == [origin])
}

#[test]
fn no_value_of_a_simulator_is_ever_shown_unmarked() {
    let (scene, _) = scene();
    let mut view = View::open(scene);
    view.frame();
    assert!(view.viewer.stats().origin.is_empty(), "there is none yet");
    let simulator = simulate(&view.scene);
    for _ in 0..2 {
        let begun = Instant::now();
        loop {
            view.frame();
            let stats = view.viewer.stats();
            let unmarked = |tag: &&busbar_viewer::TagStats| {
                tag.quality == "good" && tag.origin != ["simulated"]
            };
            assert_eq!(stats.tags.iter().find(unmarked).map(|tag| &tag.id), None);
            if is_good_and("simulated")(&stats) {
                break;
            }
            assert!(begun.elapsed() < MAX_WAIT, "{:?}", stats.quality);
        }
        // Marks outlive the plugin's process and its values.
        let bay = view.viewer.stats().plugins.into_iter().find(|plugin| plugin.name == "bay");
        let pid = bay.and_then(|bay| bay.pid).expect("it has a process");
        let pid = Pid::from_raw(pid.try_into().expect("a number of a process"));
        kill_process(pid.expect("not 0"), Signal::KILL).expect("it runs");
        view.wait_for("its end", |stats| stats.quality.bad > 0);
        view.frame();
        assert_eq!(view.viewer.stats().origin, ["simulated"]);
        assert!(has_band(&view.picture()), "while its values are bad");
    }
    // Marks outlive a reload that touches the instance's tags, and the simulator itself.
    view.wait_for("values", is_good_and("simulated"));
    view.edit(|config| {
        let tags = config["tags"].as_object_mut().expect("tags");
        tags.insert("A.Sum".into(), json!({ "type": "f64", "expression": "{T1.P} + {T1.TopOil}" }));
    });
    view.wait_for("values, a derived one among them", is_good_and("simulated"));
    simulator.signal(Signal::KILL);
    drop(simulator);
    view.wait_for("the end of the simulator", |stats| stats.quality.bad > 0);
    view.frame();
    assert_eq!(view.viewer.stats().origin, ["simulated"]);
    assert!(has_band(&view.picture()));
    // The band is no panel that one can hide.
    for shown in [true, false] {
        view.viewer.set_panels_shown(shown);
        view.frame();
        view.frame();
        let picture = view.picture();
        let left = if shown { 400 } else { 0 };
        let scene = image::imageops::crop_imm(&picture, left, 0, SIZE[0] - left, SIZE[1]);
        assert!(has_band(&scene.to_image()), "panels shown: {shown}");
    }
}

#[test]
fn a_chart_that_shows_the_past_says_so_with_its_panel_hidden() {
    let mut scene = Scene::without_tags();
    scene.add_plugin("gas_analysis");
    let file = scene.path("samples.csv");
    let day = time::Date::from_calendar_date(2026, time::Month::June, 30).expect("a day");
    let rows = fleet::histories(3, day);
    std::fs::write(&file, fleet::csv(&rows)).expect("it can be written");
    let config = &mut scene.config;
    config["plugins"]["gases"] =
        json!({ "plugin": "gas_analysis", "settings": { "fleet": { "file": file } } });
    config["chart"] =
        json!({ "instance": "gases", "position": [0, 12.5, 0], "size": [66, 17, 26] });
    config["graphics"] = json!({ "samples": 1, "quality": "low" });
    config["window"] = json!({ "size": SIZE });
    config["camera"] = json!({ "start": "bay" });
    let mut view = View::open(scene);
    view.wait_for("records", |stats| stats.chart.as_ref().is_some_and(|chart| chart.records > 0));
    assert!(!has_band(&view.picture()));
    let mut show = |at| {
        view.viewer.apply_chart_command(&ChartCommand::Apply(Action::SetPlayhead(at)));
        view.frame();
        view.frame();
        (view.viewer.stats().origin, has_band(&view.picture()))
    };
    assert_eq!(show(Some(1_700_000_000_000_000_000)), (vec!["historical"], true));
    assert_eq!(show(None), (vec![], false));
}
