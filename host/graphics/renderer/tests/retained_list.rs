//! Retained draw lists give the same pictures as lists made for each frame.

mod common;

use busbar_renderer::{
    DrawInstance, DrawList, Frame, InstanceSource, ModelHandle, Morph, Quality, RenderError,
    Renderer, highlight_with_pattern,
};
use busbar_scene::Material;
use common::*;
use glam::{Mat4, Quat, Vec3};

const STEPS: u32 = 150;
const PLACES: u32 = 40;

/// Some of it is beside the picture or mirrored, or coplanar with others.
fn any_instance(random: &mut Random, models: &[ModelHandle]) -> DrawInstance {
    let mut share = || random.below(1000) as f32 / 1000.0;
    let spread = Vec3::new(share() * 12.0 - 6.0, share() * 8.0 - 4.0, (share() * 3.0).floor());
    let turn = Quat::from_rotation_z(share());
    let x = if share() < 0.3 { -0.6 } else { 0.6 };
    let scale = Vec3::new(x, 0.6, 0.6);
    let cursor = random.below(60);
    let weight = random.below(4) as f32 / 4.0;
    let coarser = cursor + random.below(20);
    DrawInstance {
        cursor,
        morph: (random.below(4) == 0).then_some(Morph { coarser, weight }),
        highlight: any_highlight(random),
        ..instance(
            models[random.below(models.len() as u32) as usize],
            Mat4::from_scale_rotation_translation(scale, turn, spread),
            random.below(500) + 1,
        )
    }
}

fn any_highlight(random: &mut Random) -> [f32; 4] {
    match random.below(4) {
        0 => highlight_with_pattern([1.0, 0.0, 0.0], 0.5, random.below(4)),
        _ => [0.0; 4],
    }
}

fn change(random: &mut Random, list: &mut DrawList, models: &[ModelHandle]) {
    let place = random.below(PLACES) as usize;
    match random.below(6) {
        0 => list.set(place, None),
        1 => list.set_highlight(place, any_highlight(random)),
        2 => {
            let bent = list.get(place).map(|drawn| DrawInstance { cursor: 7, ..*drawn });
            list.set(place, bent);
        }
        _ => list.set(place, Some(any_instance(random, models))),
    }
}

fn assert_alike(renderer: &mut Renderer, list: &DrawList, step: u32) {
    let kept = Frame { instances: InstanceSource::Retained(list), ..frame(&[]) };
    let shown = picture(renderer, &kept);
    let ids = renderer.pick_all(&kept).expect("ids are drawn");
    let listed: Vec<_> = list.iter().copied().collect();
    assert_eq!(shown, picture(renderer, &frame(&listed)), "step {step}");
    // Listed frames leave nothing behind in what follows.
    assert_eq!(ids, renderer.pick_all(&frame(&listed)).expect("ids are drawn"), "step {step}");
}

#[test]
fn a_kept_list_looks_like_one_made_anew() {
    for quality in [Quality::Medium, Quality::High] {
        with_quality(quality, 1, |renderer| {
            let see_through =
                upload(renderer, grid(4, Some(0)), &[blended([0.0, 1.0, 0.0], 0.5)], &[]);
            let matt = Material { metallic: 0.0, ..Material::default() };
            let models = [upload(renderer, grid(8, Some(0)), &[matt], &[]), see_through];
            let (mut random, mut list) = (Random(quality as u64 + 5), DrawList::default());
            let mut earlier = list.clone();
            for step in 0..STEPS {
                for _ in 0..random.below(8) {
                    change(&mut random, &mut list, &models);
                }
                match random.below(12) {
                    0..3 => assert_alike(renderer, &list, step),
                    3 => earlier = list.clone(),
                    4 => assert_alike(renderer, &earlier, step),
                    5 => change(&mut random, &mut earlier, &models),
                    _ => {
                        let kept =
                            Frame { instances: InstanceSource::Retained(&list), ..frame(&[]) };
                        renderer.draw(&kept).unwrap();
                    }
                }
            }
            assert_alike(renderer, &list, STEPS);
        });
    }
}

/// More kinds than are retained while none of them is drawn.
#[test]
fn what_was_of_many_kinds_in_turn_looks_like_what_it_is() {
    with_renderer(1, |renderer| {
        let model = upload(renderer, grid(20, None), &[], &[]);
        let mut list = DrawList::default();
        let at = |place: u32, cursor: u32| {
            let x = Mat4::from_translation(Vec3::X * place as f32);
            Some(DrawInstance { cursor, ..instance(model, x, place + 1) })
        };
        for place in 0..3 {
            list.set(place as usize, at(place, 5 * place));
        }
        for cursor in 20..360 {
            list.set(1, at(1, cursor));
            let kept = Frame { instances: InstanceSource::Retained(&list), ..frame(&[]) };
            renderer.draw(&kept).unwrap();
        }
        list.set(0, None);
        assert_alike(renderer, &list, 0);
    });
}

#[test]
fn a_list_that_names_what_is_gone_is_refused_until_it_does_not() {
    with_renderer(1, |renderer| {
        let models = [0, 1].map(|_| upload(renderer, grid(4, None), &[], &[]));
        let mut list = DrawList::default();
        for (place, model) in models.into_iter().enumerate() {
            let x = Mat4::from_translation(Vec3::X * place as f32);
            list.set(place, Some(instance(model, x, place as u32 + 1)));
        }
        assert_alike(renderer, &list, 0);
        renderer.remove_model(models[1]);
        for _ in 0..2 {
            let kept = Frame { instances: InstanceSource::Retained(&list), ..frame(&[]) };
            assert!(matches!(renderer.draw(&kept), Err(RenderError::UnknownModel(_))));
        }
        list.set(1, None);
        assert_alike(renderer, &list, 1);
    });
}
