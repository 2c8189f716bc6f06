//! Pass splitting: passes of more triangles than a software rasterizer draws at a time.

#![allow(clippy::unwrap_used, reason = "helpers of tests")]

mod common;

use std::thread::available_parallelism;

use busbar_renderer::{DrawInstance, Picture, Renderer};
use common::*;
use glam::{Mat4, Quat, Vec3};

/// Quads a side of some 16,000 triangles, twice what a round takes for each core: see
/// `host/graphics/renderer/src/software.rs`.
const FINE: u32 = 90;

/// Columns beside each other and a pane before them, as grids of so many quads a side; the
/// picture, and whose its pixels are.
fn drawn(renderer: &mut Renderer, quads: u32) -> (Picture, Vec<Option<u32>>) {
    let column = upload(renderer, grid(quads, Some(0)), &[glowing([0.0, 0.6, 0.0])], &[]);
    let pane = upload(renderer, grid(quads, Some(0)), &[blended([0.7, 0.0, 0.0], 0.5)], &[]);
    let count = available_parallelism().unwrap().get() as u32 + 2;
    let width = 5.2 / count as f32;
    let column_at = |number: u32| {
        let at = Mat4::from_translation(Vec3::X * ((number as f32 + 0.5) * width - 2.6));
        let at = at * Mat4::from_scale(Vec3::new(0.4 * width, 1.5, 1.0));
        instance(column, at, number + 1)
    };
    let mut instances: Vec<DrawInstance> = (0..count).map(column_at).collect();
    let before = Mat4::from_scale_rotation_translation(
        Vec3::new(2.0, 0.5, 1.0),
        Quat::IDENTITY,
        Vec3::Z * 0.5,
    );
    instances.push(instance(pane, before, count + 1));
    let frame = frame(&instances);
    (picture(renderer, &frame), renderer.pick_all(&frame).unwrap())
}

#[test]
fn all_rounds_are_seen() {
    for samples in [1, 4] {
        with_each_quality(samples, |renderer| {
            let (coarse, coarse_ids) = drawn(renderer, 1);
            let (fine, fine_ids) = drawn(renderer, FINE);
            assert_ne!(center(&coarse), pixel(&coarse, 0, 0), "nothing is seen");
            assert_eq!(coarse_ids, fine_ids);
            for (at, expected) in coarse.rgba8.chunks_exact(4).enumerate() {
                let (x, y) = (at as u32 % coarse.width, at as u32 / coarse.width);
                assert_near(pixel(&fine, x, y), expected.try_into().unwrap(), 2);
            }
        });
    }
}
