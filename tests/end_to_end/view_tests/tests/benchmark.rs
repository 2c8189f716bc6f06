//! `busbar benchmark`: a table and JSON of what the machine can show, of generated scenes and of a
//! configuration.

use std::process::Command;
use std::time::Duration;

use e2e::{Output, Process, Scene, busbar};
use serde_json::{Value, json};

/// Options that make it short: some frames of little pictures.
const SHORT: [&str; 4] = ["--size", "160x90", "--seconds", "0.1"];

/// Longest run of a measurement on a busy machine.
const MAX_RUN: Duration = Duration::from_secs(200);

fn finish(command: &mut Command) -> Output {
    Process::start(command).finish_within(MAX_RUN)
}

fn written(output: &Output, file: &std::path::Path) -> Value {
    assert_eq!(output.code, Some(0), "{output:?}");
    let text = std::fs::read_to_string(file).expect("it was written");
    serde_json::from_str(&text).expect("JSON")
}

fn results(output: &Output, file: &std::path::Path) -> Vec<Value> {
    written(output, file)["scenes"].as_array().expect("a list").clone()
}

fn median(of: &Value) -> f64 {
    of["p50"].as_f64().unwrap_or_else(|| panic!("a median: {of}"))
}

#[test]
fn generated_scenes_grow_and_have_every_figure() {
    let scene = Scene::without_tags();
    for plugin in ["gas_analysis", "power_overlay"] {
        scene.add_plugin(plugin);
    }
    let file = scene.path("results.json");
    let mut command = busbar();
    command.arg("benchmark").args(SHORT).arg("--json").arg(&file);
    let plugins = scene.library("power_overlay");
    command.arg("--plugins").arg(plugins.parent().expect("a folder"));
    let output = finish(&mut command);
    let all = written(&output, &file);
    let scenes = all["scenes"].as_array().expect("a list");
    // The gas analysis shows none of the tags.
    assert_eq!([&all["optimizer"], &all["overlay"]], ["quadric_collapse", "power_overlay"]);
    let names: Vec<_> =
        scenes.iter().map(|scene| scene["scene"].as_str().expect("a name")).collect();
    assert_eq!(names, ["bay", "yard", "substation"]);
    let triangles: Vec<_> =
        scenes.iter().map(|scene| scene["triangles"].as_u64().expect("a number")).collect();
    assert!(triangles[0] * 6 == triangles[1] && triangles[2] > 1_000_000, "{triangles:?}");
    for scene in scenes {
        for part in
            ["rest_ms", "still_ms", "motion_ms", "tags_ms", "detail_step_ms", "detail_full_ms"]
        {
            assert!(median(&scene[part]) > 0.0, "{part}: {scene}");
            assert!(scene[part]["count"].as_u64() >= Some(3), "{part}: {scene}");
        }
        assert!(median(&scene["rest_ms"]) < median(&scene["still_ms"]), "{scene}");
        assert!(scene["start_seconds"].as_f64() > Some(0.0), "{scene}");
        assert!(scene["peak_bytes"].as_u64() > Some(1 << 20), "{scene}");
        assert!(median(&scene["pass_ms"]["scene"]) > 0.0, "{scene}");
        assert!(scene["tags"].as_u64() > Some(0), "{scene}");
        assert_eq!(scene["size"], json!([160, 90]));
        assert!(scene["motion_triangles"].as_u64() > Some(1000), "{scene}");
    }
    for name in names {
        assert!(output.stdout.contains(name), "{}", output.stdout);
    }
    let figures = output.stdout.lines().take_while(|line| !line.starts_with("device in motion"));
    assert!(figures.clone().count() > 10, "{}", output.stdout);
    let lacking: Vec<_> =
        figures.filter(|line| line.split_whitespace().any(|of| of == "-")).collect();
    assert_eq!(lacking, Vec::<&str>::new());
}

#[test]
fn a_configuration_is_measured_as_it_is() {
    let scene = Scene::without_tags();
    let file = scene.path("results.json");
    let config = scene.write();
    let mut command = busbar();
    command.arg("benchmark").arg(&config).args(SHORT).arg("--json").arg(&file).arg("--validation");
    let scenes = results(&finish(&mut command), &file);
    let [only] = &scenes[..] else { panic!("one scene: {scenes:?}") };
    assert_eq!([&only["tags"], &only["tags_ms"]], [&json!(0), &Value::Null]);
    assert!(median(&only["detail_full_ms"]) > 0.0);
    assert_eq!(only["validation_messages"], json!([]));
}

#[test]
fn what_cannot_be_measured_is_told() {
    let scene = Scene::without_tags();
    let missing = scene.path("nothing.json");
    let output = finish(busbar().arg("benchmark").arg(missing));
    assert_ne!(output.code, Some(0));
    assert!(output.stderr.contains("nothing.json"), "{output:?}");
    // No plugin in a folder: what is then not measured is said, and the rest is.
    let folder = tempfile::tempdir().expect("a folder");
    let file = scene.path("results.json");
    let mut command = busbar();
    command.arg("benchmark").args(SHORT).arg("--plugins").arg(folder.path());
    let output = finish(command.arg("--json").arg(&file));
    for option in ["--optimizer", "--overlay"] {
        assert!(output.stderr.contains(option), "{output:?}");
    }
    let scenes = results(&output, &file);
    for part in ["detail_step_ms", "detail_full_ms", "tags_ms"] {
        assert!(scenes.iter().all(|scene| scene[part] == Value::Null), "{part}");
    }
}

/// Neither people nor logs hear of values that are measured with, and a plant far from the origin is
/// in the picture.
#[test]
fn a_measurement_is_no_event_of_the_plant() {
    let mut scene = Scene::without_tags();
    let log = scene.path("log");
    scene.config["tags"] = json!({ "T": { "type": "f64", "set_by_host": true } });
    scene.config["alarms"] = json!({
        "A": { "tag": "T", "condition": { "high": 0.5 }, "priority": "high", "message": "high" }
    });
    scene.config["alarm_handling"] = json!({ "log_directory": log });
    for node in scene.config["scene"].as_array_mut().expect("a list") {
        node["transform"] = json!({ "translation": [500_000, 0, 5_000_000] });
    }
    let file = scene.path("results.json");
    let config = scene.write();
    let mut command = busbar();
    command.arg("benchmark").arg(&config).args(SHORT).arg("--json").arg(&file);
    let scenes = results(&finish(&mut command), &file);
    assert!(scenes[0]["motion_triangles"].as_u64() > Some(1000), "{scenes:?}");
    assert_eq!(scenes[0]["tags"], json!(1));
    let written = std::fs::read_dir(&log).map_or(0, |entries| entries.count());
    assert_eq!(written, 0, "the audit log has what was measured with");
}
