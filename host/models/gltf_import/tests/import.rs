//! Import of well-formed and of odd files.

#![allow(clippy::unwrap_used)]

mod common;

use busbar_gltf_export::write_glb;
use busbar_gltf_import::{ImportLimits, ImportedModel, import_file};
use busbar_scene::{AlphaMode, Material, Model, Texture, TextureRef, Wrap};
use common::{Builder, SQUARE, floats, glb, import, import_json, shorts, square_with_image};
use glam::{DMat4, DQuat, DVec3, Vec2, Vec3};
use serde_json::{Value, json};

/// The triangles of mesh 0 as points.
fn triangles(imported: &ImportedModel) -> Vec<[[f32; 3]; 3]> {
    let mesh = &imported.model.meshes[0];
    let point = |position: u32| mesh.positions[position as usize].to_array();
    mesh.triangles.iter().map(|&t| mesh.corner_positions(t).map(point)).collect()
}

/// Corners of [`SQUARE`] as points.
fn corners<const N: usize>(indices: [[usize; 3]; N]) -> Vec<[[f32; 3]; 3]> {
    let point = |i: usize| [SQUARE[3 * i], SQUARE[3 * i + 1], SQUARE[3 * i + 2]];
    indices.map(|t| t.map(point)).to_vec()
}

const HALVES: [[usize; 3]; 2] = [[0, 1, 2], [0, 2, 3]];

fn note(imported: &ImportedModel, expected: &str) -> bool {
    imported.report.notes.iter().any(|n| n.contains(expected))
}

#[test]
fn a_square_of_either_container() {
    let builder = Builder::square();
    let text = builder.import();
    assert_eq!(triangles(&text), corners(HALVES));
    assert_eq!(text.model.nodes[0].name, "tank");
    assert_eq!(text.report.meshes[0].vertices_in, 4);
    assert!(text.report.notes.is_empty());

    let mut document = builder.document();
    let mut bin = floats(&SQUARE);
    bin.extend(shorts(&[0, 1, 2, 0, 2, 3]));
    document["buffers"][0].as_object_mut().unwrap().remove("uri");
    let binary = import(&glb(document.to_string().as_bytes(), &bin)).unwrap();
    assert_eq!(binary.model.meshes, text.model.meshes);
}

#[test]
fn indices_of_every_width() {
    for (component, bytes) in [
        (5121, vec![0, 1, 2, 0, 2, 3]),
        (5123, shorts(&[0, 1, 2, 0, 2, 3])),
        (5125, [0_u32, 1, 2, 0, 2, 3].iter().flat_map(|i| i.to_le_bytes()).collect()),
    ] {
        let mut builder = Builder::square();
        let indices = builder.accessor(&bytes, component, "SCALAR", 6);
        builder.primitive()["indices"] = json!(indices);
        assert_eq!(triangles(&builder.import()), corners(HALVES), "{component}");
    }
}

#[test]
fn strips_fans_and_plain_lists() {
    for (mode, indices, expected) in [
        (5, vec![0, 1, 3, 2], corners([[0, 1, 3], [1, 2, 3]])),
        (6, vec![0, 1, 2, 3], corners([[1, 2, 0], [2, 3, 0]])),
        (4, vec![2, 3, 0, 1], corners([[2, 3, 0]])),
        (5, vec![0, 1], vec![]),
    ] {
        let mut builder = Builder::square();
        let accessor = builder.accessor(&shorts(&indices), 5123, "SCALAR", indices.len());
        builder.primitive()["indices"] = json!(accessor);
        builder.primitive()["mode"] = json!(mode);
        let imported = builder.import();
        if expected.is_empty() {
            assert!(imported.model.meshes.is_empty() && note(&imported, "without triangles"));
            assert_eq!(imported.model.nodes[0].mesh, None);
            continue;
        }
        assert_eq!(triangles(&imported), expected, "mode {mode}");
        assert_eq!(note(&imported, "left over"), mode == 4);
    }
}

#[test]
fn without_indices_vertices_are_taken_in_order() {
    for (mode, expected) in [(4, corners([[0, 1, 2]])), (5, corners([[0, 1, 2], [1, 3, 2]]))] {
        let mut builder = Builder::square();
        builder.primitive().as_object_mut().unwrap().remove("indices");
        builder.primitive()["mode"] = json!(mode);
        assert_eq!(triangles(&builder.import()), expected);
    }
}

