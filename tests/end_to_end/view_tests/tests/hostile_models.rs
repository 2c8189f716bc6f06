//! Hostile models: refused at once, in little memory, with one error.

use std::fs;
use std::path::Path;
use std::process::Command;
use std::time::Duration;

use e2e::glb::{self, WeldedMesh};
use e2e::{Output, Scene, busbar, finish};
use serde_json::{Value, json};

/// Longest time of a refusal.
const MAX_TIME: Duration = Duration::from_secs(1);
/// Greatest additional memory over a run with a tiny model, besides four times the file, bytes.
const MAX_EXTRA_BYTES: u64 = 64 << 20;

/// Returns a model with one triangle, whose data are a file beside it.
fn triangle() -> Value {
    json!({
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
        "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3",
            "min": [0, 0, 0], "max": [1, 1, 0]}],
        "bufferViews": [{"buffer": 0, "byteLength": 36}],
        "buffers": [{"byteLength": 36, "uri": "triangle.bin"}]
    })
}

fn checking(scene: &Scene, model: &Path) -> Command {
    let text = json!({
        "version": 1,
        "models": {"hostile": {"file": model}},
        "scene": [{"id": "=Q1", "model": "hostile"}]
    });
    let mut command = busbar();
    command.arg("check").arg(scene.write_text(&text.to_string()));
    command
}

fn optimizing(scene: &Scene, model: &Path) -> Command {
    let mut command = busbar();
    command.arg("optimize").arg(model).args(["--plugin", "weighted_collapse", "--theta", "0.5"]);
    command.arg("--plugin-directory").arg(scene.path("plugins"));
    command
}

/// Runs `check` on an odd model, which is shown once, quickly.
fn assert_loaded(name: &str, document: &Value) {
    let scene = Scene::without_tags();
    prepare(&scene);
    let odd = scene.path("odd.gltf");
    fs::write(&odd, document.to_string()).expect("the folder can be written");
    let output = finish(&mut checking(&scene, &odd)).expect_code(0);
    assert!(output.elapsed < MAX_TIME, "{name} took {:?}", output.elapsed);
}

/// Runs `check` and `optimize` on a hostile model and on a tiny good one.
fn assert_refused(name: &str, document: &Value, words: &str) {
    let scene = Scene::without_tags();
    prepare(&scene);
    let (hostile, good) = (scene.path("hostile.gltf"), scene.path("good.glb"));
    fs::write(&hostile, document.to_string()).expect("the folder can be written");
    let file_bytes = fs::metadata(&hostile).expect("it was written").len();
    for run in [checking, optimizing] {
        let baseline = finish(&mut run(&scene, &good)).expect_code(0).peak_bytes;
        assert!(baseline > 1 << 20, "no program runs in {baseline} bytes");
        let output = finish(&mut run(&scene, &hostile)).expect_code(1);
        let Output { stderr, elapsed, peak_bytes, .. } = &output;
        assert!(!stderr.contains("panicked"), "{name}: {stderr}");
        assert_eq!(stderr.matches("error: ").count(), 1, "{name}: {stderr}");
        assert!(stderr.contains("hostile.gltf") && stderr.contains(words), "{name}: {stderr}");
        assert!(*elapsed < MAX_TIME, "{name} took {elapsed:?}");
        let most = baseline + 4 * file_bytes + MAX_EXTRA_BYTES;
        assert!(*peak_bytes < most, "{name}: {peak_bytes} bytes, beside {baseline}");
    }
}

/// Puts a good model, the data of [`triangle`], and traps into the folder.
fn prepare(scene: &Scene) {
    let tiny = WeldedMesh {
        positions: vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]],
        triangles: vec![[0, 1, 2]],
    };
    fs::write(scene.path("good.glb"), glb::write(&tiny)).expect("the folder can be written");
    let data = tiny.positions.iter().flatten().flat_map(|x| x.to_le_bytes());
    let data: Vec<u8> = data.collect();
    fs::write(scene.path("triangle.bin"), data).expect("the folder can be written");
    finish(Command::new("mkfifo").arg(scene.path("fifo.bin"))).expect_code(0);
    std::os::unix::fs::symlink("/dev/zero", scene.path("zero.bin")).expect("it can be written");
}

#[test]
fn the_model_that_the_hostile_ones_are_made_from_is_good() {
    let scene = Scene::without_tags();
    prepare(&scene);
    let path = scene.path("triangle.gltf");
    fs::write(&path, triangle().to_string()).expect("the folder can be written");
    for run in [checking, optimizing] {
        finish(&mut run(&scene, &path)).expect_code(0);
    }
}

#[test]
fn buffers_outside_the_folder_or_of_other_kinds() {
    let cases = [
        ("../../../etc/passwd", "is refused"),
        ("/etc/passwd", "is refused"),
        ("file:///etc/passwd", "is refused"),
        ("%2e%2e/%2e%2e/etc/passwd", "is refused"),
        ("http://localhost/triangle.bin", "is refused"),
        ("fifo.bin", "not a regular file"),
        ("zero.bin", "hostile.gltf"),
        ("missing.bin", "cannot read"),
    ];
    for (uri, words) in cases {
        let mut document = triangle();
        document["buffers"][0]["uri"] = json!(uri);
        assert_refused(uri, &document, words);
    }
}

#[test]
fn counts_that_no_bytes_are_behind() {
    let mut sparse = triangle();
    sparse["accessors"][0]["sparse"] = json!({
        "count": 4_000_000_000_u64,
        "indices": {"bufferView": 0, "componentType": 5125},
        "values": {"bufferView": 0}
    });
    assert_refused("a sparse accessor", &sparse, "4000000000");

    let mut without_view = triangle();
    without_view["accessors"][0] = json!({
        "componentType": 5126, "count": 4_000_000_000_u64, "type": "VEC3",
        "min": [0, 0, 0], "max": [1, 1, 0]
    });
    assert_refused("an accessor of zeros", &without_view, "/meshes/0/primitives/0");

    let mut accessor = triangle();
    accessor["accessors"][0]["count"] = json!(4_000_000_000_u64);
    assert_refused("an accessor", &accessor, "/accessors/0");

    let mut buffer = triangle();
    buffer["buffers"][0]["byteLength"] = json!(1_u64 << 40);
    assert_refused("a buffer", &buffer, "/buffers/0");
}

#[test]
fn nodes_that_do_not_form_a_tree() {
    let mut cycle = triangle();
    cycle["nodes"] = json!([{"mesh": 0, "children": [1]}, {"children": [2]}, {"children": [1]}]);
    assert_refused("a cycle", &cycle, "/nodes/");

    let mut own_parent = triangle();
    own_parent["nodes"] = json!([{"mesh": 0, "children": [0]}]);
    assert_refused("its own parent", &own_parent, "/nodes/");

    // Each level names the next one twice: 2^31 nodes, were they followed.
    let mut doubled = triangle();
    let levels = (1..32).map(|next| json!({"children": [next, next]}));
    doubled["nodes"] = levels.chain([json!({"mesh": 0})]).collect();
    assert_loaded("doubled nodes", &doubled);

    // The same with two nodes a level.
    let mut diamonds = triangle();
    let levels = (0..62).map(|node| json!({"children": [node / 2 * 2 + 2, node / 2 * 2 + 3]}));
    diamonds["nodes"] = levels.chain([json!({"mesh": 0}), json!({"mesh": 0})]).collect();
    assert_loaded("diamonds of nodes", &diamonds);
}
