//! Occlusion culling on a software rasterizer: hidden geometry is left out and pictures stay the
//! same.

#![allow(clippy::unwrap_used, reason = "helpers of tests")]

mod common;

use busbar_geometry::{Mesh, RawPrimitive, weld};
use busbar_renderer::{
    CameraView, DrawInstance, Frame, FrameStats, ModelHandle, ModelUpload, OutlineKind,
    OutlinedObject, Picture, Quality, Renderer, SectionPlane,
};
use busbar_scene::{AlphaMode, Material};
use common::*;
use glam::{Mat4, Quat, Vec3};

/// A closed box of two units a side.
fn cube() -> Mesh {
    let corner = |i: u32| {
        let side = |bit: u32| if i >> bit & 1 == 1 { 1.0 } else { -1.0 };
        Vec3::new(side(0), side(1), side(2))
    };
    let sides =
        [[1, 3, 7, 5], [0, 4, 6, 2], [2, 6, 7, 3], [0, 1, 5, 4], [4, 5, 7, 6], [0, 2, 3, 1]];
    let corners = sides.as_flattened().iter().map(|&number| corner(number));
    let normal = |side: &[u32; 4]| {
        let [a, b, c, _] = side.map(corner);
        (b - a).cross(c - a).normalize()
    };
    let square = |first: u32| [[first, first + 1, first + 2], [first, first + 2, first + 3]];
    let primitive = RawPrimitive {
        positions: corners.collect(),
        normals: sides.iter().flat_map(|side| [normal(side); 4]).collect(),
        triangles: (0..6).flat_map(|side| square(4 * side)).collect(),
        material: Some(0),
        ..RawPrimitive::default()
    };
    weld(&[primitive]).unwrap().0
}

fn cubes(renderer: &mut Renderer, material: Material) -> ModelHandle {
    upload(renderer, cube(), &[material], &[])
}

fn placed(center: [f32; 3], half: [f32; 3]) -> Mat4 {
    Mat4::from_translation(center.into()) * Mat4::from_scale(half.into())
}

fn drawn(renderer: &mut Renderer, frame: &Frame<'_>) -> (FrameStats, Picture) {
    let stats = renderer.draw(frame).unwrap();
    (stats, renderer.read_picture().unwrap())
}

/// First frame, which has no occluders since nothing is resolved before it, and the second.
fn first_and_second(renderer: &mut Renderer, frame: &Frame<'_>) -> [(FrameStats, Picture); 2] {
    [drawn(renderer, frame), drawn(renderer, frame)]
}

/// A wall, and a small box somewhere.
fn wall_and_box(wall: ModelHandle, small: ModelHandle, at: [f32; 3]) -> [DrawInstance; 2] {
    [
        instance(wall, placed([0.0, -2.0, 0.0], [9.0, 2.2, 0.1]), 1),
        instance(small, placed(at, [0.2; 3]), 2),
    ]
}

#[test]
fn what_a_wall_hides_is_not_drawn_and_what_is_above_it_is() {
    if draws_on_card() {
        return;
    }
    for samples in [1, 4] {
        with_each_quality(samples, |renderer| {
            let wall = cubes(renderer, glowing([0.0, 1.0, 0.0]));
            let small = cubes(renderer, glowing([1.0, 0.0, 0.0]));
            let hidden = wall_and_box(wall, small, [0.5, -1.0, -2.0]);
            let [(all, expected), (seen, shown)] = first_and_second(renderer, &frame(&hidden));
            assert_eq!((all.draw_calls, seen.draw_calls), (2, 1));
            assert_eq!(all.triangles, seen.triangles, "they count as there");
            assert!(expected == shown);
            for at in [[0.5, 0.3, -2.0], [0.5, -1.0, 1.0]] {
                let (seen, shown) = drawn(renderer, &frame(&wall_and_box(wall, small, at)));
                assert_eq!(seen.draw_calls, 2);
                let is_red = |rgba: &[u8; 4]| rgba[0] > 99 && rgba[1] < 99;
                assert!(shown.rgba8.as_chunks::<4>().0.iter().any(is_red), "{at:?}");
            }
        });
    }
}