#[test]
fn interleaved_attributes() {
    let mut builder = Builder::square();
    let mut bytes = Vec::new();
    for (corner, uv) in SQUARE.chunks(3).zip([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]) {
        bytes.extend(floats(corner));
        bytes.extend([0_i8, 0, 127, 99].map(|b| b as u8));
        bytes.extend(shorts(&uv.map(|v: f32| (v * 65535.0) as u16)));
    }
    let view = builder.view(&bytes);
    builder.json["bufferViews"][view]["byteStride"] = json!(20);
    let attribute = |offset: u32, component: u32, shape: &str| {
        json!({ "bufferView": view, "byteOffset": offset, "componentType": component,
            "type": shape, "count": 4, "normalized": component != 5126 })
    };
    for (accessor, name) in [
        (attribute(0, 5126, "VEC3"), "POSITION"),
        (attribute(12, 5120, "VEC3"), "NORMAL"),
        (attribute(16, 5123, "VEC2"), "TEXCOORD_0"),
    ] {
        let index = common::push(&mut builder.json["accessors"], accessor);
        builder.primitive()["attributes"][name] = json!(index);
    }
    builder.json["extensionsRequired"] = json!(["KHR_mesh_quantization"]);
    builder.json["extensionsUsed"] = json!(["KHR_mesh_quantization"]);
    let imported = builder.import();
    assert_eq!(triangles(&imported), corners(HALVES));
    let wedges = &imported.model.meshes[0].wedges;
    assert!(wedges.normal.iter().all(|&n| n == Vec3::Z));
    assert_eq!(wedges.uv, [Vec2::ZERO, Vec2::X, Vec2::ONE, Vec2::Y]);
    assert!(imported.report.notes.is_empty());
}

#[test]
fn sparse_accessors_replace_elements_with_or_without_a_base() {
    let mut builder = Builder::square();
    let raised = builder.view(&floats(&[1., 1., 5., 0., 1., 6.]));
    let which = builder.view(&[2, 3]);
    let sparse = json!({ "count": 2, "indices": { "bufferView": which, "componentType": 5121 },
        "values": { "bufferView": raised } });
    builder.json["accessors"][0]["sparse"] = sparse;
    let heights = |imported: &ImportedModel| -> Vec<f32> {
        imported.model.meshes[0].positions.iter().map(|p| p.z).collect()
    };
    assert_eq!(heights(&builder.import()), [0.0, 0.0, 5.0, 6.0]);

    builder.json["accessors"][0].as_object_mut().unwrap().remove("bufferView");
    let imported = builder.import();
    assert_eq!(heights(&imported), [0.0, 5.0, 6.0], "vertices 0 and 1 are both at the origin");
    assert_eq!(imported.report.meshes[0].coincident_triangles, 1);
}

#[test]
fn bounds_that_lie_change_nothing() {
    let mut builder = Builder::square();
    builder.json["accessors"][0]["min"] = json!([9e9, 9e9, 9e9]);
    builder.json["accessors"][0]["max"] = json!([10000000000_u64, -1, 1e300]);
    assert_eq!(triangles(&builder.import()), corners(HALVES));
}

#[test]
fn primitives_that_share_one_vertex_array_read_what_they_name() {
    let mut builder = Builder::new();
    let many = builder.accessor(&floats(&[SQUARE; 1000].concat()), 5126, "VEC3", 4000);
    let mut primitives = Vec::new();
    for first in [0, 1996] {
        let indices = shorts(&[first, first + 1, first + 2]);
        let indices = builder.accessor(&indices, 5123, "SCALAR", 3);
        primitives.push(json!({ "attributes": { "POSITION": many }, "indices": indices }));
    }
    builder.json["meshes"][0]["primitives"] = json!(primitives);
    let imported = builder.import();
    assert_eq!(triangles(&imported), corners([[0, 1, 2], [0, 1, 2]]));
    assert_eq!(imported.model.meshes[0].sections.len(), 2);
    assert_eq!(imported.report.meshes[0].vertices_in, 6);
}

