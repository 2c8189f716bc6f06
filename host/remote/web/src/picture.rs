//! Newest picture of the server in tiles, each with the number of its last change.

use busbar_protocol::pictures::{Area, PIXEL_BYTES};

/// Side of a tile, pixels: whole blocks of JPEG with half the resolution of colour.
pub(crate) const TILE: u32 = 64;
/// Areas that one message has at most; with more, one around all of them is sent.
pub(crate) const MAX_PARTS: usize = 32;

/// The newest picture that was true.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Picture {
    /// Width and height, pixels.
    pub(crate) size: [u32; 2],
    /// Blue, green, red and 255, rows from the top.
    pixels: Vec<u8>,
    /// Number of the picture in which each tile changed last, row by row.
    changed: Vec<u64>,
    /// Number of this picture, from 1.
    pub(crate) number: u64,
}

/// Columns and rows of tiles.
fn tiles_of([width, height]: [u32; 2]) -> [u32; 2] {
    [width.div_ceil(TILE), height.div_ceil(TILE)]
}

impl Picture {
    /// Takes the next picture, of which nothing outside `damage` changed; whether anything did.
    pub(crate) fn update(&mut self, size: [u32; 2], pixels: &[u8], damage: Area) -> bool {
        if self.size != size {
            let [columns, rows] = tiles_of(size);
            self.number += 1;
            self.size = size;
            self.pixels = pixels.to_vec();
            self.changed = vec![self.number; columns as usize * rows as usize];
            return true;
        }
        let number = self.number + 1;
        for tile in self.tiles_within(damage) {
            if self.replace(tile, pixels) {
                self.changed[tile] = number;
                self.number = number;
            }
        }
        self.number == number
    }

    /// Tiles that are at least partly within an area.
    fn tiles_within(&self, area: Area) -> Vec<usize> {
        let [columns, rows] = tiles_of(self.size);
        let range = |from: u32, length: u32, count: u32| {
            from / TILE..(from + length).div_ceil(TILE).min(count)
        };
        if area.is_empty() {
            return Vec::new();
        }
        let (across, down) = (range(area.x, area.width, columns), range(area.y, area.height, rows));
        down.flat_map(|y| across.clone().map(move |x| (y * columns + x) as usize)).collect()
    }

    /// Takes a tile's pixels from the next picture; whether they differ.
    fn replace(&mut self, tile: usize, pixels: &[u8]) -> bool {
        let area = self.area_of(tile);
        let mut differs = false;
        for y in area.y..area.y + area.height {
            let from = (y as usize * self.size[0] as usize + area.x as usize) * PIXEL_BYTES;
            let row = from..from + area.width as usize * PIXEL_BYTES;
            if self.pixels[row.clone()] != pixels[row.clone()] {
                self.pixels[row.clone()].copy_from_slice(&pixels[row]);
                differs = true;
            }
        }
        differs
    }

    /// A tile's pixels; the last of a row or column may be narrower.
    fn area_of(&self, tile: usize) -> Area {
        let columns = tiles_of(self.size)[0] as usize;
        let (x, y) = ((tile % columns) as u32 * TILE, (tile / columns) as u32 * TILE);
        let [width, height] = self.size;
        Area { x, y, width: TILE.min(width - x), height: TILE.min(height - y) }
    }

    /// Returns the number of each tile's last change.
    pub(crate) fn changed(&self) -> &[u64] {
        &self.changed
    }

    /// An area as red, green and blue, rows from the top.
    pub(crate) fn cut_out(&self, area: Area) -> Vec<u8> {
        let mut cut = Vec::with_capacity(area.width as usize * area.height as usize * 3);
        for y in area.y..area.y + area.height {
            let from = (y as usize * self.size[0] as usize + area.x as usize) * PIXEL_BYTES;
            let row = &self.pixels[from..from + area.width as usize * PIXEL_BYTES];
            cut.extend(row.chunks_exact(PIXEL_BYTES).flat_map(|bgra| [bgra[2], bgra[1], bgra[0]]));
        }
        cut
    }

