//! Cache of optimisers' results on disk: found again, never trusted, never needed.

use std::fs;
use std::path::PathBuf;

use busbar_geometry::{RawPrimitive, weld};
use busbar_gltf_export::write_glb;
use busbar_scene::{Model, ModelNode};
use e2e::{Output, Scene, Stats, busbar, finish};
use glam::{DMat4, Vec3};
use serde_json::json;

/// Returns a scene of the demo's equipment with a cache in its folder.
fn scene() -> Scene {
    let mut scene = Scene::without_tags();
    scene.config["cache"] = json!({ "directory": "cache" });
    scene
}

#[track_caller]
fn render(scene: &Scene) -> (Output, Stats, Vec<u8>) {
    let mut command = busbar();
    command.arg("render").arg(scene.write()).args(["--size", "320x180", "--theta", "0.6"]);
    command.arg("--out").arg(scene.path("picture.png"));
    command.arg("--stats").arg(scene.path("stats.json"));
    let output = finish(&mut command).expect_code(0);
    let picture = fs::read(scene.path("picture.png")).expect("it was written");
    (output, Stats::read(&scene.path("stats.json")), picture)
}

/// Lists the cached results; compiled pipelines lie beside them.
fn files(scene: &Scene) -> Vec<PathBuf> {
    files_like(scene, "stacks")
}

fn files_like(scene: &Scene, extension: &str) -> Vec<PathBuf> {
    let entries = fs::read_dir(scene.path("cache")).expect("the cache is there");
    let files = entries.map(|entry| entry.expect("it can be read").path());
    let mut files: Vec<_> =
        files.filter(|path| path.extension() == Some(extension.as_ref())).collect();
    files.sort();
    files
}

#[test]
fn the_second_start_optimises_nothing() {
    let scene = scene();
    let (_, first, picture) = render(&scene);
    assert_eq!(first.count("cached_meshes"), 0);
    assert!(first.0["load_ms"]["optimize"].is_number(), "{:#}", first.0["load_ms"]);
    let (_, second, again) = render(&scene);
    assert_eq!(second.count("cached_meshes"), files(&scene).len() as u64);
    // The yard has no optimiser, so some stacks are built in any case.
    assert!(second.0["load_ms"]["optimize"].is_null(), "{:#}", second.0["load_ms"]);
    assert_eq!(picture, again);
}

#[test]
fn other_settings_have_other_results() {
    let mut scene = scene();
    render(&scene);
    let before = files(&scene);
    scene.config["plugins"]["optimizer"]["settings"] = json!({ "border_weight": 0.0 });
    let (_, stats, _) = render(&scene);
    assert_eq!(stats.count("cached_meshes"), 0);
    assert_eq!(files(&scene).len(), 2 * before.len());
}

#[test]
fn a_damaged_cache_is_built_anew_with_a_note() {
    let scene = scene();
    let (_, _, picture) = render(&scene);
    let files = files(&scene);
    let mut cut = fs::read(&files[0]).expect("it is there");
    cut.truncate(cut.len() / 2);
    fs::write(&files[0], cut).expect("it can be written");
    let mut altered = fs::read(&files[1]).expect("it is there");
    let last = altered.len() - 1;
    altered[last] ^= 1;
    fs::write(&files[1], altered).expect("it can be written");

    let (output, stats, again) = render(&scene);
    assert_eq!(picture, again);
    assert_eq!(stats.count("cached_meshes"), files.len() as u64 - 2);
    for (file, reason) in [(&files[0], "bytes instead of"), (&files[1], "checksum")] {
        let note = format!("{} is built anew", file.display());
        let line = output.stderr.lines().find(|line| line.contains(&note));
        assert!(line.is_some_and(|line| line.contains(reason)), "{}", output.stderr);
    }
    let (output, stats, _) = render(&scene);
    assert_eq!(stats.count("cached_meshes"), files.len() as u64, "{}", output.stderr);
}

#[test]
fn a_cache_that_cannot_be_used_is_a_remark() {
    let mut scene = scene();
    scene.config["cache"] = json!({ "directory": "scene.json/cache" });
    let (output, stats, _) = render(&scene);
    assert_eq!(stats.count("cached_meshes"), 0);
    assert!(output.stderr.contains("cannot use the cache directory"), "{}", output.stderr);
    assert!(output.stderr.contains("/cache/directory"), "{}", output.stderr);
}

#[test]
fn a_cache_of_no_size_keeps_nothing() {
    let mut scene = scene();
    scene.config["cache"] = json!({ "directory": "cache", "max_megabytes": 0 });
    render(&scene);
    assert!(!scene.path("cache").exists());
}

/// Builds hills of 51,200 triangles.
fn hills() -> Model {
    const SIDE: u32 = 160;
    let at = |i: u32| {
        let [x, z] = [i % (SIDE + 1), i / (SIDE + 1)].map(|steps| steps as f32 * 0.05);
        Vec3::new(x, 0.4 * x.sin() * z.cos(), z)
    };
    let cell = |i: u32| {
        let corner = i / SIDE * (SIDE + 1) + i % SIDE;
        let [a, b, c, d] = [corner, corner + 1, corner + SIDE + 1, corner + SIDE + 2];
        [[a, c, b], [b, c, d]]
    };
    let ground = RawPrimitive {
        positions: (0..(SIDE + 1) * (SIDE + 1)).map(at).collect(),
        triangles: (0..SIDE * SIDE).flat_map(cell).collect(),
        ..RawPrimitive::default()
    };
    let node = ModelNode {
        name: "hills".into(),
        parent: None,
        parent_from_node: DMat4::IDENTITY,
        mesh: Some(0),
    };
    Model {
        meshes: vec![weld(&[ground]).expect("it is a mesh").0],
        nodes: vec![node],
        ..Model::default()
    }
}

fn write_hills(scene: &Scene, hills: &Model) {
    let file = write_glb(hills).expect("it can be written");
    fs::write(scene.path("hills.glb"), file).expect("it can be written");
}

#[test]
fn a_large_mesh_is_kept_as_welded_and_welded_anew_where_its_file_is_damaged_or_edited() {
    let mut scene = scene();
    write_hills(&scene, &hills());
    scene.config = json!({
        "version": 1,
        "cache": { "directory": "cache" },
        "models": { "hills": { "file": "hills.glb" } },
        "scene": [{ "id": "hills", "model": "hills" }],
    });
    let (_, _, picture) = render(&scene);
    let kept = files_like(&scene, "mesh");
    assert_eq!(kept.len(), 1);
    let bytes = fs::read(&kept[0]).expect("it is there");
    let (output, _, again) = render(&scene);
    assert!(again == picture && !output.stderr.contains("built anew"), "{}", output.stderr);

    let mut altered = bytes.clone();
    let middle = altered.len() / 2;
    altered[middle] ^= 1;
    fs::write(&kept[0], altered).expect("it can be written");
    let (output, _, again) = render(&scene);
    assert!(again == picture);
    let note = format!("{} is built anew: its checksum is wrong", kept[0].display());
    assert!(output.stderr.contains(&note), "{}", output.stderr);
    assert_eq!(fs::read(&kept[0]).expect("it is there"), bytes, "it was kept again");

    let mut edited = hills();
    edited.meshes[0].positions.iter_mut().for_each(|position| position.y *= 2.0);
    write_hills(&scene, &edited);
    let (_, _, other) = render(&scene);
    assert!(other != picture, "the old mesh is not shown for the new file");
    assert_eq!(files_like(&scene, "mesh").len(), 2);
}
