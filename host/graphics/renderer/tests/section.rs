//! Section planes that cut equipment open.

mod common;

use busbar_renderer::{Frame, SectionPlane};
use busbar_scene::Material;
use common::*;
use glam::{Mat4, Quat, Vec3};

fn before(normal: Vec3, distance: f32) -> Option<SectionPlane> {
    Some(SectionPlane { normal, distance })
}

#[test]
fn what_lies_before_the_plane_is_neither_seen_nor_picked() {
    for samples in [1, 4] {
        with_each_quality(samples, |renderer| {
            let red = quad(renderer, glowing([0.5, 0.0, 0.0]));
            let green = quad(renderer, glowing([0.0, 0.5, 0.0]));
            let behind = Mat4::from_translation(Vec3::NEG_Z);
            let drawn = [instance(red, Mat4::IDENTITY, 1), instance(green, behind, 2)];
            let middle = SIZE.map(|side| side / 2);
            for (section, seen) in
                [(None, 1), (before(Vec3::Z, 0.5), 1), (before(Vec3::Z, -0.5), 2)]
            {
                for wireframe in [false, true] {
                    let cut = Frame { section, wireframe, ..frame(&drawn) };
                    assert_eq!(renderer.pick(&cut, middle).unwrap(), Some(seen));
                    let all = renderer.pick_all(&cut).unwrap();
                    let width = renderer.picked_size()[0];
                    let index = (middle[1] * width + middle[0]) as usize;
                    assert_eq!(all[index], Some(seen), "{section:?}");
                }
                let shown = center(&picture(renderer, &Frame { section, ..frame(&drawn) }));
                assert!(shown[usize::from(seen == 2)] > 150, "{section:?}: {shown:?}");
            }
            let nothing = Frame { section: before(Vec3::Z, -2.0), ..frame(&drawn) };
            assert_eq!(center(&picture(renderer, &nothing)), [0, 0, 255, 255]);
            let wires = Frame { wireframe: true, ..nothing };
            assert_eq!(center(&picture(renderer, &wires)), [0, 0, 255, 255]);
            assert_eq!(renderer.pick(&nothing, middle).unwrap(), None);
        });
    }
}

#[test]
fn the_cut_runs_where_the_plane_says() {
    with_each_quality(1, |renderer| {
        let red = quad(renderer, glowing([0.5, 0.0, 0.0]));
        let drawn = [instance(red, Mat4::IDENTITY, 1)];
        let cut = Frame { section: before(Vec3::X, 0.25), ..frame(&drawn) };
        let shown = picture(renderer, &cut);
        let ids = renderer.pick_all(&cut).unwrap();
        let at = camera().clip_from_world().project_point3(Vec3::X * 0.25).x;
        let edge = (at + 1.0) * 0.5 * SIZE[0] as f32;
        let y = SIZE[1] / 2;
        for x in SIZE[0] / 2..SIZE[0] {
            let is_there = (x as f32 + 0.5) < edge;
            assert_eq!(pixel(&shown, x, y)[0] > 100, is_there, "{x} of {edge}");
            assert_eq!(ids[(y * SIZE[0] + x) as usize].is_some(), is_there, "{x} of {edge}");
            assert_eq!(renderer.pick(&cut, [x, y]).unwrap().is_some(), is_there, "{x}");
        }
    });
}

#[test]
fn insides_are_hatched_where_there_is_a_plane() {
    with_each_quality(4, |renderer| {
        let turned = Mat4::from_quat(Quat::from_rotation_y(std::f32::consts::PI));
        let single = quad(renderer, glowing([0.5, 0.0, 0.0]));
        let double = quad(renderer, Material { double_sided: true, ..glowing([0.5, 0.0, 0.0]) });
        let far = before(Vec3::Z, 3.0);
        let mut shown = |model, section| {
            picture(renderer, &Frame { section, ..frame(&[instance(model, turned, 1)]) })
        };
        let without = shown(single, None);
        assert_eq!(center(&without), [0, 0, 255, 255], "culled");
        let hatched = shown(single, far);
        let row: Vec<_> = (34..62).map(|x| pixel(&hatched, x, SIZE[1] / 2)).collect();
        assert!(
            row.iter().all(|[r, g, b, _]| *r < 100 && r.abs_diff(*g) < 12 && b.abs_diff(*g) < 12),
            "{row:?}"
        );
        let greens = row.iter().map(|rgba| rgba[1]);
        let [least, most] = [greens.clone().min(), greens.max()].map(|green| green.unwrap());
        assert!(most > least + 25, "lines: {least} to {most}");
        let lit = center(&shown(double, far));
        assert!(lit[0] > 150, "both sides are shown: {lit:?}");
    });
}
