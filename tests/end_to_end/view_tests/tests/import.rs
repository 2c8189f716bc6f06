//! `busbar import`: from a model and a point list to a live scene, by the commands of the book,
//! and its errors for invalid lists and requests.

use std::fs;
use std::net::TcpListener;
use std::path::{Path, PathBuf};

use e2e::{Output, Process, Stats, built, built_folder, busbar, finish, model, workspace_path};
use serde_json::{Value, json};
use tempfile::TempDir;

/// Chapter of the book with the commands.
const CHAPTER: &str = "host/app/busbar/book/src/configure/import.md";
/// Reading time of the device before the picture, seconds.
const SECONDS: &str = "4";

/// Folder with the model, the list and the plugins of the example.
struct Example {
    folder: TempDir,
}

impl Example {
    fn new() -> Self {
        let folder = tempfile::tempdir().expect("a temporary folder can be made");
        let example = Self { folder };
        fs::create_dir(example.path("plugins")).expect("it can be written");
        for plugin in ["modbus_adapter", "power_overlay"] {
            let name = format!("lib{plugin}.so");
            let library = built(built_folder().join(&name));
            fs::copy(library, example.path("plugins").join(name)).expect("it can be copied");
        }
        fs::copy(model("transformer.glb"), example.path("transformer.glb")).expect("a copy");
        let list = workspace_path("config/transformer_points.csv");
        fs::copy(list, example.path("points.csv")).expect("a copy");
        example
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    fn write(&self, name: &str, text: &str) {
        fs::write(self.path(name), text).expect("it can be written");
    }

    fn exists(&self, name: &str) -> bool {
        self.path(name).exists()
    }

    fn json(&self, name: &str) -> Value {
        let text = fs::read(self.path(name)).expect("it is there");
        serde_json::from_slice(&text).expect("it is JSON")
    }

    /// Runs `busbar import` on the example's files, with more arguments.
    fn import(&self, more: &[&str]) -> Output {
        let mut command = busbar();
        command.current_dir(self.folder.path());
        command.args(["import", "transformer.glb", "points.csv", "--out", "scene.json"]);
        finish(command.args(more))
    }

    fn files(&self) -> Vec<String> {
        let entries = fs::read_dir(self.folder.path()).expect("it is there");
        let name =
            |entry: std::io::Result<fs::DirEntry>| entry.expect("it can be read").file_name();
        let mut files: Vec<_> =
            entries.map(|e| name(e).into_string().expect("it is UTF-8")).collect();
        files.sort();
        files
    }
}

/// Returns the argument of `--plugin` for a device at an unused port.
fn device() -> String {
    let taken = TcpListener::bind("127.0.0.1:0").expect("a port is free");
    let port = taken.local_addr().expect("it has an address").port();
    format!("bay=modbus_adapter,host=127.0.0.1,port={port},poll_seconds=0.2")
}

/// Simulates the device of a scene.
fn simulate(scene: &Path) -> Process {
    let process = Process::start(busbar().arg("simulate").arg(scene));
    process.wait_for_line(|line| (line == "ready").then_some(()));
    process
}

#[test]
fn a_model_and_a_list_become_a_live_scene() {
    let example = Example::new();
    example.import(&["--plugin", &device(), "--overlay", "power_overlay"]).expect_code(0);
    let _device = simulate(&example.path("scene.json"));

    let mut check = busbar();
    finish(check.arg("check").arg(example.path("scene.json"))).expect_code(0);
    let mut render = busbar();
    render.arg("render").arg(example.path("scene.json")).args(["--seconds", SECONDS]);
    render.args(["--size", "640x360", "--out"]).arg(example.path("picture.png"));
    finish(render.arg("--stats").arg(example.path("stats.json"))).expect_code(0);

    let stats = Stats::read(&example.path("stats.json"));
    assert_eq!(stats.tags().count(), 11);
    for (id, tag) in stats.tags() {
        assert_eq!(tag.quality, "good", "{id}: {:?}", tag.reason);
    }
    let scene = example.json("scene.json");
    let bindings = scene["bindings"].as_array().expect("there are bindings");
    let node_of = |tag: &str| {
        let binding = bindings.iter().find(|binding| binding["tag"] == tag);
        binding.unwrap_or_else(|| panic!("{tag} is not bound"))["node"].clone()
    };
    for (tag, node) in [
        ("T1.U12", "transformer"),
        ("T1.I1", "transformer"),
        ("T1.P", "transformer"),
        ("T1.Q", "transformer"),
        ("T1.Load", "transformer"),
        ("T1.Fans", "transformer"),
        ("T1.TopOil", "transformer/tank"),
        ("T1.HotSpot", "transformer/tank"),
        ("T1.OilLevel", "transformer/conservator"),
        ("T1.Tap", "transformer/tap changer"),
        ("T1.Buchholz", "transformer/buchholz relay"),
    ] {
        assert_eq!(node_of(tag), node, "{tag}");
    }
    assert_eq!(bindings.len(), 11);
    // The values themselves: the list's scale is the tag's.
    let oil = stats.tag("T1.TopOil").value.as_f64().expect("a number");
    assert!((20.0..95.0).contains(&oil), "{oil} degrees");
}

#[test]
fn the_book_has_these_commands() {
    let chapter = fs::read_to_string(workspace_path(CHAPTER)).expect("it is there");
    for part in [
        "busbar import config/models/transformer.glb config/transformer_points.csv",
        "--plugin bay=modbus_adapter,host=127.0.0.1,port=15020",
        "--overlay power_overlay",
        "busbar view config/transformer.json",
    ] {
        assert!(chapter.contains(part), "{CHAPTER} does not say `{part}`");
    }
}

#[test]
fn nothing_is_replaced_unless_asked() {
    let example = Example::new();
    let plugin = ["--plugin", "bay=modbus_adapter,host=127.0.0.1,port=9"];
    example.write("scene.import.md", "mine");
    let output = example.import(&plugin).expect_code(1);
    assert!(output.stderr.contains("scene.import.md") && output.stderr.contains("--force"));
    assert!(!example.exists("scene.json"));
    example.import(&[&plugin[..], &["--force"]].concat()).expect_code(0);
    assert!(example.exists("scene.json"));
    let report = fs::read_to_string(example.path("scene.import.md")).expect("it is there");
    assert!(report.starts_with("# Import\n\n11 of 11 tags are bound"), "{report}");
    let expected = [
        "plugins",
        "points.csv",
        "scene.import.csv",
        "scene.import.md",
        "scene.json",
        "transformer.glb",
    ];
    assert_eq!(example.files(), expected, "and nothing is left over");
}

#[test]
fn what_is_in_doubt_is_listed_and_not_bound() {
    let example = Example::new();
    example.write(
        "points.csv",
        "\u{feff}Tag;Type;Unit;address;node\n\
         T1.TopOil;AI;°C;{\"table\": \"holding\", \"register\": 100, \"type\": \"i16\"};\n\
         T1.Bushing.Temp;AI;°C;{\"table\": \"holding\", \"register\": 101, \"type\": \"i16\"};\n\
         Q7.CB.Pos;DP;;{\"table\": \"discrete\", \"register\": 0};\n\
         Odd;AI;;{\"table\": \"holding\", \"register\": 103, \"type\": \"i16\"};bushing 2V\n",
    );
    example.import(&["--plugin", "bay=modbus_adapter,host=127.0.0.1"]).expect_code(0);
    let scene = example.json("scene.json");
    assert_eq!(
        scene["bindings"],
        json!([
            {"tag": "T1.TopOil", "node": "transformer/tank", "role": "value"},
            {"tag": "Odd", "node": "transformer/bushing 2V", "role": "value"}
        ])
    );
    assert_eq!(scene["tags"].as_object().map(serde_json::Map::len), Some(4), "none is lost");
    let report = fs::read_to_string(example.path("scene.import.csv")).expect("it is there");
    let line = |tag: &str| report.lines().find(|line| line.starts_with(tag)).expect("each tag");
    assert!(line("T1.Bushing.Temp,doubtful,").contains("bushing"), "{report}");
    assert!(line("Q7.CB.Pos,doubtful,").len() > "Q7.CB.Pos,doubtful,".len());
    assert!(line("Odd,bound,").contains("the list says so"));
}

#[test]
fn every_bad_row_is_told_and_can_be_left_out() {
    let example = Example::new();
    example.write(
        "points.csv",
        "tag,type,low,address.table,address.register,address.type,plugin,node\n\
         T1.TopOil,f64,,holding,100,i16,,\n\
         T1.Load,command,x,holding,101,i16,,\n\
         T1.P,f64,,holding,101,i16,nobody,\n\
         T1.Q,f64,,holding,102,i16,,no such part\n",
    );
    let plugin = ["--plugin", "bay=modbus_adapter,host=127.0.0.1"];
    let output = example.import(&plugin).expect_code(1);
    for told in [
        "points.csv:3: error: column 'type': 'command'",
        "points.csv:3: error: column 'low': 'x' is no number",
        "points.csv:4: error: column 'plugin': there is no plugin 'nobody'",
        "points.csv:5: error: column 'node': the model has no node 'no such part'",
    ] {
        assert!(output.stderr.contains(told), "{told} is not in {}", output.stderr);
    }
    assert_eq!(output.stderr.matches("remedy:").count(), 4, "{}", output.stderr);
    assert!(!example.exists("scene.json"));
    let output = example.import(&[&plugin[..], &["--skip-bad-rows"]].concat()).expect_code(0);
    assert_eq!(output.stderr.matches("warning: skipped:").count(), 4, "{}", output.stderr);
    let scene = example.json("scene.json");
    assert_eq!(scene["tags"].as_object().map(serde_json::Map::len), Some(1));
}

#[test]
fn a_list_is_read_in_the_encoding_that_is_named() {
    let example = Example::new();
    // A description in ISO 8859-5, which no spreadsheet writes.
    let list = b"tag,type,description,address.table,address.register,address.type\n\
        T1.TopOil,f64,\xc2\xde\xda,holding,100,i16\n";
    std::fs::write(example.path("points.csv"), list).expect("it can be written");
    let plugin = ["--plugin", "bay=modbus_adapter,host=127.0.0.1"];
    let named = |name| example.import(&[&plugin[..], &["--encoding", name]].concat());
    let output = named("utf-8").expect_code(1);
    assert!(output.stderr.contains("points.csv:2: error: it is not UTF-8"), "{}", output.stderr);
    named("utf-9").expect_code(2);
    named("iso-8859-5").expect_code(0);
    assert_eq!(example.json("scene.json")["tags"]["T1.TopOil"]["name"], "Ток");
}

#[test]
fn requests_that_cannot_work_say_what_to_do() {
    let example = Example::new();
    let cases: [(&[&str], &str); 4] = [
        (&[], "add --plugin NAME=PLUGIN_ID"),
        (&["--plugin", "bay=no_such_plugin"], "no_such_plugin"),
        // A setting that the plugin refuses.
        (&["--plugin", "bay=modbus_adapter,host=127.0.0.1,port=banana"], "port"),
        (&["--plugin", "bay=modbus_adapter,host=a", "--overlay", "bay"], "two plugins"),
    ];
    for (arguments, told) in cases {
        let output = example.import(arguments).expect_code(1);
        assert!(output.stderr.contains(told), "{told} is not in {}", output.stderr);
        assert_eq!(example.files(), ["plugins", "points.csv", "transformer.glb"]);
    }
    example.write("points.csv", "");
    let output = example.import(&["--plugin", "bay=modbus_adapter,host=a"]).expect_code(1);
    assert!(output.stderr.contains("points.csv:1: error: no column"), "{}", output.stderr);
    example.import(&["--plugin", "bay"]).expect_code(2);
    assert!(!Path::new(&example.path("scene.json")).exists());
}
