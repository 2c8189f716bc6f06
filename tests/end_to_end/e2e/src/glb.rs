//! Independent reader and writer of GLB files, apart from the importer under test.

use std::collections::{BTreeMap, BTreeSet};

use serde_json::{Value, json};

/// Mesh with welded vertices: equal positions are one.
#[derive(Clone, Debug, Default)]
pub struct WeldedMesh {
    /// Distinct positions after welding.
    pub positions: Vec<[f32; 3]>,
    /// Corners as indices into `positions`.
    pub triangles: Vec<[usize; 3]>,
}

/// Reads all meshes of a GLB file with float positions and indexed triangles.
///
/// # Panics
/// When the file has another form.
pub fn read(bytes: &[u8]) -> Vec<WeldedMesh> {
    let word =
        |at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().expect("four bytes")) as usize;
    assert_eq!((&bytes[..4], word(4), word(8)), (b"glTF".as_slice(), 2, bytes.len()));
    let json_end = 20 + word(12);
    let document: Value = serde_json::from_slice(&bytes[20..json_end]).expect("the JSON chunk");
    let buffer = &bytes[json_end + 8..];
    assert_eq!(&bytes[json_end + 4..json_end + 8], b"BIN\0");
    let meshes = document["meshes"].as_array().expect("a model has meshes");
    meshes.iter().map(|mesh| read_mesh(&document, buffer, mesh)).collect()
}

fn read_mesh(document: &Value, buffer: &[u8], mesh: &Value) -> WeldedMesh {
    let mut welded = WeldedMesh::default();
    let mut known = BTreeMap::new();
    for primitive in mesh["primitives"].as_array().expect("a mesh has primitives") {
        let positions = elements(document, buffer, &primitive["attributes"]["POSITION"], 12);
        let indices: Vec<usize> = positions
            .into_iter()
            .map(|bytes| {
                let position = [0, 4, 8].map(|at| float(&bytes[at..at + 4]));
                // Adding zero makes -0 the 0 that it equals.
                *known.entry(position.map(|x| (x + 0.0).to_bits())).or_insert_with(|| {
                    welded.positions.push(position);
                    welded.positions.len() - 1
                })
            })
            .collect();
        let width =
            match document["accessors"][number(&primitive["indices"])]["componentType"].as_u64() {
                Some(5121) => 1,
                Some(5123) => 2,
                Some(5125) => 4,
                other => panic!("component type {other:?} of indices"),
            };
        let corners: Vec<usize> = elements(document, buffer, &primitive["indices"], width)
            .into_iter()
            .map(|bytes| bytes.iter().rev().fold(0, |n, &byte| (n << 8) | usize::from(byte)))
            .map(|index| indices[index])
            .collect();
        welded.triangles.extend(corners.chunks_exact(3).map(|c| [c[0], c[1], c[2]]));
    }
    welded
}

/// Returns the bytes of each element of an accessor.
fn elements<'a>(
    document: &Value,
    buffer: &'a [u8],
    accessor: &Value,
    size: usize,
) -> Vec<&'a [u8]> {
    let accessor = &document["accessors"][number(accessor)];
    let view = &document["bufferViews"][number(&accessor["bufferView"])];
    let offset = |value: &Value| value["byteOffset"].as_u64().unwrap_or(0) as usize;
    let start = offset(accessor) + offset(view);
    let stride = view["byteStride"].as_u64().map_or(size, |stride| stride as usize);
    (0..number(&accessor["count"])).map(|i| &buffer[start + i * stride..][..size]).collect()
}

fn number(value: &Value) -> usize {
    value.as_u64().expect("an index or count") as usize
}

fn float(bytes: &[u8]) -> f32 {
    f32::from_le_bytes(bytes.try_into().expect("four bytes"))
}

/// Writes one mesh as GLB.
pub fn write(mesh: &WeldedMesh) -> Vec<u8> {
    let positions = mesh.positions.iter().flatten().flat_map(|x| x.to_le_bytes());
    let mut buffer: Vec<u8> = positions.collect();
    let index_start = buffer.len();
    buffer.extend(mesh.triangles.iter().flatten().flat_map(|&i| (i as u32).to_le_bytes()));
    let bound = |choose: fn(f32, f32) -> f32| {
        [0, 1, 2].map(|axis| mesh.positions.iter().map(|p| p[axis]).reduce(choose))
    };
    let document = json!({
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"name": "mesh", "mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": mesh.positions.len(),
                "type": "VEC3", "min": bound(f32::min), "max": bound(f32::max)},
            {"bufferView": 1, "componentType": 5125, "count": mesh.triangles.len() * 3,
                "type": "SCALAR"}
        ],
        "bufferViews": [
            {"buffer": 0, "byteLength": index_start},
            {"buffer": 0, "byteOffset": index_start, "byteLength": buffer.len() - index_start}
        ],
        "buffers": [{"byteLength": buffer.len()}]
    });
    let mut json = document.to_string().into_bytes();
    json.resize(json.len().next_multiple_of(4), b' ');
    let chunk = |kind: &[u8; 4], data: &[u8]| {
        [&(data.len() as u32).to_le_bytes(), kind.as_slice(), data].concat()
    };
    let chunks = [chunk(b"JSON", &json), chunk(b"BIN\0", &buffer)].concat();
    let length = (12 + chunks.len()) as u32;
    [b"glTF".as_slice(), &2_u32.to_le_bytes(), &length.to_le_bytes(), &chunks].concat()
}

impl WeldedMesh {
    /// Counts the connected components of the positions.
    pub fn components(&self) -> usize {
        let mut parent: Vec<usize> = (0..self.positions.len()).collect();
        for &[a, b, c] in &self.triangles {
            for (one, other) in [(a, b), (b, c)] {
                let (one, other) = (root(&mut parent, one), root(&mut parent, other));
                parent[one] = other;
            }
        }
        (0..parent.len()).filter(|&i| parent[i] == i).count()
    }

    /// Counts the edges with exactly one triangle.
    pub fn border_edges(&self) -> usize {
        let mut uses = BTreeMap::new();
        for &[a, b, c] in &self.triangles {
            for (one, other) in [(a, b), (b, c), (c, a)] {
                *uses.entry([one.min(other), one.max(other)]).or_insert(0) += 1;
            }
        }
        uses.values().filter(|&&count| count == 1).count()
    }

    /// Counts the positions that a triangle uses.
    pub fn referenced(&self) -> usize {
        self.triangles.iter().flatten().collect::<BTreeSet<_>>().len()
    }
}

fn root(parent: &mut [usize], mut of: usize) -> usize {
    while parent[of] != of {
        parent[of] = parent[parent[of]];
        of = parent[of];
    }
    of
}
