//! Error messages: each fault is reported once, with its place and remedy; nothing panics.

use std::path::Path;
use std::process::Command;

use e2e::{Output, Scene, busbar, finish, model, workspace_path};
use serde_json::{Value, json};

/// Asserts that a run failed by the user's input, and reported it in one error with all these
/// words.
#[track_caller]
fn assert_one_error(output: Output, words: &[&str]) {
    let output = output.expect_code(1);
    assert_eq!(errors_of(&output).len(), 1, "{}", output.stderr);
    for word in words {
        assert!(output.stderr.contains(word), "no '{word}' in: {}", output.stderr);
    }
}

/// Asserts one error with plugins in processes of their own, and without.
#[track_caller]
fn assert_one_error_either_way(scene: &mut Scene, words: &[&str]) {
    for isolation in ["process", "none"] {
        scene.config["isolation"] = json!(isolation);
        assert_one_error(check(&scene.write()), words);
    }
}

/// Returns the lines that describe an error; none may describe a panic.
#[track_caller]
fn errors_of(output: &Output) -> Vec<&str> {
    assert!(!output.stderr.contains("panicked"), "{}", output.stderr);
    output.stderr.lines().filter(|line| line.contains("error: ")).collect()
}

fn check(config: &Path) -> Output {
    finish(busbar().arg("check").arg(config))
}

fn render(scene: &Scene, more: &[&str]) -> Output {
    finish(&mut rendering(scene, more))
}

fn rendering(scene: &Scene, more: &[&str]) -> Command {
    let mut command = busbar();
    command.arg("render").arg(scene.write()).args(["--size", "64x64"]);
    command.arg("--out").arg(scene.path("picture.png")).args(more);
    command
}

/// Returns the demo with one value of its configuration changed.
fn with(pointer: &str, value: Value) -> Scene {
    let mut scene = Scene::demo(1);
    *scene.config.pointer_mut(pointer).expect("the demo has it") = value;
    scene
}

#[test]
fn a_configuration_that_names_what_is_not_there() {
    let cases = [
        ("/models/breaker/file", json!("models/none.glb"), "cannot read '"),
        ("/bindings/0/tag", json!("T1.TopOli"), "did you mean 'T1.TopOil'?"),
        ("/bindings/0/node", json!("=S12D1T1-TA1/tnak"), "no node '=S12D1T1-TA1/tnak'"),
        ("/bindings/0/node", json!("=S12D1T1-TA2"), "did you mean '=S12D1T1-TA1'?"),
        ("/plugins/values/plugin", json!("power_overlya"), "no plugin 'power_overlya' in "),
        ("/camera/start", json!("bey"), "'bay'"),
    ];
    for (pointer, value, words) in cases {
        let scene = with(pointer, value);
        let place = format!("(at {pointer})");
        let words = ["scene.json:", &place, words, "remedy: "];
        assert_one_error(check(&scene.write()), &words);
        assert_one_error(render(&scene, &[]), &words);
    }
}

#[test]
fn a_plugin_that_cannot_do_what_is_asked() {
    let cases = [
        ("/models/breaker/optimizer", json!("values"), "busbar.mesh-optimizer/1-draft"),
        ("/overlays/0", json!("optimizer"), "busbar.overlay/2-draft"),
        ("/tags/T1.U12/source/instance", json!("optimizer"), "busbar.telemetry/2-draft"),
    ];
    for (pointer, value, capability) in cases {
        let mut scene = with(pointer, value);
        let place = format!("(at {pointer})");
        let words = ["scene.json:", &place, "has no capability", capability, "remedy: "];
        assert_one_error_either_way(&mut scene, &words);
    }
}

#[test]
fn settings_and_addresses_that_a_plugin_refuses() {
    let cases = [
        (
            "/plugins/bay/settings/poll_seconds",
            json!("fast"),
            "settings of plugin 'modbus_adapter'",
        ),
        ("/plugins/bay/settings/poll_seconds", json!(0.001), "settings of plugin 'modbus_adapter'"),
        ("/plugins/optimizer/settings", json!({"guard": 1}), "'guard' was unexpected"),
    ];
    for (pointer, value, words) in cases {
        let mut scene = with(pointer, value);
        let words = ["scene.json:", &format!("(at {pointer}"), words, "remedy: "];
        assert_one_error_either_way(&mut scene, &words);
    }
    let address = json!({"table": "holding", "register": 70_000, "type": "f32"});
    let mut scene = with("/tags/T1.U12/source/address", address);
    let words = ["scene.json:", "tag 'T1.U12'", "`70000`", "register", "remedy: "];
    assert_one_error_either_way(&mut scene, &words);
}

