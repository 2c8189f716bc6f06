//! Counts, ranges and values that lie.

use serde_json::json;

use super::super::{Builder, shorts};
use super::{Cases, add, changed};

pub fn numbers(c: &mut Cases) {
    changed(
        c,
        "accessor of 4e9",
        |d| d["accessors"][0]["count"] = json!(4_000_000_000_u32),
        &["/accessors/0", "48000000000 bytes, but there are 48"],
    );
    changed(
        c,
        "indices of 4e9",
        |d| d["accessors"][1]["count"] = json!(4_000_000_000_u32),
        &["/accessors/1", "8000000000 bytes, but there are 12"],
    );
    changed(
        c,
        "count beyond 64 bits",
        |d| d["accessors"][0]["count"] = json!(u64::MAX),
        &["/accessors/0/count", "18446744073709551615"],
    );
    let sparse = |count: u64| {
        json!({ "count": count, "indices": { "bufferView": 1, "componentType": 5123 },
            "values": { "bufferView": 0 } })
    };
    changed(
        c,
        "sparse of 4e9",
        |d| {
            d["accessors"][0]["sparse"] = sparse(4_000_000_000);
            d["accessors"][0]["count"] = json!(4_000_000_000_u32);
            d["accessors"][0].as_object_mut().unwrap().remove("bufferView");
        },
        &["/accessors/0/sparse/indices", "8000000000 bytes, but there are 12"],
    );
    changed(
        c,
        "sparse more than whole",
        |d| d["accessors"][0]["sparse"] = sparse(5),
        &["/accessors/0/sparse/count", "5 of 4"],
    );
    changed(
        c,
        "4e9 zeros from nothing",
        |d| {
            d["accessors"][0]["count"] = json!(4_000_000_000_u32);
            d["accessors"][0]["sparse"] = sparse(1);
            d["accessors"][0].as_object_mut().unwrap().remove("bufferView");
            d["meshes"][0]["primitives"][0].as_object_mut().unwrap().remove("indices");
        },
        &["/meshes/0/primitives/0", "triangles for the bytes there are, and the limit is 65536"],
    );
    changed(
        c,
        "sparse out of order",
        |d| d["accessors"][0]["sparse"] = sparse(4),
        &["/accessors/0/sparse/indices", "sparse index 0 is out of order"],
    );
    changed(
        c,
        "view beyond its buffer",
        |d| d["bufferViews"][1]["byteLength"] = json!(13),
        &["/bufferViews/1", "61 bytes, but there are 60"],
    );
    changed(
        c,
        "view offset that overflows",
        |d| {
            d["bufferViews"][1]["byteOffset"] = json!(u32::MAX);
            d["bufferViews"][1]["byteLength"] = json!(u32::MAX);
        },
        &["/bufferViews/1", "8589934590 bytes"],
    );
    changed(
        c,
        "accessor offset",
        |d| d["accessors"][0]["byteOffset"] = json!(4),
        &["/accessors/0", "52 bytes, but there are 48"],
    );
    changed(
        c,
        "stride too small",
        |d| d["bufferViews"][0]["byteStride"] = json!(1),
        &["/accessors/0", "overlap at a stride of 1"],
    );
    changed(
        c,
        "stride too large",
        |d| d["bufferViews"][0]["byteStride"] = json!(u32::MAX),
        &["/accessors/0", "12884901897 bytes"],
    );
    changed(
        c,
        "an index modulo 2^32",
        |d| d["nodes"][0]["mesh"] = json!(1_u64 << 32),
        &["/nodes/0/mesh", "4294967296 is more than"],
    );
    changed(
        c,
        "a negative count",
        |d| d["accessors"][0]["count"] = json!(-1),
        &["/accessors/0/count", "line 1"],
    );
    changed(
        c,
        "a fractional count",
        |d| d["accessors"][0]["count"] = json!(1.5),
        &["/accessors/0/count"],
    );
    changed(
        c,
        "a count in words",
        |d| d["accessors"][0]["count"] = json!("four"),
        &["/accessors/0/count", "invalid type: string"],
    );
    for (name, pointer, what) in [
        ("no such view", "/accessors/0/bufferView", "buffer view 99"),
        ("no such buffer", "/bufferViews/0/buffer", "buffer 99"),
        ("no such accessor", "/meshes/0/primitives/0/attributes/POSITION", "accessor 99"),
        ("no such indices", "/meshes/0/primitives/0/indices", "accessor 99"),
        ("no such mesh", "/nodes/0/mesh", "mesh 99"),
        ("no such node", "/scenes/0/nodes/0", "node 99"),
    ] {
        let mut document = Builder::square().document();
        *document.pointer_mut(pointer).unwrap() = json!(99);
        let bytes = serde_json::to_vec(&document).unwrap();
        c.push(super::Case { name, bytes, expected: Vec::leak(vec![pointer, what]) });
    }
    changed(
        c,
        "no such material",
        |d| d["meshes"][0]["primitives"][0]["material"] = json!(0),
        &["/meshes/0/primitives/0/material", "material 0 is named, but there are 0"],
    );
    changed(
        c,
        "no such texture",
        |d| {
            d["materials"] =
                json!([{ "pbrMetallicRoughness": { "baseColorTexture": { "index": 3 } } }]);
            d["meshes"][0]["primitives"][0]["material"] = json!(0);
        },
        &["/materials/0/pbrMetallicRoughness/baseColorTexture/index", "texture 3"],
    );
}

