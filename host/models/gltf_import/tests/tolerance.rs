//! Files that are odd where nothing is shown, or where what is meant is clear: each loads.

#![allow(clippy::unwrap_used)]

mod common;

use busbar_gltf_import::{ImportLimits, ImportedModel, import_bytes, import_file};
use common::{Builder, SQUARE, floats, glb, import, push, shorts, square_with_image};
use serde_json::{Value, json};

fn triangles(imported: &ImportedModel) -> usize {
    imported.model.meshes.iter().map(|mesh| mesh.triangles.len()).sum()
}

fn has_note(imported: &ImportedModel, expected: &str) -> bool {
    imported.report.notes.iter().any(|note| note.contains(expected))
}

/// Imports the square with a changed document; both of its triangles must be shown.
fn changed(change: impl FnOnce(&mut Value)) -> ImportedModel {
    let mut document = Builder::square().document();
    change(&mut document);
    let imported = import(document.to_string().as_bytes()).unwrap();
    assert_eq!(triangles(&imported), 2);
    imported
}

#[test]
fn extensions_that_refine_the_look_are_remarked_on_once() {
    for name in [
        "KHR_materials_unlit",
        "KHR_materials_ior",
        "KHR_materials_variants",
        "KHR_materials_transmission",
        "KHR_materials_clearcoat",
        "KHR_materials_sheen",
        "KHR_materials_specular",
        "KHR_materials_volume",
        "KHR_materials_iridescence",
        "KHR_materials_anisotropy",
        "KHR_materials_dispersion",
        "KHR_lights_punctual",
        "KHR_node_visibility",
        "KHR_animation_pointer",
        "KHR_xmp_json_ld",
        "EXT_texture_avif",
    ] {
        let imported = changed(|d| {
            d["extensionsUsed"] = json!([name, name]);
            d["extensionsRequired"] = json!([name]);
        });
        let [note] = imported.report.notes.as_slice() else { panic!("{name}") };
        assert!(note.starts_with("1 x extension") && note.contains(name), "{note}");
    }
}

#[test]
fn what_nobody_shows_may_be_odd() {
    for (member, value) in [
        ("animations", json!([{}, { "channels": [{ "target": { "path": "tint" } }] }, 7])),
        ("skins", json!([{}, { "joints": [99] }])),
        ("cameras", json!([{ "type": "fisheye" }, null])),
        ("samplers", json!([{ "wrapS": 1, "magFilter": "blurred" }])),
        ("images", json!([{ "uri": "..\\x.png" }, { "uri": "http://a/b" }, {}])),
        ("textures", json!([{ "source": 42 }])),
        ("materials", json!([{ "alphaMode": "GLASS" }, 1, { "pbrMetallicRoughness": 2 }])),
        ("extras", json!([1, { "a": null }])),
        ("extensions", json!({ "ACME_x": 3 })),
        ("materials", Value::Null),
        ("unknown", json!({ "deep": [[[[]]]] })),
    ] {
        changed(|d| d[member] = value);
    }
    for extras in [json!(true), json!("text"), json!(1.5), json!(null), json!([[]])] {
        changed(|d| {
            d["extras"] = extras.clone();
            d["asset"]["extras"] = extras.clone();
            d["nodes"][0]["extras"] = extras.clone();
            d["meshes"][0]["primitives"][0]["extras"] = extras;
        });
    }
    changed(|d| {
        push(&mut d["buffers"], json!({ "byteLength": 9 }));
        push(&mut d["bufferViews"], json!({ "buffer": 77 }));
        push(&mut d["accessors"], json!({ "type": "VEC9" }));
        push(&mut d["nodes"], json!({ "camera": 4, "children": [2] }));
        d["accessors"][0]["min"] = json!(["nan", {}]);
        d["nodes"][0]["name"] = json!(null);
        d["buffers"][0]["byteLength"] = json!(1000);
    });
}

#[test]
fn a_scene_without_nodes_is_empty() {
    let mut builder = Builder::square();
    builder.json["scenes"] = json!([{ "name": "x" }]);
    assert!(builder.import().model.nodes.is_empty());
}

