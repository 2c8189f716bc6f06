//! Yard as sites export it: all equipment in one mesh, ids by vertex.

use std::f32::consts::{PI, TAU};
use std::fs;

use busbar_geometry::{CollapseStacks, NO_FEATURE, RawPrimitive, weld};
use busbar_gltf_export::write_glb;
use busbar_plugin_host::{Catalog, MeshOptimizer};
use busbar_scene::{Material, Model, ModelNode};
use busbar_scene_loader::LoadedScene;
use busbar_viewer::{RendererOptions, Viewer};
use e2e::Scene;
use glam::{DMat4, Vec3};
use serde_json::json;

/// Number of pieces of equipment, side by side along x, a metre each.
pub(crate) const PIECES: usize = 8;
/// Number of quads along an edge of a box.
const STEPS: u32 = 6;
/// Number of quads around and from top to bottom of a ball.
const BALL: [u32; 2] = [16, 10];
/// Position of the camera before the middle of the row.
const EYE: Vec3 = Vec3::new(PIECES as f32 / 2.0, 0.8, 22.0);
const FOV_DEGREES: f32 = 24.0;

pub(crate) fn name_of(piece: usize) -> String {
    format!("=S1Q{piece}-QA1")
}

/// Returns the equipment id of a piece in [`scene_of`].
pub(crate) fn id_of(piece: usize) -> String {
    format!("yard/{}", name_of(piece))
}

/// Returns the corners of the ground, which is no feature.
pub(crate) fn ground_box() -> (Vec3, Vec3) {
    (Vec3::new(-1.0, -1.0, -1.0), Vec3::new(PIECES as f32 + 1.0, -0.5, 2.0))
}

/// Builds boxes, wall to wall, each with a ball of another material above; each two are a feature.
/// One mesh at one node.
pub(crate) fn merged_yard() -> Model {
    let mut boxes = RawPrimitive { material: Some(0), ..RawPrimitive::default() };
    let mut balls = RawPrimitive { material: Some(1), ..RawPrimitive::default() };
    let (low, high) = ground_box();
    add_box(&mut boxes, low, high, NO_FEATURE);
    for piece in 0..PIECES {
        let left = Vec3::X * piece as f32;
        add_box(&mut boxes, left, left + Vec3::ONE, piece as u32);
        add_ball(&mut balls, left + Vec3::new(0.5, 1.6, 0.5), piece as u32);
    }
    let paint =
        |name: &str, base_color| Material { name: name.into(), base_color, ..Material::default() };
    let node = ModelNode {
        name: "body".into(),
        parent: None,
        parent_from_node: DMat4::IDENTITY,
        mesh: Some(0),
    };
    Model {
        meshes: vec![weld(&[boxes, balls]).expect("its points are finite").0],
        features: vec![(0..PIECES).map(name_of).collect()],
        materials: vec![paint("grey", [0.6, 0.6, 0.6, 1.0]), paint("tan", [0.7, 0.6, 0.4, 1.0])],
        nodes: vec![node],
        ..Model::default()
    }
}

fn add_grid(
    into: &mut RawPrimitive,
    [columns, rows]: [u32; 2],
    feature: u32,
    point: impl Fn(f32, f32) -> Vec3,
) {
    let first = into.positions.len() as u32;
    for row in 0..=rows {
        for column in 0..=columns {
            let (u, v) = (column as f32 / columns as f32, row as f32 / rows as f32);
            into.positions.push(point(u, v));
            into.features.push(feature);
        }
    }
    for row in 0..rows {
        for column in 0..columns {
            let a = first + row * (columns + 1) + column;
            let above = a + columns + 1;
            into.triangles.extend([[a, a + 1, above + 1], [a, above + 1, above]]);
        }
    }
}

fn add_box(into: &mut RawPrimitive, low: Vec3, high: Vec3, feature: u32) {
    for axis in 0..3 {
        for side in [0.0, 1.0] {
            // Turned so that it faces outward.
            let (one, other) = ((axis + 1) % 3, (axis + 2) % 3);
            let (one, other) = if side == 1.0 { (one, other) } else { (other, one) };
            add_grid(into, [STEPS; 2], feature, |u, v| {
                let mut share = Vec3::ZERO;
                (share[axis], share[one], share[other]) = (side, u, v);
                low + share * (high - low)
            });
        }
    }
}

/// Adds a ball half a metre across at most, closed but for rounding at its seam.
fn add_ball(into: &mut RawPrimitive, center: Vec3, feature: u32) {
    add_grid(into, BALL, feature, |u, v| {
        // The last column is the first one, to the bit.
        let (around, down) = ((u % 1.0) * TAU, (1.0 - v) * PI);
        let out = if v == 0.0 || v == 1.0 { 0.0 } else { down.sin() };
        center + 0.45 * Vec3::new(out * around.sin(), down.cos(), out * around.cos())
    });
}

