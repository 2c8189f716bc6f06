//! Isolation of plugins in processes of their own: whatever happens to one, the view continues,
//! reports it, and restarts the plugin.

use std::collections::BTreeSet;
use std::fs;

use busbar_scene_loader::LoadedScene;
use e2e::faulty_plugins::{self, FaultyPluginScene};
use e2e::{Process, Scene, Stats, busbar, finish, picture, wait_for};
use rustix::process::{Signal, kill_process};
use serde_json::json;

use crate::view::{MAX_FRAME, MAX_TO_BAD, MAX_TO_GOOD, View};

#[path = "common/view.rs"]
mod view;

/// Greatest difference of letters, of 255: they are rounded by their places in the font texture,
/// which depend on the order of first use.
const MAX_ROUNDING: u8 = 2;

#[track_caller]
fn assert_lost_and_back(view: &mut View, signal: Signal, words: &str) {
    view.wait_for_quality("good", MAX_TO_GOOD);
    let before = view.plugin("trouble").deaths;
    kill_process(view.pid("trouble"), signal).expect("it runs");
    view.wait_for_quality("bad", MAX_TO_BAD);
    for tag in view.viewer.stats().tags {
        assert_eq!(tag.reason.as_deref(), Some("communication"), "{}", tag.id);
        assert_eq!(tag.value, 1.0, "the last value stays, as bad");
    }
    view.wait_for_quality("good", MAX_TO_GOOD);
    let plugin = view.plugin("trouble");
    assert_eq!((plugin.state, plugin.deaths), ("running", before + 1));
    let death = plugin.last_death.expect("it died");
    assert!(death.contains(words), "{death}");
}

#[test]
fn a_killed_plugin_is_bad_within_a_second_and_comes_back() {
    let mut view = View::open(FaultyPluginScene::with_plugin("trouble.steady"));
    assert_lost_and_back(&mut view, Signal::KILL, "killed by SIGKILL");
    assert_lost_and_back(&mut view, Signal::ABORT, "killed by SIGABRT");
}

#[test]
fn a_stopped_plugin_is_killed_for_its_heartbeat_and_comes_back() {
    let mut view = View::open(FaultyPluginScene::with_plugin("trouble.steady"));
    assert_lost_and_back(&mut view, Signal::STOP, "no heartbeat");
}

#[test]
fn a_plugin_that_dies_too_often_is_left_alone_until_it_is_started_by_hand() {
    let mut view = View::open(FaultyPluginScene::with_plugin("trouble.segfault"));
    view.wait_for_state("quarantined", 4 * MAX_TO_GOOD);
    let plugin = view.plugin("trouble");
    assert_eq!((plugin.deaths, plugin.pid), (3, None));
    let death = plugin.last_death.expect("it died");
    assert!(death.contains("killed by SIGSEGV"), "{death}");
    view.wait_for_quality("bad", MAX_TO_BAD);
    // It stays as it is.
    std::thread::sleep(MAX_TO_BAD);
    assert_eq!(view.plugin("trouble").state, "quarantined");

    view.viewer.start_plugin("trouble");
    view.wait_for_quality("good", MAX_TO_GOOD);
    assert_eq!(view.plugin("trouble").state, "running");
    assert!(view.longest < MAX_FRAME, "a frame of {:?}", view.longest);
}

#[test]
fn a_flood_drops_its_own_oldest_samples_and_holds_up_no_frame() {
    let mut view = View::open(FaultyPluginScene::with_plugin("trouble.flood"));
    view.wait_for_quality("good", MAX_TO_GOOD);
    let limit = 4 * MAX_TO_GOOD;
    view.wait_for("dropped samples", limit, |view| view.plugin("trouble").dropped > 0);
    view.wait_for_quality("good", MAX_TO_GOOD);
    assert_eq!(view.plugin("trouble").deaths, 0);
    assert!(view.longest < MAX_FRAME, "a frame of {:?}", view.longest);
}

#[test]
fn an_overlay_that_hangs_holds_up_no_frame_and_is_killed() {
    let mut view = View::open(FaultyPluginScene::with_plugin("trouble.slow"));
    let limit = MAX_TO_GOOD;
    view.wait_for("a death", limit, |view| view.plugin("trouble").deaths > 0);
    let plugin = view.plugin("trouble");
    let death = plugin.last_death.expect("it died");
    assert!(death.contains("`draw` took longer"), "{death}");
    assert!(plugin.fault.is_some(), "its labels are not shown as if they were live");
    assert!(view.longest < MAX_FRAME, "a frame of {:?}", view.longest);
    assert_eq!(view.plugin("source").deaths, 0, "the others go on");
}

