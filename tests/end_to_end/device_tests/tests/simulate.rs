//! `busbar simulate` beside `busbar render`: the shown values are those of the generator.

use std::net::{TcpListener, TcpStream};
use std::process::Command;
use std::time::{Duration, Instant, SystemTime};

use busbar_plugin_sdk::simulation::{Behavior, Signal, SignalShape};
use busbar_plugin_sdk::{DoublePoint, Value as SimulatedValue, ValueKind};
use busbar_scene_loader::LoadedScene;
use busbar_viewer::{RendererOptions, TagStats, Viewer};
use e2e::{Process, Scene, Stats, built, built_folder, busbar, finish, wait_for};
use rustix::process::{Pid, Signal as ProcessSignal, kill_process};
use serde_json::{Value, json};

const SEED: u64 = 42;
/// Greatest additional age of a value by freshness limits, polls and changes.
const FRESHNESS: Duration = Duration::from_secs(3);
/// Longest time of one part of a test, loaded machines included.
const PATIENCE: Duration = Duration::from_secs(60);
const FAULT_PERIOD: Duration = Duration::from_secs(8);
const FAULT_LENGTH: Duration = Duration::from_secs(5);

/// Tag of the scene: id, source, type, address, signal.
type Row = (&'static str, &'static str, &'static str, Value, Value);

fn rows() -> Vec<Row> {
    let moving = |shape: &str, base: f64, amplitude: f64, period: f64| json!({"shape": shape, "base": base, "amplitude": amplitude, "period_seconds": period});
    let state =
        |shape: &str, period: f64| json!({"shape": shape, "base": 1, "period_seconds": period});
    vec![
        (
            "A.Float",
            "device",
            "f64",
            json!({"table": "holding", "register": 0, "type": "f32"}),
            moving("sine", 60.0, 20.0, 15.0),
        ),
        (
            "A.Scaled",
            "device",
            "f64",
            json!({"table": "input", "register": 9, "type": "i16", "scale": 0.1}),
            moving("walk", -20.0, 30.0, 6.0),
        ),
        (
            "A.Count",
            "device",
            "i64",
            json!({"table": "holding", "register": 4, "type": "u32"}),
            moving("counter", 0.0, 1e6, 0.3),
        ),
        (
            "A.Flag",
            "device",
            "bool",
            json!({"table": "coil", "register": 1}),
            state("constant", 1.0),
        ),
        (
            "A.Mode",
            "device",
            "text",
            json!({"table": "holding", "register": 20, "length": 16}),
            moving("counter", 1.0, 3.0, 1.0),
        ),
        ("B.Float", "station", "f64", json!({"ioa": 1}), moving("sine", 230.0, 5.0, 15.0)),
        (
            "B.Count",
            "station",
            "i64",
            json!({"ioa": 2, "type": "counter"}),
            moving("counter", 0.0, 1e6, 0.3),
        ),
        ("B.Switch", "station", "double_point", json!({"ioa": 3}), state("steps", 3.0)),
        ("B.Flag", "station", "bool", json!({"ioa": 4}), state("constant", 1.0)),
    ]
}

/// Returns a scene with both sources at free ports.
fn scene() -> Scene {
    let mut scene = Scene::without_tags();
    let station = scene.library("iec104");
    let library = built(built_folder().join(station.file_name().expect("a name")));
    std::fs::copy(library, &station).expect("it can be copied");
    let ports: [TcpListener; 2] =
        [(); 2].map(|()| TcpListener::bind("127.0.0.1:0").expect("a port is free"));
    let [device, station] = ports.map(|port| port.local_addr().expect("it has an address").port());
    let reconnect = json!({"min_seconds": 1, "max_seconds": 1});
    scene.config["plugins"]["device"] = json!({
        "plugin": "modbus_adapter",
        "settings": {
            "host": "127.0.0.1", "port": device, "poll_seconds": 0.1, "timeout_seconds": 0.6,
            "reconnect": reconnect,
        },
    });
    scene.config["plugins"]["station"] = json!({
        "plugin": "iec104",
        "settings": {
            "host": "127.0.0.1", "port": station, "interrogation_period_seconds": 1,
            "counter_period_seconds": 1, "reconnect": reconnect,
            "t1_seconds": 1, "t2_seconds": 0.5, "t3_seconds": 0.8,
        },
    });
    for (id, source, kind, address, simulate) in rows() {
        scene.config["tags"][id] = json!({
            "type": kind, "freshness_seconds": FRESHNESS.as_secs_f64(),
            "source": {"instance": source, "address": address}, "simulate": simulate,
        });
    }
    scene
}

fn simulate(scene: &Scene, more: &[&str]) -> Process {
    let mut command = busbar();
    command.arg("simulate").arg(scene.write()).args(["--seed", &SEED.to_string()]);
    let process = Process::start(command.args(["--update", "0.1"]).args(more));
    process.wait_for_line(|line| (line == "ready").then_some(()));
    process
}

fn signal((id, _, kind, _, simulate): &Row) -> Signal {
    let shape = match simulate["shape"].as_str() {
        Some("sine") => SignalShape::Sine,
        Some("walk") => SignalShape::Walk,
        Some("counter") => SignalShape::Counter,
        Some("steps") => SignalShape::Steps,
        _ => SignalShape::Constant,
    };
    let kind = match *kind {
        "f64" => ValueKind::F64,
        "i64" => ValueKind::I64,
        "bool" => ValueKind::Bool,
        "text" => ValueKind::Text,
        _ => ValueKind::DoublePoint,
    };
    let number = |name: &str| simulate[name].as_f64().unwrap_or_default();
    let period = Duration::from_secs_f64(number("period_seconds"));
    let behaviour = Behavior::new(shape, number("base"), number("amplitude"), period);
    Signal::new(SEED, id, kind, behaviour.expect("in range")).expect("it can move so")
}

/// Reports whether the generator gives this value at some instant of a period.
fn is_given(row: &Row, value: &Value, from: SystemTime, to: SystemTime) -> bool {
    let signal = signal(row);
    let fits = |time| match signal.at(time) {
        // Half a step of what is on the wire, and what 2 ms change.
        SimulatedValue::F64(given) => {
            let slope = signal.max_slope().expect("it is smooth");
            value.as_f64().is_some_and(|value| (value - given).abs() <= 0.051 + 0.002 * slope)
        }
        SimulatedValue::I64(given) => value.as_i64() == Some(given),
        SimulatedValue::Bool(given) => value.as_bool() == Some(given),
        SimulatedValue::Text(given) => value.as_str() == Some(given.as_str()),
        SimulatedValue::DoublePoint(given) => {
            let name = match given {
                DoublePoint::Intermediate => "travelling",
                DoublePoint::Off => "open",
                DoublePoint::On => "closed",
                DoublePoint::BadState => "invalid",
            };
            value.as_str() == Some(name)
        }
    };
    let millis = to.duration_since(from).expect("in order").as_millis() as u32;
    (0..=millis).step_by(2).any(|millis| fits(from + Duration::from_millis(millis.into())))
}

#[test]
fn what_is_rendered_is_what_the_generator_gives() {
    for isolation in ["process", "none"] {
        let mut scene = scene();
        scene.config["isolation"] = json!(isolation);
        let simulator = simulate(&scene, &[]);
        let mut render = busbar();
        render.arg("render").arg(scene.path("scene.json")).args(["--size", "320x180"]);
        render.arg("--out").arg(scene.path("picture.png")).args(["--seconds", "3"]);
        render.arg("--stats").arg(scene.path("stats.json"));
        let begun = SystemTime::now();
        finish(&mut render).expect_code(0);
        let ended = SystemTime::now();
        let stats = Stats::read(&scene.path("stats.json"));
        for row in rows() {
            let tag = stats.tag(row.0);
            assert_eq!((tag.quality.as_str(), tag.reason), ("good", None), "{}", row.0);
            // No older than its freshness limit, and from a run that took so long at most.
            let from = begun.max(ended - FRESHNESS - Duration::from_secs(2));
            assert!(is_given(&row, &tag.value, from, ended), "{}: {}", row.0, tag.value);
        }
        simulator.signal(ProcessSignal::TERM);
        let said = simulator.finish().expect_code(0).stdout;
        for words in [
            "device: listens at 127.0.0.1:",
            "with 4 tags",
            "device: clients: 1",
            "station: 1 connections, ",
        ] {
            assert!(said.contains(words), "{words}:\n{said}");
        }
    }
}

/// View that checks every tag in every frame.
struct View {
    viewer: Viewer,
    looked: SystemTime,
}

impl View {
    fn open(scene: &Scene) -> Self {
        let loaded = LoadedScene::load(&scene.path("scene.json"), &|_, _, _| ());
        let loaded = loaded.unwrap_or_else(|error| panic!("{error}"));
        let options = RendererOptions { samples: 1, ..Default::default() };
        let viewer = Viewer::new_headless(loaded, options, [64, 64]).expect("there is a device");
        Self { viewer, looked: SystemTime::now() }
    }

    /// Draws until the tags satisfy a condition; good values must be right in every frame.
    fn until(&mut self, what: &str, is: impl Fn(&[TagStats]) -> bool) {
        let begun = Instant::now();
        loop {
            let input = self.viewer.headless_input(0.0);
            self.viewer.frame(input).expect("a frame can be drawn");
            let tags = self.viewer.stats().tags;
            let from = self.looked - FRESHNESS - Duration::from_secs(1);
            self.looked = SystemTime::now();
            for row in rows() {
                let tag = tags.iter().find(|tag| tag.id == row.0).expect("it is configured");
                if tag.quality == "good" {
                    let given = is_given(&row, &tag.value, from, self.looked);
                    assert!(given, "{what}: {} shows {}", row.0, tag.value);
                }
            }
            if is(&tags) {
                return;
            }
            assert!(begun.elapsed() < PATIENCE, "not within time: {what}: {tags:?}");
            std::thread::sleep(Duration::from_millis(20));
        }
    }
}

/// Tags go bad and come back with each fault, and no wrong value is ever shown as good.
#[test]
fn faults_make_tags_bad_and_never_wrong() {
    // What is slow, or has another clock than its values, need not be lost.
    let faults = [
        ("link-loss", &["A.", "B."][..]),
        ("half-open", &["A.", "B."]),
        ("reset", &["A.", "B."]),
        ("garbage", &["A.", "B."]),
        ("late", &["A.", "B."]),
        ("slow", &[]),
        ("clock-jump", &[]),
    ];
    for (fault, lost) in faults {
        let scene = scene();
        let [period, length] = [FAULT_PERIOD, FAULT_LENGTH].map(|time| time.as_secs().to_string());
        let more = ["--fault", fault, "--fault-period", &period, "--fault-seconds", &length];
        let simulator = simulate(&scene, &more);
        let mut view = View::open(&scene);
        let good = |tags: &[TagStats]| tags.iter().all(|tag| tag.quality == "good");
        view.until(&format!("{fault}: all is good"), good);
        for source in lost {
            view.until(&format!("{fault}: {source} is bad"), |tags| {
                tags.iter().any(|tag| tag.id.starts_with(source) && tag.quality == "bad")
            });
        }
        if lost.is_empty() {
            let begins = format!("device: fault: {fault}");
            simulator.wait_for_line(|line| (line == begins).then_some(()));
            let until = Instant::now() + FAULT_LENGTH;
            view.until(&format!("{fault}: it holds"), |_| Instant::now() > until);
        }
        view.until(&format!("{fault}: all is good again"), good);
        simulator.signal(ProcessSignal::INT);
        let said = simulator.finish().expect_code(0).stdout;
        assert!(said.contains(&format!("device: fault: {fault}")), "{said}");
    }
}

/// A device whose process is killed is that device again.
#[test]
fn a_device_that_dies_comes_back() {
    let scene = scene();
    let simulator = simulate(&scene, &["--plugin", "device"]);
    let port = scene.config["plugins"]["device"]["settings"]["port"].as_u64();
    let address = ("127.0.0.1", port.and_then(|port| u16::try_from(port).ok()).expect("a port"));
    assert!(TcpStream::connect(address).is_ok());
    let before = children(simulator.id());
    for &child in &before {
        kill_process(child, ProcessSignal::KILL).expect("it lives");
    }
    wait_for("the device", PATIENCE, || {
        let is_new = children(simulator.id()).iter().any(|child| !before.contains(child));
        (is_new && TcpStream::connect(address).is_ok()).then_some(())
    });
    simulator.signal(ProcessSignal::TERM);
    let said = simulator.finish().expect_code(0);
    assert!(said.stderr.contains("SIGKILL"), "{}", said.stderr);
}

/// Returns the processes that any thread of a process has started.
fn children(process: u32) -> Vec<Pid> {
    let threads = std::fs::read_dir(format!("/proc/{process}/task")).expect("it lives");
    let lists = threads
        .flatten()
        .filter_map(|thread| std::fs::read_to_string(thread.path().join("children")).ok());
    let numbers = lists.flat_map(|list| {
        list.split_whitespace().filter_map(|number| number.parse().ok()).collect::<Vec<_>>()
    });
    numbers.filter_map(Pid::from_raw).collect()
}

#[test]
fn what_cannot_be_simulated_is_told() {
    let run = |scene: &Scene, more: &[&str]| {
        let mut command: Command = busbar();
        command.arg("simulate").arg(scene.write()).args(["--seconds", "0.3"]).args(more);
        finish(&mut command)
    };
    let refused = |scene: &Scene, more: &[&str], words: &[&str]| {
        let said = run(scene, more).expect_code(1).stderr;
        assert!(words.iter().all(|word| said.contains(word)), "{words:?}: {said}");
    };
    // One alone, for a while.
    let mut scene = scene();
    let said = run(&scene, &["--plugin", "station"]).expect_code(0).stdout;
    assert!(said.contains("station: listens") && !said.contains("device:"), "{said}");
    refused(&scene, &["--plugin", "statoin"], &["no tag has a source 'statoin'"]);
    // The port is another's.
    let taken = TcpListener::bind("127.0.0.1:0").expect("a port is free");
    let port = taken.local_addr().expect("it has an address").port();
    scene.config["plugins"]["device"]["settings"]["port"] = json!(port);
    refused(&scene, &[], &["scene.json:", "cannot listen at 127.0.0.1", "nobody else has"]);
    // Values that no register can hold, at their plugin, by tag.
    scene.config["plugins"]["device"]["settings"]["port"] = json!(1);
    scene.config["tags"]["A.Scaled"]["simulate"]["base"] = json!(1e6);
    refused(&scene, &["--plugin", "device"], &["'A.Scaled'", "\"simulate\"", "remedy:"]);
    refused(&scene, &["--fault", "all", "--fault-seconds", "30"], &["--fault-period"]);
    let output = finish(busbar().args(["simulate", "x.json", "--fault", "no-such"]));
    assert!(output.expect_code(2).stderr.contains("link-loss"));
}

/// A plugin that is no device: its tags are named, and the others are served.
#[test]
fn sources_without_a_simulator_are_remarked() {
    let mut scene = scene();
    e2e::faulty_plugins::compile(&scene.path("plugins"));
    scene.config["plugins"]["other"] = json!({"plugin": "trouble.steady"});
    scene.config["tags"]["C"] =
        json!({"type": "f64", "source": {"instance": "other", "address": 1}});
    let mut command = busbar();
    command.arg("simulate").arg(scene.write()).args(["--seconds", "0.3"]);
    let output = finish(&mut command).expect_code(0);
    let words = "'other' cannot be simulated, and its 1 tags have no device here";
    assert!(output.stderr.contains(words), "{}", output.stderr);
    assert!(output.stdout.contains("ready"), "{}", output.stdout);
}
