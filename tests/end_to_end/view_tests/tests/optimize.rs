//! `busbar optimize` against independent counts from the bytes of the files.

use std::collections::HashSet;
use std::path::Path;

use e2e::glb::{self, WeldedMesh};
use e2e::{Output, Scene, Stats, busbar, finish, model};
use serde_json::Value;

/// The optimisers that reach every theta.
const PLUGINS: [&str; 2] = ["weighted_collapse", "quadric_collapse"];
const THETAS: [f64; 5] = [0.0, 0.3, 0.7, 0.85, 0.95];

/// Runs an optimiser with further arguments; writes `out.glb` and `stats.json`.
fn optimize(plugin: &str, scene: &Scene, model: &Path, theta: f64, more: &[&str]) -> Output {
    let mut command = busbar();
    command.arg("optimize").arg(model).args(["--plugin", plugin]);
    command.args(["--theta", &theta.to_string()]).args(more);
    command.arg("--plugin-directory").arg(scene.path("plugins"));
    command.arg("--out").arg(scene.path("out.glb")).arg("--stats").arg(scene.path("stats.json"));
    finish(&mut command)
}

fn optimized(
    plugin: &str,
    scene: &Scene,
    model: &Path,
    theta: f64,
    more: &[&str],
) -> (Vec<u8>, Stats) {
    optimize(plugin, scene, model, theta, more).expect_code(0);
    let written = std::fs::read(scene.path("out.glb")).expect("the model is written");
    (written, Stats::read(&scene.path("stats.json")))
}

/// Returns the number of surviving vertices at theta: V - min(round(theta V), V - left). In the
/// end, the paper's order leaves a vertex of each component, and an order that removes dead
/// components leaves one.
fn surviving(plugin: &str, mesh: &WeldedMesh, theta: f64) -> usize {
    let vertices = mesh.positions.len();
    let left = if plugin == "weighted_collapse" { mesh.components() } else { 1 };
    vertices - usize::min((theta * vertices as f64).round() as usize, vertices - left)
}

fn check_counts(plugin: &str, name: &str) {
    let scene = Scene::without_tags();
    let path = model(name);
    let imported = glb::read(&std::fs::read(&path).expect("it is staged"));
    let sum = |meshes: &[WeldedMesh], count: &dyn Fn(&WeldedMesh) -> usize| {
        meshes.iter().map(count).sum::<usize>() as u64
    };
    let mut last_triangles = u64::MAX;
    for theta in THETAS {
        let (written, stats) = optimized(plugin, &scene, &path, theta, &[]);
        let context = format!("{plugin}: {name} at theta {theta}");
        let expected = sum(&imported, &|mesh| surviving(plugin, mesh, theta));
        // Meshes share a theta: their cursors are rounded each.
        let apart = stats.count("vertices").abs_diff(expected);
        assert!(apart <= imported.len() as u64, "{context}: {apart} of {expected} apart");

        let live = glb::read(&written);
        let triangles = sum(&live, &|mesh| mesh.triangles.len());
        assert_eq!(stats.count("triangles"), triangles, "{context}");
        let border_edges = sum(&live, &WeldedMesh::border_edges);
        assert_eq!(stats.count("border_edges"), border_edges, "{context}");
        let referenced = sum(&live, &WeldedMesh::referenced);
        assert_eq!(stats.count("vertices_referenced"), referenced, "{context}");
        assert!(triangles < last_triangles, "{context}: fewer triangles with every step");
        last_triangles = triangles;

        let full = &stats.0["imported"];
        assert_eq!(full["vertices"], sum(&imported, &|mesh| mesh.positions.len()), "{context}");
        assert_eq!(full["triangles"], sum(&imported, &|mesh| mesh.triangles.len()), "{context}");
        assert_eq!(full["components"], sum(&imported, &WeldedMesh::components), "{context}");
        // Half-edge collapses make no new places.
        let old: HashSet<_> = corners(&imported).flatten().collect();
        assert!(corners(&live).flatten().all(|place| old.contains(&place)), "{context}");
    }
}

/// Iterates over the corners of all triangles, as the bits of their positions.
fn corners(meshes: &[WeldedMesh]) -> impl Iterator<Item = [[u32; 3]; 3]> {
    let place = |mesh: &WeldedMesh, i: usize| mesh.positions[i].map(f32::to_bits);
    meshes.iter().flat_map(move |m| m.triangles.iter().map(move |t| t.map(|i| place(m, i))))
}

