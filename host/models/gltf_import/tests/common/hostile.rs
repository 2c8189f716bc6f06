//! Hostile files: bytes, and what the error must say.

mod data;
mod features;
mod floods;
mod structure;

use std::path::{Path, PathBuf};

use serde_json::{Value, json};

use super::Builder;

pub struct Case {
    pub name: &'static str,
    pub bytes: Vec<u8>,
    /// Parts of the expected message: place and fault.
    pub expected: &'static [&'static str],
}

/// Every file here is refused.
pub fn cases() -> Vec<Case> {
    let mut cases = Vec::new();
    data::numbers(&mut cases);
    data::values(&mut cases);
    features::features(&mut cases);
    features::tables(&mut cases);
    features::floods(&mut cases);
    structure::structure(&mut cases);
    structure::text(&mut cases);
    structure::containers(&mut cases);
    floods::floods(&mut cases);
    cases
}

/// Every file here is imported, with a checker and a remark.
pub fn broken_images() -> Vec<Case> {
    let mut cases = Vec::new();
    floods::broken_images(&mut cases);
    cases
}

type Cases = Vec<Case>;

fn add(cases: &mut Cases, name: &'static str, bytes: Vec<u8>, expected: &'static [&'static str]) {
    cases.push(Case { name, bytes, expected });
}

/// A square with one value changed, after its data are embedded.
fn changed(
    cases: &mut Cases,
    name: &'static str,
    change: impl FnOnce(&mut Value),
    expected: &'static [&'static str],
) {
    let mut document = Builder::square().document();
    change(&mut document);
    add(cases, name, serde_json::to_vec(&document).unwrap(), expected);
}

/// Writes a model whose 200 buffers are one file of 3 MB, and whose 200
/// primitives have a million positions each, in those buffers.
pub fn write_one_file_named_often(folder: &Path) -> PathBuf {
    const SIZE: usize = 3_000_000;
    const TIMES: usize = 200;
    std::fs::write(folder.join("a.bin"), vec![0; SIZE]).unwrap();
    let document = json!({
        "asset": { "version": "2.0" },
        "nodes": [{ "mesh": 0 }],
        "buffers": vec![json!({ "uri": "a.bin", "byteLength": SIZE }); TIMES],
        "bufferViews": (0..TIMES)
            .map(|i| json!({ "buffer": i, "byteLength": SIZE }))
            .collect::<Value>(),
        "accessors": (0..TIMES)
            .map(|i| json!({ "bufferView": i, "componentType": 5120, "type": "VEC3",
                "count": SIZE / 3 }))
            .chain([json!({ "bufferView": 0, "componentType": 5121, "type": "SCALAR",
                "count": 3 })])
            .collect::<Value>(),
        "meshes": [{ "primitives": (0..TIMES)
            .map(|i| json!({ "attributes": { "POSITION": i }, "indices": TIMES }))
            .collect::<Value>() }],
    });
    let path = folder.join("model.gltf");
    std::fs::write(&path, document.to_string()).unwrap();
    path
}
