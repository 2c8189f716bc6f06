//! Pictures of the renderer: colours, textures, transparency, tints and wireframes.

mod common;

use busbar_renderer::{
    CameraView, DeviceChoice, DrawInstance, Frame, Ground, ModelUpload, Picture, Quality,
    RenderError, Renderer, RendererOptions,
};
use busbar_scene::{AlphaMode, Material, Texture, TextureRef, Wrap};
use common::*;
use glam::{Mat4, Quat, Vec3};

#[test]
fn a_red_quad_stands_before_the_background() {
    for samples in [1, 4] {
        with_each_quality(samples, |renderer| {
            let red = quad(renderer, glowing([0.5, 0.0, 0.0]));
            let shown = picture(renderer, &frame(&[instance(red, Mat4::IDENTITY, 1)]));
            assert_near(center(&shown), [srgb_byte(0.5), 0, 0, 255], 12);
            assert_eq!(pixel(&shown, 0, 0), [0, 0, 255, 255]);
            assert_eq!((shown.width, shown.height), (SIZE[0], SIZE[1]));
        });
    }
}

#[test]
fn backgrounds_are_encoded_as_srgb() {
    with_each_quality(4, |renderer| {
        let grey = Frame { background: [0.2, 0.5, 0.7], ..frame(&[]) };
        let shown = picture(renderer, &grey);
        assert_near(center(&shown), [srgb_byte(0.2), srgb_byte(0.5), srgb_byte(0.7), 255], 1);
    });
}

#[test]
fn the_nearer_quad_is_seen_in_either_order() {
    with_renderer(4, |renderer| {
        let red = quad(renderer, glowing([0.5, 0.0, 0.0]));
        let green = quad(renderer, glowing([0.0, 0.5, 0.0]));
        let near = Mat4::from_translation(Vec3::Z);
        for (front, other, expected) in
            [(red, green, [188, 0, 0, 255]), (green, red, [0, 188, 0, 255])]
        {
            let there = [instance(other, Mat4::IDENTITY, 1), instance(front, near, 2)];
            let back = [there[1], there[0]];
            let shown = picture(renderer, &frame(&there));
            assert_near(center(&shown), expected, 12);
            assert_eq!(shown, picture(renderer, &frame(&back)), "order of the list is no matter");
        }
    });
}

#[test]
fn a_cursor_changes_triangles_and_picture() {
    with_renderer(4, |renderer| {
        let model = upload(renderer, grid(8, Some(0)), &[glowing([0.5, 0.0, 0.0])], &[]);
        let mut drawn = instance(model, Mat4::IDENTITY, 1);
        let full = renderer.draw(&frame(&[drawn])).unwrap();
        let full_picture = renderer.read_picture().unwrap();
        drawn.cursor = 40;
        let half = renderer.draw(&frame(&[drawn])).unwrap();
        let half_picture = renderer.read_picture().unwrap();
        assert_eq!(full.triangles, 128);
        assert!(half.triangles > 0 && half.triangles < 128, "{}", half.triangles);
        assert_ne!(full_picture, half_picture);
        drawn.cursor = u32::MAX;
        let none = renderer.draw(&frame(&[drawn])).unwrap();
        assert_eq!((none.triangles, none.draw_calls), (0, 0));
        drawn.cursor = 0;
        assert_eq!(picture(renderer, &frame(&[drawn])), full_picture, "nothing is lost");
    });
}

#[test]
fn instances_at_one_cursor_share_a_draw_call() {
    with_renderer(1, |renderer| {
        let model = quad(renderer, Material::default());
        let at = |x: f32, cursor| busbar_renderer::DrawInstance {
            cursor,
            ..instance(model, Mat4::from_translation(Vec3::X * x), 1)
        };
        let drawn: Vec<_> = (0..50).map(|i| at(i as f32, 0)).collect();
        let stats = renderer.draw(&frame(&drawn)).unwrap();
        assert_eq!((stats.triangles, stats.draw_calls), (100, 1));
        let stats = renderer.draw(&frame(&[at(0.0, 0), at(1.0, 1), at(2.0, 0)])).unwrap();
        assert_eq!((stats.triangles, stats.draw_calls), (5, 2));
        assert_eq!(stats.draw_commands, 1, "what is alike is one command");
    });
}

