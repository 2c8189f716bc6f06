//! Vertex colours: what is shown of them.

#![allow(clippy::unwrap_used)]

mod common;

use busbar_gltf_import::ImportedModel;
use busbar_scene::{Texture, linear_from_srgb};
use common::{Builder, floats, shorts, square_with_image};
use glam::{Vec2, Vec3};
use serde_json::json;

/// Samples a texture as devices do: between the centres of pixels, in linear light.
fn sample(texture: &Texture, uv: Vec2) -> Vec3 {
    let size = Vec2::new(texture.width as f32, texture.height as f32);
    let at = (uv * size - 0.5).clamp(Vec2::ZERO, size - 1.0);
    let (low, share) = (at.floor(), at.fract());
    let pixel = |x: f32, y: f32| {
        let (x, y) = (x.min(size.x - 1.0) as u32, y.min(size.y - 1.0) as u32);
        let start = ((y * texture.width + x) * 4) as usize;
        let [r, g, b] = [0, 1, 2].map(|i| linear_from_srgb(texture.rgba8[start + i]));
        Vec3::new(r, g, b)
    };
    let row = |y: f32| pixel(low.x, y).lerp(pixel(low.x + 1.0, y), share.x);
    row(low.y).lerp(row(low.y + 1.0), share.y)
}

/// Colour that a triangle shows at a point, given by its shares of the corners.
fn shown(imported: &ImportedModel, triangle: usize, shares: [f32; 3]) -> Vec3 {
    let mesh = &imported.model.meshes[0];
    let section = mesh.sections.iter().find(|section| {
        let first = section.first_triangle as usize;
        (first..first + section.triangle_count as usize).contains(&triangle)
    });
    let material = &imported.model.materials[section.unwrap().material.unwrap() as usize];
    let [r, g, b, _] = material.base_color;
    let corners = mesh.triangles[triangle].map(|wedge| mesh.wedges.uv[wedge as usize]);
    let uv = corners.into_iter().zip(shares).map(|(uv, share)| uv * share).sum();
    let texture = material.base_color_texture;
    let texel = texture.map(|of| sample(&imported.model.textures[of.texture as usize], uv));
    Vec3::new(r, g, b) * texel.unwrap_or(Vec3::ONE)
}

const RED: [f32; 3] = [1.0, 0.0, 0.0];
const GREEN: [f32; 3] = [0.0, 1.0, 0.0];
const BLUE: [f32; 3] = [0.0, 0.0, 1.0];
const YELLOW: [f32; 3] = [1.0, 1.0, 0.0];

fn colored(colors: [[f32; 3]; 4], write: impl Fn(&mut Builder, &[[f32; 3]]) -> usize) -> Builder {
    let mut builder = Builder::square();
    let colors = write(&mut builder, &colors);
    builder.primitive()["attributes"]["COLOR_0"] = json!(colors);
    builder
}

fn as_floats(builder: &mut Builder, colors: &[[f32; 3]]) -> usize {
    builder.accessor(&floats(colors.as_flattened()), 5126, "VEC3", colors.len())
}

fn as_bytes(builder: &mut Builder, colors: &[[f32; 3]]) -> usize {
    let with_alpha = |&[r, g, b]: &[f32; 3]| [r, g, b, 1.0].map(|c| (c * 255.0) as u8);
    let bytes: Vec<u8> = colors.iter().flat_map(with_alpha).collect();
    let accessor = builder.accessor(&bytes, 5121, "VEC4", colors.len());
    builder.json["accessors"][accessor]["normalized"] = json!(true);
    accessor
}

fn as_shorts(builder: &mut Builder, colors: &[[f32; 3]]) -> usize {
    // Four bytes a vertex more than three components take, and not said to be normalised.
    let words = |&[r, g, b]: &[f32; 3]| [r, g, b, 0.0].map(|c| (c * 65_535.0) as u16);
    let words: Vec<u16> = colors.iter().flat_map(words).collect();
    let accessor = builder.accessor(&shorts(&words), 5123, "VEC3", colors.len());
    let view = builder.json["accessors"][accessor]["bufferView"].as_u64().unwrap() as usize;
    builder.json["bufferViews"][view]["byteStride"] = json!(8);
    accessor
}

