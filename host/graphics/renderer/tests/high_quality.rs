//! High quality: shadows and ambient occlusion.

mod common;

use busbar_geometry::Bounds;
use busbar_renderer::{
    CameraView, DrawInstance, Frame, Ground, InstanceSource, Picture, Quality, Renderer,
    SectionPlane,
};
use busbar_scene::Material;
use common::*;
use glam::{Mat4, Quat, Vec3};

const BOUNDS: Bounds = Bounds { min: Vec3::splat(-2.0), max: Vec3::splat(2.0) };

fn high(test: impl FnOnce(&mut Renderer)) {
    with_quality(Quality::High, 4, test);
}

fn matt() -> Material {
    Material { roughness: 1.0, double_sided: true, ..Material::default() }
}

/// Faces up, `half` metres to each side, around a point.
fn level(half: f32, at: Vec3) -> Mat4 {
    let up = Quat::from_rotation_x(-std::f32::consts::FRAC_PI_2);
    Mat4::from_scale_rotation_translation(Vec3::splat(half), up, at)
}

/// From above, a little aslant.
fn from_above() -> CameraView {
    let aspect = SIZE[0] as f32 / SIZE[1] as f32;
    CameraView::look_at(Vec3::new(0.0, 6.0, 0.4), Vec3::ZERO, Vec3::Y, 0.7, aspect, 0.1)
}

/// The green of the pixel that shows a point.
fn green_at(picture: &Picture, camera: &CameraView, world: Vec3) -> u8 {
    let at = camera.clip_from_world().project_point3(world);
    let [x, y] = [(at.x, picture.width), (at.y, picture.height)]
        .map(|(at, size)| ((at + 1.0) * 0.5 * size as f32) as u32);
    pixel(picture, x, y)[1]
}

#[test]
fn a_plate_shades_the_floor_where_the_sun_says() {
    high(|renderer| {
        let grey = quad(renderer, matt());
        let drawn =
            [instance(grey, level(2.0, Vec3::ZERO), 1), instance(grey, level(0.3, Vec3::Y), 2)];
        let camera = from_above();
        let mut green = |shadow_bounds, world| {
            let shown = Frame { shadow_bounds, ..Frame::new(camera, &drawn) };
            green_at(&picture(renderer, &shown), &camera, world)
        };
        let [x, y, z] = busbar_shaders::SUN_DIRECTION;
        let shaded = Vec3::new(-x / y, 0.0, -z / y);
        let [without, with] = [None, Some(BOUNDS)].map(|bounds| green(bounds, shaded));
        assert!(with + 40 < without, "{without} to {with}");
        for lit in [Vec3::new(1.2, 0.0, 1.0), Vec3::new(-1.3, 0.0, 1.1), Vec3::Y] {
            let [without, with] = [None, Some(BOUNDS)].map(|bounds| green(bounds, lit));
            assert!(without.abs_diff(with) <= 1, "{lit}: {without} to {with}");
        }
    });
}

#[test]
fn nothing_shades_itself_however_it_is_tilted() {
    high(|renderer| {
        let grey = quad(renderer, matt());
        for tilt in 0..16 {
            let turn = Quat::from_rotation_y(tilt as f32 * 0.4) * Quat::from_rotation_x(-1.1);
            let drawn = [instance(grey, Mat4::from_quat(turn), 1)];
            let mut shown = |shadow_bounds| {
                picture(renderer, &Frame { shadow_bounds, ..Frame::new(from_above(), &drawn) })
            };
            let [without, with] = [None, Some(BOUNDS)].map(&mut shown);
            let apart = without.rgba8.iter().zip(&with.rgba8).map(|(a, b)| a.abs_diff(*b)).max();
            assert!(apart.unwrap() <= 1, "{tilt}: {apart:?}");
        }
    });
}

