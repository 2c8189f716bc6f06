//! Small files made in code, for all tests of the importer.

#![allow(dead_code, unreachable_pub)] // Each test binary uses a part.

pub mod basis;
pub mod hostile;
pub mod ktx2;

use busbar_gltf_import::{ImportError, ImportLimits, ImportedModel, import_bytes};
use serde_json::{Value, json};

pub fn import(bytes: &[u8]) -> Result<ImportedModel, ImportError> {
    import_bytes(bytes, None, &ImportLimits::default())
}

pub fn import_json(document: &Value) -> Result<ImportedModel, ImportError> {
    import(&serde_json::to_vec(document).unwrap())
}

pub fn data_uri(bytes: &[u8]) -> String {
    const DIGITS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut uri = String::from("data:application/octet-stream;base64,");
    for group in bytes.chunks(3) {
        let mut padded = [0; 4];
        padded[1..=group.len()].copy_from_slice(group);
        let bits = u32::from_be_bytes(padded);
        for i in 0..4 {
            let digit = DIGITS[(bits >> (18 - 6 * i)) as usize & 63];
            uri.push(if i <= group.len() { digit.into() } else { '=' });
        }
    }
    uri
}

pub fn floats(values: &[f32]) -> Vec<u8> {
    values.iter().flat_map(|v| v.to_le_bytes()).collect()
}

pub fn shorts(values: &[u16]) -> Vec<u8> {
    values.iter().flat_map(|v| v.to_le_bytes()).collect()
}

/// The corners of a unit square.
pub const SQUARE: [f32; 12] = [0., 0., 0., 1., 0., 0., 1., 1., 0., 0., 1., 0.];

/// A document with one primitive; parts are appended to one data URI, each as
/// a view of its own.
pub struct Builder {
    pub json: Value,
    bytes: Vec<u8>,
}

impl Builder {
    pub fn new() -> Self {
        let json = json!({
            "asset": { "version": "2.0" },
            "scene": 0,
            "scenes": [{ "nodes": [0] }],
            "nodes": [{ "name": "tank", "mesh": 0 }],
            "meshes": [{ "name": "steel", "primitives": [{ "attributes": {} }] }],
            "accessors": [],
            "bufferViews": [],
            "buffers": [{}],
        });
        Self { json, bytes: Vec::new() }
    }

    /// A square of two triangles, accessors 0 (positions) and 1 (indices).
    pub fn square() -> Self {
        let mut builder = Self::new();
        let positions = builder.accessor(&floats(&SQUARE), 5126, "VEC3", 4);
        let indices = builder.accessor(&shorts(&[0, 1, 2, 0, 2, 3]), 5123, "SCALAR", 6);
        builder.json["meshes"][0]["primitives"][0] =
            json!({ "attributes": { "POSITION": positions }, "indices": indices });
        builder
    }

    pub fn view(&mut self, bytes: &[u8]) -> usize {
        self.bytes.resize(self.bytes.len().next_multiple_of(4), 0);
        let view =
            json!({ "buffer": 0, "byteOffset": self.bytes.len(), "byteLength": bytes.len() });
        self.bytes.extend(bytes);
        push(&mut self.json["bufferViews"], view)
    }

    pub fn accessor(&mut self, bytes: &[u8], component: u32, shape: &str, count: usize) -> usize {
        let view = self.view(bytes);
        let accessor = json!({
            "bufferView": view, "componentType": component, "type": shape, "count": count,
        });
        push(&mut self.json["accessors"], accessor)
    }

    pub fn primitive(&mut self) -> &mut Value {
        &mut self.json["meshes"][0]["primitives"][0]
    }

    /// The document, with its data embedded.
    pub fn document(&self) -> Value {
        let mut json = self.json.clone();
        json["buffers"][0] =
            json!({ "byteLength": self.bytes.len(), "uri": data_uri(&self.bytes) });
        json
    }

    pub fn bytes(&self) -> Vec<u8> {
        serde_json::to_vec(&self.document()).unwrap()
    }

    pub fn import(&self) -> ImportedModel {
        import(&self.bytes()).unwrap()
    }
}

