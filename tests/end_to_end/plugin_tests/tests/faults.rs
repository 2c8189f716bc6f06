//! Plugin faults: deaths while the scene loads, storms, and resource limits of a plugin's process.
//! The view is there, continues, and reports the fault.

use std::fs;
use std::path::Path;
use std::process::Command;
use std::time::{Duration, Instant};

use e2e::faulty_plugins::FaultyPluginScene;
use e2e::{Output, Scene, Stats, built, built_folder, busbar, finish, wait_for};
use rustix::process::{Signal, kill_process};
use serde_json::{Value, json};

use crate::view::{MAX_FRAME, MAX_TO_BAD, MAX_TO_GOOD, View};

#[path = "common/view.rs"]
mod view;

/// Duration of the frame-time measurement beside a storm.
const STORM: Duration = Duration::from_secs(3);
/// Greatest address space of a greedy plugin, 10^6 bytes.
const MEMORY_MEGABYTES: u64 = 512;

/// Returns a scene of a steady plugin with its three tags beside one that has this fault, and one
/// tag.
fn beside(fault: Value) -> FaultyPluginScene {
    let mut trouble = FaultyPluginScene::with_plugin("trouble.steady");
    let name = format!("libfault_injector.{}", std::env::consts::DLL_EXTENSION);
    fs::copy(built(built_folder().join(&name)), trouble.path("plugins").join(&name))
        .expect("it can be copied");
    trouble.config["plugins"]["faulty"] = json!({ "plugin": "fault_injector", "settings": fault });
    trouble
}

fn with_tag(fault: Value) -> FaultyPluginScene {
    let mut trouble = beside(fault);
    trouble.config["tags"]["F"] =
        json!({ "type": "f64", "source": { "instance": "faulty", "address": {} } });
    trouble
}

fn run(command: &str, trouble: &FaultyPluginScene) -> Output {
    let mut program = busbar();
    program.arg(command).arg(trouble.write());
    if command == "render" {
        program.args(["--seconds", "2", "--out"]).arg(trouble.path("picture.png"));
        program.arg("--stats").arg(trouble.path("stats.json"));
    }
    finish(&mut program)
}

#[track_caller]
fn assert_says(output: &Output, words: &[&str]) {
    for word in words {
        assert!(output.stderr.contains(word), "no '{word}' in: {}", output.stderr);
    }
}

/// Asserts that the scene is shown with the others' values, and the faulty plugin is in quarantine.
#[track_caller]
fn assert_shown(trouble: &FaultyPluginScene, words: &[&str]) -> Stats {
    let output = run("render", trouble).expect_code(0);
    assert_says(&output, words);
    let stats = Stats::read(&trouble.path("stats.json"));
    for id in ["A", "B", "C"] {
        assert_eq!(stats.tag(id).quality, "good", "{id}");
    }
    let plugins = stats.0["plugins"].as_array().expect("there are plugins");
    let faulty = plugins.iter().find(|plugin| plugin["name"] == "faulty").expect("it is there");
    assert_eq!((&faulty["state"], &faulty["deaths"]), (&json!("quarantined"), &json!(3)));
    stats
}

/// Injects each kind of fault at each function once, in 49 processes beside one view; `cargo xtask
/// faults` does it 40 times and measures.
#[test]
fn a_view_survives_every_fault_at_every_function() {
    let folder = tempfile::tempdir().expect("a temporary folder can be made");
    let mut command = Command::new(built(built_folder().join("faults")));
    let library = format!("libfault_injector.{}", std::env::consts::DLL_EXTENSION);
    command.arg("--library").arg(built(built_folder().join(library)));
    command.arg("--out").arg(folder.path()).args(["--storm-only", "--injections", "250"]);
    finish(&mut command).expect_code(0);
    let report = fs::read(folder.path().join("report.json")).expect("it is written");
    let report: Value = serde_json::from_slice(&report).expect("it is JSON");
    assert!(report["injections"].as_u64() >= Some(250), "{report:#}");
}

#[test]
fn telemetry_that_dies_while_the_scene_loads_keeps_nothing_from_being_shown() {
    for (kind, at, words) in [
        ("segfault", "create", "killed by SIGSEGV"),
        ("exit", "create", "exited with code 0"),
        ("panic", "create", "`create` failed"),
        ("abort", "start", "killed by SIGABRT"),
        ("panic", "start", "`start` failed"),
    ] {
        let trouble = with_tag(json!({ "kind": kind, "at": at }));
        let stats = assert_shown(&trouble, &[words, "in quarantine after 3 deaths"]);
        let tag = stats.tag("F");
        assert_eq!((tag.quality.as_str(), tag.value), ("bad", Value::Null), "{kind} at {at}");
        assert_eq!(tag.reason.as_deref(), Some("communication"), "{kind} at {at}");
        if at == "create" {
            let words = ["error: ", "it died while the scene was loaded", words, "remedy: "];
            assert_says(&run("check", &trouble).expect_code(1), &words);
        }
    }
}

