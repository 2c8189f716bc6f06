//! KTX 2.0 images (Khronos KTX file format specification 2.0): the first level, as it is
//! or compressed with Zstandard, in formats that every device can be given as RGBA8; Basis
//! Universal (ETC1S and UASTC) too.

use std::borrow::Cow;
use std::io::{self, Read};
use std::ops::Range;

use basisu::{DecodeFlags, TargetFormat, Transcoder};
use busbar_scene::Texture;
use ktx2::{Format, Reader, SupercompressionScheme};
use ruzstd::decoding::StreamingDecoder;

use crate::error::ImportFault;

/// "File identifier" (section 3.1).
const IDENTIFIER: [u8; 12] = *b"\xABKTX 20\xBB\r\n\x1A\n";

/// A block of Zstandard holds 128 KiB at most, and takes 4 bytes at least (RFC 8878,
/// section 3.1.1.2): more than this cannot come from the bytes.
const MAX_COMPRESSION: u64 = 128 << 8;

/// Bytes of a window, as decoders are recommended to support (RFC 8878, section 3.1.1.1.2).
const MAX_WINDOW: u64 = 8 << 20;

/// Pixels along a side of a block.
const BLOCK: usize = 4;

/// Reports whether bytes begin with the KTX2 identifier.
pub(crate) fn is_ktx2(bytes: &[u8]) -> bool {
    bytes.starts_with(&IDENTIFIER)
}

/// Encoding of the pixels in a level.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Coding {
    Rgb8,
    Rgba8,
    /// Basis Universal, of which UASTC has blocks of 16 bytes and ETC1S none of a fixed size.
    Basis,
    /// Blocks of 4 x 4 pixels: bytes of each.
    Blocks(Block, usize),
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Block {
    Bc1,
    Bc2,
    Bc3,
    Bc4,
    Bc5,
    Bc7,
}

/// The first level of an image that was measured.
pub(crate) struct Level<'a> {
    file: &'a [u8],
    size: [u32; 2],
    coding: Coding,
    reader: Reader<&'a [u8]>,
    is_compressed: bool,
    /// Number of bytes once decompressed.
    bytes: u64,
}

/// Reads width and height in pixels, at least 1, from the header alone.
pub(crate) fn dimensions(bytes: &[u8]) -> Result<[u32; 2], ImportFault> {
    let header = read(bytes)?.header();
    let is_flat = header.pixel_height > 0
        && header.pixel_depth <= 1
        && header.layer_count <= 1
        && header.face_count == 1;
    match is_flat {
        true => Ok([header.pixel_width, header.pixel_height]),
        false => Err(fault("it is no single picture in two dimensions")),
    }
}

/// Returns the first level, checked against the bytes that exist, without decompressing.
pub(crate) fn first_level(bytes: &[u8]) -> Result<Level<'_>, ImportFault> {
    let size = dimensions(bytes)?;
    let reader = read(bytes)?;
    let header = reader.header();
    let coding = coding_of(header.format).ok_or_else(|| fault(&unreadable(header.format)))?;
    let is_compressed = match header.supercompression_scheme {
        None => false,
        Some(SupercompressionScheme::Zstandard) => true,
        Some(SupercompressionScheme::BasisLZ) if coding == Coding::Basis => false,
        Some(scheme) => return Err(fault(&format!("{scheme:?} is not supported"))),
    };
    let needed = match header.supercompression_scheme {
        // Codes of no fixed size; pixels are bounded.
        Some(SupercompressionScheme::BasisLZ) => 0,
        _ => coding.bytes(size),
    };
    let level = Level { file: bytes, size, coding, reader, is_compressed, bytes: needed };
    let available = level.data().len() as u64;
    let least = if is_compressed { needed.div_ceil(MAX_COMPRESSION) } else { needed };
    if available < least {
        let what = "an image of its size";
        return Err(ImportFault::Beyond { what, needed: least, available });
    }
    Ok(level)
}

