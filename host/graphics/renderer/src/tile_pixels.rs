//! Pixels of tiles of a picture.

use std::ops::Range;

use busbar_gpu::ImageArea;

/// Returns the pixels of columns and rows of tiles, clipped to the picture.
pub(crate) fn tile_pixels(
    [columns, rows]: [&Range<u32>; 2],
    tile: u32,
    picture: [u32; 2],
) -> ImageArea {
    let along = |tiles: &Range<u32>, most: u32| {
        let start = tiles.start * tile;
        [start, (tiles.end * tile).min(most).saturating_sub(start)]
    };
    let [[left, width], [top, height]] = [along(columns, picture[0]), along(rows, picture[1])];
    ImageArea { origin: [left, top], size: [width, height] }
}