/// `check` is asked once, so that a plugin that dies of it serves its tags later.
#[test]
fn telemetry_that_dies_of_its_check_is_started_all_the_same() {
    let trouble = with_tag(json!({ "kind": "segfault", "at": "check" }));
    assert_says(&run("check", &trouble).expect_code(1), &["error: ", "killed by SIGSEGV"]);
    let output = run("render", &trouble).expect_code(0);
    assert_says(&output, &["warning: ", "it died while the scene was loaded"]);
    let stats = Stats::read(&trouble.path("stats.json"));
    assert_eq!(stats.tag("F").quality, "good");
}

#[test]
fn an_overlay_that_dies_while_the_scene_loads_keeps_nothing_from_being_shown() {
    for (kind, words) in [("segfault", "killed by SIGSEGV"), ("panic", "`configure` failed")] {
        let mut trouble = beside(json!({ "kind": kind, "at": "configure" }));
        trouble.config["overlays"] = json!(["faulty"]);
        assert_shown(&trouble, &["warning: ", words, "in quarantine after 3 deaths"]);
        assert_says(&run("check", &trouble).expect_code(1), &["error: ", words]);
    }
}

#[test]
fn a_model_whose_optimizer_fails_is_shown_in_full_detail() {
    for (kind, words) in [
        ("segfault", "killed by SIGSEGV"),
        ("deadlock", "`optimize` took longer than"),
        ("out_of_range", "invalid collapse sequence"),
        ("panic", "fault_injector"),
    ] {
        let mut trouble = beside(json!({ "kind": kind, "at": "optimize" }));
        let model = e2e::model("breaker.glb");
        trouble.config["models"]["m"] = json!({ "file": model, "optimizer": "faulty" });
        trouble.config["scene"] = json!([{ "id": "=N1", "model": "m" }]);
        trouble.config["cache"] = json!({ "max_megabytes": 0 });
        trouble.config["supervision"] = json!({ "optimize_seconds": 0.5, "restart_seconds": 10 });
        let output = run("render", &trouble).expect_code(0);
        assert_says(&output, &["warning: ", "model 'm' is shown in full detail", words]);
        let stats = Stats::read(&trouble.path("stats.json"));
        assert_eq!(stats.count("triangles"), stats.count("triangles_full"), "{kind}");
        assert!(stats.count("triangles") > 0, "{kind}");
        let words = ["error: ", "model 'm' is shown in full detail", words, "/models/m/optimizer"];
        assert_says(&run("check", &trouble).expect_code(1), &words);
    }
}

/// Wrong settings are errors without a plugin's process, too: there is no death to survive.
#[test]
fn settings_that_are_wrong_are_errors_still() {
    let trouble = with_tag(json!({ "kind": "flood", "at": "create" }));
    for command in ["check", "render"] {
        assert_says(&run(command, &trouble).expect_code(1), &["error: ", "cannot happen at"]);
    }
}

#[test]
#[allow(clippy::print_stderr, reason = "the figure that was measured")]
fn frames_go_on_beside_a_storm_of_deaths() {
    let mut trouble = FaultyPluginScene::with_plugin("trouble.segfault");
    trouble.config["supervision"] = json!({ "restart_seconds": 0, "max_deaths": 0 });
    let mut view = View::open(trouble);
    let (start, mut last, mut gaps) = (Instant::now(), Instant::now(), Vec::new());
    while start.elapsed() < STORM {
        view.frame();
        gaps.push(last.elapsed());
        last = Instant::now();
        std::thread::sleep(Duration::from_millis(10));
    }
    gaps.sort();
    let (middle, longest) = (gaps[gaps.len() / 2], gaps[gaps.len() - 1]);
    let deaths = view.plugin("trouble").deaths;
    eprintln!(
        "{} frames beside {deaths} deaths: {middle:?} apart, at most {longest:?}",
        gaps.len()
    );
    assert!(deaths > 2, "{deaths} deaths are no storm");
    assert!(middle <= Duration::from_millis(100), "frames are {middle:?} apart");
    assert!(longest < MAX_FRAME, "{longest:?} between two frames");
}

