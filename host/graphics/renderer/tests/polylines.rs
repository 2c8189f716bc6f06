//! Polylines and faces in the world.

#![allow(clippy::unwrap_used, reason = "helpers of tests")]

mod common;

use busbar_renderer::{
    Frame, MAX_POLYLINE_PARTS, Polylines, Quality, RenderError, Renderer, WorldFace, WorldStroke,
};
use common::*;
use glam::{Mat4, Vec3};

fn stroke(from: [f32; 3], to: [f32; 3], width: f32) -> WorldStroke {
    let (from, to) = (Vec3::from(from), Vec3::from(to));
    WorldStroke { from, to, width, color: [255, 0, 0], cover: 1.0, pattern: 0 }
}

fn face(z: f32) -> WorldFace {
    let corners = [[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]];
    let corners = corners.map(|[x, y]| Vec3::new(x, y, z));
    WorldFace { corners, color: [0, 255, 0], cover: 1.0 }
}

fn shown(
    renderer: &mut Renderer,
    revision: u64,
    faces: &[WorldFace],
    strokes: &[WorldStroke],
) -> Vec<[u8; 4]> {
    let polylines = Some(Polylines { revision, faces, planes: &[], strokes });
    picture_of(renderer, &Frame { polylines, ..frame(&[]) })
}

fn picture_of(renderer: &mut Renderer, frame: &Frame<'_>) -> Vec<[u8; 4]> {
    let picture = picture(renderer, frame);
    picture.rgba8.chunks_exact(4).map(|p| [p[0], p[1], p[2], p[3]]).collect()
}

fn reds(pixels: &[[u8; 4]]) -> Vec<usize> {
    (0..pixels.len()).filter(|&at| pixels[at][0] > 200 && pixels[at][2] < 80).collect()
}

#[test]
fn a_line_is_as_wide_as_told_in_pixels_at_every_quality() {
    for samples in [1, 4] {
        for quality in [Quality::Low, Quality::Medium, Quality::High] {
            with_quality(quality, samples, |renderer| {
                let [width, height] = SIZE.map(|pixels| pixels as usize);
                for wide in [3.0, 6.0] {
                    let lines = [stroke([0.0, -9.0, 0.0], [0.0, 9.0, 0.0], wide)];
                    let pixels = shown(renderer, wide as u64, &[], &lines);
                    let row = height / 2 * width;
                    let across = reds(&pixels).into_iter().filter(|at| at / width * width == row);
                    let count = across.count() as f32;
                    assert!((count - wide).abs() <= 1.0, "{quality:?} {samples} {wide} {count}");
                }
            });
        }
    }
}

#[test]
fn what_lies_before_hides_and_what_comes_later_covers() {
    with_renderer(4, |renderer| {
        let mesh = quad(renderer, glowing([1.0, 1.0, 1.0]));
        let drawn = [instance(mesh, Mat4::IDENTITY, 1)];
        let mut seen = |z: f32, revision: u64| {
            let (faces, strokes) = ([face(z)], [stroke([-0.3, 0.0, z], [0.3, 0.0, z], 8.0)]);
            let polylines =
                Some(Polylines { revision, faces: &faces, planes: &[], strokes: &strokes });
            picture_of(renderer, &Frame { polylines, ..frame(&drawn) })
        };
        let center = SIZE[1] as usize / 2 * SIZE[0] as usize + SIZE[0] as usize / 2;
        let before = seen(0.5, 1);
        assert!(before[center][0] > 200 && before[center][1] < 60, "{:?}", before[center]);
        let behind = seen(-0.5, 2);
        assert!(behind[center].iter().all(|part| *part > 200), "{:?}", behind[center]);
    });
}

#[test]
fn patterns_leave_gaps_that_tell_them_apart() {
    with_renderer(1, |renderer| {
        let mut count = |pattern: u32| {
            let line = WorldStroke { pattern, ..stroke([-9.0, 0.0, 0.0], [9.0, 0.0, 0.0], 5.0) };
            reds(&shown(renderer, u64::from(pattern) + 10, &[], &[line])).len()
        };
        let [plain, dashed, mixed, dotted] = [0, 1, 2, 3].map(&mut count);
        let share = |part: usize| part as f32 / plain as f32;
        for (part, expected) in [(dashed, 0.64), (mixed, 0.64), (dotted, 0.45)] {
            assert!((share(part) - expected).abs() < 0.12, "{plain} {part} {expected}");
        }
    });
}

#[test]
fn lines_through_the_eye_and_of_no_length_do_no_harm() {
    with_renderer(4, |renderer| {
        let through = stroke([0.1, -0.2, -40.0], [0.1, -0.2, 400.0], 4.0);
        let point = stroke([0.0; 3], [0.0; 3], 4.0);
        let behind = stroke([0.0, 0.0, 300.0], [1.0, 0.0, 400.0], 4.0);
        let seen = reds(&shown(renderer, 1, &[], &[through])).len();
        assert!(seen > 0, "its part before the eye is seen");
        let before = shown(renderer, 2, &[], &[]);
        assert_eq!(shown(renderer, 3, &[], &[behind]), before);
        shown(renderer, 4, &[], &[point]);
    });
}

#[test]
fn too_many_are_refused_and_the_renderer_goes_on() {
    with_renderer(1, |renderer| {
        let many = vec![stroke([0.0; 3], [1.0; 3], 1.0); MAX_POLYLINE_PARTS + 1];
        let polylines = Some(Polylines { revision: 1, faces: &[], planes: &[], strokes: &many });
        let refused = renderer.draw(&Frame { polylines, ..frame(&[]) });
        assert!(matches!(refused, Err(RenderError::TooMany { .. })), "{refused:?}");
        let line = [stroke([0.0, -9.0, 0.0], [0.0, 9.0, 0.0], 3.0)];
        assert!(!reds(&shown(renderer, 2, &[], &line)).is_empty());
    });
}