#[test]
fn transforms_and_hierarchy() {
    let mut builder = Builder::square();
    let half = std::f32::consts::FRAC_1_SQRT_2;
    builder.json["nodes"] = json!([
        { "name": "bushing", "mesh": 0, "translation": [1, 2, 3], "scale": [2, 2, 2],
            "rotation": [0, 0, half, half] },
        { "name": "transformer", "children": [2, 0] },
        { "name": "lid", "matrix": [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 7, 8, 9, 1] },
        { "name": "elsewhere" },
    ]);
    builder.json["scenes"] = json!([{ "nodes": [3] }, { "nodes": [1] }]);
    builder.json["scene"] = json!(1);
    let imported = builder.import();
    let nodes = &imported.model.nodes;
    let summary: Vec<_> = nodes.iter().map(|n| (n.name.as_str(), n.parent)).collect();
    assert_eq!(summary, [("transformer", None), ("lid", Some(0)), ("bushing", Some(0))]);
    assert_eq!(nodes[1].parent_from_node, DMat4::from_translation(DVec3::new(7., 8., 9.)));
    let placed = nodes[2].parent_from_node.transform_point3(DVec3::X);
    assert!(placed.distance(DVec3::new(1.0, 4.0, 3.0)) < 1e-6, "{placed}");
    let expected = DQuat::from_rotation_z(std::f64::consts::FRAC_PI_2);
    assert!(nodes[2].parent_from_node.to_scale_rotation_translation().1.dot(expected) > 0.9999);
    assert!(note(&imported, "1 x node skipped"));
}

#[test]
fn without_a_default_scene_all_scenes_and_without_scenes_all_roots() {
    let mut builder = Builder::square();
    builder.json["nodes"] = json!([{ "name": "a" }, { "name": "b" }, { "name": "c", "mesh": 0 }]);
    builder.json["scenes"] = json!([{ "nodes": [2, 0] }, { "nodes": [0] }]);
    builder.json.as_object_mut().unwrap().remove("scene");
    let names = |builder: &Builder| -> Vec<String> {
        builder.import().model.nodes.into_iter().map(|n| n.name).collect()
    };
    assert_eq!(names(&builder), ["c", "a"]);
    builder.json.as_object_mut().unwrap().remove("scenes");
    assert_eq!(names(&builder), ["a", "b", "c"]);
}

#[test]
fn names_become_unique_parts() {
    let mut builder = Builder::square();
    let named = |name: &str| json!({ "name": name });
    builder.json["nodes"] = json!([
        named("bushing"), named("bushing"), named("bushing#2"), named("bushing"),
        named("1U/1V\u{7}"), named("  "), {}, { "mesh": 0 }, named(&"ä".repeat(100)),
    ]);
    builder.json["scenes"][0]["nodes"] = (0..9).collect();
    let names: Vec<_> = builder.import().model.nodes.into_iter().map(|n| n.name).collect();
    let expected = ["bushing", "bushing#2", "bushing#2#2", "bushing#3", "1U_1V", "node 5"];
    assert_eq!(names[..4], expected[..4]);
    assert_eq!(names[4], "1U_1V_");
    assert_eq!(names[5..8], ["node 5", "node 6", "steel"]);
    assert_eq!(names[8], "ä".repeat(64));
}

#[test]
fn materials_and_their_textures() {
    let mut png = Vec::new();
    let pixels = image::RgbImage::from_raw(2, 1, vec![1, 2, 3, 4, 5, 6]).unwrap();
    pixels.write_to(&mut std::io::Cursor::new(&mut png), image::ImageFormat::Png).unwrap();
    let mut builder = square_with_image(&png);
    builder.json["materials"][0] = json!({
        "name": "porcelain",
        "pbrMetallicRoughness": {
            "baseColorFactor": [0.5, 0.25, 2.0, 0.5],
            "baseColorTexture": { "index": 0 },
            "metallicRoughnessTexture": { "index": 0, "texCoord": 1 },
            "metallicFactor": 0.5,
        },
        "normalTexture": { "index": 0 },
        "emissiveFactor": [0, 1, 0],
        "alphaMode": "MASK",
        "doubleSided": true,
    });
    common::push(
        &mut builder.json["materials"],
        json!({ "emissiveTexture": { "index": 0 },
        "emissiveFactor": [1, 1, 1], "alphaMode": "BLEND" }),
    );
    let second = json!({ "attributes": { "POSITION": 0 }, "indices": 1, "material": 1 });
    common::push(&mut builder.json["meshes"][0]["primitives"], second);
    let imported = builder.import();
    let texture = TextureRef { texture: 0, wrap: [Wrap::Clamp, Wrap::Mirror] };
    let porcelain = Material {
        name: "porcelain".into(),
        base_color: [0.5, 0.25, 1.0, 0.5],
        base_color_texture: Some(texture),
        metallic: 0.5,
        roughness: 1.0,
        metallic_roughness_texture: None,
        emissive: [0.0, 1.0, 0.0],
        double_sided: true,
        alpha: AlphaMode::Mask(0.5),
    };
    assert_eq!(imported.model.materials[0], porcelain);
    assert_eq!(imported.model.materials[1].emissive, [0.0; 3]);
    assert_eq!(imported.model.materials[1].alpha, AlphaMode::Blend);
    let expected = Texture { width: 2, height: 1, rgba8: vec![1, 2, 3, 255, 4, 5, 6, 255] };
    assert_eq!(imported.model.textures, [expected]);
    assert_eq!(imported.model.meshes[0].sections[0].material, Some(0));
    for expected in ["roughness texture ignored", "normal texture", "emissive texture"] {
        assert!(note(&imported, expected), "{:?}", imported.report.notes);
    }
}

