//! Lines and points: slender islands, which are drawn a pixel wide from afar.

#![allow(clippy::unwrap_used)]

mod common;

use busbar_gltf_import::ImportedModel;
use common::{Builder, floats};
use glam::Vec3;
use serde_json::json;

/// Corners of a polyline of three metres, and an absurd one.
const CORNERS: [[f32; 3]; 5] =
    [[0., 0., 0.], [1., 0., 0.], [1., 1., 0.], [2., 1., 0.], [f32::NAN, 0., 0.]];

fn drawn(mode: u32, indices: &[u8]) -> ImportedModel {
    let mut builder = Builder::new();
    let positions = builder.accessor(&floats(CORNERS.as_flattened()), 5126, "VEC3", 5);
    let indices = builder.accessor(indices, 5121, "SCALAR", indices.len());
    *builder.primitive() =
        json!({ "attributes": { "POSITION": positions }, "indices": indices, "mode": mode });
    builder.import()
}

/// Triangles of a tube.
const TUBE: usize = 10;

#[test]
fn lines_of_every_mode_are_slender_tubes() {
    for (mode, indices, segments) in [
        (1, &[0, 1, 2, 3][..], 2),
        (1, &[0, 1, 2], 1),
        (3, &[0, 1, 2, 3], 3),
        (2, &[0, 1, 2, 3], 4),
        (3, &[0, 1, 255, 2, 3], 2),
        (3, &[0, 1, 4, 2, 3], 2),
        (0, &[0, 1, 2], 3),
    ] {
        let imported = drawn(mode, indices);
        let mesh = &imported.model.meshes[0];
        assert_eq!(mesh.triangles.len(), segments * TUBE, "{mode} {indices:?}");
        // All of it is taken for a wire, which is widened to a pixel.
        let slender = mesh.slender_points();
        assert_eq!(slender.len(), mesh.positions.len(), "{mode} {indices:?}");
        assert!(slender.iter().all(|point| point.radius <= 0.001 && point.radius > 0.0));
    }
    let note = &drawn(3, &[0, 1, 4, 2, 3]).report.notes[0];
    assert!(note.starts_with("2 x line or point left out"), "{note}");
    let note = &drawn(3, &[0, 1, 255, 2, 3]).report.notes[0];
    assert!(note.contains("restart value"), "{note}");
}

#[test]
fn tubes_follow_their_lines() {
    let imported = drawn(1, &[1, 2]);
    let bounds = imported.model.meshes[0].bounds().unwrap();
    assert!(bounds.min.distance(Vec3::new(1.0, 0.0, 0.0)) < 0.003, "{bounds:?}");
    assert!(bounds.max.distance(Vec3::new(1.0, 1.0, 0.0)) < 0.003, "{bounds:?}");
    // Faces look outwards.
    let mesh = &imported.model.meshes[0];
    for &triangle in &mesh.triangles {
        let [a, b, c] = mesh.corner_positions(triangle).map(|p| mesh.positions[p as usize]);
        let outward = (a + b + c) / 3.0 - Vec3::new(1.0, (a.y + b.y + c.y) / 3.0, 0.0);
        assert!((b - a).cross(c - a).dot(outward) > 0.0);
    }
}

#[test]
fn lines_have_the_colours_of_their_ends() {
    let mut builder = Builder::new();
    let positions = builder.accessor(&floats(&[0., 0., 0., 1., 0., 0.]), 5126, "VEC3", 2);
    let colors = builder.accessor(&floats(&[1., 0., 0., 1., 0., 0.]), 5126, "VEC3", 2);
    *builder.primitive() =
        json!({ "attributes": { "POSITION": positions, "COLOR_0": colors }, "mode": 1 });
    let model = builder.import().model;
    assert_eq!(model.materials[0].base_color, [1.0, 0.0, 0.0, 1.0]);
    assert_eq!(model.meshes[0].triangles.len(), TUBE);
}

#[test]
fn lines_far_away_and_of_no_length_do_no_harm() {
    for (positions, tubes) in [
        ([[2.6e6, 450.0, -1.2e6], [2.6e6, 460.0, -1.2e6]], 1),
        ([[1e12, 0.0, 0.0], [-1e12, 0.0, 0.0]], 1),
        ([[0.0; 3], [0.0; 3]], 1),
        ([[1e-30, 0.0, 0.0], [-1e-30, 0.0, 0.0]], 1),
    ] {
        let mut builder = Builder::new();
        let positions = builder.accessor(&floats(positions.as_flattened()), 5126, "VEC3", 2);
        *builder.primitive() = json!({ "attributes": { "POSITION": positions }, "mode": 1 });
        let imported = builder.import();
        let triangles = imported.model.meshes[0].triangles.len();
        assert!(triangles <= tubes * TUBE, "{triangles}");
        assert!(imported.model.meshes[0].positions.iter().all(|point| point.is_finite()));
    }
}