#[test]
fn the_map_is_drawn_again_only_when_shadows_changed() {
    high(|renderer| {
        let model = upload(renderer, grid(4, Some(0)), &[matt()], &[]);
        let mut drawn = [instance(model, Mat4::IDENTITY, 1)];
        let first = Frame { shadow_bounds: Some(BOUNDS), ..Frame::new(camera(), &[]) };
        let mut is_drawn = |frame: Frame<'_>, drawn: &[DrawInstance]| {
            renderer
                .draw(&Frame { instances: InstanceSource::Listed(drawn), ..frame })
                .unwrap()
                .shadows_drawn
        };
        assert!(is_drawn(first, &drawn));
        assert!(!is_drawn(first, &drawn));
        drawn[0].highlight = [0.5; 4];
        assert!(!is_drawn(Frame { camera: from_above(), ..first }, &drawn), "the camera moved");
        drawn[0].cursor = 3;
        assert!(is_drawn(first, &drawn), "a cursor moved");
        drawn[0].world_from_mesh = Mat4::from_translation(Vec3::X);
        assert!(is_drawn(first, &drawn), "an instance moved");
        assert!(is_drawn(first, &[drawn[0]; 2]), "one more");
        let section = Some(SectionPlane { normal: Vec3::X, distance: 0.0 });
        assert!(is_drawn(Frame { section, ..first }, &[drawn[0]; 2]));
        assert!(is_drawn(Frame { shadow_bounds: None, ..first }, &drawn));
        assert!(!is_drawn(Frame { shadow_bounds: None, ..first }, &drawn));
        assert!(!is_drawn(Frame { wireframe: true, ..first }, &drawn));
    });
}

#[test]
fn medium_draws_no_shadows() {
    with_renderer(4, |renderer| {
        let grey = quad(renderer, matt());
        let drawn =
            [instance(grey, level(2.0, Vec3::ZERO), 1), instance(grey, level(0.3, Vec3::Y), 2)];
        let mut shown = |shadow_bounds| {
            picture(renderer, &Frame { shadow_bounds, ..Frame::new(from_above(), &drawn) })
        };
        let [without, with] = [None, Some(BOUNDS)].map(&mut shown);
        assert_eq!(without, with);
    });
}

/// Large enough for a contact shade to show.
const LARGE: [u32; 2] = [384, 256];

#[test]
fn contact_is_darker_and_open_floor_is_not() {
    for samples in [1, 4] {
        let shown = [Quality::Medium, Quality::High].map(|quality| {
            let mut greens = Vec::new();
            with_quality(quality, samples, |renderer| {
                renderer.resize(LARGE);
                let grey = quad(renderer, matt());
                let wall = Mat4::from_translation(Vec3::Y);
                let drawn = [instance(grey, level(2.0, Vec3::ZERO), 1), instance(grey, wall, 2)];
                let camera = CameraView::look_at(
                    Vec3::new(0.0, 4.0, 5.0),
                    Vec3::ZERO,
                    Vec3::Y,
                    0.7,
                    1.5,
                    0.1,
                );
                let picture = picture(renderer, &Frame::new(camera, &drawn));
                let at = [0.15, 1.6].map(|z| Vec3::new(0.1, 0.0, z));
                greens.extend(at.map(|at| green_at(&picture, &camera, at)));
            });
            greens
        });
        let [medium, high] = &shown;
        assert!(high[0] + 12 < medium[0], "contact: {shown:?}");
        assert!(high[1].abs_diff(medium[1]) <= 1, "open: {shown:?}");
    }
}

#[test]
fn the_ground_too_is_in_contact_and_in_shadow() {
    let ground = Some(Ground { height: 0.0, reach: 50.0 });
    let green = |quality, shadow_bounds, at: Vec3| {
        let mut green = 0;
        with_quality(quality, 4, |renderer| {
            renderer.resize(LARGE);
            let grey = quad(renderer, matt());
            let drawn = [instance(grey, Mat4::from_translation(Vec3::Y), 1)];
            let eye = Vec3::new(0.0, 4.0, 5.0);
            let camera = CameraView::look_at(eye, Vec3::ZERO, Vec3::Y, 0.9, 1.5, 0.1);
            let background = [0.6; 3];
            let frame = Frame { ground, shadow_bounds, background, ..Frame::new(camera, &drawn) };
            green = green_at(&picture(renderer, &frame), &camera, at);
        });
        green
    };
    let before = Vec3::new(0.13, 0.0, 0.12);
    let [medium, high] = [Quality::Medium, Quality::High].map(|q| green(q, None, before));
    assert!(high + 8 < medium, "contact: {medium} to {high}");
    // Beside the wall's shadow, which goes back and to the left.
    let shaded = Vec3::new(-1.25, 0.0, -0.6);
    let [without, with] = [None, Some(BOUNDS)].map(|b| green(Quality::High, b, shaded));
    assert!(with + 20 < without, "shadow: {without} to {with}");
}