#[test]
fn ten_errors_are_told_at_their_lines() {
    let faults = [
        r#""versoin": 1,"#,
        r#""plugins": {"optimizer": {"plugin": "weighted_collapse", "setings": {}}},"#,
        r#""models": {"breaker": {"file": "models/breaker.glb", "optimizer": "optimizer", "theta": 2}},"#,
        r#""scene": [{"id": "=Q1", "modle": "breaker"}],"#,
        r#""tags": {"A": {"type": "f16", "source": {"instance": "optimizer", "address": 1}},"#,
        r#""B": {"type": "f64", "freshness_seconds": 0.001, "source": {"instance": "optimizer", "address": 1}}},"#,
        r#""bindings": [{"tag": "nobody's", "node": "=Q1"}],"#,
        r#""overlays": ["nothing"],"#,
        r#""cameras": {"bay": {"eye": [1, 2, 3], "target": [0, 0, 0], "fov_degrees": 500}},"#,
        r#""graphics": { "samples": 3 }"#,
    ];
    let scene = Scene::demo(1);
    let path = scene.write_text(&format!(
        "{{ \"version\": 1, \"plugin_directories\": [\"plugins\"],\n{}\n}}",
        faults.join("\n")
    ));
    let output = check(&path).expect_code(1);
    let errors = errors_of(&output);
    assert_eq!(errors.len(), faults.len(), "{}", output.stderr);
    for (line, (error, fault)) in (2..).zip(errors.iter().zip(faults)) {
        let column = error
            .strip_prefix(&format!("{}:{line}:", path.display()))
            .and_then(|rest| rest.split(':').next()?.parse::<usize>().ok());
        let column = column.unwrap_or_else(|| panic!("not at line {line}: {error}"));
        assert!((1..=fault.len()).contains(&column), "not in the line: {error}");
        assert!(error.contains("(at /"), "no JSON pointer: {error}");
    }
    assert!(output.stderr.matches("remedy: ").count() >= faults.len(), "{}", output.stderr);
}

#[test]
fn text_that_is_no_json() {
    let scene = Scene::demo(1);
    let path = scene.write_text("{\n  \"version\": 1,\n  \"scene\": [}\n}");
    assert_one_error(check(&path), &["scene.json:3:13: error: ", "remedy: "]);
    let missing = scene.path("missing.json");
    assert_one_error(check(&missing), &["missing.json:1:1: error: ", "remedy: "]);
}

#[test]
fn a_library_that_is_missing() {
    let scene = Scene::demo(1);
    std::fs::remove_file(scene.library("power_overlay")).expect("it is there");
    let words = ["no plugin 'power_overlay'", "(at /plugins/values/plugin)", "remedy: put the"];
    assert_one_error(check(&scene.write()), &words);
}

#[test]
fn a_library_that_is_no_plugin() {
    let mut scene = Scene::demo(1);
    let library = scene.library("power_overlay");
    let mut refused = |words: &str| {
        let refused = format!("refused {}: ", library.display());
        assert_one_error_either_way(
            &mut scene,
            &["no plugin 'power_overlay'", &refused, words, "remedy: rebuild or replace"],
        );
    };
    std::fs::remove_file(&library).expect("it is there");
    std::fs::write(&library, "no library at all").expect("the folder can be written");
    refused("cannot load it: ");
    compile("int busbar_plugin_entries = 1;", &library);
    refused("it has no symbol 'busbar_plugin_entry'");
    for (major, minor) in [(2, 0), (0, 0), (1, 999)] {
        compile(&entry_of_version(major, minor), &library);
        refused(&format!("it speaks plugin ABI {major}.{minor}, this host 1."));
    }
}

/// Returns the C source of a plugin entry of this version.
fn entry_of_version(major: u32, minor: u32) -> String {
    format!(
        "#include <busbar/plugin.h>\n\
         BUSBAR_EXPORT const BusbarPluginEntry busbar_plugin_entry = {{\n\
         .struct_size = sizeof(BusbarPluginEntry), .abi_major = {major}, .abi_minor = {minor}\n\
         }};\n"
    )
}

