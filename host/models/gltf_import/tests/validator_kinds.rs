//! Kinds of files that the reference validator's own test suite (KhronosGroup/glTF-Validator,
//! `test/base/data` and `test/ext`) holds valid, each made here: all load.

#![allow(clippy::unwrap_used)]

mod common;

use busbar_gltf_import::ImportedModel;
use common::{Builder, data_uri, floats, glb, import, shorts};
use serde_json::{Value, json};

/// Imports a document of glTF 2.0 with these members.
fn load(kind: &str, members: &Value) -> ImportedModel {
    let mut document = json!({ "asset": { "version": "2.0" } });
    for (name, value) in members.as_object().unwrap() {
        document[name] = value.clone();
    }
    import(document.to_string().as_bytes()).unwrap_or_else(|error| panic!("{kind}: {error}"))
}

/// Accessor whose elements are zeros.
fn zeros(component: u32, shape: &str, count: usize) -> Value {
    json!({ "componentType": component, "type": shape, "count": count })
}

fn with_note(imported: &ImportedModel, expected: &str) {
    let notes = &imported.report.notes;
    assert!(notes.iter().any(|note| note.contains(expected)), "{expected}: {notes:?}");
}

#[test]
fn unused_objects_of_all_kinds_load() {
    for (kind, members) in [
        ("empty", json!({})),
        ("unknown property of the root", json!({ "acme": true, "asset/acme": 1 })),
        (
            "accessor with an unknown property",
            json!({ "accessors": [{ "type": "VEC3",
            "componentType": 5126, "count": 1, "acme": {} }] }),
        ),
        ("accessor of an unknown type", json!({ "accessors": [zeros(5126, "VEC5", 7)] })),
        (
            "matrices whose columns are padded",
            json!({ "accessors": [
            { "type": "MAT2", "componentType": 5120, "count": 2, "bufferView": 0 },
            { "type": "MAT3", "componentType": 5123, "count": 1, "bufferView": 0 } ],
            "bufferViews": [{ "buffer": 0, "byteLength": 24 }],
            "buffers": [{ "byteLength": 24, "uri": data_uri(&[1; 24]) }] }),
        ),
        (
            "animation",
            json!({ "nodes": [{ "extras": 1 }], "animations": [{ "acme": 1,
            "samplers": [{ "input": 0, "output": 1, "interpolation": "LINEAR" }],
            "channels": [{ "sampler": 0, "target": { "node": 0, "path": "scale" } }] }],
            "accessors": [zeros(5126, "SCALAR", 2), zeros(5126, "VEC3", 2)] }),
        ),
        (
            "buffer of which nobody reads a byte",
            json!({ "buffers": [{ "byteLength": 1 },
            { "byteLength": 2, "uri": "http://example.com/a.bin" },
            { "byteLength": 3, "uri": "missing.bin" }],
            "bufferViews": [{ "buffer": 1, "byteLength": 2, "byteStride": 4, "target": 34962 }] }),
        ),
        (
            "cameras",
            json!({ "cameras": [
            { "type": "perspective", "perspective": { "yfov": 4, "znear": 10, "acme": 0 } },
            { "type": "orthographic", "orthographic":
                { "xmag": 1, "ymag": 1, "znear": 1, "zfar": 2 } } ] }),
        ),
        (
            "images",
            json!({ "images": [{ "uri": "missing.png" }, { "uri": "odd.bmp", "acme": 1 },
            { "uri": data_uri(b"none") }, { "bufferView": 0, "mimeType": "image/webp" }] }),
        ),
        (
            "materials",
            json!({ "materials": [{}, { "alphaMode": "MASK", "alphaCutoff": 0.6 },
            { "alphaMode": "BLEND", "alphaCutoff": 0.6 }, { "alphaMode": "OPAQUE" }] }),
        ),
        (
            "mesh",
            json!({ "meshes": [{ "primitives": [{ "attributes": { "NORMAL": 0 } }] }],
            "accessors": [zeros(5126, "VEC3", 3)] }),
        ),
        (
            "samplers",
            json!({ "samplers": [{}, { "acme": true }, { "magFilter": 9728,
            "minFilter": 9987, "wrapS": 33071, "wrapT": 33648 }] }),
        ),
        ("scenes", json!({ "scenes": [{ "acme": true }] })),
        (
            "skin",
            json!({ "nodes": [{ "children": [1] }, {}], "skins": [{ "joints": [0, 1],
            "inverseBindMatrices": 0, "skeleton": 0, "acme": 2 }],
            "accessors": [zeros(5126, "MAT4", 2)] }),
        ),
        ("textures", json!({ "textures": [{}, { "acme": true }] })),
        ("odd name of an extension", json!({ "extensionsUsed": ["_extension"] })),
        (
            "materials of variants",
            json!({ "extensionsUsed": ["KHR_materials_variants"],
            "extensions": { "KHR_materials_variants": { "variants": [{ "name": "a" }] } } }),
        ),
        (
            "pointers of animations",
            json!({ "extensionsUsed": ["KHR_animation_pointer"],
            "animations": [{ "samplers": [], "channels": [{ "sampler": 0, "target":
                { "path": "pointer", "extensions": { "KHR_animation_pointer":
                    { "pointer": "/materials/0/alphaCutoff" } } } }] }] }),
        ),
        (
            "lights",
            json!({ "extensionsUsed": ["KHR_lights_punctual"],
            "extensions": { "KHR_lights_punctual": { "lights": [{ "type": "spherical" },
                { "type": "spot", "spot": { "outerConeAngle": 1.0 }, "range": 10 }] } } }),
        ),
    ] {
        let imported = load(kind, &members);
        assert!(imported.model.meshes.is_empty(), "{kind}");
    }
}