#[test]
fn wireframe_shows_lines_and_gaps() {
    with_each_quality(4, |renderer| {
        assert!(renderer.can_draw_wireframe(), "the software rasteriser draws lines");
        let model = upload(renderer, grid(4, Some(0)), &[Material::default()], &[]);
        let drawn = [instance(model, Mat4::IDENTITY, 1)];
        let shaded = picture(renderer, &frame(&drawn));
        let wires = picture(renderer, &Frame { wireframe: true, ..frame(&drawn) });
        assert_ne!(shaded, wires);
        let reds: Vec<u8> = (0..SIZE[0]).map(|x| pixel(&wires, x, SIZE[1] / 2 + 3)[0]).collect();
        assert!(reds.iter().any(|&r| r > 200), "fill: {reds:?}");
        let dark = reds.iter().filter(|&&r| r > 0 && r < 150).count();
        assert!(dark >= 4, "lines: {reds:?}");
    });
}

#[test]
fn blended_quads_cover_by_alpha_from_back_to_front() {
    with_renderer(4, |renderer| {
        let glass = quad(renderer, blended([0.5, 0.0, 0.0], 0.5));
        let green = quad(renderer, glowing([0.0, 0.5, 0.0]));
        let shift = |z: f32| Mat4::from_translation(Vec3::Z * z);
        let behind = picture(
            renderer,
            &frame(&[instance(glass, shift(0.5), 1), instance(green, shift(0.0), 2)]),
        );
        assert_near(center(&behind), [srgb_byte(0.25), srgb_byte(0.25), 0, 255], 12);
        let hidden = picture(
            renderer,
            &frame(&[instance(glass, shift(-0.5), 1), instance(green, shift(0.0), 2)]),
        );
        assert_near(center(&hidden), [0, srgb_byte(0.5), 0, 255], 12);
        // Two glasses, the nearer listed first: red must lie over green.
        let green_glass = quad(renderer, blended([0.0, 0.5, 0.0], 0.5));
        let both = picture(
            renderer,
            &frame(&[instance(glass, shift(0.5), 1), instance(green_glass, shift(0.0), 2)]),
        );
        let expected = [srgb_byte(0.25), srgb_byte(0.125), srgb_byte(0.25), 255];
        assert_near(center(&both), expected, 12);
    });
}

#[test]
fn backs_are_culled_unless_double_sided_also_in_mirrors() {
    with_each_quality(4, |renderer| {
        let single = quad(renderer, glowing([0.5, 0.0, 0.0]));
        let double = quad(renderer, Material { double_sided: true, ..glowing([0.5, 0.0, 0.0]) });
        let turned = Mat4::from_quat(Quat::from_rotation_y(std::f32::consts::PI));
        let mirrored = Mat4::from_scale(Vec3::new(-1.0, 1.0, 1.0));
        let mut is_seen = |model, transform| {
            center(&picture(renderer, &frame(&[instance(model, transform, 1)])))[0] > 100
        };
        assert!(is_seen(single, Mat4::IDENTITY));
        assert!(!is_seen(single, turned));
        assert!(is_seen(double, turned));
        assert!(is_seen(single, mirrored), "a mirror does not turn a face away");
        assert!(!is_seen(single, turned * mirrored));
        assert!(is_seen(double, turned * mirrored));
    });
}

#[test]
fn a_mirrored_face_is_lit_as_the_plain_one() {
    with_each_quality(4, |renderer| {
        let matt = quad(renderer, Material::default());
        let mirrored = Mat4::from_scale(Vec3::new(-1.0, 1.0, 1.0));
        let plain = picture(renderer, &frame(&[instance(matt, Mat4::IDENTITY, 1)]));
        let mirror = picture(renderer, &frame(&[instance(matt, mirrored, 1)]));
        assert_near(center(&plain), center(&mirror), 1);
    });
}

#[test]
fn a_highlight_tints() {
    with_each_quality(4, |renderer| {
        let matt = quad(renderer, Material::default());
        let mut drawn = instance(matt, Mat4::IDENTITY, 1);
        let plain = center(&picture(renderer, &frame(&[drawn])));
        drawn.highlight = [1.0, 0.2, 0.0, 0.6];
        let tinted = center(&picture(renderer, &frame(&[drawn])));
        assert!(tinted[0] > tinted[2].saturating_add(60), "{tinted:?}");
        assert!(plain[0].abs_diff(plain[2]) < 30, "{plain:?}");
    });
}

