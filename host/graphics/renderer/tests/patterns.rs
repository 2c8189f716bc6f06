//! Patterns of tints: told apart without colour, as legible far away as near, and while the scene
//! is drawn at reduced resolution.

mod common;

use busbar_renderer::{
    DrawInstance, Frame, MIN_SCENE_RESOLUTION, PATTERNS, Picture, Renderer, highlight_with_pattern,
};
use busbar_scene::Material;
use common::*;
use glam::{Mat4, Vec3};

/// Levels of grey by which a pixel is seen to differ.
const VISIBLE: f32 = 14.0;
/// The share of a surface that differs where two of its states do.
const MIN_SHARE: f32 = 0.15;
/// Tint strength of a legend's states.
const STRENGTH: f32 = 0.85;

/// Luma (ITU-R BT.709) of each pixel.
fn grey(picture: &Picture) -> Vec<f32> {
    let luma =
        |p: &[u8]| 0.2126 * f32::from(p[0]) + 0.7152 * f32::from(p[1]) + 0.0722 * f32::from(p[2]);
    picture.rgba8.chunks_exact(4).map(luma).collect()
}

/// The share of the pixels of `shape` at which two pictures differ in grey.
fn differing(a: &Picture, b: &Picture, shape: &[bool]) -> f32 {
    let (a, b) = (grey(a), grey(b));
    let differs = |at: &usize| (a[*at] - b[*at]).abs() > VISIBLE;
    let within: Vec<usize> = (0..shape.len()).filter(|&at| shape[at]).collect();
    within.iter().copied().filter(|at| differs(at)).count() as f32 / within.len() as f32
}

#[test]
fn every_pair_of_patterns_is_told_apart_in_grey_near_and_far() {
    with_each_quality(4, |renderer| {
        let model =
            quad(renderer, Material { base_color: [0.6, 0.6, 0.6, 1.0], ..Default::default() });
        for (scale, scene_resolution) in [(1.0, 1.0), (0.5, 1.0), (1.0, MIN_SCENE_RESOLUTION)] {
            let world_from_mesh = Mat4::from_scale(Vec3::splat(scale));
            let with =
                |highlight| DrawInstance { highlight, ..instance(model, world_from_mesh, 1) };
            let shown = |renderer: &mut Renderer, instances: &[DrawInstance]| {
                picture(renderer, &Frame { scene_resolution, ..frame(instances) })
            };
            let background = shown(renderer, &[]);
            let bare = shown(renderer, &[with([0.0; 4])]);
            let pixels = bare.rgba8.chunks_exact(4).zip(background.rgba8.chunks_exact(4));
            let shape: Vec<bool> = pixels.map(|(a, b)| a != b).collect();
            // One colour for all: that it differs must not be what tells them apart.
            let color = [0.05, 0.05, 0.05];
            let pictures: Vec<Picture> = (0..PATTERNS)
                .map(|pattern| highlight_with_pattern(color, STRENGTH, pattern))
                .map(|highlight| shown(renderer, &[with(highlight)]))
                .chain([bare])
                .collect();
            for a in 0..pictures.len() {
                for b in a + 1..pictures.len() {
                    let share = differing(&pictures[a], &pictures[b], &shape);
                    assert!(
                        share > MIN_SHARE,
                        "{a} and {b} at {scale}, {scene_resolution}: {share}"
                    );
                }
            }
        }
    });
}

#[test]
fn a_pattern_lies_on_the_screen() {
    with_renderer(1, |renderer| {
        let model = quad(renderer, glowing([0.3; 3]));
        let highlight = highlight_with_pattern([0.9, 0.1, 0.1], 1.0, 1);
        let at = |x: f32| {
            let world_from_mesh = Mat4::from_translation(Vec3::X * x);
            DrawInstance { highlight, ..instance(model, world_from_mesh, 1) }
        };
        let here = picture(renderer, &frame(&[at(0.0)]));
        let there = picture(renderer, &frame(&[at(0.137)]));
        // The same marks where both show the quad, whatever the quad does below them.
        let [x, y] = SIZE.map(|pixels| pixels / 2);
        for dx in 0..12 {
            assert_eq!(pixel(&here, x + dx, y), pixel(&there, x + dx, y));
        }
    });
}
