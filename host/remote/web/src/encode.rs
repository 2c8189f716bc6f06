//! Encoding of picture parts for pages, which `page/picture.js` decodes.

use busbar_protocol::pictures::Area;
use image::codecs::jpeg::JpegEncoder;
use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use image::{ExtendedColorType, ImageEncoder, ImageError};

use crate::picture::Picture;

/// Image format of the parts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Format {
    /// JPEG of this quality, 1 to 100.
    Jpeg(u8),
    /// PNG, which is lossless.
    Png,
}

/// Encodes areas of a picture as one message: format (0 JPEG, 1 PNG), 0, number of parts,
/// the picture's number, width and height; x, y, width, height and bytes of each part;
/// the parts. Numbers are little-endian, of two bytes; the picture's and those of bytes four.
///
/// # Errors
/// The encoder's.
pub(crate) fn message(
    picture: &Picture,
    areas: &[Area],
    format: Format,
) -> Result<Vec<u8>, ImageError> {
    let parts: Vec<_> =
        areas.iter().map(|&area| part(picture, area, format)).collect::<Result<_, _>>()?;
    let mut bytes = vec![u8::from(format == Format::Png), 0];
    let short = |bytes: &mut Vec<u8>, number: u32| bytes.extend((number as u16).to_le_bytes());
    short(&mut bytes, areas.len() as u32);
    // Pages compare it for equality alone.
    bytes.extend((picture.number as u32).to_le_bytes());
    picture.size.iter().for_each(|side| short(&mut bytes, *side));
    for (area, part) in areas.iter().zip(&parts) {
        [area.x, area.y, area.width, area.height].iter().for_each(|n| short(&mut bytes, *n));
        bytes.extend((part.len() as u32).to_le_bytes());
    }
    parts.iter().for_each(|part| bytes.extend(part));
    Ok(bytes)
}

fn part(picture: &Picture, area: Area, format: Format) -> Result<Vec<u8>, ImageError> {
    let (rgb, mut bytes) = (picture.cut_out(area), Vec::new());
    let (width, height, color) = (area.width, area.height, ExtendedColorType::Rgb8);
    match format {
        Format::Jpeg(quality) => {
            JpegEncoder::new_with_quality(&mut bytes, quality)
                .encode(&rgb, width, height, color)?;
        }
        Format::Png => {
            let (compression, filter) = (CompressionType::Fast, FilterType::Adaptive);
            PngEncoder::new_with_quality(&mut bytes, compression, filter)
                .write_image(&rgb, width, height, color)?;
        }
    }
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_lie_where_the_message_says() {
        let mut picture = Picture::default();
        let size = [100_u32, 70];
        let pixels: Vec<u8> = (0..size[0] * size[1])
            .flat_map(|i| [(i % 100) as u8, (i / 100) as u8, (i % 7) as u8 * 30, 255])
            .collect();
        picture.update(size, &pixels, Area { x: 0, y: 0, width: 100, height: 70 });
        let areas = [
            Area { x: 64, y: 0, width: 36, height: 64 },
            Area { x: 0, y: 64, width: 64, height: 6 },
        ];
        for format in [Format::Png, Format::Jpeg(90)] {
            let bytes = message(&picture, &areas, format).unwrap();
            let short = |at: usize| u32::from(u16::from_le_bytes([bytes[at], bytes[at + 1]]));
            let long = |at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap());
            assert_eq!(bytes[0], u8::from(format == Format::Png));
            assert_eq!((short(2), long(4), short(8), short(10)), (2, 1, 100, 70));
            let mut at = 12 + 2 * 12;
            for (i, area) in areas.iter().enumerate() {
                let place = 12 + i * 12;
                let told = [0, 2, 4, 6].map(|offset| short(place + offset));
                assert_eq!(told, [area.x, area.y, area.width, area.height]);
                let length = long(place + 8) as usize;
                let decoded = image::load_from_memory(&bytes[at..at + length]).unwrap().to_rgb8();
                assert_eq!(decoded.dimensions(), (area.width, area.height));
                if format == Format::Png {
                    assert_eq!(decoded.into_raw(), picture.cut_out(*area));
                }
                at += length;
            }
            assert_eq!(at, bytes.len());
        }
    }
}