/// The square with a feature id a vertex, in rows of a table with these names.
pub fn square_with_features(ids: [u16; 4], names: &[&str]) -> Builder {
    let mut builder = Builder::square();
    let bytes: Vec<u8> = ids.iter().flat_map(|id| [id.to_le_bytes(), [0; 2]].concat()).collect();
    let accessor = builder.accessor(&bytes, 5123, "SCALAR", 4);
    builder.json["bufferViews"][accessor]["byteStride"] = json!(4);
    let values = builder.view(names.concat().as_bytes());
    let ends = names.iter().scan(0, |end, name| {
        *end += name.len() as u16;
        Some(*end)
    });
    let offsets = builder.view(&shorts(&[0].into_iter().chain(ends).collect::<Vec<_>>()));
    builder.primitive()["attributes"]["_FEATURE_ID_0"] = json!(accessor);
    builder.primitive()["extensions"] = json!({ "EXT_mesh_features": { "featureIds": [
        { "featureCount": names.len(), "attribute": 0, "propertyTable": 0 },
    ] } });
    builder.json["extensionsUsed"] = json!(["EXT_mesh_features", "EXT_structural_metadata"]);
    builder.json["extensions"] = json!({ "EXT_structural_metadata": {
        "schema": { "id": "plant", "classes": {
            "piece": { "properties": { "tag": { "type": "STRING" } } },
        } },
        "propertyTables": [{ "class": "piece", "count": names.len(), "properties": {
            "tag": { "values": values, "stringOffsets": offsets, "stringOffsetType": "UINT16" },
        } }],
    } });
    builder
}

/// The property table of [`square_with_features`].
pub const TABLE: &str = "/extensions/EXT_structural_metadata/propertyTables/0";

pub fn push(array: &mut Value, value: Value) -> usize {
    let array = array.as_array_mut().unwrap();
    array.push(value);
    array.len() - 1
}

/// A GLB of whatever JSON and whatever chunk lengths.
pub fn glb(json: &[u8], bin: &[u8]) -> Vec<u8> {
    let mut json = json.to_vec();
    json.resize(json.len().next_multiple_of(4), b' ');
    let mut file = b"glTF\x02\0\0\0".to_vec();
    file.extend((28 + json.len() as u32 + bin.len() as u32).to_le_bytes());
    file.extend((json.len() as u32).to_le_bytes());
    file.extend(b"JSON");
    file.extend(json);
    file.extend((bin.len() as u32).to_le_bytes());
    file.extend(b"BIN\0");
    file.extend(bin);
    file
}

/// A PNG whose header claims a size and whose data are nearly nothing.
pub fn png_claiming(width: u32, height: u32) -> Vec<u8> {
    let mut png = b"\x89PNG\r\n\x1a\n".to_vec();
    let mut header = b"IHDR".to_vec();
    header.extend(width.to_be_bytes());
    header.extend(height.to_be_bytes());
    header.extend([8, 6, 0, 0, 0]);
    for chunk in [header, b"IDAT\x78\x9c\x63\x00".to_vec(), b"IEND".to_vec()] {
        png.extend((chunk.len() as u32 - 4).to_be_bytes());
        png.extend(&chunk);
        png.extend(crc32(&chunk).to_be_bytes());
    }
    png
}

fn crc32(bytes: &[u8]) -> u32 {
    !bytes.iter().fold(u32::MAX, |crc, &byte| {
        (0..8).fold(crc ^ u32::from(byte), |crc, _| {
            (crc >> 1) ^ (0xEDB8_8320 & (crc & 1).wrapping_neg())
        })
    })
}

/// Gives the square a material with an image of these bytes.
pub fn square_with_image(image: &[u8]) -> Builder {
    let mut builder = Builder::square();
    let view = builder.view(image);
    builder.json["images"] = json!([{ "bufferView": view, "mimeType": "image/png" }]);
    builder.json["samplers"] = json!([{ "wrapS": 33071, "wrapT": 33648 }]);
    builder.json["textures"] = json!([{ "source": 0, "sampler": 0 }]);
    builder.json["materials"] =
        json!([{ "pbrMetallicRoughness": { "baseColorTexture": { "index": 0 } } }]);
    builder.primitive()["material"] = json!(0);
    builder
}
