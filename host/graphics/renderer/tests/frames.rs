//! Frames one after another: cache, picking, panels, sizes, sameness.

mod common;

use std::time::{Duration, Instant};

use busbar_renderer::{
    DrawInstance, EguiFrame, Frame, MAX_UPLOAD_BYTES_PER_FRAME, MeshAtCursor, RenderError,
    Renderer, RendererOptions, ResolveRequest,
};
use busbar_scene::Material;
use common::*;
use glam::{Mat4, Vec3};

#[test]
fn the_index_cache_stays_under_its_limit() {
    with_renderer(1, |renderer| {
        let model = upload(renderer, grid(16, None), &[], &[]);
        let at = |cursor| DrawInstance { cursor, ..instance(model, Mat4::IDENTITY, 1) };
        // 512 triangles of 12 bytes: some three of them fit.
        let limit = 20_000;
        renderer.set_index_cache_limit(limit);
        let mut first = None;
        for cursor in 0..200 {
            renderer.draw(&frame(&[at(cursor)])).unwrap();
            assert!(renderer.index_cache_bytes() <= limit, "{}", renderer.index_cache_bytes());
            first.get_or_insert_with(|| renderer.read_picture().unwrap());
        }
        assert_eq!(Some(picture(renderer, &frame(&[at(0)]))), first, "evicted and made again");
        // A frame gets what it needs even when that is more than the limit.
        let many: Vec<_> = (0..8).map(at).collect();
        let stats = renderer.draw(&frame(&many)).unwrap();
        assert!(stats.triangles > 7 * 450, "{}", stats.triangles);
        renderer.draw(&frame(&[at(0)])).unwrap();
        assert!(renderer.index_cache_bytes() <= limit);
        renderer.remove_model(model);
        assert_eq!(renderer.index_cache_bytes(), 0);
    });
}

#[test]
fn picking_names_the_object_in_front() {
    with_renderer(4, |renderer| {
        let model = quad(renderer, Material::default());
        let move_by = |x: f32, z: f32| Mat4::from_translation(Vec3::new(x, 0.0, z));
        let small = Mat4::from_scale(Vec3::splat(0.4));
        let drawn = [
            instance(model, move_by(0.0, 0.0), 7),
            instance(model, move_by(0.0, 0.5) * small, 4_000_000_000),
            instance(model, move_by(2.0, 0.0) * small, 9),
        ];
        let frame = frame(&drawn);
        renderer.draw(&frame).unwrap();
        let [width, height] = SIZE;
        let mut pick = |x, y| renderer.pick(&frame, [x, y]).unwrap();
        assert_eq!(pick(width / 2, height / 2), Some(4_000_000_000));
        assert_eq!(pick(width / 2 - 12, height / 2), Some(7));
        assert_eq!(pick(0, 0), None);
        assert_eq!(pick(width - 1, height - 1), None);
        let found: Vec<_> = (0..width).filter(|&x| pick(x, height / 2) == Some(9)).collect();
        assert!(found.len() > 5 && found[0] > width / 2 + 16, "{found:?}");
        let error = renderer.pick(&frame, [width, 0]).unwrap_err();
        assert!(matches!(error, RenderError::OutsidePicture { .. }));
    });
}

#[test]
fn picking_agrees_with_the_picture_pixel_by_pixel() {
    with_renderer(1, |renderer| {
        let red = upload(renderer, grid(3, Some(0)), &[glowing([0.5, 0.0, 0.0])], &[]);
        let tilt = Mat4::from_rotation_z(0.3) * Mat4::from_rotation_y(0.5);
        let drawn = [instance(red, tilt, 5)];
        let shown = picture(renderer, &frame(&drawn));
        for y in (0..SIZE[1]).step_by(3) {
            for x in 0..SIZE[0] {
                let is_red = pixel(&shown, x, y) != [0, 0, 255, 255];
                let picked = renderer.pick(&frame(&drawn), [x, y]).unwrap();
                assert_eq!(picked, is_red.then_some(5), "at {x}, {y}");
            }
        }
    });
}

/// egui's output for a screen of `SIZE` points with one filled rectangle.
fn egui_rectangle(
    context: &egui::Context,
    rect: egui::Rect,
    color: egui::Color32,
) -> (egui::TexturesDelta, Vec<egui::ClippedPrimitive>) {
    let screen =
        egui::Rect::from_min_size(egui::Pos2::ZERO, egui::vec2(SIZE[0] as f32, SIZE[1] as f32));
    let input = egui::RawInput { screen_rect: Some(screen), ..Default::default() };
    let mut output = context.run_ui(input, |ui| {
        ui.painter().rect_filled(rect, 0.0, color);
    });
    let primitives = context.tessellate(output.shapes, 1.0);
    (std::mem::take(&mut output.textures_delta), primitives)
}

