//! `busbar plugin new`: its project builds, passes its own tests and the checker, and runs against
//! a simulator, by the commands of its README.

use std::fs;
use std::net::TcpListener;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use e2e::picture::{self, difference};
use e2e::{Process, Scene, Stats, built_folder, busbar, finish, workspace_path};
use rustix::process::Signal;
use serde_json::{Value, json};
use tempfile::TempDir;

/// Greatest number of lines of code in a new telemetry plugin in Rust.
const MAX_LINES: usize = 60;
const KINDS: [&str; 3] = ["telemetry", "overlay", "optimizer"];

struct Project {
    folder: TempDir,
    name: String,
    is_rust: bool,
}

impl Project {
    fn new(kind: &str, lang: &str) -> Self {
        let folder = tempfile::tempdir().expect("a temporary folder can be made");
        let name = format!("my_{kind}_{lang}");
        let mut command = busbar();
        command.args(["plugin", "new", &name, "--kind", kind, "--lang", lang]);
        let output = finish(command.arg("--path").arg(folder.path())).expect_code(0);
        assert!(output.stdout.contains("README.md"), "{}", output.stdout);
        let project = Self { folder, name, is_rust: lang == "rust" };
        for file in files(&project.path("")) {
            let text = fs::read_to_string(&file).expect("it is text");
            let left = ["my_plugin", "MyPlugin", "SDK_PATH", "LIBRARY_FOLDER", "BUSBAR_PLUGINS"];
            let found = left.iter().find(|word| text.contains(**word));
            assert_eq!(found, None, "in {}", file.display());
        }
        project
    }

    fn path(&self, file: &str) -> PathBuf {
        self.folder.path().join(&self.name).join(file)
    }

    fn library(&self) -> PathBuf {
        let folder = if self.is_rust { "target/debug" } else { "build" };
        self.path(folder).join(format!("lib{}.so", self.name))
    }

    fn run(&self, program: &str, arguments: &[&str]) {
        let mut command = Command::new(program);
        command.args(arguments).current_dir(self.path("")).stdin(Stdio::null());
        let output = command.env("CARGO_TARGET_DIR", cargo_target()).output();
        let output = output.unwrap_or_else(|error| panic!("{program}: {error}"));
        let said = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success(), "{program} {arguments:?}: {said}");
    }

    /// Builds the project and runs its tests.
    fn build(&self) {
        if !self.is_rust {
            self.run("make", &[]);
            return self.run("make", &["test"]);
        }
        // The workspace's versions: they are on this machine.
        fs::copy(workspace_path("Cargo.lock"), self.path("Cargo.lock")).expect("it can be copied");
        self.run(env!("CARGO"), &["build", "--offline"]);
        self.run(env!("CARGO"), &["test", "--offline"]);
        let library = self.library();
        let folder = library.parent().expect("it is in a folder");
        fs::create_dir_all(folder).expect("it can be made");
        let name = library.file_name().expect("it has a name");
        fs::copy(cargo_target().join("debug").join(name), &library).expect("it was built");
    }

    fn check(&self) {
        let mut command = busbar();
        command.args(["plugin", "check"]).arg(self.library());
        let output = finish(command.arg("--sample").arg(self.path("sample.json"))).expect_code(0);
        assert!(output.stdout.contains(" 0 failed, 0 skipped"), "{}", output.stdout);
    }

    /// Changes the scene's text, as one would in an editor.
    fn edit_scene(&self, from: &str, to: &str) {
        let text = fs::read_to_string(self.path("scene.json")).expect("it is there");
        assert!(text.contains(from), "{from} in {text}");
        fs::write(self.path("scene.json"), text.replace(from, to)).expect("it can be written");
    }

    fn render(&self, seconds: &str) -> (image::RgbImage, Stats) {
        let (picture, stats) = (self.path("picture.png"), self.path("stats.json"));
        let mut command = busbar();
        command.arg("render").arg(self.path("scene.json")).args(["--size", "480x360"]);
        command.args(["--seconds", seconds]).arg("--out").arg(&picture);
        finish(command.arg("--stats").arg(&stats)).expect_code(0);
        (picture::load(&picture), Stats::read(&stats))
    }
}

/// Returns the target folder of all projects, which build the same dependencies.
fn cargo_target() -> PathBuf {
    built_folder().join("e2e-new-plugins")
}

fn files(folder: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).expect("it is there");
    let paths = entries.map(|entry| entry.expect("it can be read").path());
    paths.flat_map(|path| if path.is_dir() { files(&path) } else { vec![path] }).collect()
}

/// Starts a simulator that prints its port; returns the port.
fn simulator(command: &mut Command) -> (Process, u16) {
    let process = Process::start(command);
    let port = process
        .wait_for_line(|line| line.strip_prefix("listening on ")?.rsplit_once(':')?.1.parse().ok());
    (process, port)
}

/// Asserts that telemetry shows the simulator's values, and that they are bad once it is gone.
fn assert_telemetry_works(project: &Project, mut command: Command) {
    let (device, port) = simulator(&mut command);
    project.edit_scene("127.0.0.1:7070", &format!("127.0.0.1:{port}"));
    let (_, stats) = project.render("1.5");
    let temperature = stats.tag("Temperature");
    assert_eq!(temperature.quality, "good", "{temperature:?}");
    assert!((55.0..=65.0).contains(&temperature.value.as_f64().expect("it is a number")));
    assert!(stats.tag("Alarm").value.is_boolean());
    device.signal(Signal::KILL);
    drop(device);
    let (_, stats) = project.render("0.5");
    assert_eq!(stats.tag("Temperature").quality, "bad");
}

