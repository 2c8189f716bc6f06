//! IEC 61850 in a scene, with a server of libiec61850: its values are in the statistics, and those
//! that it no longer confirms are bad. The configuration is the one of the plugin's page.

use std::process::Command;
use std::time::Duration;

use e2e::peer::python;
use e2e::{Process, Scene, busbar, finish, wait_for, workspace_path};
use rustix::process::Signal;
use serde_json::{Value, json};

/// Longest wait on a loaded machine.
const PATIENCE: Duration = Duration::from_secs(20);

const READING: Duration = Duration::from_millis(1500);

struct Server {
    process: Process,
    port: u16,
    answers: usize,
}

impl Server {
    fn start() -> Option<Self> {
        let mut command = Command::new(python("pyiec61850.pyiec61850")?);
        command.arg(workspace_path("tests/end_to_end/peers/iec61850_server.py")).arg("{}");
        let process = Process::start(&mut command);
        let port = process.wait_for_line(|line| line.strip_prefix("READY ")?.parse().ok());
        Some(Self { process, port, answers: 0 })
    }

    fn command(&mut self, command: &Value) {
        self.process.write_line(&command.to_string());
        self.answers += 1;
        let mut left = self.answers;
        self.process.wait_for_line(|line| {
            assert!(!line.starts_with("ERROR"), "{line}");
            left -= usize::from(line == "OK");
            (left == 0).then_some(())
        });
    }
}

/// Returns a scene of the example on the plugin's page, at the port of a server.
fn scene(port: u16) -> Scene {
    let page = std::fs::read_to_string(workspace_path("plugins/telemetry/iec61850/README.md"));
    let page = page.expect("the plugin has a page");
    let example = page.split("```json").nth(1).and_then(|rest| rest.split("```").next());
    let example: Value = serde_json::from_str(example.expect("it has an example")).expect("JSON");
    let mut scene = Scene::without_tags();
    scene.add_plugin("iec61850");
    scene.config["plugins"]["ied"] = example["plugins"]["ied"].clone();
    scene.config["tags"] = example["tags"].clone();
    let settings = &mut scene.config["plugins"]["ied"]["settings"];
    settings["port"] = json!(port);
    settings["timeout_seconds"] = json!(0.6);
    scene
}

fn set_values(server: &mut Server) {
    for (object, values, quality) in [
        ("LD0/XCBR1.Pos", json!({"stVal": {"dbpos": 2}}), 0),
        ("LD0/MMXU1.TotW", json!({"mag.f": 63_500_000.0}), 0b11 | 8),
        ("LD0/XCBR1.OpCnt", json!({"actVal": {"int64": 1234}}), 0),
    ] {
        server.command(&json!({"object": object, "values": values, "quality": quality}));
    }
}

#[test]
fn values_are_those_of_the_server() {
    let Some(mut server) = Server::start() else { return };
    set_values(&mut server);
    for isolation in ["process", "none"] {
        let mut scene = scene(server.port);
        scene.config["isolation"] = json!(isolation);
        scene.config["tags"]["Lost"] = json!({
            "type": "f64",
            "source": {"instance": "ied", "address": {"reference": "IED1LD0/MMXU7.TotW", "fc": "MX"}}
        });
        let output = finish(&mut scene.rendering(2.0)).expect_code(0);
        let said = output.stdout + &output.stderr;
        assert!(said.contains("the server has no IED1LD0/MMXU7$MX$TotW"), "{said}");
        let nodes = "the logical nodes of IED1LD0 are ATCC1, GGIO1, LLN0, MMXU1";
        assert!(said.contains(nodes), "{said}");
        let stats = scene.stats();
        for (id, value, quality, reason) in [
            ("Q1.Position", json!("closed"), "good", None),
            ("Q1.P", json!(63.5), "uncertain", Some("out of range")),
            ("Q1.Operations", json!(1234), "good", None),
            ("Lost", Value::Null, "bad", Some("configuration")),
        ] {
            let tag = stats.tag(id);
            assert_eq!((&tag.value, tag.quality.as_str()), (&value, quality), "{id}");
            assert_eq!(tag.reason.as_deref(), reason, "{id}");
        }
    }
}

#[test]
fn what_a_server_has_is_imported_and_is_live() {
    let Some(mut server) = Server::start() else { return };
    set_values(&mut server);
    let mut scene = scene(server.port);
    scene.config["plugins"]["ied"]["network"] = json!(true);
    scene.config["tags"] = json!({});
    let tags = scene.path("tags.json");
    let mut import = busbar();
    import.arg("import").arg(scene.write()).args(["--from", "ied", "--out"]).arg(&tags);
    let output = finish(&mut import).expect_code(0);
    assert!(output.stderr.contains("ied: tags: 18"), "{}", output.stderr);
    let imported: Value =
        serde_json::from_slice(&std::fs::read(&tags).expect("it was written")).expect("it is JSON");
    scene.config["tags"] = imported["tags"].clone();
    finish(busbar().arg("check").arg(scene.write())).expect_code(0);
    finish(&mut scene.rendering(2.0)).expect_code(0);
    let stats = scene.stats();
    for (id, value, quality) in [
        ("XCBR1.Pos", json!("closed"), "good"),
        ("MMXU1.TotW", json!(63_500_000.0), "uncertain"),
        ("XCBR1.OpCnt", json!(1234), "good"),
    ] {
        let tag = stats.tag(&format!("IED1LD0/{id}"));
        assert_eq!((&tag.value, tag.quality.as_str()), (&value, quality), "{id}");
    }
    assert!(stats.tags().all(|(_, tag)| tag.reason.as_deref() != Some("configuration")));
}

