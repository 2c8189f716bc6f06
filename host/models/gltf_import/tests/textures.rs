//! KTX2 textures, and what is shown where a texture is missing or broken.
#![allow(clippy::unwrap_used)]

mod common;

use busbar_gltf_import::{ImportLimits, ImportedModel, import_bytes};
use common::basis::*;
use common::ktx2::*;
use common::square_with_image;
use serde_json::json;

/// The first pixels of what is imported, and the remarks.
fn shown(image: &[u8]) -> (Vec<[u8; 4]>, Vec<String>) {
    let ImportedModel { model, report } = square_with_image(image).import();
    let texture = &model.textures[0];
    assert_eq!(texture.rgba8.len(), (texture.width * texture.height * 4) as usize);
    (texture.rgba8.as_chunks().0.to_vec(), report.notes)
}

fn is_checker(pixels: &[[u8; 4]]) -> bool {
    pixels[0] == [255, 0, 255, 255] && pixels[4] == [128, 128, 128, 255] && pixels.len() == 256
}

#[test]
fn pixels_come_as_they_are_plain_or_compressed() {
    let pixels: Vec<u8> = (0..5 * 3 * 4).collect();
    for format in [RGBA8_UNORM, RGBA8_SRGB] {
        let plain = ktx2(format, [5, 3], PLAIN, &pixels, 60);
        for file in [plain, zstandard(format, [5, 3], &pixels)] {
            let (shown, notes) = shown(&file);
            assert_eq!(shown.as_flattened(), pixels);
            assert_eq!(notes, Vec::<String>::new());
        }
    }
}

#[test]
fn blocks_are_decoded_and_cut_off_at_the_edges() {
    // Red at both ends, index 0 everywhere (Khronos Data Format specification, S3TC).
    let bc1 = [0x00, 0xF8, 0x00, 0x00, 0, 0, 0, 0];
    // One alpha at both ends.
    let bc3 = [&[77, 77, 0, 0, 0, 0, 0, 0], &bc1[..]].concat();
    let bc4 = [200, 200, 0, 0, 0, 0, 0, 0];
    let bc5 = [bc4, [90, 90, 0, 0, 0, 0, 0, 0]].concat();
    // Mode 6, all ends and their low bits set.
    let bc7 = ((((1_u128 << 58) - 1) << 7) | 1 << 6).to_le_bytes();
    let cases: [(u32, &[u8], [u8; 4]); 5] = [
        (BC1_RGBA, &bc1, [255, 0, 0, 255]),
        (BC3, &bc3, [255, 0, 0, 77]),
        (BC4, &bc4, [200, 0, 0, 255]),
        (BC5, &bc5, [200, 90, 0, 255]),
        (BC7, &bc7, [255; 4]),
    ];
    for (format, block, expected) in cases {
        // Two blocks by one, the second of a single column.
        let level = [block, block].concat();
        let plain = ktx2(format, [5, 3], PLAIN, &level, level.len() as u64);
        for file in [plain, zstandard(format, [5, 3], &level)] {
            let (shown, notes) = shown(&file);
            assert_eq!(shown, vec![expected; 15], "{format}: {notes:?}");
        }
    }
}

#[test]
fn basis_universal_is_decoded() {
    for hex in [ETC1S, UASTC, UASTC_ZSTANDARD] {
        let (shown, notes) = shown(&bytes_of_hex(hex));
        assert_eq!(notes, Vec::<String>::new());
        assert_eq!(shown.len(), 8 * 4);
        for (index, pixel) in shown.iter().enumerate() {
            let expected = if index % 8 < 4 { [255, 0, 0, 255] } else { [0, 0, 255, 255] };
            let off = pixel.iter().zip(expected).map(|(a, b)| a.abs_diff(b)).max();
            assert!(off <= Some(8), "{index}: {pixel:?}");
        }
    }
}

#[test]
fn damaged_basis_universal_is_a_checker_or_a_picture_of_its_size() {
    let mut random = 1_u64;
    for hex in [ETC1S, UASTC, UASTC_ZSTANDARD] {
        let whole = bytes_of_hex(hex);
        for end in 0..whole.len() {
            shown(&whole[..end]);
        }
        for _ in 0..500 {
            let mut altered = whole.clone();
            for _ in 0..2 {
                random = random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
                let at = 48 + (random >> 33) as usize % (altered.len() - 48);
                altered[at] = (random >> 20) as u8;
            }
            shown(&altered);
        }
    }
}