#[test]
fn panels_have_exactly_their_colours() {
    with_renderer(4, |renderer| {
        let context = egui::Context::default();
        let rect = egui::Rect::from_min_max(egui::pos2(8.0, 8.0), egui::pos2(40.0, 40.0));
        let colors = [[30, 100, 200], [200, 60, 5], [1, 2, 3], [255, 128, 64]];
        for [r, g, b] in colors {
            let color = egui::Color32::from_rgb(r, g, b);
            let (mut delta, primitives) = egui_rectangle(&context, rect, color);
            let overlay = EguiFrame {
                textures_delta: &delta,
                primitives: &primitives,
                pixels_per_point: 1.0,
            };
            let shown = picture(renderer, &Frame { overlay: Some(overlay), ..frame(&[]) });
            // Applied: egui panics on deltas that are dropped unapplied.
            delta.clear();
            assert_eq!(pixel(&shown, 20, 20), [r, g, b, 255]);
            assert_eq!(pixel(&shown, 60, 20), [0, 0, 255, 255], "the picture beside it");
        }
        // egui blends bytes as they are, as browsers do.
        let half = egui::Color32::from_rgba_unmultiplied(255, 255, 255, 128);
        let (mut delta, primitives) = egui_rectangle(&context, rect, half);
        let overlay =
            EguiFrame { textures_delta: &delta, primitives: &primitives, pixels_per_point: 1.0 };
        let black = Frame { background: [0.0; 3], overlay: Some(overlay), ..frame(&[]) };
        let shown = picture(renderer, &black);
        delta.clear();
        assert_near(pixel(&shown, 20, 20), [128, 128, 128, 255], 2);
    });
}

#[test]
fn panels_with_changing_text_and_textures_stay_whole() {
    with_renderer(1, |renderer| {
        let context = egui::Context::default();
        for step in 0..30 {
            let screen = egui::Rect::from_min_size(egui::Pos2::ZERO, egui::vec2(96.0, 64.0));
            let input = egui::RawInput { screen_rect: Some(screen), ..Default::default() };
            let image = egui::ColorImage::filled([4, 4], egui::Color32::from_gray(step * 8));
            // A texture a frame, freed in the next.
            let texture = context.load_texture(format!("step {step}"), image, Default::default());
            let mut output = context.run_ui(input, |ui| {
                let glyph = char::from(b'A' + step % 26);
                ui.label(format!("{glyph}{glyph}"));
                ui.image((texture.id(), egui::vec2(8.0, 8.0)));
            });
            let primitives = context.tessellate(output.shapes, 1.0);
            let overlay = EguiFrame {
                textures_delta: &output.textures_delta,
                primitives: &primitives,
                pixels_per_point: 1.0,
            };
            renderer.draw(&Frame { overlay: Some(overlay), ..frame(&[]) }).unwrap();
            output.textures_delta.clear();
        }
        let shown = renderer.read_picture().unwrap();
        let background: [u8; 4] = [0, 0, 255, 255];
        let painted = shown.rgba8.chunks_exact(4).filter(|&p| p != background).count();
        assert!(painted > 40, "{painted}");
    });
}

#[test]
fn two_hundred_frames_with_random_sizes() {
    with_renderer(4, |renderer| {
        let model = upload(renderer, grid(8, None), &[], &[]);
        let mut random = Random(42);
        for step in 0..200 {
            if step % 3 == 0 {
                renderer.resize([random.below(200), random.below(150)]);
            }
            let drawn: Vec<_> = (0..random.below(20))
                .map(|object| DrawInstance {
                    cursor: random.below(80),
                    ..instance(model, Mat4::from_rotation_y(step as f32 * 0.1), object + 1)
                })
                .collect();
            let wireframe = step % 7 == 0;
            renderer.draw(&Frame { wireframe, ..frame(&drawn) }).unwrap();
            if step % 10 == 0 && renderer.read_picture().is_ok() {
                renderer.pick(&frame(&drawn), [0, 0]).unwrap();
            }
        }
        renderer.resize(SIZE);
        let stats = renderer.draw(&frame(&[])).unwrap();
        assert!(stats.gpu_millis.is_some_and(|millis| millis >= 0.0));
        let stages: Vec<_> = stats.gpu_stages.iter().collect();
        let names: Vec<_> = stages.iter().map(|(name, _)| *name).collect();
        assert_eq!(names, ["upload", "scene"]);
        let sum: f64 = stages.iter().map(|(_, millis)| millis).sum();
        assert!(stats.gpu_millis.is_some_and(|whole| sum <= whole + 1e-6), "{stats:?}");
    });
}