#[test]
fn counts_of_the_transformer_are_those_of_the_formula() {
    for plugin in PLUGINS {
        check_counts(plugin, "transformer.glb");
    }
}

#[test]
fn counts_of_the_breaker_are_those_of_the_formula() {
    for plugin in PLUGINS {
        check_counts(plugin, "breaker.glb");
    }
}

#[test]
fn theta_zero_writes_the_imported_triangles() {
    let scene = Scene::without_tags();
    let path = model("breaker.glb");
    let (written, _) = optimized(PLUGINS[0], &scene, &path, 0.0, &[]);
    let imported = std::fs::read(&path).expect("it is staged");
    assert!(corners(&glb::read(&written)).eq(corners(&glb::read(&imported))));
}

#[test]
fn a_thousand_round_trips_are_lossless() {
    let scene = Scene::without_tags();
    let path = model("breaker.glb");
    for plugin in PLUGINS {
        let walk = ["--round-trip", "1000"];
        let output = optimize(plugin, &scene, &path, 0.5, &walk).expect_code(0);
        let said = output.stdout;
        assert!(said.contains("1000 round trips: every byte identical"), "{plugin}: {said}");
        let stats = Stats::read(&scene.path("stats.json"));
        assert_eq!((stats.count("round_trips"), &stats.0["lossless"]), (1000, &Value::Bool(true)));
    }
}

#[test]
fn two_runs_write_the_same_bytes_and_numbers() {
    let scene = Scene::without_tags();
    let path = model("transformer.glb");
    let run = |plugin| {
        let walk = ["--round-trip", "3"];
        let (written, mut stats) = optimized(plugin, &scene, &path, 0.7, &walk);
        let times = stats.0.as_object_mut().and_then(|stats| stats.remove("build_ms"));
        assert!(times.is_some_and(|times| times.is_object()));
        (written, stats.0)
    };
    for plugin in PLUGINS {
        let (first, second) = (run(plugin), run(plugin));
        assert!(first.0 == second.0, "{plugin}: the models differ");
        assert_eq!(first.1, second.1);
    }
}

/// Builds a flat grid, whose border is a square.
fn open_grid(side: usize) -> WeldedMesh {
    let places = (0..side * side).map(|i| [(i % side) as f32, 0.0, (i / side) as f32]);
    let cells = (0..side - 1).flat_map(|z| (0..side - 1).map(move |x| z * side + x));
    let triangles = cells.flat_map(|a| [[a, a + side, a + 1], [a + 1, a + side, a + side + 1]]);
    WeldedMesh { positions: places.collect(), triangles: triangles.collect() }
}

#[test]
fn border_protection_keeps_the_border_of_an_open_grid() {
    let scene = Scene::without_tags();
    let path = scene.path("grid.glb");
    let grid = open_grid(12);
    std::fs::write(&path, glb::write(&grid)).expect("the folder can be written");
    assert_eq!(grid.border_edges(), 4 * 11);
    let at_half = |setting: &str| optimized(PLUGINS[0], &scene, &path, 0.5, &["--set", setting]);

    let (protected, kept) = at_half("border_protection=true");
    let (unprotected, lost) = at_half("border_protection=false");

    assert!(protected != unprotected, "the setting changes the model");
    assert_eq!(kept.count("vertices"), lost.count("vertices"), "theta decides the count");
    assert_eq!(kept.count("vertices"), 72);
    let on_border = |[x, _, z]: [u32; 3]| {
        [x, z].map(f32::from_bits).iter().any(|&side| side == 0.0 || side == 11.0)
    };
    let border_places = |bytes: &[u8]| {
        let meshes = glb::read(bytes);
        let places = corners(&meshes).flatten().filter(|&place| on_border(place));
        places.collect::<HashSet<_>>().len()
    };
    assert!(border_places(&protected) > border_places(&unprotected));
}

#[test]
fn a_wrong_setting_is_told() {
    let scene = Scene::without_tags();
    let path = model("breaker.glb");
    let check = |setting: &str, expected: &[&str]| {
        let output = optimize(PLUGINS[0], &scene, &path, 0.5, &["--set", setting]).expect_code(1);
        for words in expected {
            assert!(output.stderr.contains(words), "no '{words}' in: {}", output.stderr);
        }
        assert_eq!(output.stderr.matches("error: ").count(), 1, "{}", output.stderr);
    };
    let plugin = "settings of plugin 'weighted_collapse'";
    check("edge_protection=true", &[plugin, "'edge_protection'", "remedy: "]);
    check("border_protection=maybe", &[plugin, "boolean", "remedy: "]);
}