#[test]
fn nodes_of_every_kind_are_there() {
    for (kind, nodes) in [
        (
            "properties and extras",
            json!([{ "acme": true }, { "extras": 42 }, { "extras": "a" },
            { "extras": false }, { "extras": [1] }, { "extras": null }]),
        ),
        (
            "identity",
            json!([{ "matrix": [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1] },
            { "scale": [1, 1, 1], "rotation": [0, 0, 0, 1], "translation": [0, 0, 0] }]),
        ),
        (
            "extensions",
            json!([{ "extensions": { "KHR_lights_punctual": { "light": 0 } } },
            { "extensions": { "EXT_extension_unknown": {} } },
            { "extensions": { "KHR_node_visibility": { "visible": true } } },
            { "extensions": { "KHR_node_visibility": {} } }]),
        ),
        ("children as floats", json!([{ "children": [1.0, 2.0] }, {}, {}])),
    ] {
        let count = nodes.as_array().unwrap().len();
        assert_eq!(load(kind, &json!({ "nodes": nodes })).model.nodes.len(), count, "{kind}");
    }
}

#[test]
fn newer_minor_versions_load() {
    for (version, minimum, is_newer) in
        [("2.0", "2.0", false), ("2.1", "2.0", true), ("2.1", "2.1", true)]
    {
        let asset = json!({ "version": version, "minVersion": minimum, "generator": "x",
            "copyright": "y", "acme": true });
        let imported = load(version, &json!({ "asset": asset }));
        assert_eq!(imported.report.notes.len(), usize::from(is_newer), "{version} {minimum}");
    }
}

#[test]
fn containers_of_every_kind_load() {
    let square = Builder::square();
    let mut json = square.document();
    let buffer = json["buffers"][0]["byteLength"].as_u64().unwrap();
    let mut bin = floats(&common::SQUARE);
    bin.extend(shorts(&[0, 1, 2, 0, 2, 3]));
    assert_eq!(bin.len() as u64, buffer);
    let triangles = |file: &[u8]| import(file).unwrap().model.meshes[0].triangles.len();
    // A data URI within GLB, and content of its own.
    assert_eq!(triangles(&glb(json.to_string().as_bytes(), &[])), 2);
    json["buffers"][0] = json!({ "byteLength": buffer });
    common::push(&mut json["buffers"], json!({ "byteLength": 1024 }));
    let text = json.to_string();
    assert_eq!(triangles(&glb(text.as_bytes(), &bin)), 2);
    // Padded chunks, and bytes after the last one.
    bin.extend([0; 3]);
    assert_eq!(triangles(&glb(text.as_bytes(), &bin)), 2);
    let mut longer = glb(text.as_bytes(), &bin);
    longer.push(0);
    assert_eq!(triangles(&longer), 2);
    // A single chunk.
    let json = br#"{"asset":{"version":"2.0"}} "#;
    let mut single = b"glTF\x02\0\0\0".to_vec();
    single.extend((20 + json.len() as u32).to_le_bytes());
    single.extend((json.len() as u32).to_le_bytes());
    single.extend(b"JSON");
    single.extend(json);
    assert!(import(&single).unwrap().model.nodes.is_empty());
}

