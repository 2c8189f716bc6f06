//! Results of optimisers on disk: found again, never trusted, never needed.

use std::fs;
use std::path::PathBuf;

use e2e::{Output, Scene, Stats, busbar, finish};
use serde_json::json;

/// The demo's equipment with a cache in its folder.
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

/// Kept results; compiled pipelines lie beside them.
fn files(scene: &Scene) -> Vec<PathBuf> {
    let entries = fs::read_dir(scene.path("cache")).expect("the cache is there");
    let files = entries.map(|entry| entry.expect("it can be read").path());
    let mut files: Vec<_> =
        files.filter(|path| path.extension() == Some("stacks".as_ref())).collect();
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