#[test]
fn three_bytes_a_pixel_are_opaque() {
    const RGB8_SRGB: u32 = 29;
    let pixels: Vec<u8> = (0..2 * 3).collect();
    let file = ktx2(RGB8_SRGB, [2, 1], PLAIN, &pixels, 6);
    assert_eq!(shown(&file).0, [[0, 1, 2, 255], [3, 4, 5, 255]]);
}

#[test]
fn a_broken_texture_is_a_checker_with_a_remark() {
    let pixels = [9; 64];
    let mut torn = zstandard(RGBA8_UNORM, [4, 4], &pixels);
    torn.truncate(torn.len() - 3);
    let mut volume = ktx2(RGBA8_UNORM, [4, 4], PLAIN, &pixels, 64);
    volume[28] = 2;
    let cases = [
        (b"no picture".to_vec(), "format could not be determined"),
        (common::png_claiming(16, 16)[..40].to_vec(), ""),
        (ktx2(UNDEFINED, [4, 4], PLAIN, &pixels, 64), "Basis Universal: InvalidData"),
        (ktx2(97, [4, 4], PLAIN, &pixels, 64), "R16G16B16A16_SFLOAT is not supported"),
        (ktx2(RGBA8_UNORM, [4, 5], PLAIN, &pixels, 80), "needs 80 bytes, but there are 64"),
        (ktx2(RGBA8_UNORM, [4, 4], 3, &pixels, 64), "ZLIB is not supported"),
        (ktx2(RGBA8_UNORM, [4, 4], ZSTANDARD, &pixels, 64), "Zstandard"),
        (zstandard(RGBA8_UNORM, [4, 5], &pixels), "64 bytes or more for 80"),
        (zstandard(RGBA8_UNORM, [4, 3], &pixels), "bytes or more for 48"),
        (torn, "KTX"),
        (volume, "no single picture"),
    ];
    for (image, reason) in cases {
        let (shown, notes) = shown(&image);
        assert!(is_checker(&shown), "{reason}");
        let [note] = notes.as_slice() else { panic!("{notes:?}") };
        assert!(note.starts_with("1 x texture shown as a checker: "), "{note}");
        assert!(note.contains(reason) && note.contains("at /images/0: "), "{note}");
    }
}

#[test]
fn a_missing_file_is_a_checker_and_says_nothing_of_roughness() {
    let folder = tempfile::tempdir().unwrap();
    let mut builder = square_with_image(b"");
    builder.json["images"] = json!([{ "uri": "gone.png" }]);
    builder.primitive()["material"] = json!(0);
    builder.json["materials"] = json!([{ "pbrMetallicRoughness": {
        "baseColorTexture": { "index": 0 }, "metallicRoughnessTexture": { "index": 0 } } }]);
    let bytes = builder.bytes();
    let imported = import_bytes(&bytes, Some(folder.path()), &ImportLimits::default()).unwrap();
    let material = &imported.model.materials[0];
    assert!(material.base_color_texture.is_some());
    assert_eq!(material.metallic_roughness_texture, None);
    assert!(is_checker(imported.model.textures[0].rgba8.as_chunks().0));
    assert!(imported.report.notes[0].contains("gone.png"), "{:?}", imported.report.notes);
}

#[test]
fn basisu_names_an_image_where_there_is_no_other() {
    let blue = ktx2(RGBA8_SRGB, [1, 1], PLAIN, &[0, 0, 255, 255], 4);
    let mut builder = square_with_image(&blue);
    builder.json["extensionsUsed"] = json!(["KHR_texture_basisu"]);
    builder.json["extensionsRequired"] = json!(["KHR_texture_basisu"]);
    builder.json["textures"] = json!([{ "extensions": { "KHR_texture_basisu": { "source": 0 } } }]);
    let imported = builder.import();
    assert_eq!(imported.model.textures[0].rgba8, [0, 0, 255, 255]);
    builder.json["textures"] = json!([{ "extensions": { "KHR_texture_basisu": { "source": 9 } } }]);
    let error = common::import(&builder.bytes()).unwrap_err().to_string();
    assert!(error.contains("image 9"), "{error}");
}

#[test]
fn a_few_bytes_that_claim_many_pixels_are_a_checker() {
    // A few bytes that claim 256 MiB.
    let bomb = ktx2(RGBA8_UNORM, [8192, 8192], ZSTANDARD, &[0; 64], 1 << 28);
    let (shown, notes) = shown(&bomb);
    assert!(is_checker(&shown) && notes[0].contains("needs"), "{notes:?}");
}
