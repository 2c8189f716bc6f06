//! Slender conductors, wires and rods below a pixel: whole lines that do not shimmer.

#![allow(clippy::unwrap_used, reason = "helpers of tests")]

mod common;

use std::f32::consts::TAU;

use busbar_geometry::{Mesh, RawPrimitive, weld};
use busbar_renderer::{DrawInstance, Picture, Renderer};
use busbar_scene::Material;
use common::*;
use glam::{Mat4, Vec3};

/// A quarter of a pixel wide where it is drawn.
const RADIUS: f32 = 0.0075;
/// Metres that a pixel of the test's picture shows of it.
const PIXEL: f32 = 0.0604;
/// The white of a wire, above the background.
const VISIBLE: u8 = 8;

/// A wire along x through the whole picture, in pieces as long as asked for.
fn wire(pieces: u32) -> Mesh {
    let mut primitive = RawPrimitive { material: Some(0), ..Default::default() };
    add_wire(&mut primitive, pieces);
    weld(&[primitive]).unwrap().0
}

fn add_wire(primitive: &mut RawPrimitive, pieces: u32) {
    const SIDES: u32 = 6;
    for piece in 0..pieces {
        let first = primitive.positions.len() as u32;
        for ring in 0..2 {
            let x = 6.0 * (piece + ring) as f32 / pieces as f32 - 3.0;
            for side in 0..SIDES {
                let (sin, cos) = (TAU * side as f32 / SIDES as f32).sin_cos();
                // Pieces do not touch: each is an island of its own.
                let gap = if ring == 0 { 1e-4 } else { 0.0 };
                primitive.positions.push(Vec3::new(x + gap, RADIUS * cos, RADIUS * sin));
            }
        }
        for side in 0..SIDES {
            let [a, b] = [side, (side + 1) % SIDES].map(|side| first + side);
            primitive.triangles.extend([[a, b, b + SIDES], [a, b + SIDES, a + SIDES]]);
        }
    }
}

/// A square plate behind the wire, above and below it.
fn add_plate(primitive: &mut RawPrimitive) {
    let first = primitive.positions.len() as u32;
    let corners = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]];
    primitive.positions.extend(corners.map(|[x, y]| Vec3::new(x, y, -0.5)));
    primitive.triangles.extend([[0, 1, 2], [0, 2, 3]].map(|t| t.map(|corner| first + corner)));
}

fn white() -> Material {
    Material { base_color: [1.0; 4], roughness: 1.0, metallic: 0.0, ..Material::default() }
}

/// By how much the pixels of a column differ from the background, all taken together.
fn weights(picture: &Picture) -> Vec<u32> {
    let red = |x: u32, y: u32| u32::from(pixel(picture, x, y)[0]);
    (0..SIZE[0]).map(|x| (0..SIZE[1]).map(|y| red(x, y)).sum()).collect()
}

/// Pictures of a wire that slants, so many times as thick, and moves up by parts of a pixel.
fn moved(renderer: &mut Renderer, mesh: Mesh, thicker: f32) -> Vec<Vec<u32>> {
    let model = upload(renderer, mesh, &[white()], &[]);
    let picture_at = |step: u32| {
        let up = Vec3::Y * (PIXEL * step as f32 / 8.0);
        let at = Mat4::from_translation(up)
            * Mat4::from_rotation_z(0.07)
            * Mat4::from_scale(Vec3::new(1.0, thicker, thicker));
        weights(&picture(renderer, &frame(&[instance(model, at, 1)])))
    };
    (0..8).map(picture_at).collect()
}

#[test]
fn a_wire_thinner_than_a_pixel_is_a_whole_line_wherever_it_is() {
    for samples in [1, 4] {
        with_each_quality(samples, |renderer| {
            // A quarter of a pixel wide, and a fifteenth.
            for weights in [1.0, 0.27].map(|by| moved(renderer, wire(1), by)).concat() {
                let least = weights.iter().min().unwrap();
                assert!(*least > u32::from(VISIBLE), "{samples}: a gap in {weights:?}");
            }
            // The same tube in stubs is not slender, and is drawn as it is: the test can fail.
            let gaps = moved(renderer, wire(60), 1.0).concat();
            assert!(gaps.contains(&0), "{samples}: stubs without a gap");
        });
    }
}

