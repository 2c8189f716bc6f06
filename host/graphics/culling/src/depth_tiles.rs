//! Occlusion test against depth that was drawn, in tiles of the farthest depth.

use std::ops::Range;

use busbar_geometry::Bounds;
use glam::Mat4;

use crate::CameraView;
use crate::screen_box::{ScreenBox, hull};

/// Pixels along a side of a tile, of which the farthest depth is kept.
pub const TILE_PIXELS: u32 = 4;
/// Margin in pixels around a box. Slender things are drawn a pixel wide, and a rasterizer snaps to
/// 1/256 of a pixel.
const MARGIN_PIXELS: f32 = 0.6;
/// Tolerance of depths for rounding, as a share of the distance. A face that begins before the eye
/// has depths as exact as its greatest.
const DEPTH_TOLERANCE: f32 = 1e-3;

/// Position of a bounding box on the screen.
enum ScreenPlace {
    /// Before the near plane in part, or no place at all.
    Uncertain,
    /// Beside the picture, behind the eye or between pixels.
    Outside,
    /// In these columns and rows of tiles, with this depth at its nearest.
    Tiles([Range<u32>; 2], f32),
}

/// Depth of a part of a picture whose pixels have one sample, tile by tile.
#[derive(Default)]
pub struct DepthTiles {
    clip_from_world: Mat4,
    /// Size of the picture in pixels.
    size: [u32; 2],
    /// Margin by which occluded boxes lie farther, as a share of the distance.
    tolerance: f32,
    /// Tiles of it that are known: columns and rows.
    columns: Range<u32>,
    rows: Range<u32>,
    /// The least depth in each, row by row.
    tiles: Vec<f32>,
    queries: Vec<ScreenPlace>,
}

impl DepthTiles {
    /// Begins a frame of a camera without any depth.
    pub fn begin(&mut self, camera: &CameraView, size: [u32; 2]) {
        self.clip_from_world = camera.clip_from_world();
        self.size = size;
        self.tolerance = DEPTH_TOLERANCE + MARGIN_PIXELS / camera.pixels_per_unit(size[1]);
        (self.columns, self.rows) = (0..0, 0..0);
        self.tiles.clear();
        self.queries.clear();
    }

    /// Queues a query for a box; [`DepthTiles::query_results`] answers it.
    pub fn add_query(&mut self, clip_from_box: &Mat4, bounds: &Bounds) {
        let place = self.place_of(clip_from_box, bounds);
        if let ScreenPlace::Tiles([columns, rows], _) = &place {
            let with = |all: &Range<u32>, more: &Range<u32>| match all.is_empty() {
                true => more.clone(),
                false => hull(all, more),
            };
            (self.columns, self.rows) = (with(&self.columns, columns), with(&self.rows, rows));
        }
        self.queries.push(place);
    }

    /// Returns for each queued box whether it may be visible, once depth was read back.
    pub fn query_results(&self) -> impl Iterator<Item = bool> {
        self.queries.iter().map(|place| self.is_place_visible(place))
    }

    /// Returns the columns and rows of tiles that queries ask about.
    pub fn queried(&self) -> [&Range<u32>; 2] {
        [&self.columns, &self.rows]
    }

    /// Takes over the depth drawn in the queried tiles: pixel lines of a width.
    pub fn read(&mut self, depths: &[f32], width: usize) {
        add_tiles(&mut self.tiles, depths, width);
    }

    /// Reports whether a box may be visible: within the picture, and not behind the depth drawn. A
    /// box with NaN coordinates may be.
    #[inline]
    pub fn is_visible(&self, clip_from_box: &Mat4, bounds: &Bounds) -> bool {
        self.is_place_visible(&self.place_of(clip_from_box, bounds))
    }

    fn place_of(&self, clip_from_box: &Mat4, bounds: &Bounds) -> ScreenPlace {
        let found = ScreenBox::project(clip_from_box, bounds);
        let Some(nearest) = found.nearest() else {
            return if found.may_surround() {
                ScreenPlace::Uncertain
            } else {
                ScreenPlace::Outside
            };
        };
        // Depth is the near plane's distance over its own.
        let depth = found.near() / nearest * (1.0 + self.tolerance);
        let tiles = found.tiles(self.size, TILE_PIXELS, MARGIN_PIXELS);
        tiles.map_or(ScreenPlace::Outside, |tiles| ScreenPlace::Tiles(tiles, depth))
    }

    fn is_place_visible(&self, place: &ScreenPlace) -> bool {
        let ([columns, rows], depth) = match place {
            ScreenPlace::Uncertain => return true,
            ScreenPlace::Outside => return false,
            ScreenPlace::Tiles(tiles, depth) => (tiles, depth),
        };
        let is_within =
            |of: &Range<u32>, all: &Range<u32>| all.start <= of.start && of.end <= all.end;
        if !(is_within(columns, &self.columns) && is_within(rows, &self.rows)) {
            return true;
        }
        let width = self.columns.len();
        let from = (columns.start - self.columns.start) as usize;
        rows.clone().any(|row| {
            let start = (row - self.rows.start) as usize * width + from;
            let tiles = self.tiles.get(start..start + columns.len());
            !tiles.is_some_and(|tiles| tiles.iter().all(|tile| depth < tile))
        })
    }

    /// Returns the transform from world to clip space.
    pub fn clip_from_world(&self) -> &Mat4 {
        &self.clip_from_world
    }
}

/// Adds the tiles of pixel lines of a width.
fn add_tiles(tiles: &mut Vec<f32>, depths: &[f32], width: usize) {
    let mut least = Vec::with_capacity(width);
    for lines in depths.chunks(width * TILE_PIXELS as usize) {
        add_least(tiles, lines, width, &mut least);
    }
}

/// Adds the least depth of each tile of a row of tiles.
fn add_least(tiles: &mut Vec<f32>, lines: &[f32], width: usize, least: &mut Vec<f32>) {
    let lesser = |one: f32, other: f32| if one < other { one } else { other };
    let (first, others) = lines.split_at(width.min(lines.len()));
    least.clear();
    least.extend_from_slice(first);
    for line in others.chunks(width) {
        least.iter_mut().zip(line).for_each(|(least, &depth)| *least = lesser(depth, *least));
    }
    let (whole, rest) = least.as_chunks::<{ TILE_PIXELS as usize }>();
    tiles.extend(whole.iter().map(|[a, b, c, d]| lesser(lesser(*a, *b), lesser(*c, *d))));
    if !rest.is_empty() {
        tiles.push(rest.iter().copied().fold(f32::INFINITY, lesser));
    }
}

#[cfg(test)]
#[path = "depth_tiles_tests.rs"]
mod tests;