#[test]
fn a_plugin_that_wants_all_memory_dies_of_its_limit_alone() {
    let mut trouble = FaultyPluginScene::with_plugin("trouble.greedy");
    trouble.config["plugins"]["trouble"]["memory_megabytes"] = json!(MEMORY_MEGABYTES);
    trouble.config["plugins"]["other"] = json!({ "plugin": "trouble.steady" });
    trouble.config["tags"]["D"] =
        json!({ "type": "f64", "source": { "instance": "other", "address": {} } });
    trouble.config["supervision"] = json!({ "max_deaths": 1 });
    let mut view = View::open(trouble);
    let quality_of = |view: &View, id: &str| {
        let tags = view.viewer.stats().tags;
        tags.into_iter().find(|tag| tag.id == id).expect("it is configured").quality
    };
    view.wait_for("a good value", MAX_TO_GOOD, |view| quality_of(view, "D") == "good");
    let mut most = 0;
    wait_for("its death", 4 * MAX_TO_GOOD, || {
        view.frame();
        assert_eq!(quality_of(&view, "D"), "good", "the others go on");
        let plugin = view.plugin("trouble");
        most = most.max(plugin.memory_bytes.unwrap_or_default());
        (plugin.state == "quarantined").then_some(())
    });
    let death = view.plugin("trouble").last_death.expect("it died");
    assert!(death.contains("killed by SIGABRT"), "{death}");
    assert!(most <= MEMORY_MEGABYTES * 1_000_000, "{most} bytes");
    view.wait_for("bad values", MAX_TO_BAD, |view| quality_of(view, "A") == "bad");
    assert_eq!(view.plugin("other").deaths, 0);
    assert!(view.longest < MAX_FRAME, "a frame of {:?}", view.longest);
}

#[test]
fn what_a_plugin_started_itself_dies_with_it() {
    let mut trouble = FaultyPluginScene::with_plugin("trouble.parent");
    trouble.config["supervision"] = json!({ "max_deaths": 1 });
    let mut view = View::open(trouble);
    view.wait_for_quality("good", MAX_TO_GOOD);
    let child = view.viewer.stats().tags[0].value.as_f64().expect("the number of its child");
    let lives = || {
        let status = fs::read_to_string(Path::new("/proc").join(format!("{child}/status")));
        status.is_ok_and(|status| !status.contains("State:\tZ"))
    };
    assert!(lives(), "{child}");
    kill_process(view.pid("trouble"), Signal::KILL).expect("it runs");
    wait_for("the end of its child", MAX_TO_BAD, || (!lives()).then_some(()));
}

/// Many overlays that hang at once hold a frame up no longer than one of them.
#[test]
fn all_overlays_share_the_patience_of_a_frame() {
    let mut trouble = FaultyPluginScene::with_plugin("trouble.slow");
    let overlays: Vec<_> = (0..24).map(|index| format!("slow{index}")).collect();
    for name in &overlays {
        trouble.config["plugins"][name] = json!({ "plugin": "trouble.slow" });
    }
    trouble.config["overlays"] = json!(overlays);
    let mut view = View::open(trouble);
    let name = overlays[0].as_str();
    view.wait_for("a hang", MAX_TO_GOOD, |view| view.plugin(name).fault.is_some());
    let mut frames: Vec<_> = (0..15)
        .map(|_| {
            let start = Instant::now();
            view.frame();
            start.elapsed()
        })
        .collect();
    frames.sort();
    // Each for itself would wait 24 times 4 ms.
    assert!(frames[7] < Duration::from_millis(90), "{:?}", frames[7]);
}

/// The demo's scene can be loaded beside a plugin that does not come up at all.
#[test]
fn the_demo_is_shown_beside_telemetry_that_never_starts() {
    let mut scene = Scene::demo(1);
    let name = format!("libfault_injector.{}", std::env::consts::DLL_EXTENSION);
    fs::copy(built(built_folder().join(&name)), scene.path("plugins").join(&name))
        .expect("it can be copied");
    let settings = json!({ "kind": "abort", "at": "create" });
    scene.config["plugins"]["faulty"] = json!({ "plugin": "fault_injector", "settings": settings });
    let (picture, stats) = (scene.path("picture.png"), scene.path("stats.json"));
    let mut command = busbar();
    command.arg("render").arg(scene.write()).args(["--size", "160x90", "--out"]).arg(&picture);
    finish(command.arg("--stats").arg(&stats)).expect_code(0);
    assert!(Stats::read(&stats).count("triangles") > 0);
}