#[test]
fn the_picture_comes_from_the_overlays_process() {
    let mut view = View::open(FaultyPluginScene::with_plugin("trouble.echo"));
    view.wait_for_quality("good", MAX_TO_GOOD);
    view.wait_for("a picture", MAX_TO_GOOD, |view| view.plugin("trouble").fault.is_none());
    kill_process(view.pid("trouble"), Signal::KILL).expect("it runs");
    view.wait_for("the fault", MAX_TO_BAD, |view| view.plugin("trouble").fault.is_some());
    view.wait_for("a picture", MAX_TO_GOOD, |view| view.plugin("trouble").fault.is_none());
}

#[test]
fn a_plugins_process_has_no_more_than_it_needs() {
    let mut view = View::open(FaultyPluginScene::with_plugin("trouble.echo"));
    view.frame();
    let pid = view.plugin("trouble").pid.expect("it has a process");
    let status = fs::read_to_string(format!("/proc/{pid}/status")).expect("it runs");
    let value = |name: &str| {
        let line = status.lines().find_map(|line| line.strip_prefix(name));
        line.unwrap_or_else(|| panic!("no {name} in {status}")).trim().to_owned()
    };
    assert_eq!(value("NoNewPrivs:"), "1");
    assert_eq!(value("Seccomp:"), "2", "a filter");
    let limits = fs::read_to_string(format!("/proc/{pid}/limits")).expect("it runs");
    let limit = |name: &str| {
        let line = limits.lines().find(|line| line.starts_with(name));
        line.unwrap_or_else(|| panic!("no {name} in {limits}")).replace(name, "")
    };
    assert!(limit("Max core file size").trim().starts_with("0 "));
    assert!(limit("Max address space").trim().starts_with("4000000000 "));
    let opened = fs::read_dir(format!("/proc/{pid}/fd")).expect("it runs");
    let targets: BTreeSet<String> = opened
        .filter_map(|entry| fs::read_link(entry.expect("it can be read").path()).ok())
        .map(|target| target.display().to_string())
        .collect();
    let known = ["/dev/null", "socket:", "pipe:", "libtrouble.so"];
    for target in &targets {
        assert!(known.iter().any(|known| target.contains(known)), "{target} of {targets:?}");
    }
    let environment = fs::read_to_string(format!("/proc/{pid}/environ")).expect("it runs");
    assert!(!environment.contains("LD_"), "{environment}");
}

#[test]
fn plugins_end_with_a_viewer_that_is_killed() {
    let trouble = FaultyPluginScene::with_plugin("trouble.steady");
    let mut command = busbar();
    command.arg("render").arg(trouble.write()).args(["--seconds", "30", "--out"]);
    let process = Process::start(command.arg(trouble.path("picture.png")));
    let children = || {
        let of_viewer = format!("{}", process.id());
        let listed = fs::read_dir("/proc").expect("there are processes");
        let pids = listed.filter_map(|entry| entry.ok()?.file_name().into_string().ok());
        pids.filter(|pid| pid.bytes().all(|digit| digit.is_ascii_digit()))
            .filter(|pid| {
                let stat = fs::read_to_string(format!("/proc/{pid}/stat")).unwrap_or_default();
                let parent = stat.rsplit(')').next().unwrap_or_default();
                parent.split_whitespace().nth(1) == Some(&of_viewer)
            })
            .collect::<Vec<_>>()
    };
    let pids = wait_for("a child", MAX_TO_GOOD, || Some(children()).filter(|c| !c.is_empty()));
    process.signal(Signal::KILL);
    wait_for("its end", MAX_TO_GOOD, || {
        let gone = |pid: &String| {
            let status = fs::read_to_string(format!("/proc/{pid}/status")).unwrap_or_default();
            status.is_empty() || status.contains("State:\tZ")
        };
        pids.iter().all(gone).then_some(())
    });
}

#[test]
fn a_plugin_may_use_the_network_only_if_it_needs_it() {
    let told = |change: &dyn Fn(&mut serde_json::Value)| {
        let mut trouble = FaultyPluginScene::with_plugin("trouble.socket");
        change(&mut trouble.config);
        let Err(error) = LoadedScene::check(&trouble.write(), &|_, _, _| ()) else {
            panic!("it fails in any case")
        };
        error.to_string()
    };
    let refused = told(&|_| ());
    assert!(refused.contains("Operation not permitted"), "{refused}");
    let allowed = told(&|config| config["plugins"]["trouble"]["network"] = json!(true));
    assert!(allowed.contains("a socket was made"), "{allowed}");
    let together = told(&|config| config["isolation"] = json!("none"));
    assert!(together.contains("a socket was made"), "{together}");
}

