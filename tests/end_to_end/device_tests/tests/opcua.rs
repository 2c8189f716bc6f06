//! OPC UA in a scene, with asyncua: the example of the plugin's page has the server's values in the
//! statistics, and those that it no longer confirms are bad.

use std::fs;
use std::process::Command;
use std::thread;
use std::time::Duration;

use e2e::peer::python;
use e2e::{Process, Scene, finish, wait_for, workspace_path};
use rustix::process::Signal;
use serde_json::{Value, json};

/// Longest wait on a loaded machine.
const PATIENCE: Duration = Duration::from_secs(20);
/// Time for reading values once there is a connection.
const READING: Duration = Duration::from_millis(1500);
/// Address in the example.
const EXAMPLE_PORT: &str = ":4840/";

struct Server {
    process: Process,
    port: u16,
}

impl Server {
    fn start() -> Option<Self> {
        let python = python("asyncua")?;
        let nodes = json!({"nodes": [
            {"id": "ns=2;s=S12D1Q3.P", "type": "Double", "value": 61_500.0},
            {"id": "ns=2;s=S12D1Q3.QA1", "type": "String", "value": "CLOSED"},
        ]});
        let mut command = Command::new(python);
        command
            .arg(workspace_path("tests/end_to_end/peers/opcua_asyncua.py"))
            .arg(nodes.to_string());
        let process = Process::start(&mut command);
        let port = process.wait_for_line(|line| line.strip_prefix("READY ")?.parse().ok());
        Some(Self { process, port })
    }
}

/// Returns the configuration under the heading "Example" of the plugin's page.
fn example() -> Value {
    let page = fs::read_to_string(workspace_path("plugins/telemetry/opcua/README.md"))
        .expect("it is there");
    let (_, rest) = page.split_once("## Example").expect("it has an example");
    let lines = rest.lines().skip_while(|line| !line.starts_with("    "));
    let text: String = lines.take_while(|line| line.starts_with("    ")).collect();
    serde_json::from_str(&text).expect("it is JSON")
}

fn scene(port: u16) -> Scene {
    let mut scene = Scene::without_tags();
    scene.add_plugin("opcua");
    let example = example();
    scene.config["plugins"]["plc"] = example["plugins"]["plc"].clone();
    let settings = &mut scene.config["plugins"]["plc"]["settings"];
    let url = settings["url"].as_str().expect("a text");
    assert!(url.contains(EXAMPLE_PORT), "{url}");
    settings["url"] = json!(url.replace(EXAMPLE_PORT, &format!(":{port}/")));
    settings["silence_seconds"] = json!(1);
    for (id, tag) in example["tags"].as_object().expect("tags") {
        scene.config["tags"][id] = tag.clone();
    }
    scene
}

#[test]
fn the_example_of_the_page_shows_what_the_server_has() {
    let Some(server) = Server::start() else { return };
    for isolation in ["process", "none"] {
        let mut scene = scene(server.port);
        scene.config["isolation"] = json!(isolation);
        finish(&mut scene.rendering(3.0)).expect_code(0);
        let stats = scene.stats();
        for (id, value) in [("S12D1Q3.P", json!(61.5)), ("S12D1Q3.QA1", json!("closed"))] {
            let tag = stats.tag(id);
            assert_eq!((&tag.value, tag.quality.as_str()), (&value, "good"), "{id}, {isolation}");
        }
    }
}

#[test]
fn a_server_that_is_killed_or_hangs_leaves_nothing_good() {
    for signal in [Signal::KILL, Signal::STOP] {
        let Some(server) = Server::start() else { return };
        let scene = scene(server.port);
        let running = Process::start(&mut scene.rendering(6.0));
        wait_for("a connection", PATIENCE, || is_connected(server.port).then_some(()));
        // Values follow at once.
        thread::sleep(READING);
        server.process.signal(signal);
        running.finish().expect_code(0);
        for (id, tag) in scene.stats().tags() {
            let found = (tag.quality.as_str(), tag.reason.as_deref());
            assert_eq!(found, ("bad", Some("communication")), "{id} after {signal:?}");
        }
        assert_eq!(scene.stats().tag("S12D1Q3.P").value, json!(61.5), "the last value stays");
    }
}

/// Reports whether a client is connected to a local port.
fn is_connected(port: u16) -> bool {
    const ESTABLISHED: &str = "01";
    let table = fs::read_to_string("/proc/net/tcp").expect("Linux has it");
    let local = format!(":{port:04X}");
    table.lines().any(|line| {
        let mut fields = line.split_whitespace().skip(1);
        let (place, _, state) = (fields.next(), fields.next(), fields.next());
        place.is_some_and(|place| place.ends_with(&local)) && state == Some(ESTABLISHED)
    })
}