#[test]
fn what_can_be_seen_through_hides_nothing() {
    if draws_on_card() {
        return;
    }
    with_each_quality(1, |renderer| {
        let opaque = glowing([0.0, 1.0, 0.0]);
        let small = cubes(renderer, glowing([1.0, 0.0, 0.0]));
        for alpha in [AlphaMode::Blend, AlphaMode::Mask(0.5)] {
            let wall = cubes(renderer, Material { alpha, ..opaque.clone() });
            let both = wall_and_box(wall, small, [0.5, -1.0, -2.0]);
            let [(first, _), (second, _)] = first_and_second(renderer, &frame(&both));
            assert_eq!(first.draw_calls, second.draw_calls, "{alpha:?}");
        }
        // From within, the backs of its faces are not drawn, unless both sides are.
        for double_sided in [false, true] {
            let wall = cubes(renderer, Material { double_sided, ..opaque.clone() });
            let both = [
                instance(wall, placed([0.0; 3], [9.0, 9.0, 9.0]), 1),
                instance(small, placed([0.5, -1.0, -20.0], [0.2; 3]), 2),
            ];
            let [(first, expected), (second, shown)] = first_and_second(renderer, &frame(&both));
            let hidden = u32::from(double_sided);
            assert_eq!(first.draw_calls, second.draw_calls + hidden, "{double_sided}");
            assert!(expected == shown);
        }
    });
}

#[test]
fn what_is_hidden_has_its_outline() {
    with_each_quality(1, |renderer| {
        let wall = cubes(renderer, glowing([0.0, 1.0, 0.0]));
        let small = cubes(renderer, glowing([1.0, 0.0, 0.0]));
        let both = wall_and_box(wall, small, [0.5, -1.0, -2.0]);
        let outlined = [OutlinedObject { object: 2, kind: OutlineKind::Selected }];
        let selected = Frame { outlined: &outlined, ..frame(&both) };
        let [(_, expected), (_, shown)] = first_and_second(renderer, &selected);
        assert!(expected == shown);
        assert!(shown != drawn(renderer, &frame(&both)).1, "there is an outline");
    });
}

/// Occluders change with the camera. In a section, a wireframe or without perspective everything is
/// drawn.
#[test]
fn only_what_is_behind_for_this_camera_is_hidden() {
    if draws_on_card() {
        return;
    }
    with_each_quality(1, |renderer| {
        let wall = cubes(renderer, glowing([0.0, 1.0, 0.0]));
        let small = cubes(renderer, glowing([1.0, 0.0, 0.0]));
        let both = wall_and_box(wall, small, [0.5, -1.0, -2.0]);
        let from_before = frame(&both);
        let seen_of = |renderer: &mut Renderer, frame: &Frame<'_>| {
            let [_, (seen, _)] = first_and_second(renderer, frame);
            seen.visible_instances
        };
        assert_eq!(seen_of(renderer, &from_before), 1);
        let camera = CameraView::look_at(Vec3::Z * -9.0, Vec3::ZERO, Vec3::Y, 0.9, 1.5, 0.1);
        let (seen, _) = drawn(renderer, &Frame { camera, ..from_before });
        assert_eq!(seen.visible_instances, 2, "from the other side");
        let section = Some(SectionPlane { normal: Vec3::Z, distance: 100.0 });
        assert_eq!(seen_of(renderer, &Frame { section, ..from_before }), 2);
        assert_eq!(seen_of(renderer, &Frame { wireframe: true, ..from_before }), 2);
        let camera = CameraView::orthographic(Vec3::Z * 4.0, Vec3::ZERO, Vec3::Y, 4.0, 1.5, 50.0);
        assert_eq!(seen_of(renderer, &Frame { camera, ..from_before }), 2);
        assert_eq!(seen_of(renderer, &from_before), 1);
    });
}