#[test]
fn jpeg_files_beside_the_model() {
    let folder = tempfile::tempdir().unwrap();
    let mut jpeg = Vec::new();
    let pixels = image::RgbImage::from_pixel(16, 8, image::Rgb([200, 100, 50]));
    pixels.write_to(&mut std::io::Cursor::new(&mut jpeg), image::ImageFormat::Jpeg).unwrap();
    std::fs::write(folder.path().join("rusty tank.jpg"), jpeg).unwrap();
    let mut builder = square_with_image(b"");
    builder.json["images"] = json!([{ "uri": "rusty%20tank.jpg" }]);
    let path = folder.path().join("model.gltf");
    std::fs::write(&path, builder.bytes()).unwrap();
    let imported = import_file(&path, &ImportLimits::default()).unwrap();
    let texture = &imported.model.textures[0];
    assert_eq!((texture.width, texture.height), (16, 8));
    for (channel, expected) in texture.rgba8[..4].iter().zip([200, 100, 50, 255]) {
        assert!(channel.abs_diff(expected) < 4, "{:?}", &texture.rgba8[..4]);
    }
}

#[test]
fn large_pngs_are_read_whole() {
    let (width, height) = (4096, 2304);
    let mut png = Vec::new();
    let pixels = image::GrayImage::from_fn(width, height, |x, y| image::Luma([(x ^ y) as u8]));
    pixels.write_to(&mut std::io::Cursor::new(&mut png), image::ImageFormat::Png).unwrap();
    let imported = square_with_image(&png).import();
    let texture = &imported.model.textures[0];
    assert_eq!((texture.width, texture.height), (width, height));
    let last = texture.rgba8.last_chunk().unwrap();
    let level = ((width - 1) ^ (height - 1)) as u8;
    assert_eq!(*last, [level, level, level, 255]);
}

#[test]
fn what_has_no_place_is_skipped_and_said() {
    let mut builder = Builder::square();
    let nothing = json!({ "attributes": {}, "mode": 1 });
    builder.json["meshes"][0]["primitives"].as_array_mut().unwrap().push(nothing);
    builder.primitive()["attributes"]["_TEMPERATURE"] = json!(0);
    builder.primitive()["attributes"]["COLOR_1"] = json!(0);
    common::push(&mut builder.json["meshes"], json!({ "primitives": [] }));
    builder.json["cameras"] = json!([{ "type": "perspective",
        "perspective": { "yfov": 1.0, "znear": 0.1 } }]);
    builder.json["extensionsUsed"] = json!(["KHR_lights_punctual"]);
    builder.json["extras"] = json!({ "deep": [[[[1]]]], "much": 10000000000_u64 });
    let imported = builder.import();
    assert_eq!(triangles(&imported), corners(HALVES));
    for expected in [
        "1 x primitive without positions",
        "1 x further set of vertex colours",
        "1 x camera",
        "1 x mesh skipped: no node shows it",
        "extension 'KHR_lights_punctual' ignored",
    ] {
        assert!(note(&imported, expected), "{expected}: {:?}", imported.report.notes);
    }
}

