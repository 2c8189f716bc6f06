//! Compressed meshes and views, and instances.

#![allow(clippy::unwrap_used)]

mod common;

use busbar_gltf_import::{ImportError, ImportFault, ImportedModel};
use common::{Builder, SQUARE, floats, import, push, shorts};
use glam::Vec3;
use serde_json::{Value, json};

/// The square with a colour at each corner, as the reference encoder (Draco 1.5.7) writes it: by
/// sequential coding, and by edge breaker.
const DRACO_SEQUENTIAL: &str = "445241434f02020100000002040100010200020301020202030100000903000\
    10102000101000303012001200300f08331b00100000000ff0000000001010003030130011003003482880400000\
    000ff0700000000000000000000000000000000803f0b";
const DRACO_EDGEBREAKER: &str = "445241434f02020101000000040201020000011fff0111ff01110200000\
    0ff000001020203010001010009030001020101010003030130011003002482912600000000ff00000001010100\
    03030130011003002882980000000000ff0700000000000000000000000000000000803f0b";

fn bytes_of_hex(hex: &str) -> Vec<u8> {
    let digits: Vec<u8> =
        hex.chars().filter(|c| !c.is_whitespace()).map(|c| c.to_digit(16).unwrap() as u8).collect();
    digits.as_chunks::<2>().0.iter().map(|[high, low]| high << 4 | low).collect()
}

/// A document whose one primitive is compressed by Draco.
fn draco(packed: &[u8]) -> Builder {
    let mut builder = Builder::new();
    let view = builder.view(packed);
    builder.json["extensionsRequired"] = json!(["KHR_draco_mesh_compression"]);
    builder.json["accessors"] = json!([
        { "componentType": 5126, "type": "VEC3", "count": 4 },
        { "componentType": 5123, "type": "SCALAR", "count": 6 },
    ]);
    *builder.primitive() = json!({ "attributes": { "POSITION": 0 }, "indices": 1, "extensions": {
        "KHR_draco_mesh_compression": { "bufferView": view, "attributes": { "POSITION": 1 } } } });
    builder
}

fn points(imported: &ImportedModel) -> Vec<[f32; 3]> {
    let mut points: Vec<_> =
        imported.model.meshes[0].positions.iter().map(Vec3::to_array).collect();
    points.sort_by(|a, b| a.partial_cmp(b).unwrap());
    points
}

const CORNERS: [[f32; 3]; 4] = [[0., 0., 0.], [0., 1., 0.], [1., 0., 0.], [1., 1., 0.]];

#[test]
fn what_the_reference_encoder_of_draco_writes_is_read() {
    for hex in [DRACO_SEQUENTIAL, DRACO_EDGEBREAKER] {
        let imported = draco(&bytes_of_hex(hex)).import();
        assert_eq!(points(&imported), CORNERS);
        let mesh = &imported.model.meshes[0];
        assert_eq!(mesh.triangles.len(), 2);
        assert!(mesh.wedges.normal.iter().all(|&normal| normal == Vec3::Z));
        assert!(imported.report.notes.is_empty(), "{:?}", imported.report.notes);
    }
}

#[test]
fn without_compression_positions_are_read_as_they_are() {
    let mut builder = draco(b"no Draco at all");
    let positions = builder.accessor(&floats(&SQUARE), 5126, "VEC3", 4);
    let indices = builder.accessor(&shorts(&[0, 1, 2, 0, 2, 3]), 5123, "SCALAR", 6);
    builder.primitive()["attributes"]["POSITION"] = json!(positions);
    builder.primitive()["indices"] = json!(indices);
    assert_eq!(points(&builder.import()), CORNERS);
}

fn refused(builder: &Builder) -> ImportError {
    let error = import(&builder.bytes()).unwrap_err();
    assert!(!matches!(error.fault, ImportFault::Panicked(_)), "{error}");
    error
}