impl Level<'_> {
    /// Returns the level's bytes as stored.
    fn data(&self) -> &[u8] {
        self.reader.levels().next().map_or(&[], |level| level.data)
    }

    /// Decodes the pixels of the first level.
    pub(crate) fn decode(&self) -> Result<Texture, ImportFault> {
        let [width, height] = self.size;
        let rgba8 = match (self.is_compressed, self.coding) {
            (_, Coding::Basis) => self.transcode()?,
            (false, coding) => coding.decode(self.size, &self.data()[..self.bytes as usize]),
            (true, Coding::Rgba8) => self.decompressed()?,
            (true, coding) => coding.decode(self.size, &self.decompressed()?),
        };
        Ok(Texture { width, height, rgba8 })
    }

    /// Reads the level through without keeping its pixels, so that a broken one costs no
    /// memory.
    pub(crate) fn verify(&self) -> Result<(), ImportFault> {
        match self.is_compressed {
            true => self.decompress(&mut io::sink()),
            false => Ok(()),
        }
    }

    /// Decodes the level from Basis Universal.
    fn transcode(&self) -> Result<Vec<u8>, ImportFault> {
        let broken = |reason| fault(&format!("Basis Universal: {reason:?}"));
        let file = match self.is_compressed {
            true => Cow::Owned(self.uncompressed_file()?),
            false => Cow::Borrowed(self.file),
        };
        let transcoder = Transcoder::new(&file).map_err(broken)?;
        let target = TargetFormat::Rgba32;
        let rgba8 = transcoder.transcode(0, target, DecodeFlags::NONE).map_err(broken)?;
        let [width, height] = self.size.map(u64::from);
        match rgba8.len() as u64 == width * height * 4 {
            true => Ok(rgba8),
            false => Err(fault("Basis Universal: it has another size than it says")),
        }
    }

    /// Writes the file anew without Zstandard, with its first level alone: header, level index
    /// and data format descriptor stay where they are (specification, section 3).
    fn uncompressed_file(&self) -> Result<Vec<u8>, ImportFault> {
        const LEVEL_COUNT: usize = 40;
        const SCHEME: usize = 44;
        /// Places of key values and of data for further compression: there are none.
        const OTHER_PLACES: Range<usize> = 56..80;
        const LEVEL_INDEX: Range<usize> = 80..104;
        let level = self.decompressed()?;
        let index = &self.reader.header().index;
        let end = index.dfd_byte_offset as usize + index.dfd_byte_length as usize;
        let head = self.file.get(..end).filter(|head| head.len() >= LEVEL_INDEX.end);
        let mut file = head.ok_or_else(|| fault("KTX: its header is cut short"))?.to_vec();
        file.resize(file.len().next_multiple_of(BLOCK * BLOCK), 0);
        let place = [file.len() as u64, level.len() as u64, level.len() as u64];
        file[LEVEL_COUNT..LEVEL_COUNT + 4].copy_from_slice(&1_u32.to_le_bytes());
        file[SCHEME..SCHEME + 4].fill(0);
        file[OTHER_PLACES].fill(0);
        file[LEVEL_INDEX].copy_from_slice(&place.map(u64::to_le_bytes).concat());
        file.extend(level);
        Ok(file)
    }

    fn decompressed(&self) -> Result<Vec<u8>, ImportFault> {
        let mut bytes = Vec::with_capacity(self.bytes as usize);
        self.decompress(&mut bytes)?;
        Ok(bytes)
    }

    fn decompress(&self, into: &mut impl io::Write) -> Result<(), ImportFault> {
        let broken = |reason: String| fault(&format!("Zstandard: {reason}"));
        let stream = StreamingDecoder::new_with_max_window_size(self.data(), MAX_WINDOW)
            .map_err(|reason| broken(reason.to_string()))?;
        let copied = io::copy(&mut stream.take(self.bytes + 1), into);
        let count = copied.map_err(|reason| broken(reason.to_string()))?;
        match count == self.bytes {
            true => Ok(()),
            false => Err(broken(format!("{count} bytes or more for {}", self.bytes))),
        }
    }
}

impl Coding {
    fn bytes(self, [width, height]: [u32; 2]) -> u64 {
        match self {
            Self::Rgb8 => u64::from(width) * u64::from(height) * 3,
            Self::Rgba8 => u64::from(width) * u64::from(height) * 4,
            Self::Basis => Self::Blocks(Block::Bc7, 16).bytes([width, height]),
            Self::Blocks(_, bytes) => {
                let blocks = [width, height].map(|side| u64::from(side).div_ceil(BLOCK as u64));
                blocks[0] * blocks[1] * bytes as u64
            }
        }
    }

