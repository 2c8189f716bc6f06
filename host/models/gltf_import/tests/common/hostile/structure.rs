//! Hierarchies, versions, text and containers that are not what they should be.

use serde_json::{Value, json};

use super::super::{Builder, glb};
use super::{Cases, add, changed};

pub fn structure(c: &mut Cases) {
    let nodes = |c: &mut Cases, name, nodes: Value, expected| {
        changed(c, name, |d| d["nodes"] = nodes, expected);
    };
    nodes(
        c,
        "its own child",
        json!([{ "children": [1] }, { "children": [1] }]),
        &["/nodes/1/children", "node 1 is its own ancestor"],
    );
    nodes(
        c,
        "cycle",
        json!([
            { "children": [1] },
            { "children": [2] },
            { "children": [3] },
            { "children": [1] },
        ]),
        &["/nodes/1/children", "node 1 is its own ancestor"],
    );
    nodes(
        c,
        "cycle through the root",
        json!([{ "children": [1] }, { "children": [0] }]),
        &["/nodes/0/children", "node 0 is its own ancestor"],
    );
    nodes(
        c,
        "no such child",
        json!([{ "children": [7] }]),
        &["/nodes/0/children/0", "node 7 is named, but there are 1"],
    );
    let chain = |i: u32| {
        if i < 999 { json!({ "children": [i + 1] }) } else { json!({}) }
    };
    nodes(
        c,
        "1000 levels",
        (0..1000).map(chain).collect(),
        &["/nodes/512", "513 levels of nodes, and the limit is 512"],
    );
    changed(
        c,
        "an extension of shapes",
        |d| d["extensionsRequired"] = json!(["KHR_mesh_quantization", "ACME_shapes"]),
        &["/extensionsRequired/1", "'ACME_shapes'", "export the model again without"],
    );
    changed(c, "glTF 1", |d| d["asset"]["version"] = json!("1.0"), &["/asset/version", "'1.0'"]);
    add(
        c,
        "glTF 1 without an asset",
        br#"{"meshes":{"a":{}}}"#.to_vec(),
        &["glTF version '1.0'", "export the model as glTF 2.0"],
    );
    changed(c, "glTF 3 at least", |d| d["asset"]["minVersion"] = json!("3.0"), &["'3.0'"]);
}

pub fn text(c: &mut Cases) {
    add(c, "empty", vec![], &["the top of the JSON", "line 1, column 0"]);
    add(c, "not JSON", b"solid cube\nfacet".to_vec(), &["line 1, column 1"]);
    add(c, "binary", vec![0xFF; 4096], &["line 1"]);
    add(c, "cut", Builder::square().bytes()[..300].to_vec(), &["EOF"]);
    add(c, "an array", b"[]".to_vec(), &["the top of the JSON"]);
    add(c, "no asset", b"{}".to_vec(), &["there is no asset"]);
    add(
        c,
        "a key twice",
        br#"{"asset":{"version":"2.0"},"scene":0,"scene":1}"#.to_vec(),
        &["duplicate field `scene`"],
    );
    add(
        c,
        "deep",
        "[".repeat(1_000_000).into_bytes(),
        &["the top of the JSON", "expected an object"],
    );
    let deep = format!(r#"{{"asset":{{"version":"2.0"}},"extras":{}"#, "[".repeat(1_000_000));
    add(c, "deep where it is ignored", deep.into_bytes(), &["/extras", "EOF while parsing a list"]);
    changed(
        c,
        "damaged base64",
        |d| {
            let uri = d["buffers"][0]["uri"].as_str().unwrap().replace("base64,A", "base64,!");
            d["buffers"][0]["uri"] = json!(uri);
        },
        &["/buffers/0/uri", "base64 is damaged"],
    );
    for (name, uri) in [("a file", "data.bin"), ("up", "../../../etc/passwd")] {
        changed(
            c,
            name,
            |d| d["buffers"][0]["uri"] = json!(uri),
            &["/buffers/0/uri", "is refused", "put the file beside the model"],
        );
    }
}

pub fn containers(c: &mut Cases) {
    let whole = glb(br#"{"asset":{"version":"2.0"}}"#, &[0; 64]);
    for (name, end) in [
        ("cut in its header", 10),
        ("cut in a chunk's header", 15),
        ("cut in its JSON", 30),
        ("cut in its data", whole.len() - 1),
    ] {
        add(c, name, whole[..end].to_vec(), &["damaged GLB"]);
    }
    let patched = |at: usize, with: [u8; 4]| {
        let mut file = whole.clone();
        file[at..at + 4].copy_from_slice(&with);
        file
    };
    add(c, "GLB 1", patched(4, [1, 0, 0, 0]), &["container version 1"]);
    add(c, "a length of 4 GiB", patched(8, [0xFF; 4]), &["its header says 4294967295 bytes"]);
    add(c, "JSON of 4 GiB", patched(12, [0xFF; 4]), &["a chunk says 4294967295 bytes"]);
    add(c, "data first", patched(16, *b"BIN\0"), &["first chunk is not JSON"]);
}