/// So large that it is looked at block by block, an instance at a time.
#[test]
fn of_large_meshes_what_is_seen_is_drawn() {
    if draws_on_card() {
        return;
    }
    with_each_quality(1, |renderer| {
        let wall = cubes(renderer, glowing([0.0, 1.0, 0.0]));
        let large = upload(renderer, grid(64, Some(0)), &[glowing([1.0, 0.0, 0.0])], &[]);
        let mut instances = vec![instance(wall, placed([0.0, -2.0, 0.0], [9.0, 2.2, 0.1]), 1)];
        let places = [[-2.5, 0.0, -3.0], [0.0, -0.4, -2.0], [2.0, -2.2, -2.0], [1.0, 0.5, 1.0]];
        instances.extend(
            (2..)
                .zip(places)
                .map(|(object, at)| instance(large, placed(at, [0.8, 0.8, 1.0]), object)),
        );
        let [(first, expected), (second, shown)] = first_and_second(renderer, &frame(&instances));
        assert!(expected == shown);
        assert_eq!(first.visible_instances, second.visible_instances + 1, "one is hidden");
        assert!(second.draw_calls < first.draw_calls, "blocks of others are");
    });
}

/// Numbers from -1 to 1 that are the same each time.
struct Numbers(u64);

impl Numbers {
    fn next(&mut self) -> f32 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
        ((self.0 >> 40) as f32 / (1 << 23) as f32) - 1.0
    }

    fn vector(&mut self) -> Vec3 {
        Vec3::new(self.next(), self.next(), self.next())
    }
}

/// A yard of panes and posts in rows, of more triangles than are drawn without looking.
fn yard(renderer: &mut Renderer, numbers: &mut Numbers) -> Vec<DrawInstance> {
    let pane = upload(renderer, grid(16, Some(0)), &[glowing([0.0, 0.6, 0.0])], &[]);
    let plain = Material { double_sided: true, ..Material::default() };
    let post = upload(renderer, grid(12, Some(0)), &[plain], &[]);
    let glass = cubes(renderer, blended([0.7, 0.0, 0.0], 0.5));
    let mut place = |number: u32| {
        let turn = Quat::from_rotation_y(1.2 * numbers.next());
        let size = Vec3::new(0.2, 0.4, 1.0) * (1.5 + numbers.next());
        let at = Vec3::new(4.0 * numbers.next(), numbers.next(), -0.15 * number as f32);
        Mat4::from_scale_rotation_translation(size, turn, at)
    };
    let mut instances: Vec<DrawInstance> = (0..240)
        .map(|number| instance([pane, post][number as usize % 2], place(number), number + 1))
        .collect();
    instances.extend(
        (0..6).map(|row| instance(glass, placed([0.0, 0.3, -5.0 * row as f32], [0.3; 3]), 1)),
    );
    instances
}

/// Many small things that are near hide what is far, and no byte of the picture differs for it.
#[test]
fn what_is_behind_much_that_is_near_is_not_drawn() {
    if draws_on_card() {
        return;
    }
    for seed in [3, 5, 7] {
        with_each_quality(1, |renderer| {
            let instances = yard(renderer, &mut Numbers(seed));
            let [(first, expected), (second, shown)] =
                first_and_second(renderer, &frame(&instances));
            assert!(expected == shown);
            assert_eq!((first.depth_wait_millis, first.visible_instances), (0.0, 246));
            assert!(second.depth_wait_millis > 0.0, "it looked what is near");
            assert!(second.visible_instances < 200, "{} are seen", second.visible_instances);
            assert_eq!(first.triangles, second.triangles, "they count as there");
            // From a picture of another size, and with an outline of what is far.
            let outlined = [OutlinedObject { object: 239, kind: OutlineKind::Selected }];
            let selected = Frame { outlined: &outlined, ..frame(&instances) };
            renderer.resize([97, 61]);
            renderer.free_memory().unwrap();
            let [(_, expected), (third, shown)] = first_and_second(renderer, &selected);
            assert!(expected == shown && third.depth_wait_millis > 0.0);
            renderer.resize(SIZE);
        });
    }
}

