//! KTX 2.0 files made in code (file format specification 2.0, section 3).

/// Formats by their number in Vulkan.
pub const RGBA8_UNORM: u32 = 37;
pub const RGBA8_SRGB: u32 = 43;
pub const BC1_RGBA: u32 = 133;
pub const BC3: u32 = 137;
pub const BC4: u32 = 139;
pub const BC5: u32 = 141;
pub const BC7: u32 = 145;
/// Format number of Basis Universal.
pub const UNDEFINED: u32 = 0;

/// Supercompression scheme: no further compression.
pub const PLAIN: u32 = 0;
pub const ZSTANDARD: u32 = 2;

/// One level; `bytes` of it once decompressed.
pub fn ktx2(
    format: u32,
    [width, height]: [u32; 2],
    scheme: u32,
    level: &[u8],
    bytes: u64,
) -> Vec<u8> {
    const HEADER: u32 = 80 + 24;
    let descriptor = descriptor();
    let data = HEADER + descriptor.len() as u32;
    let mut file = b"\xABKTX 20\xBB\r\n\x1A\n".to_vec();
    let mut words = |words: &[u32]| file.extend(words.iter().flat_map(|word| word.to_le_bytes()));
    words(&[format, 1, width, height, 0, 0, 1, 1, scheme]);
    words(&[HEADER, descriptor.len() as u32, 0, 0, 0, 0, 0, 0]);
    let mut longs = |longs: &[u64]| file.extend(longs.iter().flat_map(|long| long.to_le_bytes()));
    longs(&[u64::from(data), level.len() as u64, bytes]);
    file.extend(descriptor);
    file.extend(level);
    file
}

/// The same with a level compressed by Zstandard.
pub fn zstandard(format: u32, size: [u32; 2], level: &[u8]) -> Vec<u8> {
    let fastest = ruzstd::encoding::CompressionLevel::Fastest;
    let compressed = ruzstd::encoding::compress_to_vec(level, fastest);
    ktx2(format, size, ZSTANDARD, &compressed, level.len() as u64)
}

/// The least that a reader takes for a data format descriptor: one basic block with one
/// sample.
fn descriptor() -> Vec<u8> {
    let mut words = vec![44, 0, 2 | 40 << 16, 1 | 1 << 8 | 1 << 16];
    words.extend([0, 4, 0]);
    words.extend([7 << 16, 0, 0, 255]);
    words.iter().flat_map(|word: &u32| word.to_le_bytes()).collect()
}