#[test]
fn meshes_whose_accessors_have_no_data_load() {
    let accessors = || {
        json!([
            zeros(5126, "VEC3", 3),
            zeros(5123, "VEC4", 3),
            zeros(5126, "VEC4", 3),
            zeros(5126, "VEC2", 3),
            zeros(5123, "SCALAR", 6),
            zeros(5126, "VEC3", 4)
        ])
    };
    let position = json!({ "POSITION": 0 });
    for (kind, primitive, node) in [
        ("position", json!({ "attributes": position, "acme": true }), json!({})),
        (
            "points with tangents",
            json!({ "attributes": { "POSITION": 0, "TANGENT": 2 },
            "mode": 0 }),
            json!({}),
        ),
        ("corners left over", json!({ "attributes": { "POSITION": 5 } }), json!({})),
        (
            "joints without a skin",
            json!({ "attributes": { "POSITION": 0, "JOINTS_0": 1,
            "WEIGHTS_0": 2 } }),
            json!({}),
        ),
        (
            "skin",
            json!({ "attributes": { "POSITION": 0, "JOINTS_0": 1, "WEIGHTS_0": 2 } }),
            json!({ "skin": 0, "translation": [1, 2, 3] }),
        ),
        (
            "weights of a node",
            json!({ "attributes": position, "targets": [position] }),
            json!({ "weights": [0.5] }),
        ),
        (
            "all at once",
            json!({ "attributes": { "POSITION": 0, "JOINTS_0": 1, "WEIGHTS_0": 2 },
            "targets": [position] }),
            json!({ "weights": [0.5], "skin": 0, "camera": 0,
            "children": [2] }),
        ),
        (
            "colours of targets",
            json!({ "attributes": { "POSITION": 0, "COLOR_0": 0 },
            "indices": 4, "material": 0, "targets": [{ "POSITION": 0, "COLOR_0": 0 }] }),
            json!({}),
        ),
        (
            "textures of every kind",
            json!({ "attributes": { "POSITION": 0, "NORMAL": 0,
            "TANGENT": 2, "TEXCOORD_0": 3 }, "material": 1 }),
            json!({}),
        ),
        (
            "variants",
            json!({ "attributes": position, "extensions": { "KHR_materials_variants":
            { "mappings": [{ "material": 0, "variants": [0] }] } } }),
            json!({}),
        ),
    ] {
        let mut shown = node;
        shown["mesh"] = json!(0);
        let texture = |set: u32| json!({ "index": 0, "texCoord": set, "acme": true });
        let imported = load(
            kind,
            &json!({
                "nodes": [shown, {}, {}],
                "skins": [{ "joints": [1] }],
                "cameras": [{ "type": "perspective", "perspective": { "yfov": 1, "znear": 1 } }],
                "meshes": [{ "primitives": [primitive], "weights": [0.7], "acme": true }],
                "textures": [{}],
                "materials": [{}, {
                    "pbrMetallicRoughness": { "baseColorTexture": texture(0),
                        "metallicRoughnessTexture": texture(1), "metallicFactor": 0.7 },
                    "normalTexture": texture(2), "occlusionTexture": texture(3),
                    "emissiveTexture": texture(4), "emissiveFactor": [0, 1, 0],
                    "alphaMode": "MASK", "alphaCutoff": 0.4, "doubleSided": true }],
                "accessors": accessors(),
            }),
        );
        assert_eq!(imported.model.nodes.len(), 3, "{kind}");
    }
    // Nothing is known of the data: the mesh is left out, the others are shown.
    let mut document = Builder::square().document();
    document["meshes"][0]["primitives"] = json!([document["meshes"][0]["primitives"][0],
        { "attributes": { "POSITION": 2 } }]);
    common::push(&mut document["accessors"], zeros(5126, "VEC3", 3));
    document["accessors"][2]["bufferView"] = json!(2);
    common::push(&mut document["bufferViews"], json!({ "buffer": 1, "byteLength": 36 }));
    common::push(&mut document["buffers"], json!({ "byteLength": 36 }));
    let imported = import(document.to_string().as_bytes()).unwrap();
    assert_eq!(imported.model.meshes[0].triangles.len(), 2);
    with_note(&imported, "1 x primitive left out: its data are in a buffer without URI");
}

