//! `busbar simulate --scenario`: the events of a file happen, and show.

use std::net::TcpListener;

use e2e::{Process, Scene, Stats, built, built_folder, busbar, finish};
use rustix::process::Signal;
use serde_json::{Value, json};

/// Returns a scene whose load and switch are a Modbus device's, with another tag of a station.
fn scene() -> Scene {
    let mut scene = Scene::without_tags();
    let station = scene.library("iec104");
    let library = built(built_folder().join(station.file_name().expect("a name")));
    std::fs::copy(library, &station).expect("it can be copied");
    let ports: [TcpListener; 2] =
        [(); 2].map(|()| TcpListener::bind("127.0.0.1:0").expect("a port is free"));
    let [device, station] = ports.map(|port| port.local_addr().expect("it has an address").port());
    scene.config["plugins"]["device"] = json!({
        "plugin": "modbus_adapter",
        "settings": { "host": "127.0.0.1", "port": device, "poll_seconds": 0.1 },
    });
    scene.config["plugins"]["station"] =
        json!({ "plugin": "iec104", "settings": { "host": "127.0.0.1", "port": station } });
    let mut tag = |id: &str, kind: &str, plugin: &str, address: Value, base: f64| {
        scene.config["tags"][id] = json!({
            // A station says what is constant once; the picture is of some seconds later.
            "type": kind, "freshness_seconds": 60,
            "source": { "instance": plugin, "address": address },
            "simulate": { "shape": "constant", "base": base },
        });
    };
    let register =
        |register: u16| json!({ "table": "holding", "register": register, "type": "f32" });
    tag("load", "f64", "device", register(0), 50.0);
    tag("calm", "f64", "device", register(2), 7.0);
    tag("switch", "double_point", "device", json!({ "table": "discrete", "register": 0 }), 2.0);
    tag("voltage", "f64", "station", json!({ "ioa": 1 }), 230.0);
    tag("breaker", "double_point", "station", json!({ "ioa": 3 }), 2.0);
    // The host's view of the load is twice the device's number.
    scene.config["tags"]["load"]["scale"] = json!({ "factor": 2.0, "offset": 0.0 });
    scene
}

/// Returns the tags after three seconds of a scenario.
fn rendered(scene: &Scene, scenario: &Value) -> Stats {
    let (config, file) = (scene.write(), scene.path("scenario.json"));
    std::fs::write(&file, scenario.to_string()).expect("it can be written");
    let simulator =
        Process::start(busbar().arg("simulate").arg(config).arg("--scenario").arg(file));
    simulator.wait_for_line(|line| (line == "ready").then_some(()));
    let mut render = busbar();
    render.arg("render").arg(scene.path("scene.json")).args(["--size", "64x64"]);
    render.arg("--out").arg(scene.path("picture.png")).args(["--seconds", "3"]);
    finish(render.arg("--stats").arg(scene.path("stats.json"))).expect_code(0);
    simulator.signal(Signal::TERM);
    simulator.finish().expect_code(0);
    Stats::read(&scene.path("stats.json"))
}

#[test]
fn tags_do_what_the_scenario_says() {
    let stats = rendered(
        &scene(),
        &json!({ "version": 1, "events": [
            { "at_seconds": 0, "tag": "load", "value": 120, "over_seconds": 0.5 },
            { "at_seconds": 0, "tag": "switch", "value": 1 },
            { "at_seconds": 0.2, "tag": "breaker", "value": 0 },
            { "at_seconds": 0, "tag": "voltage", "value": 0 },
            { "at_seconds": 0.5, "tag": "voltage", "release": true },
            { "at_seconds": 3600, "tag": "calm", "value": 0 },
        ] }),
    );
    let good = |id: &str| {
        let tag = stats.tag(id);
        assert_eq!(tag.quality, "good", "{id}");
        tag.value.clone()
    };
    assert_eq!(good("load").as_f64(), Some(120.0));
    assert_eq!(good("calm").as_f64(), Some(7.0));
    assert_eq!(good("voltage").as_f64(), Some(230.0));
    assert_eq!(good("switch").as_str(), Some("open"));
    assert_eq!(good("breaker").as_str(), Some("travelling"));
}

#[test]
fn a_link_fails_alone() {
    let stats = rendered(
        &scene(),
        &json!({ "version": 1, "events": [
            { "at_seconds": 0, "instance": "station", "link": "link-loss", "for_seconds": 600 },
        ] }),
    );
    assert_eq!(stats.tag("load").quality, "good");
    assert_eq!(stats.tag("voltage").quality, "bad");
}

#[test]
fn a_faulty_scenario_is_told_by_file_and_line() {
    let scene = scene();
    let (config, file) = (scene.write(), scene.path("scenario.json"));
    let text = "{ \"version\": 1,\n  \"events\": [\n    { \"at\": 1, \"tag\": \"laod\", \"value\": 1 }\n] }";
    std::fs::write(&file, text).expect("it can be written");
    let mut command = busbar();
    let output = finish(command.arg("simulate").arg(config).arg("--scenario").arg(&file));
    let said = output.expect_code(1).stderr;
    for words in ["scenario.json:3:", "no tag 'laod'", "did you mean 'load'?"] {
        assert!(said.contains(words), "{words}: {said}");
    }
}