#[test]
fn gradients_are_linear_over_each_triangle() {
    let corners = [RED, GREEN, BLUE, YELLOW];
    for write in [as_floats, as_bytes, as_shorts] {
        let imported = colored(corners, write).import();
        assert!(imported.report.notes.is_empty(), "{:?}", imported.report.notes);
        // Triangles may have a section each, in the order of the file.
        for (triangle, indices) in [[0, 1, 2], [0, 2, 3]].into_iter().enumerate() {
            for shares in [
                [1.0, 0.0, 0.0],
                [0.0, 1.0, 0.0],
                [0.0, 0.0, 1.0],
                [0.5, 0.25, 0.25],
                [0.1, 0.2, 0.7],
            ] {
                let expected: Vec3 = indices
                    .iter()
                    .zip(shares)
                    .map(|(&i, s)| Vec3::from_array(corners[i]) * s)
                    .sum();
                let shown = shown(&imported, triangle, shares);
                assert!(
                    shown.distance(expected) < 0.03,
                    "{triangle} {shares:?}: {shown} {expected}"
                );
            }
        }
    }
}

#[test]
fn flat_colours_are_materials_that_meshes_share() {
    let mut builder = colored([RED; 4], as_floats);
    let mut second = builder.json["meshes"][0].clone();
    let blue = as_floats(&mut builder, &[BLUE; 4]);
    second["primitives"][0]["attributes"]["COLOR_0"] = json!(blue);
    common::push(&mut builder.json["meshes"], second);
    let third = builder.json["meshes"][0].clone();
    common::push(&mut builder.json["meshes"], third);
    builder.json["nodes"] = json!([{ "mesh": 0 }, { "mesh": 1 }, { "mesh": 2 }]);
    builder.json["scenes"][0]["nodes"] = json!([0, 1, 2]);
    let model = builder.import().model;
    assert!(model.textures.is_empty());
    let colors: Vec<_> = model.materials.iter().map(|material| material.base_color).collect();
    assert_eq!(colors, [[1.0, 0.0, 0.0, 1.0], [0.0, 0.0, 1.0, 1.0]]);
    let of_meshes: Vec<_> = model.meshes.iter().map(|mesh| mesh.sections[0].material).collect();
    assert_eq!(of_meshes, [Some(0), Some(1), Some(0)]);
}

#[test]
fn colours_tint_the_material_and_its_texture() {
    let mut png = Vec::new();
    let pixels = image::RgbImage::from_pixel(1, 1, image::Rgb([255; 3]));
    pixels.write_to(&mut std::io::Cursor::new(&mut png), image::ImageFormat::Png).unwrap();
    let mut builder = square_with_image(&png);
    builder.json["materials"][0]["pbrMetallicRoughness"]["baseColorFactor"] =
        json!([0.5, 0.5, 0.5, 1]);
    let green = as_floats(&mut builder, &[GREEN; 4]);
    builder.primitive()["attributes"]["COLOR_0"] = json!(green);
    let imported = builder.import();
    assert!(shown(&imported, 0, [1.0, 0.0, 0.0]).distance(Vec3::new(0.0, 0.5, 0.0)) < 1e-3);
    assert!(imported.report.notes.is_empty(), "{:?}", imported.report.notes);
    let graded = as_floats(&mut builder, &[RED, GREEN, BLUE, RED]);
    builder.primitive()["attributes"]["COLOR_0"] = json!(graded);
    assert!(builder.import().report.notes[0].contains("coarser steps"));
}

#[test]
fn white_changes_nothing_and_odd_numbers_are_clamped() {
    let imported = colored([[1.0; 3]; 4], as_floats).import();
    assert!(imported.model.materials.is_empty());
    let imported = colored([[7.0, -1.0, f32::INFINITY]; 4], as_floats).import();
    assert_eq!(imported.model.materials[0].base_color, [1.0, 0.0, 1.0, 1.0]);
    let imported = colored([[f32::NAN, 0.0, 0.0]; 4], as_floats).import();
    assert!(imported.model.materials.is_empty());
}

#[test]
fn many_colours_stay_within_bounds() {
    // 30,000 triangles of pseudo-random corner colours, no three of which share a plane.
    let count = 90_000;
    let mut state = 1_u64;
    let mut random = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
        (state >> 40) as f32 / (1 << 24) as f32
    };
    let mut builder = Builder::new();
    let positions: Vec<f32> = (0..3 * count).map(|_| random()).collect();
    let colors: Vec<f32> = (0..3 * count).map(|_| random()).collect();
    let positions = builder.accessor(&floats(&positions), 5126, "VEC3", count);
    let colors = builder.accessor(&floats(&colors), 5126, "VEC3", count);
    *builder.primitive() = json!({ "attributes": { "POSITION": positions, "COLOR_0": colors } });
    let imported = builder.import();
    assert_eq!(imported.model.meshes[0].triangles.len(), count / 3);
    assert!(imported.model.materials.len() <= 32);
    assert!(imported.report.notes.iter().any(|note| note.contains("coarser steps")));
}