#[test]
fn a_picture_of_no_area_is_skipped_and_comes_back() {
    with_renderer(1, |renderer| {
        assert!(matches!(renderer.read_picture(), Err(RenderError::NoPicture)));
        renderer.resize([0, 50]);
        assert_eq!(renderer.draw(&frame(&[])).unwrap(), Default::default());
        renderer.resize([30, 20]);
        let shown = picture(renderer, &frame(&[]));
        assert_eq!((shown.width, shown.height), (30, 20));
    });
}

#[test]
fn the_same_frame_gives_the_same_bits() {
    let draw = || {
        let mut shown = None;
        with_renderer(4, |renderer| {
            let model = upload(renderer, grid(8, None), &[], &[]);
            let drawn: Vec<_> = (0..10)
                .map(|i| DrawInstance {
                    cursor: i,
                    ..instance(model, Mat4::from_rotation_y(i as f32 * 0.3), i + 1)
                })
                .collect();
            let once = picture(renderer, &frame(&drawn));
            assert_eq!(once, picture(renderer, &frame(&drawn)));
            shown = Some(once);
        });
        shown.unwrap()
    };
    assert_eq!(draw(), draw());
}

#[test]
fn impossible_options_are_refused() {
    for samples in [0, 2, 3, 64] {
        let options = RendererOptions { samples, validation: true, ..Default::default() };
        let error = Renderer::headless(options, SIZE).err().unwrap();
        assert!(matches!(error, RenderError::BadSamples(s) if s == samples));
    }
}

#[test]
fn what_is_asked_for_comes_beside_the_frames() {
    with_renderer(1, |renderer| {
        let model = upload(renderer, grid(16, None), &[], &[]);
        let at = |cursor| DrawInstance { cursor, ..instance(model, Mat4::IDENTITY, 1) };
        let place = |cursor| MeshAtCursor { model, mesh: 0, cursor };
        let waited = picture(renderer, &frame(&[at(100)]));
        let triangles = renderer.triangles_at(&place(100));
        renderer.set_index_cache_limit(0);
        let shown = picture(renderer, &frame(&[at(0)]));
        assert_eq!(renderer.triangles_at(&place(100)), None, "evicted");
        renderer.set_index_cache_limit(1 << 20);

        renderer
            .request([100, 100, 50].map(|cursor| ResolveRequest::Mesh(place(cursor))).into_iter());
        let start = Instant::now();
        let mut resolved = 0;
        while resolved < 2 && start.elapsed() < Duration::from_secs(10) {
            let stats = renderer.draw(&frame(&[at(0)])).unwrap();
            resolved += stats.resolved;
            assert_eq!(stats.waiting + resolved, 2);
            assert_eq!(renderer.read_picture().unwrap(), shown, "drawn as it was meanwhile");
        }
        assert_eq!(renderer.triangles_at(&place(100)), triangles);
        assert!(renderer.triangles_at(&place(50)) > triangles);
        let stats = renderer.draw(&frame(&[at(100)])).unwrap();
        assert_eq!((stats.resolved, u64::from(triangles.unwrap())), (0, stats.triangles));
        assert_eq!(renderer.read_picture().unwrap(), waited);
        // Names of what is not there are passed over.
        let absent = MeshAtCursor { mesh: 7, ..place(3) };
        renderer.request([place(3), absent].map(ResolveRequest::Mesh).into_iter());
        renderer.remove_model(model);
        assert_eq!(renderer.draw(&frame(&[])).unwrap().waiting, 0);
        renderer.request([ResolveRequest::Mesh(place(3))].into_iter());
        assert_eq!(renderer.draw(&frame(&[])).unwrap().waiting, 0);
    });
}

/// Each of these takes more than a frame uploads, so one a frame arrives.
#[test]
fn uploads_of_a_frame_are_bounded() {
    with_renderer(1, |renderer| {
        let model = upload(renderer, grid(420, None), &[], &[]);
        let drawn = [DrawInstance { cursor: u32::MAX, ..instance(model, Mat4::IDENTITY, 1) }];
        renderer.draw(&frame(&drawn)).unwrap();
        let mesh = |cursor| ResolveRequest::Mesh(MeshAtCursor { model, mesh: 0, cursor });
        renderer.request((0..3).map(mesh));
        // Time for the workers to have all ready at once.
        std::thread::sleep(Duration::from_secs(1));
        let start = Instant::now();
        let mut resolved = 0;
        while resolved < 3 && start.elapsed() < Duration::from_secs(30) {
            let before = renderer.index_cache_bytes();
            resolved += renderer.draw(&frame(&drawn)).unwrap().resolved;
            let uploaded = renderer.index_cache_bytes() - before;
            assert!(uploaded < 2 * MAX_UPLOAD_BYTES_PER_FRAME, "{uploaded}");
        }
        assert_eq!(resolved, 3);
        assert!(renderer.index_cache_bytes() > 3 * MAX_UPLOAD_BYTES_PER_FRAME);
    });
}