#[test]
fn low_quality_tells_sides_apart_as_medium_does() {
    for samples in [1, 4] {
        let shown = [Quality::Low, Quality::Medium].map(|quality| {
            let mut grey = Vec::new();
            with_quality(quality, samples, |renderer| {
                let matt = Material { metallic: 0.0, double_sided: true, ..Material::default() };
                let plain = quad(renderer, Material { double_sided: false, ..matt.clone() });
                let double = quad(renderer, matt);
                // Towards the sun, away from it, up and down.
                for angle in [0.5, -0.5, -1.2, 1.2_f32] {
                    for model in [plain, double] {
                        let axis = if angle.abs() < 1.0 { Vec3::Y } else { Vec3::X };
                        let turned = Mat4::from_axis_angle(axis, angle);
                        let drawn = [instance(model, turned, 1)];
                        grey.push(center(&picture(renderer, &frame(&drawn)))[1]);
                    }
                }
            });
            grey
        });
        let [low, medium] = &shown;
        for pair in low.chunks(2) {
            // A root stands in for the curve of sRGB where two sides may be seen.
            assert!(pair[0].abs_diff(pair[1]) <= 5, "one side or two: {low:?}");
        }
        for (low, medium) in low.iter().zip(medium) {
            assert!(low.abs_diff(*medium) < 30, "{shown:?}");
        }
        assert!(low[0] > low[2] + 8 && low[4] > low[6] + 40, "{low:?}");
    }
}

/// From `height` metres, down and ahead.
fn over_ground(height: f32, drawn: &[DrawInstance]) -> Frame<'_> {
    let aspect = SIZE[0] as f32 / SIZE[1] as f32;
    let eye = Vec3::new(0.3, height, 0.4);
    let target = Vec3::new(0.3, 0.0, -2.0);
    let camera = CameraView::look_at(eye, target, Vec3::Y, 0.9, aspect, 0.1);
    let ground = Some(Ground { height: 0.0, reach: 50.0 });
    Frame { camera, ground, background: [0.6; 3], ..frame(drawn) }
}

#[test]
fn the_ground_has_lines_is_hidden_by_what_stands_before_it_and_not_seen_from_below() {
    with_renderer(4, |renderer| {
        let green = |p: &busbar_renderer::Picture| -> Vec<u8> {
            p.rgba8.chunks_exact(4).map(|rgba| rgba[1]).collect()
        };
        let bare = srgb_byte(0.6);
        let shown = green(&picture(renderer, &over_ground(2.0, &[])));
        let [least, most] = [shown.iter().min(), shown.iter().max()].map(|c| *c.unwrap());
        assert!(most < bare, "a veil at least: {most}");
        assert!(most - least > 8, "and lines: {least} to {most}");
        let below = green(&picture(renderer, &over_ground(-2.0, &[])));
        assert!(below.iter().all(|&c| c.abs_diff(bare) <= 1));
        let red = quad(renderer, glowing([0.5, 0.0, 0.0]));
        let drawn = [instance(red, Mat4::from_translation(Vec3::new(0.3, 1.0, -1.0)), 1)];
        let hidden = picture(renderer, &over_ground(2.0, &drawn));
        assert!(center(&hidden)[1] < 40, "{:?}", center(&hidden));
    });
    with_quality(Quality::Low, 1, |renderer| {
        let shown = picture(renderer, &over_ground(2.0, &[]));
        assert!(center(&shown)[1].abs_diff(srgb_byte(0.6)) <= 1);
        assert!(shown.rgba8.chunks_exact(4).all(|rgba| rgba == &shown.rgba8[..4]), "none at low");
    });
}

