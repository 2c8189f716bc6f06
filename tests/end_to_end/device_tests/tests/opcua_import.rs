//! `busbar import --from`: the points of a running server become the tags of a configuration, which
//! are live at once. The commands are those of the plugin's page.

use std::fs;
use std::process::Command;

use e2e::peer::python;
use e2e::{Output, Process, Scene, busbar, finish, model, workspace_path};
use serde_json::{Value, json};

/// Address in the page's commands.
const PAGE_PORT: &str = ":4840/";
/// Reading time of the server before the picture, seconds.
const SECONDS: f64 = 3.0;

struct Server {
    _process: Process,
    port: u16,
}

impl Server {
    fn start() -> Option<Self> {
        let mut command = Command::new(python("asyncua")?);
        command.arg(workspace_path("tests/end_to_end/peers/opcua_asyncua.py"));
        let process = Process::start(command.arg(json!({"space": {}}).to_string()));
        let port = process.wait_for_line(|line| line.strip_prefix("READY ")?.parse().ok());
        Some(Self { _process: process, port })
    }
}

/// Returns a scene with an instance `plc` for the server at a port, and no tag.
fn scene(port: u16) -> Scene {
    let mut scene = Scene::without_tags();
    scene.add_plugin("opcua");
    scene.config["plugins"]["plc"] = json!({
        "plugin": "opcua",
        "network": true,
        "settings": {
            "url": format!("opc.tcp://127.0.0.1:{port}/test"),
            "publishing_seconds": 0.1,
            "silence_seconds": 2,
        },
    });
    scene
}

/// Runs a command of the page, in the folder of a scene: by words, and quotes around them.
fn run(scene: &Scene, line: &str, port: u16) -> Output {
    let line = line.replace(PAGE_PORT, &format!(":{port}/")).replace('"', "");
    let mut command = busbar();
    command.current_dir(scene.path("."));
    finish(command.args(line.split_whitespace().skip(1)))
}

/// Returns the commands under the heading "Points of a server" of the plugin's page.
fn commands() -> [String; 3] {
    let page = fs::read_to_string(workspace_path("plugins/telemetry/opcua/README.md"))
        .expect("it is there");
    let (_, rest) = page.split_once("## Points of a server").expect("it has the heading");
    let lines = rest.lines().filter_map(|line| line.strip_prefix("    busbar "));
    let lines: Vec<_> = lines.take(3).map(|line| format!("busbar {line}")).collect();
    lines.try_into().expect("it has three commands")
}

fn json_of(scene: &Scene, name: &str) -> Value {
    serde_json::from_slice(&fs::read(scene.path(name)).expect("it is there")).expect("it is JSON")
}

/// Checks the server's values, by the tags' ids after a prefix.
#[track_caller]
fn check_values(scene: &Scene, prefix: &str) {
    let stats = scene.stats();
    for (id, value) in [
        ("Bay 1.Any", json!(12)),
        ("Bay 1.Breaker", json!("closed")),
        ("Bay 1.Earthing", json!("closed")),
        ("Bay 1.Gas", json!(6.5)),
        ("Bay 1.Loose[0]", json!(true)),
        ("Bay 1.Loose[1]", json!(false)),
        ("Bay 1.Mode", json!(5)),
        ("Bay 1.Phases[2]", json!(3.0)),
        ("Bay 1.Pump", json!(true)),
        ("Bay 1.Twin (nsu=urn:busbar:test;s=Twin B)", json!(1.0)),
        ("Types.Boolean", json!(true)),
        ("Types.SByte", json!(-7)),
        ("Types.Byte", json!(200)),
        ("Types.Int16", json!(-3000)),
        ("Types.UInt16", json!(60_000)),
        ("Types.Int32", json!(-100_000)),
        ("Types.UInt32", json!(4_000_000_000_u32)),
        ("Types.Int64", json!(-5_000_000_000_i64)),
        ("Types.UInt64", json!(5_000_000_000_i64)),
        ("Types.Float", json!(1.5)),
        ("Types.Double", json!(-2.25)),
        ("Types.String", json!("CLOSED")),
        ("Types.LocalizedText", json!("open")),
        ("Types.StatusCode", json!(0x800A_0000_u32)),
        ("Voltage", json!(230.5)),
    ] {
        let tag = stats.tag(&format!("{prefix}{id}"));
        assert_eq!((&tag.value, tag.quality.as_str()), (&value, "good"), "{id}");
    }
    assert_eq!(stats.tags().count(), 28);
    assert!(stats.tags().all(|(_, tag)| tag.quality == "good"));
}