#[test]
fn without_isolation_plugins_run_in_the_viewers_process() {
    let mut trouble = FaultyPluginScene::with_plugin("trouble.echo");
    trouble.config["isolation"] = json!("none");
    let mut view = View::open(trouble);
    view.wait_for_quality("good", MAX_TO_GOOD);
    for name in ["trouble", "source"] {
        let plugin = view.plugin(name);
        assert_eq!((plugin.state, plugin.pid, plugin.fault), ("in process", None, None));
    }
}

#[test]
fn one_plugin_may_run_together_with_the_viewer_and_another_apart() {
    let mut trouble = FaultyPluginScene::with_plugin("trouble.echo");
    trouble.config["plugins"]["source"]["isolation"] = json!("none");
    let mut view = View::open(trouble);
    view.wait_for_quality("good", MAX_TO_GOOD);
    assert_eq!(view.plugin("source").state, "in process");
    assert_eq!(view.plugin("trouble").state, "running");
}

#[test]
fn the_log_has_a_plugins_last_words_and_what_becomes_of_it() {
    let mut trouble = FaultyPluginScene::with_plugin("trouble.segfault");
    trouble.config["supervision"] = json!({ "restart_seconds": 0, "max_deaths": 2 });
    let stats = trouble.path("stats.json");
    let mut command = busbar();
    command.arg("render").arg(trouble.write()).args(["--seconds", "3"]);
    command.arg("--out").arg(trouble.path("picture.png")).arg("--stats").arg(&stats);
    let output = finish(&mut command).expect_code(0);
    let words = [
        "about to fall over",
        "died: killed by SIGSEGV; starts again in 0.0ns",
        "died: killed by SIGSEGV; in quarantine after 2 deaths within 600s",
    ];
    for words in words {
        assert!(output.stderr.contains(words), "no '{words}' in: {}", output.stderr);
    }
    let plugin = &Stats::read(&stats).0["plugins"][0];
    assert_eq!(plugin["name"], "trouble");
    assert_eq!((&plugin["state"], &plugin["deaths"]), (&json!("quarantined"), &json!(2)));
}

/// The demo beside a plugin whose one tag is shown nowhere: a storm of deaths
/// there changes not a pixel.
#[test]
fn a_storm_in_one_plugin_changes_nothing_else_on_the_picture() {
    let picture_beside = |plugin: &str| {
        let mut scene = Scene::demo(1);
        faulty_plugins::compile(&scene.path("plugins"));
        scene.config["plugins"]["storm"] = json!({ "plugin": plugin });
        scene.config["tags"]["Z"] =
            json!({ "type": "f64", "source": { "instance": "storm", "address": {} } });
        scene.config["supervision"] = json!({ "restart_seconds": 0, "max_deaths": 0 });
        let (picture, stats) = (scene.path("picture.png"), scene.path("stats.json"));
        let mut command = busbar();
        command.arg("render").arg(scene.write()).args(["--size", "480x270", "--seconds", "3"]);
        finish(command.arg("--out").arg(&picture).arg("--stats").arg(&stats)).expect_code(0);
        let stats = Stats::read(&stats);
        let plugins = stats.0["plugins"].as_array().expect("there are plugins").clone();
        let deaths = |name: &str| {
            let found = plugins.iter().find(|plugin| plugin["name"] == name);
            found.and_then(|plugin| plugin["deaths"].as_u64()).expect("it is configured")
        };
        let others: u64 = ["bay", "optimizer", "values"].into_iter().map(deaths).sum();
        assert_eq!(others, 0, "the others go on");
        (picture::load(&picture), deaths("storm"))
    };
    let (calm, none) = picture_beside("trouble.steady");
    let (storm, deaths) = picture_beside("trouble.segfault");
    assert_eq!(none, 0);
    assert!(deaths > 2, "{deaths} deaths are no storm");
    let levels = calm.as_raw().iter().zip(storm.as_raw());
    let difference = levels.map(|(a, b)| a.abs_diff(*b)).max();
    assert!(difference <= Some(MAX_ROUNDING), "{difference:?} of 255");
}