#[test]
fn whole_numbers_may_be_written_as_floats() {
    let text = Builder::square().document().to_string();
    for (whole, float) in [
        ("\"count\":4", "\"count\":4.0"),
        ("\"count\":6", "\"count\":0.6e1"),
        ("\"componentType\":5126", "\"componentType\":5126.0"),
        ("\"byteLength\":48", "\"byteLength\":4.8E1"),
        ("\"mesh\":0", "\"mesh\":0.0"),
        ("\"nodes\":[0]", "\"nodes\":[0.0]"),
        ("\"scene\":0", "\"scene\":0.0"),
    ] {
        assert!(text.contains(whole), "{whole}");
        assert_eq!(triangles(&import(text.replace(whole, float).as_bytes()).unwrap()), 2);
    }
    let error = import(text.replace("\"count\":4", "\"count\":4.5").as_bytes()).unwrap_err();
    assert!(error.to_string().contains("4.5 is not a whole number"), "{error}");
}

#[test]
fn alpha_modes_are_read_in_any_case() {
    let imported = changed(|d| {
        d["materials"] = json!([{ "alphaMode": "Blend" }]);
        d["meshes"][0]["primitives"][0]["material"] = json!(0);
    });
    assert_eq!(imported.model.materials[0].alpha, busbar_scene::AlphaMode::Blend);
}

#[test]
fn short_optional_attributes_are_remarked_on() {
    let mut builder = Builder::square();
    let normals = builder.accessor(&floats(&[1.0; 9]), 5126, "VEC3", 3);
    builder.primitive()["attributes"]["NORMAL"] = json!(normals);
    let imported = builder.import();
    assert_eq!(imported.model.meshes[0].wedges.normal[0], glam::Vec3::Z);
    assert!(has_note(&imported, "1 x attribute with too few elements"));
}

#[test]
fn triangles_without_coordinates_are_left_out_and_counted() {
    for bad in [f32::NAN, f32::INFINITY, -1e30] {
        let mut builder = Builder::square();
        let mut points = [SQUARE.as_slice(), &[bad; 3]].concat();
        let odd = builder.accessor(&floats(&points), 5126, "VEC3", 5);
        builder.primitive()["attributes"]["POSITION"] = json!(odd);
        let unused = builder.import();
        assert_eq!(triangles(&unused), 2);
        assert!(unused.report.notes.is_empty(), "{:?}", unused.report.notes);
        // Vertex 1 is a corner of the first triangle alone.
        points[4] = bad;
        let used = builder.accessor(&floats(&points), 5126, "VEC3", 5);
        builder.primitive()["attributes"]["POSITION"] = json!(used);
        let used = builder.import();
        assert_eq!(triangles(&used), 1);
        assert!(has_note(&used, "1 x triangle left out"), "{:?}", used.report.notes);
    }
}

#[test]
fn text_may_have_a_mark_zeros_or_slips() {
    let text = Builder::square().document().to_string();
    let marked = [b"\xEF\xBB\xBF", text.as_bytes(), b"\0\0\0"].concat();
    assert!(import(&marked).unwrap().report.notes.is_empty());
    let utf16: Vec<u8> =
        format!("\u{FEFF}{text}").encode_utf16().flat_map(u16::to_le_bytes).collect();
    assert!(has_note(&import(&utf16).unwrap(), "UTF-16"));
    let latin1 = text.replace("tank", "t\u{1}nk").replace("\\u0001", "\u{1}").into_bytes();
    let latin1: Vec<u8> = latin1.into_iter().map(|b| if b == 1 { 0xE4 } else { b }).collect();
    assert_eq!(import(&latin1).unwrap().model.nodes[0].name, "t\u{FFFD}nk");
    for slip in [
        format!("// made by hand\n{text}"),
        format!("/* made // by hand */{text}"),
        text.replace("\"name\":\"tank\"", "\"name\":\"tank\",/**/"),
        text.replace("\"nodes\":[0]", "\"nodes\":[0 , ]"),
        text.replace("\"count\":4", "\"max\":[NaN,-Infinity,inf],\"count\":4"),
    ] {
        let imported = import(slip.as_bytes()).unwrap();
        assert_eq!(triangles(&imported), 2);
        assert!(has_note(&imported, "JSON with comments"));
    }
    // What looks like a slip within a text is text.
    let named = text.replace("tank", "a,] // NaN \\\" /*");
    assert_eq!(import(named.as_bytes()).unwrap().model.nodes[0].name, "a,] __ NaN \" _*");
    for version in ["\"2\"", "2.0", "2", "\"2.9\""] {
        let text = text.replace("\"version\":\"2.0\"", &format!("\"version\":{version}"));
        assert_eq!(triangles(&import(text.as_bytes()).unwrap()), 2);
    }
}