/// Parts of one model in one place share their written instance, unless one of them moves among
/// others of its kind.
#[test]
fn parts_stay_in_their_places_when_what_is_near_comes_first() {
    if draws_on_card() {
        return;
    }
    with_each_quality(1, |renderer| {
        let stacks = [stacks(grid(60, Some(0))), stacks(cube())];
        let materials = [glowing([0.0, 0.6, 0.0])];
        let upload = ModelUpload { stacks: &stacks, materials: &materials, textures: &[] };
        let model = renderer.upload_model(upload).unwrap();
        // The near one comes last.
        let mut instances: Vec<DrawInstance> = (0..12)
            .map(|number| {
                let at = Vec3::new(number as f32 * 0.3 - 1.6, 0.0, number as f32 * 1.5 - 16.0);
                let size = Mat4::from_scale(Vec3::new(0.15, 0.5, 0.15));
                instance(model, Mat4::from_translation(at) * size, number + 1)
            })
            .collect();
        let last = instances[11];
        instances.push(DrawInstance { mesh: 1, ..last });
        let [(_, expected), (second, shown)] = first_and_second(renderer, &frame(&instances));
        assert!(second.depth_wait_millis > 0.0);
        assert!(expected == shown);
    });
}

/// With several samples a pixel the first of them does not tell what the others show.
#[test]
fn with_several_samples_nothing_waits_for_what_is_near() {
    with_each_quality(4, |renderer| {
        let instances = yard(renderer, &mut Numbers(3));
        let [_, (second, _)] = first_and_second(renderer, &frame(&instances));
        assert_eq!(second.depth_wait_millis, 0.0);
    });
}

/// Whatever stands where: hiding changes no byte of the picture.
#[test]
fn no_picture_differs_for_what_is_hidden() {
    if draws_on_card() {
        return;
    }
    let mut numbers = Numbers(7);
    let mut hidden = 0;
    for samples in [1, 4] {
        for _ in 0..12 {
            let mut place = |spread: f32, size: f32| {
                let turn = Quat::from_euler(
                    glam::EulerRot::XYZ,
                    numbers.next(),
                    3.0 * numbers.next(),
                    numbers.next(),
                );
                let half = (numbers.vector() * size).abs() + 0.01;
                let mirrored = if numbers.next() > 0.8 { -1.0 } else { 1.0 };
                Mat4::from_scale_rotation_translation(
                    half * Vec3::new(mirrored, 1.0, 1.0),
                    turn,
                    numbers.vector() * spread,
                )
            };
            let large: Vec<Mat4> = (0..6).map(|_| place(4.0, 3.0)).collect();
            let small: Vec<Mat4> = (0..60).map(|_| place(8.0, 0.4)).collect();
            let eye = numbers.vector() * 9.0 + Vec3::Z;
            with_quality(Quality::Low, samples, |renderer| {
                let walls = cubes(renderer, glowing([0.0, 1.0, 0.0]));
                let others = cubes(renderer, Material { metallic: 0.0, ..Material::default() });
                let instances: Vec<DrawInstance> = large
                    .iter()
                    .map(|&place| instance(walls, place, 1))
                    .chain(
                        (2..).zip(&small).map(|(object, &place)| instance(others, place, object)),
                    )
                    .collect();
                let aspect = SIZE[0] as f32 / SIZE[1] as f32;
                let camera = CameraView::look_at(eye, Vec3::ZERO, Vec3::Y, 0.9, aspect, 0.1);
                let frame = Frame { camera, ..frame(&instances) };
                let [(all, expected), (seen, shown)] = first_and_second(renderer, &frame);
                assert!(expected == shown, "from {eye}");
                hidden += all.visible_instances - seen.visible_instances;
            });
        }
    }
    assert!(hidden > 100, "{hidden} hidden in all");
}