#[test]
fn with_samples_it_covers_as_much_as_it_is_wide() {
    with_each_quality(4, |renderer| {
        let mean = |weights: &[Vec<u32>]| {
            let all = weights.concat();
            f64::from(all.iter().sum::<u32>()) / all.len() as f64
        };
        let [widened, exact] = [1, 60].map(|pieces| mean(&moved(renderer, wire(pieces), 1.0)));
        // Stubs show the light of their own sides, and a line is seen in steps of samples.
        assert!((0.5..2.0).contains(&(widened / exact)), "{widened} instead of {exact}");
    });
}

#[test]
fn what_is_wider_than_two_pixels_is_drawn_as_it_is() {
    with_each_quality(1, |renderer| {
        let model = upload(renderer, wire(1), &[white()], &[]);
        let scale = |by: f32| Mat4::from_scale(Vec3::new(1.0, by, by));
        let width = |renderer: &mut Renderer, by| {
            let shown = picture(renderer, &frame(&[instance(model, scale(by), 1)]));
            (0..SIZE[1]).filter(|y| pixel(&shown, SIZE[0] / 2, *y)[0] > VISIBLE).count() as f32
        };
        for by in [16.0, 40.0] {
            let expected = 2.0 * RADIUS * by / PIXEL;
            let drawn = width(renderer, by);
            assert!((drawn - expected).abs() <= 1.0, "{drawn} pixels instead of {expected}");
        }
    });
}

#[test]
fn it_is_picked_where_it_is_seen() {
    with_renderer(1, |renderer| {
        let model = upload(renderer, wire(1), &[white()], &[]);
        let at = Mat4::from_rotation_z(0.07);
        let instances = [DrawInstance { object: 7, ..instance(model, at, 7) }];
        let shown = frame(&instances);
        let seen = picture(renderer, &shown);
        let all: Vec<[u32; 2]> =
            (0..SIZE[1]).flat_map(|y| (0..SIZE[0]).map(move |x| [x, y])).collect();
        let picked = renderer.pick_all(&shown).unwrap();
        let lit = |at: &[u32; 2]| pixel(&seen, at[0], at[1])[0] > VISIBLE;
        let seen: Vec<_> = all.iter().filter(|at| lit(at)).collect();
        assert!(seen.len() >= SIZE[0] as usize);
        for (at, id) in all.iter().zip(picked) {
            assert_eq!(id == Some(7), lit(at), "{at:?}");
        }
    });
}

#[test]
fn what_is_beside_a_wire_is_drawn_as_it_would_be_without() {
    for samples in [1, 4] {
        with_each_quality(samples, |renderer| {
            let mut upload_all = |parts: &[fn(&mut RawPrimitive)]| {
                let mut primitive = RawPrimitive { material: Some(0), ..Default::default() };
                parts.iter().for_each(|add| add(&mut primitive));
                upload(renderer, weld(&[primitive]).unwrap().0, &[white()], &[])
            };
            let wire: fn(&mut RawPrimitive) = |primitive| add_wire(primitive, 1);
            let together = upload_all(&[wire, add_plate]);
            let apart = [upload_all(&[add_plate]), upload_all(&[wire])];
            let at = Mat4::from_rotation_z(0.07);
            let one = [instance(together, at, 7)];
            let two = apart.map(|model| instance(model, at, 7));
            let stats = renderer.draw(&frame(&one)).unwrap();
            assert_eq!((stats.triangles, stats.draw_calls), (14, 2));
            let expected = picture(renderer, &frame(&two));
            assert_eq!(picture(renderer, &frame(&one)), expected, "{samples} samples");
            let [picked, alike] = [&one[..], &two].map(|of| renderer.pick_all(&frame(of)).unwrap());
            assert_eq!(picked, alike);
            assert!(picked.contains(&Some(7)) && picked.contains(&None));
        });
    }
}