/// Compiles C into a library, which replaces an older one.
fn compile(source: &str, library: &Path) {
    let source_path = library.with_extension("c");
    std::fs::write(&source_path, source).expect("the folder can be written");
    std::fs::remove_file(library).expect("it is there");
    let mut gcc = Command::new("gcc");
    gcc.args(["-shared", "-fPIC", "-Wall", "-Werror", "-I"]);
    gcc.arg(workspace_path("plugins/sdk/abi/include")).arg(source_path).arg("-o").arg(library);
    finish(&mut gcc).expect_code(0);
}

#[test]
fn a_broken_model() {
    let mut scene = Scene::demo(1);
    let whole = std::fs::read(model("breaker.glb")).expect("it is staged");
    let damaged = [&whole[..4], &[9, 0, 0, 0], &whole[8..]].concat();
    let cases: [&[u8]; 4] = [b"", b"no model", &whole[..whole.len() / 2], &damaged];
    for bytes in cases {
        std::fs::write(scene.path("broken.glb"), bytes).expect("the folder can be written");
        scene.config["models"]["breaker"]["file"] = json!("broken.glb");
        let words = ["broken.glb: ", "(at /models/breaker/file)", "remedy: "];
        assert_one_error(check(&scene.write()), &words);
        let mut command = busbar();
        command.arg("optimize").arg(scene.path("broken.glb"));
        command.args(["--plugin", "weighted_collapse", "--theta", "0.5", "--plugin-directory"]);
        assert_one_error(finish(command.arg(scene.path("plugins"))), &["broken.glb: "]);
    }
}

#[test]
fn no_vulkan_driver() {
    let scene = Scene::without_tags();
    let mut command = rendering(&scene, &[]);
    command.env("VK_DRIVER_FILES", "/nonexistent").env_remove("VK_ICD_FILENAMES");
    let words = ["error: Vulkan has no driver", "mesa-vulkan-drivers", "VK_DRIVER_FILES"];
    assert_one_error(finish(&mut command), &words);
    assert!(!scene.path("picture.png").exists());
}

#[test]
fn no_display() {
    let scene = Scene::without_tags();
    let mut command = busbar();
    command.arg("view").arg(scene.write()).args(["--seconds", "1"]);
    for name in ["DISPLAY", "WAYLAND_DISPLAY", "WAYLAND_SOCKET"] {
        command.env_remove(name);
    }
    assert_one_error(finish(&mut command), &["error: no display", "DISPLAY", "`busbar render`"]);
}

#[test]
fn what_cannot_be_written_or_found() {
    let scene = Scene::without_tags();
    let config = scene.write();
    let mut command = busbar();
    command.arg("render").arg(&config).args(["--size", "64x64"]);
    command.arg("--out").arg(scene.path("missing/picture.png"));
    let words = ["error: cannot write '", "missing/picture.png'", "check that its folder exists"];
    assert_one_error(finish(&mut command), &words);

    let words = ["error: no camera 'nowhere'", "remedy: name one of: bay, breaker, transformer"];
    assert_one_error(render(&scene, &["--camera", "nowhere"]), &words);

    let mut command = busbar();
    command.arg("optimize").arg(model("breaker.glb")).args(["--plugin", "nobody"]);
    command.args(["--theta", "0.5", "--plugin-directory"]).arg(scene.path("plugins"));
    assert_one_error(finish(&mut command), &["error: no plugin 'nobody' in ", "remedy: "]);
}

#[test]
fn wrong_use_ends_with_two() {
    let scene = Scene::without_tags();
    let config = scene.write();
    let config = config.to_str().expect("temporary paths are text");
    let cases: [(&[&str], &str); 7] = [
        (&["render", config, "--out", "a.png", "--theta", "2"], "--theta"),
        (&["render", config, "--out", "a.png", "--size", "0x0"], "--size"),
        (&["render", config, "--out", "a.png", "--pick", "middle"], "--pick"),
        (&["render", config], "--out"),
        (&["optimize", "a.glb", "--theta", "0.5"], "--plugin"),
        (&["optimize", "a.glb", "--plugin", "a", "--theta", "0", "--set", "x"], "--set"),
        (&["paint"], "paint"),
    ];
    for (arguments, words) in cases {
        let output = finish(busbar().args(arguments)).expect_code(2);
        assert_eq!(errors_of(&output).len(), 1, "{}", output.stderr);
        assert!(output.stderr.contains(words), "no '{words}' in: {}", output.stderr);
    }
}