#[test]
fn another_quality_may_be_asked_for_where_the_processor_draws() {
    let medium = RendererOptions { validation: true, ..RendererOptions::default() };
    let either = RendererOptions { on_software_rasterizer: Some((Quality::Low, 1)), ..medium };
    let shown = |renderer: &mut Renderer| -> Picture {
        let red = quad(renderer, glowing([0.5, 0.0, 0.0]));
        let turned = Mat4::from_translation(Vec3::new(0.3, 1.0, -1.0)) * Mat4::from_rotation_z(0.3);
        picture(renderer, &over_ground(2.0, &[instance(red, turned, 1)]))
    };
    let [wanted, other] = [(Quality::Low, 1), (Quality::Medium, 4)].map(|(quality, samples)| {
        let mut picture = None;
        with_quality(quality, samples, |renderer| picture = Some(shown(renderer)));
        picture.unwrap()
    });
    assert!(wanted.rgba8 != other.rgba8);
    let mut renderer = Renderer::headless(either, SIZE).unwrap();
    let by_device = if renderer.uses_software_rasterizer() { &wanted } else { &other };
    assert!(shown(&mut renderer).rgba8 == by_device.rgba8);
    assert!(!renderer.set_options(either, DeviceChoice::default()), "nothing else");
    assert!(renderer.set_options(medium, DeviceChoice::default()));
    renderer.renew().unwrap();
    assert!(shown(&mut renderer).rgba8 == other.rgba8);
    assert_eq!(renderer.validation_messages(), Vec::<String>::new());
}

#[test]
fn far_things_fade_into_the_background_but_not_what_is_tinted() {
    with_renderer(1, |renderer| {
        let red = quad(renderer, glowing([0.5, 0.0, 0.0]));
        let mut drawn = instance(red, Mat4::IDENTITY, 1);
        let mut seen = |drawn, fog_distance| {
            center(&picture(renderer, &Frame { fog_distance, ..frame(&[drawn]) }))
        };
        // The eye is four metres away, the background blue.
        let [clear, half, far] = [None, Some(4.0), Some(0.4)].map(|fog| seen(drawn, fog));
        assert_near(clear, [srgb_byte(0.5), 0, 0, 255], 12);
        assert_near(half, [srgb_byte(0.25), 0, srgb_byte(0.5), 255], 12);
        assert_near(far, [srgb_byte(0.005), 0, srgb_byte(0.99), 255], 12);
        drawn.highlight = [0.0, 0.8, 0.0, 1.0];
        assert_eq!(seen(drawn, Some(0.4)), seen(drawn, None));
    });
}

/// Two by two pixels: red, green / blue, transparent white.
fn checker() -> Texture {
    let rgba8 = [[255, 0, 0, 255], [0, 255, 0, 255], [0, 0, 255, 255], [255, 255, 255, 0]].concat();
    Texture { width: 2, height: 2, rgba8 }
}

#[test]
fn textures_lie_right_way_up_and_masks_cut_out() {
    with_each_quality(1, |renderer| {
        let texture = TextureRef { texture: 0, wrap: [Wrap::Clamp; 2] };
        let material = Material {
            base_color: [1.0; 4],
            base_color_texture: Some(texture),
            alpha: AlphaMode::Mask(0.5),
            ..Material::default()
        };
        let model = upload(renderer, grid(1, Some(0)), &[material], &[checker()]);
        let shown = picture(renderer, &frame(&[instance(model, Mat4::IDENTITY, 1)]));
        let strongest = |x: u32, y: u32| {
            let rgb = pixel(&shown, x, y);
            (0..3).max_by_key(|&channel| rgb[channel]).unwrap()
        };
        // The quad spans 16 pixels to each side of the centre.
        let (left, right) = (SIZE[0] / 2 - 12, SIZE[0] / 2 + 12);
        let (top, bottom) = (SIZE[1] / 2 - 12, SIZE[1] / 2 + 12);
        assert_eq!(strongest(left, top), 0);
        assert_eq!(strongest(right, top), 1);
        assert_eq!(strongest(left, bottom), 2);
        assert_eq!(pixel(&shown, right, bottom), [0, 0, 255, 255], "cut out");
    });
}

#[test]
fn wrap_rules_hold_outside_the_texture() {
    // Linear filtering reads beyond the edge, so that the edge's pixels tell
    // the rules apart: there follows blue when tiled, red else.
    let red_blue =
        Texture { width: 2, height: 1, rgba8: [[255, 0, 0, 255], [0, 0, 255, 255]].concat() };
    let left_edge = |wrap| {
        let mut seen = [0; 4];
        with_renderer(1, |renderer| {
            let material = Material {
                base_color: [1.0; 4],
                base_color_texture: Some(TextureRef { texture: 0, wrap: [wrap, Wrap::Clamp] }),
                ..Material::default()
            };
            let model =
                upload(renderer, grid(1, Some(0)), &[material], std::slice::from_ref(&red_blue));
            let near = Mat4::from_scale(Vec3::splat(1.5));
            let shown = picture(renderer, &frame(&[instance(model, near, 1)]));
            let row = SIZE[1] / 2;
            let first = (0..SIZE[0]).find(|&x| pixel(&shown, x, row) != [0, 0, 255, 255]);
            seen = pixel(&shown, first.unwrap(), row);
        });
        seen
    };
    let (repeat, clamp, mirror) =
        (left_edge(Wrap::Repeat), left_edge(Wrap::Clamp), left_edge(Wrap::Mirror));
    assert!(repeat[2] > 100, "the other edge bleeds in: {repeat:?}");
    assert!(clamp[2] < 80, "{clamp:?}");
    assert_eq!(clamp, mirror);
}

