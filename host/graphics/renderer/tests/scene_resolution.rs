//! Scenes at reduced resolution beneath panels at full resolution, in all qualities.

mod common;

use busbar_renderer::{
    EguiFrame, Frame, MIN_SCENE_RESOLUTION, OutlineKind, OutlinedObject, Picture,
};
use common::*;
use glam::Mat4;

/// Greatest mean difference of a channel between a reduced picture and a full one.
const MAX_MEAN_DIFFERENCE: f64 = 6.0;

fn mean_difference(one: &Picture, other: &Picture) -> f64 {
    let differences = one.rgba8.iter().zip(&other.rgba8).map(|(a, b)| f64::from(a.abs_diff(*b)));
    differences.sum::<f64>() / one.rgba8.len() as f64
}

#[test]
fn a_reduced_scene_shows_the_same_and_leaves_nothing_behind() {
    for samples in [1, 4] {
        with_each_quality(samples, |renderer| {
            let red = quad(renderer, glowing([0.5, 0.0, 0.0]));
            let drawn = [instance(red, Mat4::from_rotation_z(0.3), 1)];
            let full = frame(&drawn);
            let before = picture(renderer, &full);
            for scene_resolution in [0.9, 0.7, 0.5] {
                let reduced = Frame { scene_resolution, ..full };
                let shown = picture(renderer, &reduced);
                assert_eq!((shown.width, shown.height), (before.width, before.height));
                assert_near(center(&shown), center(&before), 3);
                assert_eq!(pixel(&shown, 0, 0), pixel(&before, 0, 0));
                let difference = mean_difference(&shown, &before);
                assert!(difference < MAX_MEAN_DIFFERENCE, "{difference} at {scene_resolution}");
                assert_ne!(shown, before, "edges are not as sharp");
                assert!(!renderer.shows(&full), "the full picture is to come");
                assert_eq!(picture(renderer, &full), before);
            }
        });
    }
}

#[test]
fn the_resolution_is_kept_within_its_bounds() {
    with_renderer(1, |renderer| {
        let red = quad(renderer, glowing([0.5, 0.0, 0.0]));
        let drawn = [instance(red, Mat4::from_rotation_z(0.3), 1)];
        let at = |scene_resolution| Frame { scene_resolution, ..frame(&drawn) };
        let full = picture(renderer, &at(1.0));
        let least = picture(renderer, &at(MIN_SCENE_RESOLUTION));
        for above in [1.5, f32::INFINITY] {
            assert_eq!(picture(renderer, &at(above)), full);
        }
        for below in [0.1, 0.0, -1.0, f32::NEG_INFINITY, f32::NAN] {
            assert_eq!(picture(renderer, &at(below)), least, "{below}");
        }
    });
}

#[test]
fn panels_over_a_reduced_scene_are_as_sharp_as_ever() {
    with_renderer(4, |renderer| {
        let red = quad(renderer, glowing([0.5, 0.0, 0.0]));
        let drawn = [instance(red, Mat4::IDENTITY, 1)];
        let context = egui::Context::default();
        let input = egui::RawInput {
            screen_rect: Some(egui::Rect::from_min_size(egui::Pos2::ZERO, egui::vec2(96.0, 64.0))),
            ..Default::default()
        };
        let mut output = context.run_ui(input, |ui| {
            ui.label("Sharp 123");
        });
        let primitives = context.tessellate(output.shapes, 1.0);
        let textures_delta = &output.textures_delta;
        let overlay = EguiFrame { textures_delta, primitives: &primitives, pixels_per_point: 1.0 };
        let over = |background, scene_resolution| Frame {
            overlay: Some(overlay),
            background,
            scene_resolution,
            ..frame(&[])
        };
        let full = picture(renderer, &over([0.0; 3], 1.0));
        let reduced = picture(renderer, &over([0.0; 3], MIN_SCENE_RESOLUTION));
        assert_eq!(full, reduced, "over a plain background");
        // A panel that changes over a reduced scene which rests leaves the scene as it is.
        let scene = Frame { scene_resolution: MIN_SCENE_RESOLUTION, ..frame(&drawn) };
        let bare = picture(renderer, &scene);
        renderer.draw(&scene).expect("a frame is drawn");
        renderer.draw(&Frame { overlay: Some(overlay), ..scene }).expect("a frame is drawn");
        assert_eq!(picture(renderer, &scene), bare);
        output.textures_delta.clear();
    });
}

#[test]
fn outlines_and_picks_hold_at_reduced_resolution() {
    with_each_quality(4, |renderer| {
        let red = quad(renderer, glowing([0.5, 0.0, 0.0]));
        let drawn = [instance(red, Mat4::IDENTITY, 7)];
        let outlined = [OutlinedObject { object: 7, kind: OutlineKind::Selected }];
        let plain = Frame { scene_resolution: MIN_SCENE_RESOLUTION, ..frame(&drawn) };
        let without = picture(renderer, &plain);
        let with = picture(renderer, &Frame { outlined: &outlined, ..plain });
        let changed = with.rgba8.chunks(4).zip(without.rgba8.chunks(4)).filter(|(a, b)| a != b);
        assert!(changed.count() > 40, "the outline is drawn");
        let middle = [SIZE[0] / 2, SIZE[1] / 2];
        assert_eq!(renderer.pick(&plain, middle).unwrap(), Some(7));
        assert_eq!(renderer.pick(&plain, [0, 0]).unwrap(), None);
    });
}
