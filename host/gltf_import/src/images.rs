//! Images: PNG and JPEG, measured before they are decoded.

use std::io::Cursor;

use busbar_scene::Texture;
use gltf::json::Root;
use image::{DynamicImage, ImageDecoder, ImageFormat, ImageReader, Limits};

use crate::ImportLimits;
use crate::buffers::Buffers;
use crate::error::{Fault, ImportError};
use crate::files::Files;
use crate::limits::MAX_TEXTURE_SIDE;

/// Deflate packs 258 bytes into two bits at best (zlib's "maximum compression
/// factor"), and JPEG stays below that for its one bit a block: more pixels
/// than this cannot come from the bytes.
const MAX_COMPRESSION: u64 = 1032;

/// What a decoder may take beside the pixels.
const DECODER_BYTES: u64 = 4 << 20;

/// Pixels that are decoded on trust. Of more, every PNG is first read through
/// without keeping its pixels, so that a damaged one costs no memory.
const MAX_UNVERIFIED_PIXELS: u64 = 8 << 20;

/// The files of those images that are not in a buffer.
pub(crate) fn load(
    root: &Root,
    images: &[usize],
    files: &mut Files<'_>,
) -> Result<Vec<Option<usize>>, ImportError> {
    let load = |&index: &usize| match (&root.images[index].uri, root.images[index].buffer_view) {
        (_, Some(_)) => Ok(None),
        (Some(uri), None) => files.load(uri, &format!("/images/{index}/uri")).map(Some),
        (None, None) => {
            let fault = Fault::Image("it names neither a URI nor a buffer view".into());
            Err(fault.at(format!("/images/{index}")))
        }
    };
    images.iter().map(load).collect()
}

/// Decodes images. Their pixels together stay within the limit.
pub(crate) fn decode(
    root: &Root,
    images: &[usize],
    loaded: &[Option<usize>],
    buffers: &Buffers<'_>,
    files: &Files<'_>,
    limits: &ImportLimits,
) -> Result<Vec<Texture>, ImportError> {
    let mut sources = Vec::with_capacity(images.len());
    let mut pixels = 0;
    for (&index, file) in images.iter().zip(loaded) {
        let place = || format!("/images/{index}");
        let bytes = match (root.images[index].buffer_view, file) {
            (_, Some(file)) => files.get(*file),
            (Some(view), None) => buffers.view(view.value(), || place() + "/bufferView")?.bytes,
            (None, None) => &[],
        };
        pixels += measure(bytes).map_err(|fault| fault.at(place()))?;
        let limit = limits.max_texture_pixels;
        if pixels > limit {
            let fault = Fault::TooMany { what: "texture pixels", count: pixels, limit };
            return Err(fault.at(place()));
        }
        sources.push((index, bytes));
    }
    if pixels > MAX_UNVERIFIED_PIXELS {
        for &(index, bytes) in &sources {
            verify(bytes).map_err(|fault| fault.at(format!("/images/{index}")))?;
        }
    }
    let texture = |(index, bytes)| {
        decode_one(bytes).map_err(|reason| image_fault(reason).at(format!("/images/{index}")))
    };
    sources.into_iter().map(texture).collect()
}

/// The pixels of an image, from its header alone.
fn measure(bytes: &[u8]) -> Result<u64, Fault> {
    let decoder = decoder(bytes).map_err(image_fault)?;
    let (width, height) = decoder.dimensions();
    if width == 0 || height == 0 {
        return Err(Fault::Image("it has no pixels".into()));
    }
    if width > MAX_TEXTURE_SIDE || height > MAX_TEXTURE_SIDE {
        let (count, limit) = (width.max(height).into(), MAX_TEXTURE_SIDE.into());
        return Err(Fault::TooMany { what: "pixels along a side", count, limit });
    }
    let pixels = u64::from(width) * u64::from(height);
    let bits = pixels * u64::from(decoder.original_color_type().bits_per_pixel());
    let (needed, available) = (bits.div_ceil(8 * MAX_COMPRESSION), bytes.len() as u64);
    if needed > available {
        return Err(Fault::Beyond { what: "an image of its size", needed, available });
    }
    Ok(pixels)
}

/// Reads a PNG row by row. The JPEG decoder has no such way.
fn verify(bytes: &[u8]) -> Result<(), Fault> {
    if image::guess_format(bytes).ok() != Some(ImageFormat::Png) {
        return Ok(());
    }
    let limits = png::Limits { bytes: DECODER_BYTES as usize };
    let decoder = png::Decoder::new_with_limits(Cursor::new(bytes), limits);
    let verified = decoder.read_info().and_then(|mut reader| {
        while reader.next_row()?.is_some() {}
        Ok(())
    });
    verified.map_err(|reason| Fault::Image(reason.to_string()))
}

fn decode_one(bytes: &[u8]) -> Result<Texture, image::ImageError> {
    let image = DynamicImage::from_decoder(decoder(bytes)?)?.into_rgba8();
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

fn image_fault(reason: image::ImageError) -> Fault {
    Fault::Image(reason.to_string())
}