pub fn values(c: &mut Cases) {
    let mut square = Builder::square();
    let far = square.accessor(&shorts(&[0, 1, 4]), 5123, "SCALAR", 3);
    square.primitive()["indices"] = json!(far);
    add(
        c,
        "index out of range",
        square.bytes(),
        &["/meshes/0/primitives/0/indices", "vertex 4, but there are 4 vertices"],
    );
    changed(
        c,
        "flat positions",
        |d| d["accessors"][0]["type"] = json!("VEC2"),
        &["/attributes/POSITION", "positions cannot be VEC2 of FLOAT"],
    );
    changed(
        c,
        "signed indices",
        |d| d["accessors"][1]["componentType"] = json!(5122),
        &["/primitives/0/indices", "indices cannot be SCALAR of SHORT"],
    );
    changed(
        c,
        "unknown component",
        |d| d["accessors"][1]["componentType"] = json!(5124),
        &["/accessors/1/componentType"],
    );
    changed(
        c,
        "unknown shape",
        |d| d["accessors"][1]["type"] = json!("VEC9"),
        &["/accessors/1/type"],
    );
    changed(
        c,
        "unknown mode",
        |d| d["meshes"][0]["primitives"][0]["mode"] = json!(9),
        &["/meshes/0/primitives/0/mode"],
    );
    changed(
        c,
        "unknown alpha mode",
        |d| {
            d["materials"] = json!([{ "alphaMode": "GLASS" }]);
            d["meshes"][0]["primitives"][0]["material"] = json!(0);
        },
        &["/materials/0/alphaMode"],
    );
    changed(
        c,
        "infinite transform",
        |d| d["nodes"][0]["translation"] = json!([1e39, 0, 0]),
        &["/nodes/0"],
    );
    for (name, node) in [
        ("a node beyond all coordinates", json!({ "translation": [0, -1e30, 0] })),
        (
            "a matrix beyond all coordinates",
            json!({ "matrix": [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 2e12, 0, 1] }),
        ),
    ] {
        let expected = &["/nodes/1", "translation is beyond 1e12"];
        changed(c, name, |d| d["nodes"] = json!([{ "children": [1] }, node]), expected);
    }
    let far = json!({ "translation": [8e11, 0, 0], "children": [1] });
    for (name, nodes, expected) in [
        (
            "translations that add up",
            json!([far, { "translation": [8e11, 0, 0] }]),
            &["/nodes/1:", "together with those above it, exceeds 1e12"],
        ),
        (
            "scales that multiply",
            json!([{ "scale": [1e10, 1, 1], "children": [1] }, { "scale": [1e10, 1, 1] }]),
            &["/nodes/1:", "together with those above it, exceeds 1e12"],
        ),
        (
            "transforms that multiply to infinity",
            json!([{ "scale": [1e10, 1, 1], "children": [1] }, { "scale": [1e30, 1, 1] }]),
            &["/nodes/1:", "not finite"],
        ),
    ] {
        changed(c, name, |d| d["nodes"] = nodes, expected);
    }
}