#[test]
fn morph_targets_are_shown_at_their_default_weights() {
    let mut builder = Builder::square();
    let up = builder.accessor(&floats(&[0., 0., 2.].repeat(4)), 5126, "VEC3", 4);
    let right = builder.accessor(&floats(&[4., 0., 0.].repeat(4)), 5126, "VEC3", 4);
    let never = json!({ "POSITION": 99 });
    builder.primitive()["targets"] = json!([{ "POSITION": up }, never, { "POSITION": right }]);
    let shift = |builder: &Builder| builder.import().model.meshes[0].positions[0];
    assert_eq!(shift(&builder), Vec3::ZERO);
    builder.json["meshes"][0]["weights"] = json!([0.5, 0, 0.25]);
    assert_eq!(shift(&builder), Vec3::new(1.0, 0.0, 1.0));
    let far = builder.accessor(&floats(&[f32::MAX; 12]), 5126, "VEC3", 4);
    builder.primitive()["targets"][0]["POSITION"] = json!(far);
    let imported = builder.import();
    assert!(triangles(&imported).is_empty() && note(&imported, "2 x triangle left out"));
}

#[test]
fn an_empty_document_is_an_empty_model() {
    let imported = import_json(&json!({ "asset": { "version": "2.0" } })).unwrap();
    assert!(imported.model.nodes.is_empty() && imported.model.meshes.is_empty());
}

#[test]
fn what_is_exported_imports_as_it_was() {
    let mut builder = Builder::square();
    let third = std::f32::consts::FRAC_1_PI;
    let odd: Vec<f32> = SQUARE.iter().map(|v| v * third + 0.1).collect();
    let odd = builder.accessor(&floats(&odd), 5126, "VEC3", 4);
    let uvs = builder.accessor(&floats(&[0., third, 1., 0., 1., 1., 0., 1.]), 5126, "VEC2", 4);
    let second = json!({ "attributes": { "POSITION": odd, "TEXCOORD_0": uvs }, "indices": 1, "material": 0 });
    common::push(&mut builder.json["meshes"][0]["primitives"], second);
    builder.json["nodes"] = json!([
        { "name": "T1", "mesh": 0, "rotation": [0.1, 0.2, 0.3, 0.4], "children": [1] },
        { "name": "1U", "mesh": 0, "scale": [third, 1, 1] },
    ]);
    let strong = json!({ "KHR_materials_emissive_strength": { "emissiveStrength": 12.7 } });
    builder.json["materials"] = json!([{ "name": "steel", "emissiveFactor": [0.1, 0.2, 0.3],
        "alphaMode": "MASK", "alphaCutoff": 0.3, "extensions": strong }]);
    let mut model = builder.import().model;
    assert_eq!(model.materials[0].emissive, [0.1, 0.2, 0.3].map(|light: f32| light * 12.7));
    model.textures = vec![Texture { width: 1, height: 2, rgba8: (0..8).collect() }];
    model.materials[0].base_color_texture =
        Some(TextureRef { texture: 0, wrap: [Wrap::Mirror, Wrap::Repeat] });

    let file = write_glb(&model).unwrap();
    let again = import(&file).unwrap();
    let Model { meshes, features: _, materials, textures, nodes } = again.model;
    assert_eq!(meshes, model.meshes);
    assert_eq!(materials, model.materials);
    assert_eq!(textures, model.textures);
    assert_eq!(nodes, model.nodes);
    assert!(again.report.notes.is_empty());
}

#[test]
fn emitted_light_is_factor_times_strength() {
    let emitted = |material: Value| {
        let mut builder = Builder::square();
        builder.json["materials"] = json!([material]);
        builder.primitive()["material"] = json!(0);
        let imported = builder.import();
        (imported.model.materials[0].emissive, imported.report.notes.len())
    };
    let strong = |strength: Value| json!({ "KHR_materials_emissive_strength": { "emissiveStrength": strength } });
    let factor = [0.25, 0.5, 0.0];
    for (strength, expected) in [
        (json!(4), [1.0, 2.0, 0.0]),
        (json!(0), [0.0; 3]),
        (json!(null), factor),
        (json!(-3), [0.0; 3]),
        (json!("bright"), factor),
        (json!(1e300), [f32::MAX, f32::MAX, 0.0]),
    ] {
        let material = json!({ "emissiveFactor": factor, "extensions": strong(strength.clone()) });
        assert_eq!(emitted(material), (expected, 0), "{strength}");
    }
    assert_eq!(emitted(json!({ "emissiveFactor": factor })), (factor, 0));
    assert_eq!(emitted(json!({ "extensions": strong(json!(9)) })), ([0.0; 3], 0));
}
