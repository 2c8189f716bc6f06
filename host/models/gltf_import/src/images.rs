//! Images: PNG, JPEG and KTX2, measured before they are decoded.

use std::io::Cursor;

use busbar_scene::Texture;
use gltf::json::Root;
use image::{DynamicImage, ImageDecoder, ImageFormat, ImageReader, Limits};

use crate::ImportLimits;
use crate::buffers::Buffers;
use crate::error::{ImportError, ImportFault};
use crate::files::Files;
use crate::ktx2_image;
use crate::limits::MAX_TEXTURE_SIDE;
use crate::report::Notes;

/// Deflate packs 258 bytes into two bits at best (zlib's "maximum compression
/// factor"), and JPEG stays below that for its one bit a block: more pixels
/// than this cannot come from the bytes.
const MAX_COMPRESSION: u64 = 1032;

/// Memory that a decoder may take besides the pixels, bytes.
const DECODER_BYTES: u64 = 4 << 20;

/// Pixels that are decoded on trust. Of more, every PNG and KTX2 is first read through
/// without keeping its pixels, so that a damaged one costs no memory.
const MAX_UNVERIFIED_PIXELS: u64 = 8 << 20;

/// Side of the placeholder checker and of one of its cells, pixels.
const CHECKER_SIDE: u32 = 16;
const CHECKER_CELL: u32 = 4;
/// Colours of the checker's cells in turn; nothing in a station looks like this.
const CHECKER: [[u8; 4]; 2] = [[255, 0, 255, 255], [128, 128, 128, 255]];

/// Source of an image's bytes.
pub(crate) enum Source {
    InBuffer,
    File(usize),
    /// Nowhere, for this reason.
    Missing(ImportError),
}

/// Textures, and which of them only stand in for an image that is missing or broken.
pub(crate) struct Decoded {
    pub(crate) textures: Vec<Texture>,
    pub(crate) placeholders: Vec<bool>,
}

/// Loads the bytes of images. An unreadable one is missing; a harmful one, such as a path out of
/// the model's folder, is an error.
pub(crate) fn load(
    root: &Root,
    images: &[usize],
    files: &mut Files<'_>,
) -> Result<Vec<Source>, ImportError> {
    let load = |&index: &usize| match (&root.images[index].uri, root.images[index].buffer_view) {
        (_, Some(_)) => Ok(Source::InBuffer),
        (Some(uri), None) => match files.load(uri, &format!("/images/{index}/uri")) {
            Ok(file) => Ok(Source::File(file)),
            Err(
                error @ ImportError {
                    fault: ImportFault::Read { .. } | ImportFault::NotAFile(_),
                    ..
                },
            ) => Ok(Source::Missing(error)),
            Err(error) => Err(error),
        },
        (None, None) => {
            let fault = ImportFault::Image("it names neither a URI nor a buffer view".into());
            Ok(Source::Missing(fault.at(format!("/images/{index}"))))
        }
    };
    images.iter().map(load).collect()
}

/// Decodes images; missing or broken ones become a checker, with a remark. Their pixels together
/// stay within the limit.
pub(crate) fn decode(
    root: &Root,
    (images, sources): (&[usize], Vec<Source>),
    buffers: &Buffers<'_>,
    files: &Files<'_>,
    limits: &ImportLimits,
    notes: &mut Notes,
) -> Result<Decoded, ImportError> {
    let mut measured = Vec::with_capacity(images.len());
    let mut pixels = 0;
    for (&index, source) in images.iter().zip(sources) {
        let place = || format!("/images/{index}");
        let bytes = match (root.images[index].buffer_view, source) {
            (_, Source::File(file)) => Ok(files.get(file)),
            (_, Source::Missing(error)) => Err(error),
            (Some(view), Source::InBuffer) => {
                Ok(buffers.view(view.value(), || place() + "/bufferView")?.bytes)
            }
            (None, Source::InBuffer) => Ok(&[][..]),
        };
        let sound = bytes.and_then(|bytes| match measure(bytes) {
            Ok(count) => Ok((bytes, count)),
            Err(fault) => Err(fault.at(place())),
        });
        let sound = match sound {
            Err(error) if matches!(error.fault, ImportFault::TooMany { .. }) => return Err(error),
            sound => sound,
        };
        let checker = u64::from(CHECKER_SIDE * CHECKER_SIDE);
        pixels += sound.as_ref().map_or(checker, |&(_, count)| count);
        let limit = limits.max_texture_pixels;
        if pixels > limit {
            let fault = ImportFault::TooMany { what: "texture pixels", count: pixels, limit };
            return Err(fault.at(place()));
        }
        measured.push((index, sound.map(|(bytes, _)| bytes)));
    }
    let verifies = pixels > MAX_UNVERIFIED_PIXELS;
    let mut decoded = Decoded { textures: Vec::new(), placeholders: Vec::new() };
    for (index, sound) in measured {
        let texture = sound.and_then(|bytes| {
            let verified = if verifies { verify(bytes) } else { Ok(()) };
            let texture = verified.and_then(|()| decode_one(bytes));
            texture.map_err(|fault| fault.at(format!("/images/{index}")))
        });
        decoded.placeholders.push(texture.is_err());
        decoded.textures.push(texture.unwrap_or_else(|ImportError { fault, place, .. }| {
            let remedy = fault.remedy();
            notes.add(format!("texture shown as a checker: {fault}, at {place}: {remedy}"));
            checker()
        }));
    }
    Ok(decoded)
}

