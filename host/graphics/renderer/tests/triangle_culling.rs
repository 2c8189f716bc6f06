//! CPU triangle culling and draw batching on a software rasterizer.

#![allow(clippy::unwrap_used, reason = "helpers of tests")]

mod common;

use busbar_geometry::{Mesh, RawPrimitive, weld};
use busbar_renderer::{
    CameraView, DrawInstance, Frame, FrameStats, ModelHandle, ModelUpload, Picture, Renderer,
    SectionPlane, highlight_with_pattern,
};
use busbar_scene::Material;
use common::*;
use glam::{Mat4, Quat, Vec3};

const PARTS: u32 = 5;

/// Pixels that may differ: where a face's edge goes through the middle of a pixel, its back may be
/// drawn there.
const EDGE_PIXELS: usize = 2;

/// A closed box; `feature`: whose it is.
fn solid(center: Vec3, half: Vec3, feature: u32) -> Mesh {
    let corner = |i: u32| {
        let side = |bit: u32| if i >> bit & 1 == 1 { 1.0 } else { -1.0 };
        center + half * Vec3::new(side(0), side(1), side(2))
    };
    let sides =
        [[1, 3, 7, 5], [0, 4, 6, 2], [2, 6, 7, 3], [0, 1, 5, 4], [4, 5, 7, 6], [0, 2, 3, 1]];
    let face = |[a, b, c, d]: [u32; 4]| {
        let positions = [a, b, c, d].map(corner);
        let normal = (positions[1] - positions[0]).cross(positions[2] - positions[0]).normalize();
        RawPrimitive {
            positions: positions.to_vec(),
            normals: vec![normal; 4],
            triangles: vec![[0, 1, 2], [0, 2, 3]],
            features: vec![feature; 4],
            material: Some(0),
            ..RawPrimitive::default()
        }
    };
    weld(&sides.map(face)).unwrap().0
}

/// A row of boxes as one model.
fn row(renderer: &mut Renderer) -> ModelHandle {
    let part = |number: u32| {
        let center = Vec3::new(number as f32 - 2.0, 0.2 * number as f32 - 0.4, 0.0);
        stacks(solid(center, Vec3::new(0.3, 0.6, 0.4), number))
    };
    let parts: Vec<_> = (0..PARTS).map(part).collect();
    let material = Material { metallic: 0.0, ..Material::default() };
    let upload = ModelUpload { stacks: &parts, materials: &[material], textures: &[] };
    renderer.upload_model(upload).unwrap()
}

/// All its parts, where it stands.
fn parts(model: ModelHandle, world_from_mesh: Mat4) -> Vec<DrawInstance> {
    let part = |mesh: u32| DrawInstance { mesh, ..instance(model, world_from_mesh, 1) };
    (0..PARTS).map(part).collect()
}

fn differ(one: &[u8], other: &[u8], tolerance: u8) -> bool {
    one.iter().zip(other).any(|(a, b)| a.abs_diff(*b) > tolerance)
}

fn drawn(renderer: &mut Renderer, frame: &Frame<'_>) -> (FrameStats, Picture) {
    let stats = renderer.draw(frame).unwrap();
    (stats, renderer.read_picture().unwrap())
}

/// Places that mirror, turn and stretch it.
fn places() -> [Mat4; 4] {
    let turned = Mat4::from_quat(Quat::from_euler(glam::EulerRot::XYZ, 0.5, 0.7, 0.2));
    [
        Mat4::IDENTITY,
        turned,
        Mat4::from_scale(Vec3::new(-1.0, 1.0, 1.0)) * turned,
        turned * Mat4::from_scale(Vec3::new(0.3, 1.5, 2.0)),
    ]
}

#[test]
fn parts_in_one_place_are_one_draw_and_look_as_they_do_one_by_one() {
    if draws_on_card() {
        return;
    }
    for samples in [1, 4] {
        with_each_quality(samples, |renderer| {
            let model = row(renderer);
            for place in places() {
                let together = parts(model, place);
                // Other objects, so that none is drawn with the next.
                let alone: Vec<_> = (1..)
                    .zip(&together)
                    .map(|(object, part)| DrawInstance { object, ..*part })
                    .collect();
                let (one, expected) = drawn(renderer, &frame(&alone));
                let (all, shown) = drawn(renderer, &frame(&together));
                assert!(all.draw_calls + PARTS == one.draw_calls + 1, "{all:?} {one:?}");
                assert_eq!(all.triangles, one.triangles);
                assert!(shown == expected, "{place}");
                let (first, second) = (pixel(&shown, 0, 0), center(&shown));
                assert_ne!(first, second, "nothing is seen");
            }
        });
    }
}

/// Back-facing triangles are hidden by front-facing ones. A section plane that cuts nothing has
/// them drawn.
#[test]
fn what_faces_away_is_not_missed() {
    with_each_quality(1, |renderer| {
        let model = row(renderer);
        let cuts_nothing = Some(SectionPlane { normal: Vec3::Z, distance: 100.0 });
        for place in places() {
            let instances = parts(model, place);
            let orthographic =
                CameraView::orthographic(Vec3::Z * 4.0, Vec3::ZERO, Vec3::Y, 4.0, 1.0, 50.0);
            for camera in [camera(), orthographic] {
                let seen = Frame { camera, ..frame(&instances) };
                let expected = picture(renderer, &Frame { section: cuts_nothing, ..seen });
                let shown = picture(renderer, &seen);
                let pixels = |picture: &Picture| picture.rgba8.as_chunks::<4>().0.to_vec();
                let pairs = pixels(&shown).into_iter().zip(pixels(&expected));
                let differing = pairs.filter(|(one, other)| differ(one, other, 2)).count();
                assert!(differing <= EDGE_PIXELS, "{differing} at {place}");
            }
        }
    });
}

#[test]
fn features_of_parts_are_tinted_and_picked_as_ever() {
    with_each_quality(1, |renderer| {
        let model = row(renderer);
        let mut instances = parts(model, Mat4::IDENTITY);
        instances.iter_mut().for_each(|part| part.first_feature = Some(11));
        let ids = renderer.pick_all(&frame(&instances)).unwrap();
        let picked: std::collections::BTreeSet<u32> = ids.iter().flatten().copied().collect();
        assert_eq!(picked.into_iter().collect::<Vec<_>>(), [11, 12, 13, 14, 15]);
        let plain = picture(renderer, &frame(&instances));
        let mut tints = vec![[0.0; 4]; 15];
        tints[12] = highlight_with_pattern([1.0, 0.0, 0.0], 1.0, 0);
        let tinted = picture(renderer, &Frame { object_highlights: &tints, ..frame(&instances) });
        for (at, id) in ids.iter().enumerate() {
            let [before, after] = [&plain, &tinted].map(|p| &p.rgba8[4 * at..4 * at + 4]);
            // What is tinted has another pipeline, which rounds otherwise.
            assert_eq!(differ(before, after, 8), *id == Some(13), "{id:?}: {before:?} {after:?}");
        }
    });
}