    /// Decodes blocks to RGBA8; `bytes` are as many as the size takes.
    fn decode(self, size: [u32; 2], bytes: &[u8]) -> Vec<u8> {
        if self == Self::Rgb8 {
            let opaque = |&[r, g, b]: &[u8; 3]| [r, g, b, 255];
            return bytes.as_chunks().0.iter().flat_map(opaque).collect();
        }
        let Self::Blocks(block, block_bytes) = self else { return bytes.to_vec() };
        let [width, height] = size.map(|side| side as usize);
        let mut rgba8 = vec![0; width * height * 4];
        let blocks_a_row = width.div_ceil(BLOCK);
        for (index, data) in bytes.chunks_exact(block_bytes).enumerate() {
            let pixels = block.decode(data);
            let (left, top) = (index % blocks_a_row * BLOCK, index / blocks_a_row * BLOCK);
            // Blocks at the edges may reach beyond it.
            let columns = BLOCK.min(width - left);
            for (y, row) in pixels.chunks_exact(BLOCK * 4).enumerate().take(height - top) {
                let start = ((top + y) * width + left) * 4;
                rgba8[start..start + columns * 4].copy_from_slice(&row[..columns * 4]);
            }
        }
        rgba8
    }
}

impl Block {
    /// Decodes a block of 4 x 4 pixels, four bytes each.
    fn decode(self, data: &[u8]) -> [u8; BLOCK * BLOCK * 4] {
        const PITCH: usize = BLOCK * 4;
        let mut pixels = [255; BLOCK * BLOCK * 4];
        match self {
            Self::Bc1 => bcdec_rs::bc1(data, &mut pixels, PITCH),
            Self::Bc2 => bcdec_rs::bc2(data, &mut pixels, PITCH),
            Self::Bc3 => bcdec_rs::bc3(data, &mut pixels, PITCH),
            Self::Bc7 => bcdec_rs::bc7(data, &mut pixels, PITCH),
            Self::Bc4 => {
                let mut reds = [0; BLOCK * BLOCK];
                bcdec_rs::bc4(data, &mut reds, BLOCK, false);
                for (pixel, red) in pixels.chunks_exact_mut(4).zip(reds) {
                    pixel[..3].copy_from_slice(&[red, 0, 0]);
                }
            }
            Self::Bc5 => {
                let mut pairs = [0; BLOCK * BLOCK * 2];
                bcdec_rs::bc5(data, &mut pairs, BLOCK * 2, false);
                for (pixel, pair) in pixels.chunks_exact_mut(4).zip(pairs.chunks_exact(2)) {
                    pixel[..3].copy_from_slice(&[pair[0], pair[1], 0]);
                }
            }
        }
        pixels
    }
}

/// Returns the encoding of a supported format. Whether bytes are sRGB follows from the material's
/// use of them, as for PNG.
fn coding_of(format: Option<Format>) -> Option<Coding> {
    let Some(format) = format else { return Some(Coding::Basis) };
    Some(match format {
        Format::R8G8B8_UNORM | Format::R8G8B8_SRGB => Coding::Rgb8,
        Format::R8G8B8A8_UNORM | Format::R8G8B8A8_SRGB => Coding::Rgba8,
        Format::BC1_RGB_UNORM_BLOCK
        | Format::BC1_RGB_SRGB_BLOCK
        | Format::BC1_RGBA_UNORM_BLOCK
        | Format::BC1_RGBA_SRGB_BLOCK => Coding::Blocks(Block::Bc1, 8),
        Format::BC2_UNORM_BLOCK | Format::BC2_SRGB_BLOCK => Coding::Blocks(Block::Bc2, 16),
        Format::BC3_UNORM_BLOCK | Format::BC3_SRGB_BLOCK => Coding::Blocks(Block::Bc3, 16),
        Format::BC4_UNORM_BLOCK => Coding::Blocks(Block::Bc4, 8),
        Format::BC5_UNORM_BLOCK => Coding::Blocks(Block::Bc5, 16),
        Format::BC7_UNORM_BLOCK | Format::BC7_SRGB_BLOCK => Coding::Blocks(Block::Bc7, 16),
        _ => return None,
    })
}

fn unreadable(format: Option<Format>) -> String {
    format.map_or_else(String::new, |format| format!("KTX format {format:?} is not supported"))
}

fn read(bytes: &[u8]) -> Result<Reader<&[u8]>, ImportFault> {
    Reader::new(bytes).map_err(|reason| fault(&format!("KTX: {reason}")))
}

fn fault(reason: &str) -> ImportFault {
    ImportFault::Image(reason.to_owned())
}