#[test]
fn damaged_draco_meshes_are_refused_at_their_place() {
    let whole = bytes_of_hex(DRACO_EDGEBREAKER);
    let place = "/meshes/0/primitives/0/extensions/KHR_draco_mesh_compression";
    assert_eq!(refused(&draco(b"DRACO")).place, place);
    assert_eq!(refused(&draco(b"")).place, place);
    for end in 0..whole.len() {
        assert!(refused(&draco(&whole[..end])).place.starts_with(place));
    }
    let mut builder = draco(&whole);
    builder.primitive()["extensions"]["KHR_draco_mesh_compression"]["attributes"]["POSITION"] =
        json!(7);
    assert!(refused(&builder).to_string().contains("has no attribute 7"));
    // Colours where positions should be: bytes for floats are allowed, but three of them.
    builder.json["accessors"][0]["type"] = json!("VEC2");
    builder.primitive()["extensions"]["KHR_draco_mesh_compression"]["attributes"]["POSITION"] =
        json!(1);
    assert!(refused(&builder).to_string().contains("another shape"));
}

#[test]
fn altered_draco_meshes_never_panic() {
    let mut random = 1_u64;
    for hex in [DRACO_SEQUENTIAL, DRACO_EDGEBREAKER] {
        let whole = bytes_of_hex(hex);
        for _ in 0..2000 {
            let mut altered = whole.clone();
            for _ in 0..3 {
                random = random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
                let at = (random >> 33) as usize % altered.len();
                altered[at] = (random >> 20) as u8;
            }
            if let Err(error) = import(&draco(&altered).bytes()) {
                assert!(!matches!(error.fault, ImportFault::Panicked(_)), "{error}");
            }
        }
    }
}

/// Adds a view of compressed bytes, and its accessor.
fn meshopt_accessor(builder: &mut Builder, packed: &[u8], layout: Value, accessor: Value) -> usize {
    let place = builder.view(packed);
    let packed_view = builder.json["bufferViews"][place].clone();
    let mut extension = layout;
    extension["buffer"] = json!(0);
    extension["byteOffset"] = packed_view["byteOffset"].clone();
    extension["byteLength"] = packed_view["byteLength"].clone();
    let extensions = json!({ "EXT_meshopt_compression": extension });
    // The view is of a buffer that has no bytes: a placeholder for viewers without it.
    let view = json!({ "buffer": 1, "byteLength": 1_000_000, "extensions": extensions });
    let view = push(&mut builder.json["bufferViews"], view);
    let mut accessor = accessor;
    accessor["bufferView"] = json!(view);
    push(&mut builder.json["accessors"], accessor)
}

/// The square, compressed by meshoptimizer, with filtered normals.
fn meshopt() -> Builder {
    let mut builder = Builder::new();
    builder.json["extensionsRequired"] = json!(["EXT_meshopt_compression"]);
    builder.json["buffers"] = json!([{}, { "byteLength": 1_000_000, "extensions": {
        "EXT_meshopt_compression": { "fallback": true } } }]);
    let vertices: Vec<[f32; 3]> = SQUARE.as_chunks().0.to_vec();
    let packed = meshopt::encode_vertex_buffer(&vertices).unwrap();
    let positions = meshopt_accessor(
        &mut builder,
        &packed,
        json!({ "byteStride": 12, "count": 4, "mode": "ATTRIBUTES" }),
        json!({ "componentType": 5126, "type": "VEC3", "count": 4 }),
    );
    let packed = meshopt::encode_index_buffer(&[0, 1, 2, 0, 2, 3], 4).unwrap();
    let indices = meshopt_accessor(
        &mut builder,
        &packed,
        json!({ "byteStride": 2, "count": 6, "mode": "TRIANGLES" }),
        json!({ "componentType": 5123, "type": "SCALAR", "count": 6 }),
    );
    // Octahedral: x and y of (0, 0, 1), and one in the third byte.
    let normals = vec![[0_i8, 0, 127, 0]; 4];
    let packed = meshopt::encode_vertex_buffer(&normals).unwrap();
    let normals = meshopt_accessor(
        &mut builder,
        &packed,
        json!({ "byteStride": 4, "count": 4, "mode": "ATTRIBUTES", "filter": "OCTAHEDRAL" }),
        json!({ "componentType": 5120, "type": "VEC3", "normalized": true, "count": 4 }),
    );
    // Exponential: mantissas 0 and 1 with exponents 0 and 1.
    let uvs: Vec<[u32; 2]> = [[0, 0], [1, 0], [1 << 24 | 1, 0], [0, 1]].to_vec();
    let packed = meshopt::encode_vertex_buffer(&uvs).unwrap();
    let uvs = meshopt_accessor(
        &mut builder,
        &packed,
        json!({ "byteStride": 8, "count": 4, "mode": "ATTRIBUTES", "filter": "EXPONENTIAL" }),
        json!({ "componentType": 5126, "type": "VEC2", "count": 4 }),
    );
    *builder.primitive() = json!({ "indices": indices, "attributes": {
        "POSITION": positions, "NORMAL": normals, "TEXCOORD_0": uvs } });
    builder
}