/// Returns a configuration that shows a model as `yard`, from before the middle.
pub(crate) fn scene_of(model: &Model, size: [u32; 2]) -> Scene {
    let mut scene = Scene::without_tags();
    let file = write_glb(model).expect("it can be written");
    fs::write(scene.path("model.glb"), file).expect("the folder can be written");
    scene.config["models"] = json!({ "merged": { "file": "model.glb", "optimizer": "optimizer" } });
    scene.config["scene"] = json!([{ "id": "yard", "model": "merged" }]);
    let target = EYE * Vec3::new(1.0, 1.0, 0.0);
    scene.config["cameras"] = json!({ "front": {
        "eye": EYE.to_array(), "target": target.to_array(), "fov_degrees": FOV_DEGREES } });
    scene.config["camera"] = json!({ "start": "front" });
    scene.config["window"] = json!({ "size": size });
    scene.config["graphics"] = json!({ "samples": 4 });
    scene
}

/// Returns the pixel of the middle of a box's front.
pub(crate) fn pixel_of(piece: usize, size: [u32; 2]) -> [u32; 2] {
    pixel_at(Vec3::new(piece as f32 + 0.5, 0.5, 1.0), size)
}

/// Returns the pixel of the middle of the ground's front.
pub(crate) fn pixel_of_ground(size: [u32; 2]) -> [u32; 2] {
    let (low, high) = ground_box();
    pixel_at(((low + high) / 2.0).with_z(high.z), size)
}

fn pixel_at(point: Vec3, [width, height]: [u32; 2]) -> [u32; 2] {
    let seen = point - EYE;
    let half_height = -seen.z * (FOV_DEGREES.to_radians() / 2.0).tan();
    let pixels_per_metre = height as f32 / 2.0 / half_height;
    let [x, y] = [
        width as f32 / 2.0 + seen.x * pixels_per_metre,
        height as f32 / 2.0 - seen.y * pixels_per_metre,
    ];
    [x as u32, y as u32]
}

pub(crate) fn viewer_of(scene: &Scene, size: [u32; 2]) -> Viewer {
    let loaded = LoadedScene::load(&scene.write(), &|_, _, _| ());
    let loaded = loaded.unwrap_or_else(|faults| panic!("{faults}"));
    let options = RendererOptions { validation: true, ..Default::default() };
    Viewer::new_headless(loaded, options, size).unwrap_or_else(|fault| panic!("{fault}"))
}

/// Moves all cursors to theta and draws a frame with them; returns its triangles.
pub(crate) fn show_at(viewer: &mut Viewer, theta: f64) -> u64 {
    viewer.set_theta(theta);
    let input = viewer.headless_input(0.0);
    viewer.frame(input).unwrap_or_else(|fault| panic!("{fault}"));
    viewer.stats().triangles
}

/// Runs the optimiser, and checks every corner of every live triangle at `steps` cursors and at the
/// last one.
pub(crate) fn assert_every_theta_keeps_features(model: &Model, steps: u32) {
    let scene = Scene::without_tags();
    let optimizer = Catalog::discover(&[scene.path("plugins")])
        .create("optimizer", "weighted_collapse", &json!({ "border_protection": true }))
        .and_then(MeshOptimizer::from_instance)
        .unwrap_or_else(|fault| panic!("{fault}"));
    for imported in &model.meshes {
        let optimised = optimizer.optimize(imported, |_| true);
        let sequence = optimised.unwrap_or_else(|fault| panic!("{fault}")).sequence;
        let (last, count) = (sequence.len(), imported.triangles.len());
        assert!(last as usize > imported.positions.len() / 2, "{last} collapses");
        let stacks = CollapseStacks::build(imported.clone(), &sequence);
        let mesh = stacks.mesh();
        for step in 0..=steps {
            let cursor = (u64::from(last) * u64::from(step) / u64::from(steps)) as u32;
            let resolved = stacks.resolve(cursor);
            let live: Vec<u32> = stacks.live(cursor).collect();
            assert_eq!(live.len(), resolved.triangles.len());
            assert_eq!(resolved.triangles.len() == count, step == 0);
            for (&triangle, &index) in resolved.triangles.iter().zip(&live) {
                let feature = imported.feature(imported.triangles[index as usize]);
                let [a, b, c] = triangle;
                for corner in [[a, b, c], [b, c, a], [c, a, b]] {
                    assert_eq!(mesh.feature(corner), feature, "triangle {index} at {cursor}");
                }
            }
        }
    }
}