#[test]
fn a_server_that_is_killed_or_hangs_leaves_nothing_good() {
    for signal in [Signal::KILL, Signal::STOP] {
        let Some(mut server) = Server::start() else { return };
        set_values(&mut server);
        let scene = scene(server.port);
        let running = Process::start(&mut scene.rendering(5.0));
        wait_for("a connection", PATIENCE, || has_client(server.port).then_some(()));
        // For values to come, on a loaded machine too.
        std::thread::sleep(READING);
        server.process.signal(signal);
        running.finish().expect_code(0);
        for (id, tag) in scene.stats().tags() {
            let found = (tag.quality.as_str(), tag.reason.as_deref());
            assert_eq!(found, ("bad", Some("communication")), "{id} after {signal:?}");
        }
        assert_eq!(scene.stats().tag("Q1.P").value, json!(63.5), "the last value stays");
    }
}

#[test]
fn what_is_wrong_with_a_reference_is_told_with_what_there_is() {
    let Some(server) = Server::start() else { return };
    for (reference, constraint, words) in [
        ("LD0/MMXU1.TotW", "MX", "its logical devices are IED1LD0"),
        ("IED1LD0/MMXU1.Tot", "MX", "IED1LD0/MMXU1 has under MX: PhV, TotVAr, TotW"),
        ("IED1LD0/XCBR1.Pos", "MX", "IED1LD0/XCBR1 has nothing under MX"),
        ("IED1LD0/MMXU1.TotW.mag.i", "MX", "there is no i in mag, but f"),
    ] {
        let mut scene = scene(server.port);
        let address = json!({"reference": reference, "fc": constraint});
        scene.config["tags"] =
            json!({"A": {"type": "f64", "source": {"instance": "ied", "address": address}}});
        let output = finish(&mut scene.rendering(1.5)).expect_code(0);
        let said = output.stdout + &output.stderr;
        assert!(said.contains(words), "{reference}: {said}");
    }
}

/// An SCL file to a point list, that to a scene, and the scene to values.
#[test]
fn a_scene_is_made_of_an_scl_file() {
    let Some(mut server) = Server::start() else { return };
    set_values(&mut server);
    let scene = scene(server.port);
    let mut command = busbar();
    command.arg("scl").arg(workspace_path("tests/end_to_end/peers/iec61850_ied.cid"));
    command.arg("--plugin-directory").arg(scene.path("plugins"));
    let said = finish(command.arg("--out").arg(scene.path("points.csv")).args(["--", "IED1"]));
    let said = said.expect_code(0);
    assert!(said.stderr.contains("IED1LD0/LLN0.BR.brcbA01: data set dsWhole"), "{}", said.stderr);
    let plugin = format!("ied=iec61850,host=127.0.0.1,port={}", server.port);
    let mut command = busbar();
    command.arg("import").arg(e2e::model("transformer.glb")).arg(scene.path("points.csv"));
    command.arg("--out").arg(scene.path("imported.json")).args(["--plugin", &plugin]);
    finish(&mut command).expect_code(0);
    let mut command = busbar();
    command.arg("render").arg(scene.path("imported.json")).args(["--size", "320x180"]);
    command.args(["--seconds", "3"]).arg("--out").arg(scene.path("picture.png"));
    finish(command.arg("--stats").arg(scene.path("stats.json"))).expect_code(0);
    let stats = scene.stats();
    for (id, value) in [("XCBR1.Pos", json!("closed")), ("MMXU1.PhV.phsA", json!(0.0))] {
        let tag = stats.tag(&format!("IED1LD0/{id}"));
        assert_eq!((&tag.value, tag.quality.as_str()), (&value, "good"), "{id}");
    }
}

/// Reports whether a client is connected to a local port, by the kernel's list.
fn has_client(port: u16) -> bool {
    let list = std::fs::read_to_string("/proc/net/tcp").unwrap_or_default();
    let remote = format!(":{port:04X}");
    // Local and remote address are the second and third field, the state the fourth.
    list.lines().any(|line| {
        let fields: Vec<_> = line.split_whitespace().collect();
        matches!(fields[..], [_, _, peer, "01", ..] if peer.ends_with(&remote))
    })
}