#[test]
fn containers_may_be_padded_with_zeros_and_know_no_length() {
    let mut document = Builder::square().document();
    let mut bin = floats(&SQUARE);
    bin.extend(shorts(&[0, 1, 2, 0, 2, 3]));
    document["buffers"][0].as_object_mut().unwrap().remove("uri");
    let padded = [document.to_string().as_bytes(), &[0; 5]].concat();
    let mut file = glb(&padded, &bin);
    assert!(import(&file).unwrap().report.notes.is_empty());
    file[8..12].fill(0);
    assert!(has_note(&import(&file).unwrap(), "GLB whose header says no length"));
}

#[test]
fn nodes_are_shown_once_however_often_they_are_named() {
    let parents = |nodes: Value, roots: Value| {
        let imported = changed(|d| {
            d["nodes"] = nodes;
            d["scenes"] = json!([{ "nodes": roots }]);
        });
        let parents: Vec<_> =
            imported.model.nodes.iter().map(|n| (n.name.clone(), n.parent)).collect();
        (parents, imported.report.notes.join("; "))
    };
    let named = |name: &str, parent| (name.to_owned(), parent);
    let leaf = json!({ "name": "leaf", "mesh": 0 });
    let a = json!({ "name": "a", "children": [2] });
    let b = json!({ "name": "b", "children": [2, 2] });
    let (nodes, notes) = parents(json!([a, b, leaf]), json!([0, 1]));
    assert_eq!(nodes, [named("a", None), named("b", None), named("leaf", Some(1))]);
    assert!(notes.contains("1 x node with several parents") && notes.contains("child named twice"));
    let (nodes, notes) = parents(json!([a, b, leaf]), json!([0, 2]));
    assert_eq!(nodes, [named("a", None), named("leaf", None)]);
    assert!(notes.contains("root of the scene that is also a child"));
    let (nodes, _) = parents(json!([leaf, { "children": [1] }]), json!([0, 0]));
    assert_eq!(nodes, [named("leaf", None)]);
}

#[test]
fn doubled_levels_do_not_multiply() {
    // Two children a level, both with the same two children: 2^31 paths.
    let mut doubled = vec![json!({ "mesh": 0, "children": [1, 2] })];
    for level in 0..31 {
        let next = 2 * level + 3;
        let below = if level < 30 { json!({ "children": [next, next + 1] }) } else { json!({}) };
        doubled.extend([below.clone(), below]);
    }
    assert_eq!(changed(|d| d["nodes"] = json!(doubled)).model.nodes.len(), 63);
}

