//! MQTT in a scene, with Mosquitto: the example of the plugin's page runs, and values that the
//! broker no longer brings are bad.

#[allow(dead_code, clippy::unwrap_used)]
#[path = "../../../../plugins/telemetry/mqtt/src/tests/broker.rs"]
mod broker;

use std::time::Duration;
use std::{fs, thread};

use broker::{Broker, Client};
use e2e::{Process, Scene, busbar, finish, workspace_path};
use serde_json::{Value, json};

/// Time for reading messages that have passed the broker, loaded machines included.
const READING: Duration = Duration::from_millis(700);

/// Returns the scene of the page's example, with the broker's port.
fn scene(port: u16) -> Scene {
    let mut scene = scene_of("Example");
    let settings = &mut scene.config["plugins"]["sites"]["settings"];
    settings["port"] = json!(port);
    settings["keep_alive_seconds"] = json!(2);
    scene
}

/// Returns the scene of the example below this heading of the page.
fn scene_of(heading: &str) -> Scene {
    let mut scene = Scene::without_tags();
    scene.add_plugin("mqtt");
    let page = fs::read_to_string(workspace_path("plugins/telemetry/mqtt/README.md"))
        .expect("it is there");
    let (_, below) = page.split_once(&format!("## {heading}\n")).expect("it has the heading");
    let lines = below.lines().skip_while(|line| !line.starts_with("    "));
    let block: String = lines.take_while(|line| line.starts_with("    ")).collect();
    let example: Value = serde_json::from_str(&format!("{{{block}}}")).expect("it is JSON");
    scene.config["plugins"]["sites"] = example["plugins"]["sites"].clone();
    for (id, tag) in example["tags"].as_object().expect("it has tags") {
        scene.config["tags"][id] = tag.clone();
    }
    scene
}

/// Sources of the example: a publisher with retained messages, and an edge node that is born again
/// once the viewer has connected.
struct Sites {
    broker: Broker,
    publisher: Client,
    node: Client,
}

impl Sites {
    fn start() -> Option<Self> {
        let broker = Broker::start()?;
        let publisher = Client::publisher(broker.port, &json!({}))?;
        let node = Client::node(broker.port, "north", "station8")?;
        Some(Self { broker, publisher, node })
    }

    fn speak(&mut self) {
        self.publisher.retain("site7/status", "online");
        let now = std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH);
        let millis = now.expect("it is later").as_millis() as u64;
        self.publisher.publish("site7/bay3/p", &json!({"value": 21.5, "ts": millis}).to_string());
        self.publisher.publish("site7/bay3/qb1", "closed");
        self.node.command(&json!({"birth": []}));
        let metric = json!({"name": "current", "alias": 3, "type": "FLOAT", "value": 400.5});
        self.node.command(&json!({"birth": [metric], "device": "bay1"}));
    }
}

/// Runs the scene while the sites publish for as long as it connects.
fn run(scene: &Scene, sites: &mut Sites, seconds: f64) -> Process {
    let running = Process::start(&mut scene.rendering(seconds));
    for _ in 0..8 {
        thread::sleep(Duration::from_millis(250));
        sites.speak();
    }
    running
}

#[test]
fn the_example_of_the_page_shows_what_the_sites_publish() {
    let Some(mut sites) = Sites::start() else { return };
    for isolation in ["process", "none"] {
        let mut scene = scene(sites.broker.port);
        scene.config["isolation"] = json!(isolation);
        run(&scene, &mut sites, 4.0).finish().expect_code(0);
        let stats = scene.stats();
        for (id, value) in [
            ("S7.Bay3.P", json!(21.5)),
            ("S7.Bay3.QB1", json!("closed")),
            ("S8.Bay1.Current", json!(400.5)),
        ] {
            let tag = stats.tag(id);
            assert_eq!((&tag.value, tag.quality.as_str()), (&value, "good"), "{id}");
        }
    }
}

#[test]
fn a_broker_that_is_killed_or_hangs_leaves_nothing_good() {
    for signal in ["KILL", "STOP"] {
        let Some(mut sites) = Sites::start() else { return };
        let scene = scene(sites.broker.port);
        let running = run(&scene, &mut sites, 6.0);
        thread::sleep(READING);
        sites.broker.signal(signal);
        running.finish().expect_code(0);
        let stats = scene.stats();
        for (id, tag) in stats.tags() {
            let found = (tag.quality.as_str(), tag.reason.as_deref());
            assert_eq!(found, ("bad", Some("communication")), "{id} after {signal}");
        }
        assert_eq!(stats.tag("S7.Bay3.P").value, json!(21.5), "the last value stays");
        sites.broker.signal("CONT");
    }
}

#[test]
fn the_example_of_many_sites_is_valid() {
    finish(busbar().arg("check").arg(scene_of("Many sites").write())).expect_code(0);
}

#[test]
fn faults_of_the_configuration_are_told_with_their_remedy() {
    let mut scene = scene(1883);
    scene.config["tags"]["S7.Bay3.P"]["source"]["address"] = json!({"topic": "site7/+/p"});
    let output = finish(busbar().arg("check").arg(scene.write())).expect_code(1);
    let said = output.stdout + &output.stderr;
    assert!(said.contains("put the filter into the setting subscriptions"), "{said}");
}