#[test]
fn what_a_server_has_is_imported_and_is_live() {
    let Some(server) = Server::start() else { return };
    let mut scene = scene(server.port);
    fs::rename(scene.write(), scene.path("site.json")).expect("it was just written");
    fs::copy(model("transformer.glb"), scene.path("transformer.glb")).expect("a copy");
    let [tags, list, import] = commands();

    let output = run(&scene, &tags, server.port).expect_code(0);
    assert!(
        output.stderr.contains("plc: tags: 28; variables that cannot be tags: 5"),
        "{}",
        output.stderr
    );
    let imported = json_of(&scene, "tags.json");
    assert_eq!(
        imported["tags"]["Station.Voltage"],
        json!({
            "type": "f64", "name": "Voltage, \"L1-L2\"", "unit": "kV",
            "range": {"low": 0.0, "high": 400.0},
            "source": {"instance": "plc", "address": {"node": "nsu=urn:busbar:test;s=Station.Voltage"}},
        })
    );
    scene.config["tags"] = imported["tags"].clone();
    finish(busbar().arg("check").arg(scene.write())).expect_code(0);
    finish(&mut scene.rendering(SECONDS)).expect_code(0);
    check_values(&scene, "Station.");

    run(&scene, &list, server.port).expect_code(0);
    fs::remove_file(scene.path("scene.json")).expect("it was there");
    let output = run(&scene, &import, server.port).expect_code(0);
    assert!(output.stdout.contains("28 tags"), "{}", output.stdout);
    let text = fs::read_to_string(scene.path("scene.json")).expect("it was written");
    scene.config = serde_json::from_str(&text).expect("it is JSON");
    finish(busbar().arg("check").arg(scene.path("scene.json"))).expect_code(0);
    finish(&mut scene.rendering(SECONDS)).expect_code(0);
    check_values(&scene, "");
}

/// Checks that a list is refused with this exit code, and that nothing is written.
#[track_caller]
fn check_refused(scene: &Scene, arguments: &[&str], code: i32, words: &str) {
    let mut command = busbar();
    command.arg("import").arg(scene.write()).args(arguments);
    command.arg("--out").arg(scene.path("points.csv"));
    let output = finish(&mut command).expect_code(code);
    assert!(output.stderr.contains(words), "{words}: {}", output.stderr);
    assert!(!scene.path("points.csv").exists());
}

#[test]
fn what_cannot_be_imported_is_told() {
    let Some(server) = Server::start() else { return };
    let mut scene = scene(server.port);
    check_refused(&scene, &["--from", "rtu"], 1, "there is no plugin instance 'rtu'");
    let none = "plugin 'quadric_collapse' cannot list what its device has";
    check_refused(&scene, &["--from", "optimizer"], 1, none);
    check_refused(&scene, &["--from", "plc", "--id", "T1"], 2, "--from <INSTANCE>' cannot be used");
    check_refused(&scene, &[], 2, "<POINTS>");
    let plc = scene.config["plugins"]["plc"].clone();
    scene.config["plugins"]["plc"]["network"] = json!(false);
    check_refused(&scene, &["--from", "plc"], 1, "set \"network\": true for it");
    scene.config["plugins"]["plc"] = plc;
    scene.config["plugins"]["plc"]["settings"]["url"] = json!("opc.tcp://127.0.0.1:1");
    check_refused(&scene, &["--from", "plc"], 1, "127.0.0.1:1: connection refused");
    // Users cannot reach it without an instance.
    let output =
        finish(busbar().args(["points", "x", "--plugin-directory"]).arg(scene.path("plugins")));
    let output = output.expect_code(2);
    assert!(output.stderr.contains("there is no command 'points'"), "{}", output.stderr);
}
