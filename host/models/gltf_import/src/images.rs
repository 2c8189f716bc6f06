//! Images: PNG, JPEG, WebP and KTX2, measured before they are decoded.

use std::collections::HashSet;
use std::io::Cursor;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::rc::Rc;

use busbar_scene::Texture;
use image::{DynamicImage, ImageDecoder, ImageFormat, ImageReader, Limits, RgbaImage, imageops};

use crate::ImportLimits;
use crate::buffers::Buffers;
use crate::error::{ImportError, ImportFault};
use crate::ktx2_image;
use crate::limits::MAX_TEXTURE_SIDE;
use crate::report::Notes;
use crate::schema::Image;

/// Deflate packs 258 bytes into two bits at best (zlib's "maximum compression
/// factor"), and JPEG stays below that for its one bit a block: more pixels
/// than this cannot come from the bytes. WebP has no such bound.
const MAX_COMPRESSION: u64 = 1032;

/// Memory that a decoder may take besides the pixels, bytes.
const DECODER_BYTES: u64 = 4 << 20;

/// Pixels that are decoded on trust. Of more, every PNG and KTX2 is first read through
/// without keeping its pixels, so that a damaged one costs no memory.
const MAX_UNVERIFIED_PIXELS: u64 = 8 << 20;

/// Pixels of one image that are decoded at once; a larger PNG is scaled down row by row.
const MAX_DECODED_PIXELS: u64 = 64 << 20;

/// Pixels of all images that are decoded, over those that are kept, and for each byte of them:
/// photographs have some eight a byte.
const MAX_DECODED_TIMES: u64 = 4;
const PIXELS_A_BYTE: u64 = 64;

/// Side of the placeholder checker and of one of its cells, pixels.
const CHECKER_SIDE: u32 = 16;
const CHECKER_CELL: u32 = 4;
/// Colours of the checker's cells in turn; nothing in a station looks like this.
const CHECKER: [[u8; 4]; 2] = [[255, 0, 255, 255], [128, 128, 128, 255]];

const SCALED: &str = "texture scaled down: it has too many pixels";

/// Textures, and which of them only stand in for an image that is missing or broken.
pub(crate) struct Decoded {
    pub(crate) textures: Vec<Texture>,
    pub(crate) placeholders: Vec<bool>,
}

/// The bytes of an image.
enum ImageBytes<'a> {
    File(Rc<Vec<u8>>),
    View(&'a [u8]),
}

impl ImageBytes<'_> {
    fn get(&self) -> &[u8] {
        match self {
            Self::File(bytes) => bytes,
            Self::View(bytes) => bytes,
        }
    }
}

/// An image that was measured: its bytes and its size in pixels.
struct Measured<'a> {
    bytes: ImageBytes<'a>,
    size: [u32; 2],
    /// By how much both sides are divided.
    divisor: u32,
}

impl Measured<'_> {
    fn scaled(&self) -> [u32; 2] {
        self.size.map(|side| side.div_ceil(self.divisor))
    }

    /// Returns the pixels before the image is scaled.
    fn whole_pixels(&self) -> u64 {
        u64::from(self.size[0]) * u64::from(self.size[1])
    }

    fn pixels(&self) -> u64 {
        let [width, height] = self.scaled();
        u64::from(width) * u64::from(height)
    }
}

/// Loads and decodes images; missing or broken ones become a checker, with a remark. Those with
/// too many pixels are scaled down, so that all together stay within the limit.
pub(crate) fn load(
    images: &[usize],
    buffers: &Buffers<'_>,
    limits: &ImportLimits,
    notes: &mut Notes,
) -> Decoded {
    let mut measured: Vec<Result<Measured<'_>, ImportError>> =
        images.iter().map(|&index| measure_one(index, buffers)).collect();
    fit(&mut measured, images, limits.max_texture_pixels);
    let sound = || measured.iter().flatten();
    let verifies = sound().map(Measured::whole_pixels).sum::<u64>() > MAX_UNVERIFIED_PIXELS;
    let scaled = sound().filter(|image| image.divisor > 1).count();
    notes.add_many(SCALED, scaled);
    let mut decoded = Decoded { textures: Vec::new(), placeholders: Vec::new() };
    for (&index, image) in images.iter().zip(measured) {
        let texture = image.and_then(|image| {
            // A decoder that fails costs its picture, not the model.
            let decoded = catch_unwind(AssertUnwindSafe(|| decode(&image, verifies)));
            let failed = |_| Err(ImportFault::Image("its decoder failed".into()));
            let texture = decoded.unwrap_or_else(failed);
            texture.map_err(|fault| fault.at(format!("/images/{index}")))
        });
        decoded.placeholders.push(texture.is_err());
        decoded.textures.push(texture.unwrap_or_else(|ImportError { fault, place, .. }| {
            let remedy = fault.remedy();
            notes.add(format!("texture shown as a checker: {fault}, at {place}: {remedy}"));
            checker()
        }));
    }
    decoded
}

