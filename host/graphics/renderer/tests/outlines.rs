//! Outlines of hovered and selected objects.

mod common;

use busbar_renderer::{Frame, OutlineKind, OutlinedObject, Picture};
use busbar_scene::Material;
use common::*;
use glam::{Mat4, Vec3};

const SELECTED: [OutlinedObject; 1] = [OutlinedObject { object: 1, kind: OutlineKind::Selected }];

fn outlined(kind: OutlineKind) -> [OutlinedObject; 1] {
    [OutlinedObject { object: 1, kind }]
}

/// Pixels that two pictures differ in.
fn changed(a: &Picture, b: &Picture) -> usize {
    a.rgba8.chunks_exact(4).zip(b.rgba8.chunks_exact(4)).filter(|(a, b)| a != b).count()
}

/// From the middle to the right, until the background comes.
fn row(picture: &Picture) -> Vec<[u8; 4]> {
    let [x, y] = [picture.width / 2, picture.height / 2];
    (x..picture.width).map(|x| pixel(picture, x, y)).collect()
}

#[test]
fn an_outline_is_light_then_dark_and_wide_enough_over_any_colour() {
    for color in [[0.0; 3], [1.0; 3], [0.5, 0.0, 0.0]] {
        with_each_quality(4, |renderer| {
            let model = quad(renderer, glowing(color));
            let drawn = [instance(model, Mat4::from_scale(Vec3::splat(0.5)), 1)];
            let plain = picture(renderer, &frame(&drawn));
            for kind in [OutlineKind::Hovered, OutlineKind::Selected] {
                let shown = Frame { outlined: &outlined(kind), ..frame(&drawn) };
                let shown = picture(renderer, &shown);
                let changes: Vec<_> = row(&shown)
                    .into_iter()
                    .zip(row(&plain))
                    .filter(|(shown, plain)| shown != plain)
                    .map(|(shown, _)| shown)
                    .collect();
                assert!((2..=6).contains(&changes.len()), "{kind:?}: {changes:?}");
                let green: Vec<u8> = changes.iter().map(|rgba| rgba[1]).collect();
                let lightest = green.iter().position(|&g| g > 200).unwrap();
                let darkest = green.iter().rposition(|&g| g < 90).unwrap();
                assert!(lightest < darkest, "{kind:?}: {changes:?}");
                assert_eq!(center(&shown), center(&plain), "what is inside stays");
            }
        });
    }
}

#[test]
fn no_outline_changes_nothing_and_leaves_nothing() {
    with_each_quality(4, |renderer| {
        let model = quad(renderer, Material::default());
        let drawn = [instance(model, Mat4::from_scale(Vec3::splat(0.5)), 1)];
        let before = picture(renderer, &frame(&drawn));
        picture(renderer, &Frame { outlined: &SELECTED, ..frame(&drawn) });
        assert_eq!(picture(renderer, &frame(&drawn)), before);
        let other = [OutlinedObject { object: 7, kind: OutlineKind::Selected }];
        assert_eq!(picture(renderer, &Frame { outlined: &other, ..frame(&drawn) }), before);
    });
}

#[test]
fn what_is_thinner_than_a_pixel_has_an_outline_too() {
    with_each_quality(1, |renderer| {
        let model = quad(renderer, glowing([0.0; 3]));
        let wire = Mat4::from_scale(Vec3::new(1.0, 1e-4, 1.0));
        let drawn = [instance(model, wire, 1)];
        let plain = picture(renderer, &frame(&drawn));
        let shown = picture(renderer, &Frame { outlined: &SELECTED, ..frame(&drawn) });
        let column = |x: u32| {
            let differs = |y: &u32| pixel(&shown, x, *y) != pixel(&plain, x, *y);
            (0..SIZE[1]).filter(differs).count()
        };
        // All along, on both sides.
        for x in SIZE[0] / 2 - 8..SIZE[0] / 2 + 8 {
            assert!(column(x) >= 4, "{x}: {}", column(x));
        }
    });
}

#[test]
fn what_is_hidden_has_a_paler_dashed_outline() {
    with_renderer(4, |renderer| {
        let model = quad(renderer, Material::default());
        let small = instance(model, Mat4::from_scale(Vec3::splat(0.5)), 1);
        let wall = Mat4::from_translation(Vec3::Z) * Mat4::from_scale(Vec3::splat(1.5));
        let before = instance(model, wall, 2);
        let mut changes = |drawn: &[_], wireframe| {
            let plain = Frame { wireframe, ..frame(drawn) };
            let plain_picture = picture(renderer, &plain);
            changed(&plain_picture, &picture(renderer, &Frame { outlined: &SELECTED, ..plain }))
        };
        for wireframe in [false, true] {
            let open = changes(&[small], wireframe);
            let hidden = changes(&[small, before], wireframe);
            assert!(hidden * 4 > open && hidden * 4 < open * 3, "{hidden} of {open}");
        }
    });
}

#[test]
fn all_frames_in_flight_and_other_sizes_have_their_own() {
    with_renderer(4, |renderer| {
        let model = quad(renderer, Material::default());
        let drawn = [instance(model, Mat4::from_scale(Vec3::splat(0.5)), 1)];
        let shown = Frame { outlined: &SELECTED, ..frame(&drawn) };
        let first = picture(renderer, &shown);
        for _ in 0..4 {
            renderer.draw(&shown).unwrap();
        }
        assert_eq!(picture(renderer, &shown), first);
        renderer.resize([33, 21]);
        renderer.draw(&shown).unwrap();
        renderer.resize(SIZE);
        assert_eq!(picture(renderer, &shown), first);
    });
}

/// Only a part of the picture is looked at: as if all of it were.
#[test]
fn an_outline_is_whole_wherever_it_is_and_whatever_was_outlined_before() {
    const LARGE: [u32; 2] = [3 * SIZE[0], 3 * SIZE[1]];
    for samples in [1, 4] {
        with_renderer(samples, |renderer| {
            renderer.resize(LARGE);
            let model = quad(renderer, glowing([0.5, 0.1, 0.0]));
            // Before the near plane: it shows nothing, but may be anywhere.
            let eye = Vec3::Z * 3.95;
            let everywhere = instance(model, Mat4::from_translation(eye), 3);
            let mut random = Random(11);
            for round in 0..60 {
                let mut share = |of: f32| of * (random.below(1001) as f32 / 500.0 - 1.0);
                let thin = if share(1.0) < 0.0 { 1e-3 } else { 0.3 };
                let mut anywhere = |object| {
                    let place = Vec3::new(share(3.5), share(2.5), share(2.5));
                    let turn =
                        Mat4::from_rotation_z(share(3.0)) * Mat4::from_rotation_x(share(1.0));
                    let scale = Vec3::new(0.5, thin, 0.5);
                    instance(
                        model,
                        Mat4::from_translation(place) * turn * Mat4::from_scale(scale),
                        object,
                    )
                };
                let drawn = [anywhere(1), anywhere(2), everywhere];
                let kinds = [OutlineKind::Selected, OutlineKind::Hovered];
                let [one, other] = kinds.map(|kind| OutlinedObject { object: kind as u32, kind });
                let last = OutlinedObject { object: 3, kind: OutlineKind::Selected };
                for some in [&[one][..], &[other], &[one, other]] {
                    let shown = picture(renderer, &Frame { outlined: some, ..frame(&drawn) });
                    let outlined = [some, &[last]].concat();
                    let all = picture(renderer, &Frame { outlined: &outlined, ..frame(&drawn) });
                    assert_eq!(changed(&shown, &all), 0, "{samples} samples, round {round}");
                }
            }
        });
    }
}