/// Asserts that the telemetry's value is among the tags of the whole demo.
fn assert_runs_in_demo(project: &Project, mut command: Command) {
    let (_device, port) = simulator(&mut command);
    let mut scene = Scene::demo(1);
    let folder = project.library().parent().expect("it is in a folder").to_owned();
    scene.config["plugin_directories"] = json!(["plugins", folder]);
    let id = format!("com.example.{}", project.name);
    let settings = json!({ "address": format!("127.0.0.1:{port}") });
    scene.config["plugins"]["added"] = json!({ "plugin": id, "settings": settings });
    scene.config["tags"]["Added"] = json!({
        "name": "Added", "type": "f64", "unit": "°C", "freshness_seconds": 3,
        "source": { "instance": "added", "address": "temperature" },
    });
    let stats = scene.path("stats.json");
    let mut command = busbar();
    command.arg("render").arg(scene.write()).args(["--size", "320x180", "--seconds", "1.5"]);
    command.arg("--out").arg(scene.path("picture.png"));
    finish(command.arg("--stats").arg(&stats)).expect_code(0);
    let added = Stats::read(&stats).tag("Added");
    assert_eq!(added.quality, "good", "{added:?}");
    assert!((55.0..=65.0).contains(&added.value.as_f64().expect("it is a number")));
}

fn assert_overlay_works(project: &Project) {
    let free = TcpListener::bind("127.0.0.1:0").and_then(|free| free.local_addr());
    project.edit_scene("15020", &free.expect("a port is free").port().to_string());
    let device = Process::start(busbar().arg("simulate").arg(project.path("scene.json")));
    device.wait_for_line(|line| (line == "ready").then_some(()));
    let (with, stats) = project.render("1");
    assert_eq!(stats.tag("Temperature").quality, "good");
    project.edit_scene("[\"values\"]", "[]");
    let (without, _) = project.render("1");
    let label = difference(&with, &without).expect("a label is drawn");
    assert!(label.size()[0] > 30, "{label:?}");
}

fn assert_optimizer_works(project: &Project) {
    let stats = project.path("optimized.json");
    let mut command = busbar();
    command.arg("optimize").arg(project.path("insulator.gltf"));
    command.args(["--plugin", &format!("com.example.{}", project.name)]);
    command.arg("--plugin-directory").arg(project.library().parent().expect("it is in a folder"));
    command.args(["--theta", "0.5", "--round-trip", "100"]).arg("--stats").arg(&stats);
    finish(&mut command).expect_code(0);
    let stats: Value =
        serde_json::from_slice(&fs::read(stats).expect("it is written")).expect("JSON");
    assert_eq!(stats["lossless"], true, "{stats:#}");
    assert!(stats["collapses"].as_u64().is_some_and(|count| count > 300), "{stats:#}");
    let (_, stats) = project.render("0");
    assert!((100..900).contains(&stats.count("triangles")), "{:#}", stats.0);
}

#[test]
fn rust_projects_work_as_their_readme_says() {
    for kind in KINDS {
        let project = Project::new(kind, "rust");
        let source = fs::read_to_string(project.path("src/lib.rs")).expect("it is there");
        let code = source.lines().map(str::trim).filter(|l| !l.is_empty() && !l.starts_with("//"));
        let lines = code.count() - "#[cfg(test)]\nmod tests;".lines().count();
        assert!(kind != "telemetry" || lines <= MAX_LINES, "{lines} lines");
        project.build();
        project.check();
        match kind {
            "telemetry" => {
                project.run(env!("CARGO"), &["build", "--offline", "--example", "simulator"]);
                let program = cargo_target().join("debug/examples/simulator");
                let mut command = Command::new(program);
                command.arg("127.0.0.1:0");
                assert_telemetry_works(&project, command);
            }
            "overlay" => assert_overlay_works(&project),
            _ => assert_optimizer_works(&project),
        }
    }
}

#[test]
fn c_projects_work_as_their_readme_says() {
    for kind in KINDS {
        let project = Project::new(kind, "c");
        project.build();
        project.check();
        match kind {
            "telemetry" => {
                project.run("make", &["build/simulator"]);
                let device = || {
                    let mut command = Command::new(project.path("build/simulator"));
                    command.arg("0");
                    command
                };
                assert_telemetry_works(&project, device());
                assert_runs_in_demo(&project, device());
            }
            "overlay" => assert_overlay_works(&project),
            _ => assert_optimizer_works(&project),
        }
    }
}

#[test]
fn what_cannot_be_made_is_refused_in_words() {
    let folder = tempfile::tempdir().expect("a temporary folder can be made");
    let refused = |name: &str, more: &[&str], words: &[&str]| {
        let mut command = busbar();
        command.args(["plugin", "new", name, "--kind", "overlay"]).args(more);
        let output = finish(command.current_dir(folder.path())).expect_code(1);
        for word in words {
            assert!(output.stderr.contains(word), "{word}: {}", output.stderr);
        }
    };
    refused("Oil-Monitor", &[], &["Oil-Monitor", "lower-case", "oil_monitor"]);
    refused("../up", &[], &["lower-case"]);
    refused("std", &[], &["std", "another name"]);
    refused("mine", &["--sdk", "nowhere"], &["nowhere", "plugins/sdk/sdk"]);
    refused("mine", &["--path", "/proc/none"], &["cannot make"]);
    fs::create_dir(folder.path().join("taken")).expect("it can be made");
    refused("taken", &[], &["taken", "exists already"]);
    let left: Vec<_> = fs::read_dir(folder.path()).expect("it is there").flatten().collect();
    assert_eq!(left.len(), 1, "nothing half made is left: {left:?}");
}
