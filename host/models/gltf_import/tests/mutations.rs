//! Seeded mutations of valid files: each is imported or refused, none panics,
//! and what is imported holds together. The fuzz target does the same without
//! a bound.

#![allow(clippy::unwrap_used)]

mod common;

use busbar_gltf_import::{ImportFault, ImportedModel};
use common::{Builder, glb, import, square_with_image};
use serde_json::json;

/// Mutations of each seed file.
const ROUNDS: u64 = 5000;

/// A small generator (Marsaglia, "Xorshift RNGs", 2003).
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        self.0
    }

    fn below(&mut self, limit: usize) -> usize {
        (self.next() % limit.max(1) as u64) as usize
    }
}

fn seeds() -> Vec<Vec<u8>> {
    let mut png = Vec::new();
    let pixels = image::RgbaImage::from_pixel(2, 2, image::Rgba([1, 2, 3, 4]));
    pixels.write_to(&mut std::io::Cursor::new(&mut png), image::ImageFormat::Png).unwrap();
    let mut rich = square_with_image(&png);
    rich.json["nodes"] = json!([
        { "name": "T1", "children": [1, 2] },
        { "mesh": 0, "translation": [1, 2, 3] },
        { "mesh": 0, "matrix": [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 7, 8, 9, 1] },
    ]);
    rich.json["accessors"][0]["sparse"] = json!({ "count": 1,
        "indices": { "bufferView": 1, "byteOffset": 2, "componentType": 5123 },
        "values": { "bufferView": 0 } });
    import(&rich.bytes()).unwrap();
    let mut plain = rich.document();
    plain.as_object_mut().unwrap().remove("images");
    plain.as_object_mut().unwrap().remove("textures");
    plain["materials"] = json!([{}]);
    let exported = busbar_gltf_export::write_glb(&Builder::square().import().model).unwrap();
    let mut inner = plain.clone();
    inner["buffers"][0].as_object_mut().unwrap().remove("uri");
    inner["accessors"][0].as_object_mut().unwrap().remove("sparse");
    let mut bin = common::floats(&common::SQUARE);
    bin.extend(common::shorts(&[0, 1, 2, 0, 2, 3]));
    bin.resize(4096, 0);
    let wrapped = glb(inner.to_string().as_bytes(), &bin);
    import(&wrapped).unwrap();
    let features = common::square_with_features([0, 0, 1, 1], &["T1", "T2"]).bytes();
    vec![rich.bytes(), plain.to_string().into_bytes(), exported, wrapped, features]
}

fn mutate(file: &mut Vec<u8>, random: &mut Random) {
    for _ in 0..=random.below(4) {
        let at = random.below(file.len());
        match random.below(6) {
            0 if !file.is_empty() => file[at] = random.next() as u8,
            1 if !file.is_empty() => file[at] ^= 1 << random.below(8),
            2 => file.truncate(file.len() - random.below(8).min(file.len())),
            3 => {
                let end = (at + random.below(24)).min(file.len());
                let part = file[at.min(end)..end].to_vec();
                let to = random.below(file.len());
                file.splice(to..to, part);
            }
            _ => replace_number(file, at, random),
        }
    }
}

/// Puts another number in place of the first one after `at`.
fn replace_number(file: &mut Vec<u8>, at: usize, random: &mut Random) {
    const NUMBERS: &[&str] = &[
        "0",
        "1",
        "2",
        "3",
        "4",
        "5",
        "6",
        "7",
        "12",
        "99",
        "-1",
        "0.5",
        "1e39",
        "255",
        "65535",
        "65536",
        "2147483648",
        "4294967295",
        "4294967296",
        "18446744073709551615",
        "5120",
        "5121",
        "5123",
        "5125",
        "5126",
        "1e-45",
    ];
    let digit = |b: &u8| b.is_ascii_digit();
    let Some(start) = file.iter().skip(at).position(digit).map(|p| p + at) else {
        return;
    };
    let end = file[start..].iter().position(|b| !digit(b)).map_or(file.len(), |p| p + start);
    file.splice(start..end, NUMBERS[random.below(NUMBERS.len())].bytes());
}

fn assert_sound(imported: &ImportedModel) {
    let model = &imported.model;
    for (index, node) in model.nodes.iter().enumerate() {
        assert!(node.parent.is_none_or(|p| (p as usize) < index));
        assert!(node.mesh.is_none_or(|m| (m as usize) < model.meshes.len()));
        assert!(node.parent_from_node.is_finite());
        assert!(model.nodes[..index].iter().all(|other| other.name != node.name));
    }
    for (mesh, names) in model.meshes.iter().zip(&model.features) {
        assert!(names.iter().all(|name| !name.is_empty() && !name.contains('/')));
        assert!(
            mesh.triangles.iter().all(|&t| mesh.feature(t) == mesh.feature([t[1], t[2], t[0]]))
        );
    }
    // Checks every index of meshes, materials and textures.
    busbar_gltf_export::write_glb(model).unwrap();
}

#[test]
fn mutated_files_are_imported_or_refused() {
    let mut accepted = 0;
    let mut refused = 0;
    for (which, seed) in seeds().iter().enumerate() {
        for round in 1..=ROUNDS {
            let mut random = Random(0x9E37_79B9_7F4A_7C15 ^ (round << 8 | which as u64));
            let mut file = seed.clone();
            mutate(&mut file, &mut random);
            match import(&file) {
                Ok(imported) => {
                    assert_sound(&imported);
                    accepted += 1;
                }
                Err(error) => {
                    let panicked = matches!(error.fault, ImportFault::Panicked(_));
                    assert!(!panicked, "seed file {which}, round {round}: {error}");
                    refused += 1;
                }
            }
        }
    }
    println!("{accepted} accepted, {refused} refused");
    assert!(accepted > 1000 && refused > 1000, "{accepted} accepted, {refused} refused");
}