#[test]
fn triangles_of_no_area_load() {
    let mut builder = Builder::square();
    let indices = builder.accessor(&[0, 0, 1, 2, 2, 2, 0, 1, 2], 5121, "SCALAR", 9);
    builder.primitive()["indices"] = json!(indices);
    assert_eq!(builder.import().model.meshes[0].triangles.len(), 1);
}

#[test]
fn materials_of_every_extension_are_shown() {
    let texture = json!({ "index": 0 });
    for (name, value) in [
        (
            "KHR_materials_anisotropy",
            json!({ "anisotropyStrength": 0.5,
            "anisotropyTexture": { "index": 0, "texCoord": 1 } }),
        ),
        (
            "KHR_materials_clearcoat",
            json!({ "clearcoatFactor": 0.5,
            "clearcoatNormalTexture": { "index": 0, "texCoord": 1, "scale": 1.5 } }),
        ),
        ("KHR_materials_dispersion", json!({ "dispersion": 1.0 })),
        ("KHR_materials_emissive_strength", json!({ "emissiveStrength": 2.0 })),
        ("KHR_materials_ior", json!({ "ior": 0 })),
        (
            "KHR_materials_iridescence",
            json!({ "iridescenceThicknessMinimum": 300,
            "iridescenceThicknessTexture": texture }),
        ),
        (
            "KHR_materials_pbrSpecularGlossiness",
            json!({ "diffuseTexture": texture,
            "specularFactor": [0.5, 0.6, 0.7], "specularGlossinessTexture": texture }),
        ),
        ("KHR_materials_sheen", json!({ "sheenColorTexture": texture })),
        ("KHR_materials_specular", json!({ "specularColorFactor": [1.5, 0.0, 0.5] })),
        ("KHR_materials_transmission", json!({ "transmissionTexture": texture })),
        ("KHR_materials_unlit", json!({})),
        ("KHR_materials_volume", json!({ "thicknessFactor": 3.0, "attenuationDistance": 10.0 })),
        ("EXT_materials_unknown", json!({})),
    ] {
        for value in [value, json!({}), json!({ "acme": true })] {
            let mut builder = Builder::square();
            builder.json["extensionsUsed"] = json!([name]);
            builder.json["textures"] = json!([{}]);
            builder.json["materials"] = json!([{ "normalTexture": { "index": 0 },
                "extensions": { name: value } }]);
            builder.primitive()["material"] = json!(0);
            let imported = builder.import();
            assert_eq!(imported.model.meshes[0].triangles.len(), 2, "{name}");
        }
    }
    for transform in [
        json!({ "acme": true }),
        json!({ "offset": [0, 1], "rotation": 1.5,
        "scale": [0.5, 0.5], "texCoord": 1 }),
    ] {
        let mut builder = Builder::square();
        builder.json["textures"] = json!([{ "extensions": { "EXT_texture_webp": {} } }]);
        builder.json["materials"] = json!([{ "emissiveTexture": { "index": 0,
            "extensions": { "KHR_texture_transform": transform } } }]);
        builder.primitive()["material"] = json!(0);
        assert_eq!(builder.import().model.meshes[0].triangles.len(), 2);
    }
}