fn measure_one<'b>(index: usize, buffers: &'b Buffers<'_>) -> Result<Measured<'b>, ImportError> {
    let place = || format!("/images/{index}");
    let image: Image<'_> = buffers.document().images.parse(index, place)?;
    let bytes = match (image.buffer_view, image.uri.as_deref()) {
        (Some(view), _) => {
            ImageBytes::View(buffers.view(view.index(), || place() + "/bufferView")?.bytes)
        }
        (None, Some(uri)) => ImageBytes::File(buffers.load_file(uri, &(place() + "/uri"))?),
        (None, None) => {
            let fault = ImportFault::Image("it names neither a URI nor a buffer view".into());
            return Err(fault.at(place()));
        }
    };
    let size = measure(bytes.get()).map_err(|fault| fault.at(place()))?;
    let largest = size[0].max(size[1]);
    Ok(Measured { bytes, size, divisor: largest.div_ceil(MAX_TEXTURE_SIDE) })
}

/// Scales the larger images down until all fit the limit. Those beyond what is decoded at all are
/// faults.
fn fit(measured: &mut [Result<Measured<'_>, ImportError>], images: &[usize], limit: u64) {
    let mut counted = HashSet::new();
    let distinct = measured.iter().flatten().filter(|image| {
        let bytes = image.bytes.get();
        counted.insert((bytes.as_ptr().addr(), bytes.len()))
    });
    let bytes: u64 = distinct.map(|image| image.bytes.get().len() as u64).sum();
    let allowed = MAX_DECODED_TIMES * limit + PIXELS_A_BYTE * bytes;
    let mut decoded = 0_u64;
    for (&index, image) in images.iter().zip(measured.iter_mut()) {
        decoded += image.as_ref().map_or(0, Measured::whole_pixels);
        if decoded > allowed && image.is_ok() {
            let fault = ImportFault::TooMany { what: "pixels", count: decoded, limit: allowed };
            *image = Err(fault.at(format!("/images/{index}")));
        }
    }
    let checkers = measured.iter().filter(|image| image.is_err()).count() as u64;
    let taken = checkers * u64::from(CHECKER_SIDE * CHECKER_SIDE);
    let sound = (measured.len() as u64 - checkers).max(1);
    // An equal share for each is enough for all.
    let share = (limit.saturating_sub(taken) / sound).max(1);
    while measured.iter().flatten().map(Measured::pixels).sum::<u64>() + taken > limit {
        let larger = measured.iter_mut().flatten().filter(|image| image.pixels() > share);
        let mut any = false;
        for image in larger {
            image.divisor *= 2;
            any = true;
        }
        if !any {
            return;
        }
    }
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

/// Reads the size of an image in pixels, from its header alone.
fn measure(bytes: &[u8]) -> Result<[u32; 2], ImportFault> {
    if ktx2_image::is_ktx2(bytes) {
        let size = ktx2_image::dimensions(bytes)?;
        require_pixels(size)?;
        ktx2_image::first_level(bytes)?;
        return Ok(size);
    }
    let decoder = decoder(bytes).map_err(image_fault)?;
    let (width, height) = decoder.dimensions();
    require_pixels([width, height])?;
    let pixels = u64::from(width) * u64::from(height);
    let format = image::guess_format(bytes).ok();
    if format != Some(ImageFormat::WebP) {
        let bits_a_pixel = png_bits_a_pixel(bytes)
            .unwrap_or_else(|| decoder.original_color_type().bits_per_pixel().into());
        let needed = pixels.saturating_mul(bits_a_pixel).div_ceil(8 * MAX_COMPRESSION);
        let available = bytes.len() as u64;
        if needed > available {
            return Err(ImportFault::Beyond { what: "an image of its size", needed, available });
        }
    }
    if pixels > MAX_DECODED_PIXELS && !can_scale_rows(bytes) {
        let (count, limit) = (pixels, MAX_DECODED_PIXELS);
        return Err(ImportFault::TooMany { what: "pixels in one image", count, limit });
    }
    Ok([width, height])
}

/// Returns the bits that a pixel of a PNG takes in its rows (PNG specification, section 11.2.1);
/// `None` for other images. Pixels of palettes take fewer than their colours.
fn png_bits_a_pixel(bytes: &[u8]) -> Option<u64> {
    let &[depth, color_type] = png_header(bytes)?.get(8..10)? else { return None };
    let samples = match color_type {
        2 => 3,
        4 => 2,
        6 => 4,
        _ => 1,
    };
    Some(u64::from(depth) * samples)
}

/// Returns the content of a PNG's header chunk.
fn png_header(bytes: &[u8]) -> Option<&[u8]> {
    (image::guess_format(bytes).ok()? == ImageFormat::Png).then(|| bytes.get(16..29))?
}

/// Reports whether an image is a PNG whose rows come in order.
fn can_scale_rows(bytes: &[u8]) -> bool {
    png_header(bytes).is_some_and(|header| header[12] == 0)
}

fn require_pixels([width, height]: [u32; 2]) -> Result<(), ImportFault> {
    if width == 0 || height == 0 {
        return Err(ImportFault::Image("it has no pixels".into()));
    }
    Ok(())
}

/// Reads a PNG row by row, a KTX2 block by block. The others have no such way.
fn verify(bytes: &[u8]) -> Result<(), ImportFault> {
    if ktx2_image::is_ktx2(bytes) {
        return ktx2_image::first_level(bytes)?.verify();
    }
    if image::guess_format(bytes).ok() != Some(ImageFormat::Png) {
        return Ok(());
    }
    let verified = png_decoder(bytes).read_info().and_then(|mut reader| {
        while reader.next_row()?.is_some() {}
        Ok(())
    });
    verified.map_err(png_fault)
}

fn png_decoder(bytes: &[u8]) -> png::Decoder<Cursor<&[u8]>> {
    let limits = png::Limits { bytes: DECODER_BYTES as usize };
    png::Decoder::new_with_limits(Cursor::new(bytes), limits)
}

fn png_fault(reason: png::DecodingError) -> ImportFault {
    ImportFault::Image(reason.to_string())
}

fn decode(image: &Measured<'_>, verifies: bool) -> Result<Texture, ImportFault> {
    let bytes = image.bytes.get();
    if image.divisor > 1 && can_scale_rows(bytes) {
        return scale_rows(bytes, image.divisor);
    }
    if verifies {
        verify(bytes)?;
    }
    let whole = decode_whole(bytes)?;
    if image.divisor == 1 {
        return Ok(whole);
    }
    let [width, height] = image.scaled();
    let pixels = RgbaImage::from_raw(whole.width, whole.height, whole.rgba8);
    let pixels = pixels.ok_or_else(|| ImportFault::Image("its rows are not whole".into()))?;
    let scaled = imageops::thumbnail(&pixels, width, height);
    Ok(Texture { width, height, rgba8: scaled.into_raw() })
}

fn decode_whole(bytes: &[u8]) -> Result<Texture, ImportFault> {
    if ktx2_image::is_ktx2(bytes) {
        return ktx2_image::first_level(bytes)?.decode();
    }
    let decoder = decoder(bytes).map_err(image_fault)?;
    let image = DynamicImage::from_decoder(decoder).map_err(image_fault)?.into_rgba8();
    Ok(Texture { width: image.width(), height: image.height(), rgba8: image.into_raw() })
}

/// Scales a PNG down while its rows are read: each pixel is the mean of a square.
fn scale_rows(bytes: &[u8], divisor: u32) -> Result<Texture, ImportFault> {
    let mut decoder = png_decoder(bytes);
    decoder.set_transformations(
        png::Transformations::normalize_to_color8() | png::Transformations::ALPHA,
    );
    let mut reader = decoder.read_info().map_err(png_fault)?;
    let (color, _) = reader.output_color_type();
    let (source_width, source_height) = (reader.info().width, reader.info().height);
    let (width, height) = (source_width.div_ceil(divisor), source_height.div_ceil(divisor));
    let mut rgba8 = Vec::with_capacity(width as usize * height as usize * 4);
    let mut sums = vec![[0_u64; 5]; width as usize];
    let mut flush = |sums: &mut [[u64; 5]]| {
        for sum in sums.iter_mut() {
            let [r, g, b, a, count] = std::mem::take(sum);
            rgba8.extend([r, g, b, a].map(|channel| (channel / count.max(1)) as u8));
        }
    };
    let mut y = 0;
    while let Some(row) = reader.next_row().map_err(png_fault)? {
        let samples = color.samples();
        for (x, pixel) in row.data().chunks_exact(samples).enumerate() {
            let [r, g, b, a] = match *pixel {
                [grey, alpha] => [grey, grey, grey, alpha],
                [r, g, b, a] => [r, g, b, a],
                _ => return Err(ImportFault::Image("its pixels have no alpha".into())),
            };
            let sum = &mut sums[x / divisor as usize];
            for (sum, value) in sum.iter_mut().zip([r, g, b, a, 1]) {
                *sum += u64::from(value);
            }
        }
        y += 1;
        if y % divisor == 0 || y == source_height {
            flush(&mut sums);
        }
    }
    match rgba8.len() == width as usize * height as usize * 4 {
        true => Ok(Texture { width, height, rgba8 }),
        false => Err(ImportFault::Image("it ends before its last row".into())),
    }
}

fn decoder(bytes: &[u8]) -> Result<impl ImageDecoder + '_, image::ImageError> {
    let mut reader = ImageReader::new(Cursor::new(bytes)).with_guessed_format()?;
    // Only what is meant to be read, whatever other crates turn on.
    let formats = [ImageFormat::Png, ImageFormat::Jpeg, ImageFormat::WebP];
    if !reader.format().is_some_and(|format| formats.contains(&format)) {
        reader.clear_format();
    }
    let mut limits = Limits::default();
    limits.max_alloc = Some(MAX_DECODED_PIXELS * 8 + DECODER_BYTES);
    reader.limits(limits);
    reader.into_decoder()
}

fn image_fault(reason: image::ImageError) -> ImportFault {
    ImportFault::Image(reason.to_string())
}
