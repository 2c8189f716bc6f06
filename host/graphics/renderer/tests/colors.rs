//! Vertex colours of plain materials at low quality.

#![allow(clippy::unwrap_used, reason = "helpers of tests")]

mod common;

use busbar_geometry::{RawPrimitive, weld};
use busbar_renderer::{Morph, Quality, Renderer};
use busbar_scene::Material;
use common::*;
use glam::{Mat4, Vec3};

const COLORS: [[f32; 3]; 5] =
    [[1.0, 0.0, 0.0], [0.2, 0.7, 0.1], [0.0, 0.0, 0.0], [0.003, 0.5, 1.0], [1.0, 1.0, 1.0]];

/// Quads beside each other, each of a material of its own; of the last one both sides are
/// shown, so that it has to be bound.
fn palette(renderer: &mut Renderer) -> busbar_renderer::ModelHandle {
    let materials: Vec<Material> = (0..)
        .zip(COLORS)
        .map(|(number, [red, green, blue])| Material {
            base_color: [red, green, blue, 1.0],
            metallic: [0.0, 1.0][number % 2],
            double_sided: number + 1 == COLORS.len(),
            ..Material::default()
        })
        .collect();
    let quad = |number: u32| {
        let left = 0.5 * number as f32 - 1.25;
        let corners = [[0.0, -0.5], [0.5, -0.5], [0.5, 0.5], [0.0, 0.5]];
        RawPrimitive {
            positions: corners.map(|[x, y]| Vec3::new(left + x, y, 0.0)).to_vec(),
            normals: vec![Vec3::Z; 4],
            triangles: vec![[0, 1, 2], [0, 2, 3]],
            material: Some(number),
            ..RawPrimitive::default()
        }
    };
    let quads: Vec<_> = (0..COLORS.len() as u32).map(quad).collect();
    upload(renderer, weld(&quads).unwrap().0, &materials, &[])
}

#[test]
fn they_are_drawn_together_and_look_as_they_do_alone() {
    for samples in [1, 4] {
        with_quality(Quality::Low, samples, |renderer| {
            let model = palette(renderer);
            let drawn = instance(model, Mat4::from_rotation_y(0.3), 1);
            // On its way, hardly gone yet: materials are bound.
            let morph = Some(Morph { coarser: 1, weight: 1e-6 });
            let bound = busbar_renderer::DrawInstance { morph, ..drawn };
            let mut pictures = Vec::new();
            let mut calls = Vec::new();
            for drawn in [drawn, bound] {
                let drawn = [drawn];
                let frame = frame(&drawn);
                calls.push(renderer.draw(&frame).unwrap().draw_calls);
                pictures.push(renderer.read_picture().unwrap());
            }
            assert_eq!(calls, [2, 5]);
            let [together, alone] = &*pictures else { unreachable!() };
            let mut seen = std::collections::BTreeSet::new();
            for (one, other) in together.rgba8.iter().zip(&alone.rgba8) {
                assert!(one.abs_diff(*other) <= 1, "{one} {other}");
            }
            for number in 0..COLORS.len() as u32 {
                seen.insert(pixel(together, 31 + 8 * number, SIZE[1] / 2));
            }
            assert_eq!(seen.len(), COLORS.len(), "{seen:?}");
        });
    }
}