    /// Few areas that cover tiles, and the tiles that they cover, which may be more.
    pub(crate) fn cover(&self, tiles: &[usize]) -> (Vec<Area>, Vec<usize>) {
        let areas = self.runs(tiles);
        if areas.len() <= MAX_PARTS {
            return (areas, tiles.to_vec());
        }
        let around = areas.into_iter().fold(Area::default(), Area::union);
        (vec![around], self.tiles_within(around))
    }

    /// Runs of tiles along rows; equal ones below each other are one.
    fn runs(&self, tiles: &[usize]) -> Vec<Area> {
        let mut runs: Vec<Area> = Vec::new();
        let mut areas: Vec<Area> = Vec::new();
        for area in tiles.iter().map(|&tile| self.area_of(tile)) {
            match runs.last_mut() {
                Some(run) if run.y == area.y && run.x + run.width == area.x => {
                    run.width += area.width;
                }
                _ => runs.push(area),
            }
        }
        for run in runs {
            let above = areas.iter_mut().find(|area| {
                (area.x, area.width) == (run.x, run.width) && area.y + area.height == run.y
            });
            match above {
                Some(area) => area.height += run.height,
                None => areas.push(run),
            }
        }
        areas
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIZE: [u32; 2] = [200, 150];

    fn grey(size: [u32; 2]) -> Vec<u8> {
        vec![0x80; (size[0] * size[1]) as usize * PIXEL_BYTES]
    }

    fn whole() -> Area {
        Area { x: 0, y: 0, width: SIZE[0], height: SIZE[1] }
    }

    #[test]
    fn only_tiles_that_differ_have_changed() {
        let mut picture = Picture::default();
        assert!(picture.update(SIZE, &grey(SIZE), whole()));
        assert_eq!((picture.number, picture.changed().len()), (1, 4 * 3));
        assert!(!picture.update(SIZE, &grey(SIZE), whole()), "nothing changed");
        assert_eq!(picture.number, 1);
        let mut next = grey(SIZE);
        // The last pixel, and one in the second tile of the first row.
        *next.last_mut().unwrap() = 0;
        next[70 * PIXEL_BYTES] = 1;
        assert!(picture.update(SIZE, &next, whole()));
        let changed: Vec<_> = (0..12).filter(|&tile| picture.changed()[tile] == 2).collect();
        assert_eq!(changed, [1, 11]);
        let last = Area { x: 199, y: 149, width: 1, height: 1 };
        let first = Area { x: 70, y: 0, width: 1, height: 1 };
        assert_eq!(picture.cut_out(first), [0x80, 0x80, 1]);
        assert_eq!(picture.cut_out(last), [0x80; 3]);
        assert!(picture.update([64, 64], &grey([64, 64]), whole()), "another size");
        assert_eq!(picture.changed(), [3]);
    }

    #[test]
    fn areas_cover_tiles_and_little_else() {
        let mut picture = Picture::default();
        picture.update(SIZE, &grey(SIZE), whole());
        let all: Vec<_> = (0..12).collect();
        assert_eq!(picture.cover(&all), (vec![whole()], all));
        let (areas, covered) = picture.cover(&[0, 1, 3, 4, 5, 11]);
        assert_eq!(covered, [0, 1, 3, 4, 5, 11]);
        let area = |x, y, width, height| Area { x, y, width, height };
        assert_eq!(areas, [area(0, 0, 128, 128), area(192, 0, 8, 64), area(192, 128, 8, 22)]);
    }

    #[test]
    fn more_areas_than_a_message_has_become_one() {
        let size = [TILE * 16, TILE * 16];
        let mut picture = Picture::default();
        picture.update(size, &grey(size), Area { x: 0, y: 0, width: size[0], height: size[1] });
        let board: Vec<_> = (0..256).filter(|tile| (tile + tile / 16) % 2 == 0).collect();
        let (areas, covered) = picture.cover(&board);
        assert_eq!((areas.len(), covered.len()), (1, 256));
    }
}