#[test]
fn many_levels_and_many_nodes_are_shown() {
    let chain = |i: u32| match i {
        299 => json!({ "mesh": 0 }),
        _ => json!({ "children": [i + 1] }),
    };
    let deep = changed(|d| d["nodes"] = (0..300).map(chain).collect());
    assert_eq!(deep.model.nodes.len(), 300);

    let mut document = Builder::square().document();
    document["nodes"] = json!("HERE");
    document.as_object_mut().unwrap().remove("scenes");
    document.as_object_mut().unwrap().remove("scene");
    let nodes = vec![r#"{"mesh":0}"#; 1_000_000].join(",");
    let text = document.to_string().replace("\"HERE\"", &format!("[{nodes}]"));
    assert_eq!(import(text.as_bytes()).unwrap().model.nodes.len(), 1_000_000);
}

#[test]
fn meshes_may_share_all_of_their_accessors() {
    let mut builder = Builder::new();
    let count = 500;
    let positions: Vec<f32> =
        (0..count + 2).flat_map(|i| [i as f32, (i % 2) as f32, 0.0]).collect();
    let positions = builder.accessor(&floats(&positions), 5126, "VEC3", count + 2);
    let strip = json!({ "attributes": { "POSITION": positions }, "mode": 5 });
    builder.json["meshes"] = json!(vec![json!({ "primitives": [strip] }); 40]);
    builder.json["nodes"] = (0..40).map(|mesh| json!({ "mesh": mesh })).collect();
    builder.json["scenes"][0]["nodes"] = (0..40).collect();
    let bytes = builder.bytes();
    assert!(bytes.len() < 16 << 10);
    assert_eq!(triangles(&import(&bytes).unwrap()), 40 * count);
}

#[test]
fn accessors_without_data_are_zeros() {
    let mut builder = Builder::square();
    let zeros = json!({ "componentType": 5126, "type": "VEC3", "count": 4 });
    let zeros = push(&mut builder.json["accessors"], zeros);
    builder.primitive()["attributes"]["NORMAL"] = json!(zeros);
    let imported = builder.import();
    assert_eq!(imported.model.meshes[0].wedges.normal[0], glam::Vec3::Z);
    builder.primitive()["attributes"]["POSITION"] = json!(zeros);
    assert_eq!(triangles(&builder.import()), 0);
}

#[test]
fn strips_begin_anew_at_the_restart_value() {
    let mut builder = Builder::square();
    let indices = builder.accessor(&[0, 1, 2, 255, 0, 2, 3], 5121, "SCALAR", 7);
    builder.primitive()["indices"] = json!(indices);
    builder.primitive()["mode"] = json!(5);
    let imported = builder.import();
    assert_eq!(triangles(&imported), 2);
    assert!(has_note(&imported, "restart value"));
}

#[test]
fn images_that_cannot_be_had_are_checkers() {
    let folder = tempfile::tempdir().unwrap();
    let mut png = Vec::new();
    let pixels = image::RgbImage::from_pixel(1, 1, image::Rgb([9, 8, 7]));
    pixels.write_to(&mut std::io::Cursor::new(&mut png), image::ImageFormat::Png).unwrap();
    std::fs::create_dir(folder.path().join("textures")).unwrap();
    for name in ["textures/a.png", "x%20y.png", "a b.png", "100%.png", "t:1.png", "ä.png"] {
        std::fs::write(folder.path().join(name), &png).unwrap();
    }
    let shown = |uri: Value| {
        let mut builder = square_with_image(b"");
        builder.json["images"] = json!([{ "uri": uri }]);
        let path = folder.path().join("model.gltf");
        std::fs::write(&path, builder.bytes()).unwrap();
        let imported = import_file(&path, &ImportLimits::default()).unwrap();
        assert_eq!(triangles(&imported), 2);
        let first = imported.model.textures[0].rgba8[..3].to_vec();
        (first == [9, 8, 7], imported.report.notes)
    };
    for uri in [
        "textures\\a.png",
        "x%20y.png",
        "a%20b.png",
        "a b.png",
        "100%.png",
        "t:1.png",
        "%C3%A4.png",
    ] {
        let (is_shown, notes) = shown(json!(uri));
        assert!(is_shown && notes.is_empty(), "{uri}: {notes:?}");
    }
    for uri in [
        "../a.png",
        "..\\a.png",
        "C:\\a.png",
        "C:/a.png",
        "file:///etc/passwd",
        "http://example.org/a.png",
        "",
        "%FF%.png",
        "/etc/passwd",
        "data:image/png;base64,!!",
        "data:image/png",
    ] {
        let (is_shown, notes) = shown(json!(uri));
        assert!(!is_shown && notes[0].starts_with("1 x texture shown as a checker"), "{notes:?}");
    }
    assert!(shown(json!(7)).1[0].contains("neither a URI nor"));
}

#[test]
fn images_of_unknown_extensions_are_checkers() {
    let mut builder = square_with_image(b"\0\0\0 ftypavif");
    builder.json["extensionsRequired"] = json!(["EXT_texture_avif"]);
    builder.json["textures"] = json!([{ "extensions": { "EXT_texture_avif": { "source": 0 } } }]);
    let imported = builder.import();
    assert!(imported.model.materials[0].base_color_texture.is_some());
    assert!(has_note(&imported, "shown as a checker"));
}

#[test]
fn images_of_few_bits_are_whole_pictures() {
    for (depth, color) in [(1, png::ColorType::Grayscale), (1, png::ColorType::Indexed)] {
        let mut bytes = Vec::new();
        let mut encoder = png::Encoder::new(&mut bytes, 2048, 2048);
        encoder.set_color(color);
        encoder.set_depth(png::BitDepth::from_u8(depth).unwrap());
        encoder.set_palette(vec![1, 2, 3, 200, 100, 50]);
        encoder.set_compression(png::Compression::High);
        let mut writer = encoder.write_header().unwrap();
        writer.write_image_data(&vec![0xFF; 2048 / 8 * 2048]).unwrap();
        writer.finish().unwrap();
        let imported = square_with_image(&bytes).import();
        assert_eq!(imported.report.notes, Vec::<String>::new(), "{}", bytes.len());
        assert_eq!(imported.model.textures[0].width, 2048);
    }
}

#[test]
fn images_with_too_many_pixels_are_scaled_down() {
    // Wider than a texture may be: every pixel is the mean of two by two.
    let mut png = Vec::new();
    let grey = |x: u32, _| image::Luma([if x.is_multiple_of(2) { 100 } else { 200 }]);
    let pixels = image::GrayImage::from_fn(10_000, 4, grey);
    pixels.write_to(&mut std::io::Cursor::new(&mut png), image::ImageFormat::Png).unwrap();
    let wide = square_with_image(&png).import();
    let texture = &wide.model.textures[0];
    assert_eq!((texture.width, texture.height), (5000, 2));
    assert!(texture.rgba8.as_chunks().0.iter().all(|pixel| *pixel == [150, 150, 150, 255]));
    assert!(has_note(&wide, "1 x texture scaled down"));

    let mut jpeg = Vec::new();
    let pixels = image::RgbImage::from_pixel(64, 32, image::Rgb([10, 20, 30]));
    pixels.write_to(&mut std::io::Cursor::new(&mut jpeg), image::ImageFormat::Jpeg).unwrap();
    let limits = ImportLimits { max_texture_pixels: 600, ..ImportLimits::default() };
    let small = import_bytes(&square_with_image(&jpeg).bytes(), None, &limits).unwrap();
    let texture = &small.model.textures[0];
    assert_eq!((texture.width, texture.height), (32, 16));
}

#[test]
fn odd_samplers_repeat_and_the_older_clamp_clamps() {
    use busbar_scene::Wrap;
    let mut builder = square_with_image(b"");
    builder.json["samplers"] = json!([{ "wrapS": 10496, "wrapT": 5 }]);
    let imported = builder.import();
    let texture = imported.model.materials[0].base_color_texture.unwrap();
    assert_eq!(texture.wrap, [Wrap::Clamp, Wrap::Repeat]);
    assert!(has_note(&imported, "unknown wrapping mode"));
}

#[test]
fn messages_name_no_type_of_a_language() {
    let text = Builder::square().document().to_string();
    for (from, to) in [
        ("\"count\":4", "\"count\":\"four\""),
        ("\"count\":4", "\"count\":null"),
        ("\"nodes\":[0]", "\"nodes\":{}"),
        ("\"mesh\":0", "\"mesh\":[]"),
        ("\"mesh\":0", "\"mesh\":0,\"scale\":[1,1]"),
        ("\"mesh\":0", "\"mesh\":0,\"scale\":true"),
        ("\"accessors\":[", "\"accessors\":[3,"),
        ("\"version\":\"2.0\"", "\"version\":[]"),
        ("\"attributes\":{", "\"attributes\":3,\"x\":{"),
    ] {
        assert!(text.contains(from), "{from}");
        let message = import(text.replace(from, to).as_bytes()).unwrap_err().to_string();
        for of_rust in ["u32", "u64", "usize", "f32", "struct", "Option", "::", "newtype", "unit"] {
            assert!(!message.contains(of_rust), "{message}");
        }
    }
}

#[test]
fn specular_glossiness_is_converted() {
    let of = |glossy: Value| {
        changed(|d| {
            d["extensionsRequired"] = json!(["KHR_materials_pbrSpecularGlossiness"]);
            let extensions = json!({ "KHR_materials_pbrSpecularGlossiness": glossy });
            d["materials"] = json!([{ "extensions": extensions }]);
            d["meshes"][0]["primitives"][0]["material"] = json!(0);
        })
        .model
        .materials[0]
            .clone()
    };
    let paint = of(json!({ "diffuseFactor": [0.5, 0.25, 0.125, 1], "glossinessFactor": 0.75,
        "specularFactor": [0.04, 0.04, 0.04] }));
    assert!((paint.roughness - 0.25).abs() < 1e-6 && paint.metallic < 0.01);
    for (channel, expected) in paint.base_color.iter().zip([0.5, 0.25, 0.125, 1.0]) {
        assert!((channel - expected).abs() < 0.02, "{:?}", paint.base_color);
    }
    let gold = of(json!({ "diffuseFactor": [0, 0, 0, 1], "specularFactor": [1.0, 0.8, 0.3] }));
    assert!(gold.metallic > 0.9 && gold.base_color[2] < 0.4, "{gold:?}");
}

#[test]
fn one_image_named_often_is_decoded_a_few_times() {
    let mut png = Vec::new();
    let pixels = image::GrayImage::new(1024, 1024);
    pixels.write_to(&mut std::io::Cursor::new(&mut png), image::ImageFormat::Png).unwrap();
    let mut builder = square_with_image(&png);
    let count = 50;
    builder.json["images"] = json!(vec![builder.json["images"][0].clone(); count]);
    builder.json["textures"] = (0..count).map(|image| json!({ "source": image })).collect();
    let material = |i| json!({ "pbrMetallicRoughness": { "baseColorTexture": { "index": i } } });
    builder.json["materials"] = (0..count).map(material).collect();
    let primitive = |i| json!({ "attributes": { "POSITION": 0 }, "indices": 1, "material": i });
    builder.json["meshes"][0]["primitives"] = (0..count).map(primitive).collect();
    let limits = ImportLimits { max_texture_pixels: 1 << 20, ..ImportLimits::default() };
    let imported = import_bytes(&builder.bytes(), None, &limits).unwrap();
    let textures = &imported.model.textures;
    assert_eq!(textures.len(), count);
    let pixels: u32 = textures.iter().map(|texture| texture.width * texture.height).sum();
    assert!(pixels <= 1 << 20, "{pixels}");
    let checkers = textures.iter().filter(|texture| texture.width == 16).count();
    assert!((40..count).contains(&checkers), "{checkers}");
}

#[test]
fn embedded_buffers_are_parsed_once() {
    // Fifty megabytes of text, which a thousand accessors are in.
    let mut builder = Builder::square();
    builder.view(&vec![0; 36 << 20]);
    let square = builder.json["accessors"].clone();
    let primitive = |i: usize| json!({ "attributes": { "POSITION": 2 * i }, "indices": 2 * i + 1 });
    builder.json["accessors"] = (0..500).flat_map(|_| square.as_array().unwrap().clone()).collect();
    builder.json["meshes"][0]["primitives"] = (0..500).map(primitive).collect();
    let bytes = builder.bytes();
    let start = std::time::Instant::now();
    let imported = import(&bytes).unwrap();
    assert_eq!(triangles(&imported), 1000);
    // Parsing it a thousand times takes a minute.
    assert!(start.elapsed().as_secs() < 20, "{:?}", start.elapsed());
}