#[test]
fn nothing_and_degenerate_meshes_draw_nothing() {
    with_renderer(4, |renderer| {
        let empty = upload(renderer, busbar_geometry::Mesh::default(), &[], &[]);
        let mut flat = grid(2, None);
        flat.positions.fill(Vec3::ZERO);
        let flat = upload(renderer, flat, &[], &[]);
        let nothing = picture(renderer, &frame(&[]));
        let drawn = [
            instance(empty, Mat4::IDENTITY, 1),
            instance(flat, Mat4::IDENTITY, 2),
            instance(flat, Mat4::ZERO, 3),
            instance(flat, Mat4::from_scale(Vec3::splat(f32::NAN)), 4),
        ];
        assert_eq!(picture(renderer, &frame(&drawn)), nothing);
        assert_eq!(picture(renderer, &Frame { wireframe: true, ..frame(&drawn[..1]) }), nothing);
    });
}

#[test]
fn zero_normals_do_not_blacken() {
    with_each_quality(4, |renderer| {
        let mut mesh = grid(1, None);
        mesh.wedges.normal.fill(Vec3::ZERO);
        let model = upload(renderer, mesh, &[], &[]);
        let shown = center(&picture(renderer, &frame(&[instance(model, Mat4::IDENTITY, 1)])));
        assert!(shown[..3].iter().all(|&c| c > 60), "{shown:?}");
    });
}

#[test]
fn bad_models_and_frames_are_refused_by_name() {
    with_renderer(1, |renderer| {
        let upload_of =
            |renderer: &mut busbar_renderer::Renderer, material: Material, textures: &[Texture]| {
                let stacks = [stacks(grid(1, Some(0)))];
                let upload = ModelUpload { stacks: &stacks, materials: &[material], textures };
                renderer.upload_model(upload)
            };
        let textured = Material {
            base_color_texture: Some(TextureRef { texture: 3, wrap: Default::default() }),
            ..Material::default()
        };
        let error = upload_of(renderer, textured.clone(), &[checker()]).unwrap_err();
        assert_eq!(error.to_string(), "material 0 names texture 3, but the model has 1");
        let mut short = checker();
        short.rgba8.pop();
        let material = Material {
            base_color_texture: Some(TextureRef { texture: 0, wrap: Default::default() }),
            ..textured
        };
        let error = upload_of(renderer, material, &[short]).unwrap_err();
        assert!(matches!(error, RenderError::BadTexture { bytes: 15, .. }));
        let wrong_section = [stacks(grid(1, Some(7)))];
        let upload = ModelUpload { stacks: &wrong_section, materials: &[], textures: &[] };
        let error = renderer.upload_model(upload).unwrap_err();
        assert_eq!(error.to_string(), "mesh 0 names material 7, but the model has 0");

        let model = quad(renderer, Material::default());
        let mut drawn = instance(model, Mat4::IDENTITY, 1);
        drawn.mesh = 5;
        let error = renderer.draw(&frame(&[drawn])).unwrap_err();
        assert!(matches!(error, RenderError::BadReference { index: 5, count: 1, .. }));
        drawn.mesh = 0;
        renderer.draw(&frame(&[drawn])).unwrap();
        renderer.remove_model(model);
        let error = renderer.draw(&frame(&[drawn])).unwrap_err();
        assert!(matches!(error, RenderError::UnknownModel(_)));
        renderer.draw(&frame(&[])).unwrap();
        renderer.resize([1_000_000, 4]);
        assert!(renderer.draw(&frame(&[])).unwrap_err().to_string().contains("at most"));
        renderer.resize(SIZE);
        renderer.draw(&frame(&[])).unwrap();
    });
}