/// The document of [`meshopt`], with its second buffer.
fn meshopt_bytes(builder: &Builder) -> Vec<u8> {
    let mut document = builder.document();
    document["buffers"][1] = builder.json["buffers"][1].clone();
    document.to_string().into_bytes()
}

#[test]
fn views_compressed_by_meshoptimizer_are_read() {
    let imported = import(&meshopt_bytes(&meshopt())).unwrap();
    assert_eq!(points(&imported), CORNERS);
    let wedges = &imported.model.meshes[0].wedges;
    assert!(wedges.normal.iter().all(|&normal| normal.distance(Vec3::Z) < 0.01));
    let uvs: Vec<_> = wedges.uv.iter().map(|uv| uv.to_array()).collect();
    assert_eq!(uvs, [[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [0.0, 1.0]]);
    assert!(imported.report.notes.is_empty(), "{:?}", imported.report.notes);
}

#[test]
fn compressed_views_that_lie_are_refused() {
    let extension = "/bufferViews/1/extensions/EXT_meshopt_compression";
    for (field, value, expected) in [
        ("count", json!(4_000_000_000_u32), "a compressed view needs"),
        ("count", json!(5), "is damaged"),
        ("byteStride", json!(13), "do not fit"),
        ("byteStride", json!(0), "do not fit"),
        ("byteStride", json!(260), "do not fit"),
        ("mode", json!("TRIANGLES"), "do not fit"),
        ("mode", json!("WAVELETS"), "unknown mode"),
        ("filter", json!("QUATERNION"), "do not fit"),
        ("filter", json!("BLUR"), "unknown filter"),
        ("byteLength", json!(9_999_999), "the compressed view needs"),
        ("buffer", json!(9), "buffer 9 is named"),
        ("buffer", json!(1), "without URI"),
    ] {
        let mut builder = meshopt();
        *builder.json.pointer_mut(&format!("{extension}/{field}")).unwrap_or(&mut json!(0)) =
            value.clone();
        builder.json.pointer_mut(extension).unwrap()[field] = value;
        let error = import(&meshopt_bytes(&builder)).unwrap_err();
        assert!(error.to_string().contains(expected), "{field}: {error}");
        assert!(!matches!(error.fault, ImportFault::Panicked(_)), "{error}");
    }
}

#[test]
fn instances_are_nodes_with_stable_names() {
    let mut builder = Builder::square();
    let places =
        builder.accessor(&floats(&[0., 0., 0., 5., 0., 0., f32::NAN, 0., 0.]), 5126, "VEC3", 3);
    let sizes = builder.accessor(&floats(&[1., 1., 1., 2., 2., 2., 1., 1., 1.]), 5126, "VEC3", 3);
    let half = 23_170_u16;
    let turns = [0, 0, 0, 32_767, 0, 0, half, half, 0, 0, 0, 32_767];
    let turns = builder.accessor(&shorts(&turns), 5122, "VEC4", 3);
    builder.json["accessors"][turns]["normalized"] = json!(true);
    builder.json["extensionsRequired"] = json!(["EXT_mesh_gpu_instancing"]);
    let attributes = json!({ "TRANSLATION": places, "ROTATION": turns, "SCALE": sizes });
    builder.json["nodes"] = json!([
        { "name": "post", "mesh": 0, "children": [1],
            "extensions": { "EXT_mesh_gpu_instancing": { "attributes": attributes } } },
        { "name": "sign" },
    ]);
    let imported = builder.import();
    let nodes: Vec<_> =
        imported.model.nodes.iter().map(|n| (n.name.as_str(), n.parent, n.mesh)).collect();
    let expected = [
        ("post", None, None),
        ("post[0]", Some(0), Some(0)),
        ("post[1]", Some(0), Some(0)),
        ("sign", Some(0), None),
    ];
    assert_eq!(nodes, expected);
    let placed = imported.model.nodes[2].parent_from_node.transform_point3(Vec3::X);
    assert!(placed.distance(Vec3::new(5.0, 2.0, 0.0)) < 1e-3, "{placed}");
    assert_eq!(imported.report.notes, ["1 x instance left out: its place is no coordinate"]);
}

#[test]
fn without_places_a_mesh_is_shown_once() {
    let mut builder = Builder::square();
    builder.json["nodes"][0]["extensions"] = json!({ "EXT_mesh_gpu_instancing": {} });
    assert_eq!(builder.import().model.nodes[0].mesh, Some(0));
}

#[test]
fn instances_from_nothing_are_bounded() {
    let mut builder = Builder::square();
    let zeros = json!({ "componentType": 5126, "type": "VEC3", "count": 900_000 });
    let zeros = push(&mut builder.json["accessors"], zeros);
    builder.json["nodes"][0]["extensions"] =
        json!({ "EXT_mesh_gpu_instancing": { "attributes": { "TRANSLATION": zeros } } });
    let error = refused(&builder);
    assert!(error.to_string().contains("900000 instances for the bytes there are"), "{error}");
    assert!(error.place.starts_with("/nodes/0/extensions/EXT_mesh_gpu_instancing"), "{error}");
    for (count, shape, expected) in [(2, "VEC3", "unequal numbers"), (4, "VEC2", "VEC2 instead of")]
    {
        let mut builder = Builder::square();
        let other = json!({ "componentType": 5126, "type": shape, "count": count });
        let other = push(&mut builder.json["accessors"], other);
        let attributes = json!({ "TRANSLATION": 0, "SCALE": other });
        builder.json["nodes"][0]["extensions"] =
            json!({ "EXT_mesh_gpu_instancing": { "attributes": attributes } });
        assert!(refused(&builder).to_string().contains(expected));
    }
}

#[test]
fn altered_meshoptimizer_views_never_panic() {
    let mut random = 7_u64;
    let whole = meshopt();
    let document = whole.document();
    let uri = document["buffers"][0]["uri"].as_str().unwrap().to_owned();
    for _ in 0..1500 {
        let mut altered: Vec<u8> = uri.clone().into_bytes();
        let start = uri.find("base64,").unwrap() + 7;
        for _ in 0..3 {
            random = random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            let at = start + (random >> 33) as usize % (altered.len() - start - 4);
            altered[at] = b"ABCDwxyz0189+/Zf"[(random >> 20) as usize % 16];
        }
        let mut document = document.clone();
        document["buffers"][0]["uri"] = json!(String::from_utf8(altered).unwrap());
        document["buffers"][1] = whole.json["buffers"][1].clone();
        if let Err(error) = import(document.to_string().as_bytes()) {
            assert!(!matches!(error.fault, ImportFault::Panicked(_)), "{error}");
        }
    }
}
