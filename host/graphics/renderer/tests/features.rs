//! Features: pieces of one mesh with ids and tints of their own.

#![allow(clippy::unwrap_used)]

mod common;

use busbar_geometry::{Mesh, NO_FEATURE, RawPrimitive, weld};
use busbar_renderer::{
    DrawInstance, Frame, ModelHandle, OutlineKind, OutlinedObject, RenderError, Renderer,
};
use busbar_scene::Material;
use common::*;
use glam::{Mat4, Vec3};

/// Quads side by side, one a feature, facing +z.
fn row(features: &[u32]) -> Mesh {
    let corners = [[0.0, -1.0], [1.0, -1.0], [1.0, 1.0], [0.0, 1.0]];
    let left = features.len() as f32 / -2.0;
    let quads = || (0..features.len() as u32).map(|i| 4 * i);
    let primitive = RawPrimitive {
        positions: quads()
            .flat_map(|i| corners.map(|[x, y]| Vec3::new(left + i as f32 / 4.0 + x, y, 0.0)))
            .collect(),
        normals: vec![Vec3::Z; 4 * features.len()],
        features: features.iter().flat_map(|&feature| [feature; 4]).collect(),
        triangles: quads().flat_map(|i| [[i, i + 1, i + 2], [i, i + 2, i + 3]]).collect(),
        material: Some(0),
        ..RawPrimitive::default()
    };
    weld(&[primitive]).unwrap().0
}

fn upload_row(renderer: &mut Renderer, features: &[u32], material: Material) -> ModelHandle {
    upload(renderer, row(features), &[material], &[])
}

fn with_features(model: ModelHandle, first_feature: u32) -> DrawInstance {
    DrawInstance { first_feature: Some(first_feature), ..instance(model, Mat4::IDENTITY, 1) }
}

/// Pixels in the middle of four quads side by side.
const MIDDLES: [[u32; 2]; 4] = [[25, 32], [40, 32], [55, 32], [70, 32]];

#[test]
fn each_feature_is_picked_as_its_own_object() {
    with_renderer(4, |renderer| {
        let model = upload_row(renderer, &[2, 0, NO_FEATURE, 1], Material::default());
        let drawn = [with_features(model, 7)];
        let highlights = [[0.0; 4]; 9];
        let shown = Frame { object_highlights: &highlights, ..frame(&drawn) };
        let mut pick = |pixel| renderer.pick(&shown, pixel).unwrap();
        assert_eq!(MIDDLES.map(&mut pick), [Some(9), Some(7), Some(1), Some(8)]);
        let whole = [instance(model, Mat4::IDENTITY, 5)];
        let mut pick = |pixel| renderer.pick(&frame(&whole), pixel).unwrap();
        assert_eq!(MIDDLES.map(&mut pick), [Some(5); 4], "as one piece");
    });
}

#[test]
fn all_pixels_at_once_are_what_single_picks_say() {
    with_renderer(1, |renderer| {
        let model = upload_row(renderer, &[0, 1, 2, 0], Material::default());
        let drawn = [with_features(model, 1)];
        let shown = Frame { object_highlights: &[[0.0; 4]; 3], ..frame(&drawn) };
        let all = renderer.pick_all(&shown).unwrap();
        let [width, height] = renderer.picked_size();
        assert_eq!(all.len(), (width * height) as usize);
        for (index, object) in all.iter().enumerate().step_by(7) {
            let pixel = [index as u32 % width, index as u32 / width];
            assert_eq!(renderer.pick(&shown, pixel).unwrap(), *object, "{pixel:?}");
        }
        let objects: std::collections::BTreeSet<_> = all.into_iter().collect();
        assert_eq!(objects, [None, Some(1), Some(2), Some(3)].into());
    });
}

#[test]
fn a_highlight_tints_its_feature_alone() {
    let tint = [0.0, 0.5, 0.0, 1.0];
    for (samples, wireframe, blend) in
        [(4, false, false), (1, false, false), (4, true, false), (4, false, true)]
    {
        with_renderer(samples, |renderer| {
            let red = [0.5, 0.0, 0.0];
            let material = if blend { blended(red, 1.0) } else { glowing(red) };
            let model = upload_row(renderer, &[0, 1, NO_FEATURE, 2], material);
            // Two instances, so that highlights of both lie in one buffer.
            let behind = Mat4::from_translation(Vec3::NEG_Z);
            let drawn = [
                with_features(model, 4),
                DrawInstance { world_from_mesh: behind, ..with_features(model, 1) },
            ];
            let mut highlights = [[0.0; 4]; 6];
            let mut shown = |highlights: &[[f32; 4]]| {
                let frame = Frame { object_highlights: highlights, wireframe, ..frame(&drawn) };
                let picture = picture(renderer, &frame);
                MIDDLES.map(|[x, y]| pixel(&picture, x, y))
            };
            let plain = shown(&highlights);
            highlights[4] = tint;
            let tinted = shown(&highlights);
            assert_eq!([plain[0], plain[2], plain[3]], [tinted[0], tinted[2], tinted[3]]);
            assert_ne!(plain[1], tinted[1], "wireframe {wireframe}, blend {blend}");
        });
    }
}

#[test]
fn features_without_highlights_are_refused() {
    with_renderer(1, |renderer| {
        let model = upload_row(renderer, &[0, 1], Material::default());
        let drawn = [with_features(model, 4)];
        let error = renderer.draw(&Frame { object_highlights: &[[0.0; 4]; 4], ..frame(&drawn) });
        let refused = matches!(error, Err(RenderError::NoHighlight { object: 5, count: 4 }));
        assert!(refused, "{error:?}");
        // Objects count from 1.
        let whole = [with_features(model, 0)];
        renderer.draw(&Frame { object_highlights: &[[0.0; 4]; 4], ..frame(&whole) }).unwrap();
        // A mesh of one piece has none to name.
        let plain = quad(renderer, Material::default());
        renderer.draw(&frame(&[with_features(plain, 9)])).unwrap();
    });
}

#[test]
fn an_outline_goes_around_its_feature_alone() {
    with_each_quality(4, |renderer| {
        let model = upload_row(renderer, &[0, 1, 2, 0], Material::default());
        let drawn = [with_features(model, 1)];
        let plain = Frame { object_highlights: &[[0.0; 4]; 3], ..frame(&drawn) };
        let before = picture(renderer, &plain);
        let outlined = [OutlinedObject { object: 2, kind: OutlineKind::Selected }];
        let after = picture(renderer, &Frame { outlined: &outlined, ..plain });
        let ids = renderer.pick_all(&plain).unwrap();
        let changed = |object: u32| {
            let pixels = before.rgba8.chunks_exact(4).zip(after.rgba8.chunks_exact(4));
            let of_object = pixels.zip(&ids).filter(|(_, id)| **id == Some(object));
            of_object.filter(|((before, after), _)| before != after).count()
        };
        // Its own pixels stay but for smooth edges; those beside it show the line.
        assert!(changed(1) > 20 && changed(3) > 20, "{} {}", changed(1), changed(3));
        assert!(changed(2) < 8, "{}", changed(2));
    });
}