/// Returns the placeholder texture of a missing or broken image.
fn checker() -> Texture {
    let cell = |i: u32| {
        let (x, y) = (i % CHECKER_SIDE / CHECKER_CELL, i / CHECKER_SIDE / CHECKER_CELL);
        CHECKER[((x + y) % 2) as usize]
    };
    let rgba8 = (0..CHECKER_SIDE * CHECKER_SIDE).flat_map(cell).collect();
    Texture { width: CHECKER_SIDE, height: CHECKER_SIDE, rgba8 }
}

/// Counts the pixels of an image, from its header alone.
fn measure(bytes: &[u8]) -> Result<u64, ImportFault> {
    if ktx2_image::is_ktx2(bytes) {
        let [width, height] = ktx2_image::dimensions(bytes)?;
        check_sides(width, height)?;
        ktx2_image::first_level(bytes)?;
        return Ok(u64::from(width) * u64::from(height));
    }
    let decoder = decoder(bytes).map_err(image_fault)?;
    let (width, height) = decoder.dimensions();
    check_sides(width, height)?;
    let pixels = u64::from(width) * u64::from(height);
    let bits = pixels * u64::from(decoder.original_color_type().bits_per_pixel());
    let (needed, available) = (bits.div_ceil(8 * MAX_COMPRESSION), bytes.len() as u64);
    if needed > available {
        return Err(ImportFault::Beyond { what: "an image of its size", needed, available });
    }
    Ok(pixels)
}

fn check_sides(width: u32, height: u32) -> Result<(), ImportFault> {
    if width == 0 || height == 0 {
        return Err(ImportFault::Image("it has no pixels".into()));
    }
    if width > MAX_TEXTURE_SIDE || height > MAX_TEXTURE_SIDE {
        let (count, limit) = (width.max(height).into(), MAX_TEXTURE_SIDE.into());
        return Err(ImportFault::TooMany { what: "pixels along a side", count, limit });
    }
    Ok(())
}

/// Reads a PNG row by row, a KTX2 block by block. The JPEG decoder has no such way.
fn verify(bytes: &[u8]) -> Result<(), ImportFault> {
    if ktx2_image::is_ktx2(bytes) {
        return ktx2_image::first_level(bytes)?.verify();
    }
    if image::guess_format(bytes).ok() != Some(ImageFormat::Png) {
        return Ok(());
    }
    let limits = png::Limits { bytes: DECODER_BYTES as usize };
    let decoder = png::Decoder::new_with_limits(Cursor::new(bytes), limits);
    let verified = decoder.read_info().and_then(|mut reader| {
        while reader.next_row()?.is_some() {}
        Ok(())
    });
    verified.map_err(|reason| ImportFault::Image(reason.to_string()))
}

fn decode_one(bytes: &[u8]) -> Result<Texture, ImportFault> {
    if ktx2_image::is_ktx2(bytes) {
        return ktx2_image::first_level(bytes)?.decode();
    }
    let decoder = decoder(bytes).map_err(image_fault)?;
    let image = DynamicImage::from_decoder(decoder).map_err(image_fault)?.into_rgba8();
    Ok(Texture { width: image.width(), height: image.height(), rgba8: image.into_raw() })
}

fn decoder(bytes: &[u8]) -> Result<impl ImageDecoder + '_, image::ImageError> {
    let mut reader = ImageReader::new(Cursor::new(bytes)).with_guessed_format()?;
    // Only what glTF allows, whatever other crates turn on.
    if !matches!(reader.format(), Some(ImageFormat::Png | ImageFormat::Jpeg)) {
        reader.clear_format();
    }
    let mut limits = Limits::default();
    let side = u64::from(MAX_TEXTURE_SIDE);
    limits.max_alloc = Some(side * side * 8 + DECODER_BYTES);
    reader.limits(limits);
    reader.into_decoder()
}

fn image_fault(reason: image::ImageError) -> ImportFault {
    ImportFault::Image(reason.to_string())
}
