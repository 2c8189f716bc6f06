//! Masked software occlusion culling against large faces.
//!
//! A picture in cells of 8 by 8 pixels, each with a mask of those that are covered and
//! one depth that all of these are before (J. Hasselgren, M. Andersson and T.
//! Akenine-Möller, "Masked Software Occlusion Culling", HPG 2016). It holds for every
//! sample of a pixel, so that it never hides what would be seen.

use std::ops::Range;

use busbar_geometry::Bounds;
use glam::{Mat4, Vec2, Vec3, Vec4};

use crate::CameraView;
use crate::screen_box::ScreenBox;

/// Pixels along a side of a cell.
const CELL: u32 = 8;
/// The mask of a cell that is covered.
const COVERED: u64 = u64::MAX;
/// Corners of a face, with the one that the near plane adds to a convex one.
const MAX_CORNERS: usize = crate::occluders::MAX_CORNERS + 1;
/// Pixels by which a rasteriser may draw an edge elsewhere than we do: it keeps places to
/// 1/256 of a pixel (Vulkan, `subPixelPrecisionBits`).
const SNAP_PIXELS: f32 = 1.0 / 64.0;
/// Rounding error of edges and depths far beside the picture, as a share.
const ROUNDING: f32 = 1.0 / (1 << 17) as f32;
/// Pixels from the picture beyond which faces are not drawn.
const MAX_PLACE: f32 = 1e8;
/// From a pixel's middle to where samples may be, pixels.
const SAMPLE_OFFSET_PIXELS: f32 = 0.5;
/// Margin in pixels around a box: slender parts are drawn at least a pixel wide.
const MARGIN_PIXELS: f32 = 2.0;
/// Margin by which occluded boxes lie farther, as a share of the distance, whatever the picture's
/// size.
const DEPTH_TOLERANCE: f32 = 1e-3;
/// Half of the minimum width of slender parts in pixels; it brings them nearer by as much.
const SLENDER: f32 = 0.5;

/// Masked depth buffer of large faces. Depths are one over the distance along the line of sight,
/// which is linear on the screen.
#[derive(Default)]
pub struct MaskedDepthBuffer {
    size: [u32; 2],
    columns: usize,
    /// Pixels by which a face's edges are drawn in.
    margin: f32,
    /// Pixels by which, a unit away, places may be elsewhere for their distance from the origin.
    rounding: f32,
    /// Margin by which occluded boxes lie farther, as a share of the distance.
    tolerance: f32,
    masks: Vec<u64>,
    /// Least depth among the faces that cover a cell.
    depths: Vec<f32>,
}

impl MaskedDepthBuffer {
    /// Begins a picture of a non-zero size and a number of samples a pixel.
    pub fn begin(&mut self, camera: &CameraView, size: [u32; 2], samples: u32) {
        let [columns, rows] = size.map(|pixels| pixels.div_ceil(CELL) as usize);
        let pixels_per_unit = camera.pixels_per_unit(size[1]);
        self.size = size;
        self.columns = columns;
        self.margin = if samples > 1 { SAMPLE_OFFSET_PIXELS + SNAP_PIXELS } else { SNAP_PIXELS };
        self.rounding = camera.eye.abs().max_element() * 2.0 * f32::EPSILON * pixels_per_unit;
        self.tolerance = DEPTH_TOLERANCE + SLENDER / pixels_per_unit;
        self.masks.clear();
        self.masks.resize(columns * rows, 0);
        self.depths.clear();
        self.depths.resize(columns * rows, f32::INFINITY);
        self.cover_outside(rows);
    }

    /// Marks pixels of cells beyond the picture's edges as covered.
    fn cover_outside(&mut self, rows: usize) {
        let [beyond_right, beyond_below] = self.size.map(|pixels| pixels % CELL);
        if beyond_right > 0 {
            let row = 0xff_u64 << beyond_right & 0xff;
            let mask = row * 0x0101_0101_0101_0101;
            (0..rows).for_each(|at| self.masks[(at + 1) * self.columns - 1] |= mask);
        }
        if beyond_below > 0 {
            let mask = COVERED << (beyond_below * CELL);
            let last = (rows - 1) * self.columns;
            self.masks[last..].iter_mut().for_each(|cell| *cell |= mask);
        }
    }

    /// Adds a convex flat face by its corners in clip space, either way around.
    pub fn add(&mut self, corners: impl Iterator<Item = Vec4>) {
        let mut clipped = ClippedPolygon::default();
        corners.for_each(|corner| clipped.push(corner));
        let clipped = clipped.beyond_near();
        let margins = [self.margin, self.rounding];
        let Some(face) = ScreenPolygon::new(clipped.get(), self.size, margins) else { return };
        let [top, bottom] = [face.least.y, face.most.y].map(|y| y.clamp(0.0, self.size[1] as f32));
        let rows = (top as u32 / CELL)..(bottom.ceil() as u32).div_ceil(CELL);
        rows.for_each(|row| self.add_row(&face, row));
    }

    /// Rasterizes a face into a row of cells.
    fn add_row(&mut self, face: &ScreenPolygon, row: u32) {
        let spans: [Range<i32>; CELL as usize] =
            std::array::from_fn(|line| face.span(row * CELL + line as u32, self.size[0]));
        let filled = spans.iter().filter(|span| !span.is_empty());
        let (Some(start), Some(end)) =
            (filled.clone().map(|span| span.start).min(), filled.map(|span| span.end).max())
        else {
            return;
        };
        let inner = spans
            .iter()
            .fold(0..i32::MAX, |inner, span| inner.start.max(span.start)..inner.end.min(span.end));
        let cell = CELL as i32;
        for column in start / cell..(end + cell - 1) / cell {
            let left = column * cell;
            let mask = if inner.start <= left && left + cell <= inner.end {
                COVERED
            } else {
                let lines = (0..).step_by(CELL as usize).zip(&spans);
                lines.fold(0, |mask, (line, span)| mask | row_mask(span, left) << line)
            };
            let at = row as usize * self.columns + column as usize;
            if mask & !self.masks[at] != 0 {
                self.masks[at] |= mask;
                let middle = Vec2::new(left as f32, (row * CELL) as f32) + CELL as f32 * 0.5;
                self.depths[at] = self.depths[at].min(face.least_depth_around(middle));
            }
        }
    }

    /// Reports whether a box may be visible: within the picture, and not behind added faces. A box
    /// with NaN coordinates may be.
    pub fn is_visible(&self, clip_from_box: &Mat4, bounds: &Bounds) -> bool {
        let found = ScreenBox::project(clip_from_box, bounds);
        let Some(nearest) = found.nearest() else { return found.may_surround() };
        let depth = (1.0 + self.tolerance) / nearest;
        // Most of what is seen is so in its middle.
        if self.is_point_visible(found.center(), depth) {
            return true;
        }
        let [least, most] = found.extent();
        let [width, height] = self.size.map(|pixels| pixels as f32);
        let scale = Vec2::new(width, height) * 0.5;
        let least = least * scale + scale - MARGIN_PIXELS;
        let most = most * scale + scale + MARGIN_PIXELS;
        if most.x < 0.0 || most.y < 0.0 || least.x > width || least.y > height {
            return false;
        }
        let cells = |from: f32, to: f32, pixels: u32| {
            let last = (to as u32).min(pixels - 1) / CELL;
            (from.max(0.0) as u32 / CELL) as usize..=last as usize
        };
        let columns = cells(least.x, most.x, self.size[0]);
        let is_hidden = |row: usize| {
            let cells = columns.clone().map(|column| row * self.columns + column);
            cells.into_iter().all(|at| self.is_behind(at, depth))
        };
        !cells(least.y, most.y, self.size[1]).all(is_hidden)
    }

    /// Reports whether a point at a depth is in the picture and not occluded in its cell.
    fn is_point_visible(&self, place: Vec4, depth: f32) -> bool {
        let [width, height] = self.size.map(|pixels| pixels as f32);
        let x = (place.x / place.w * 0.5 + 0.5) * width;
        let y = (place.y / place.w * 0.5 + 0.5) * height;
        if !(x >= 0.0 && y >= 0.0 && x < width && y < height) {
            return false;
        }
        let [column, row] = [x, y].map(|at| at as usize / CELL as usize);
        !self.is_behind(row * self.columns + column, depth)
    }

    fn is_behind(&self, cell: usize, depth: f32) -> bool {
        self.masks[cell] == COVERED && depth < self.depths[cell]
    }
}

/// Returns the bits of a cell's line that a span of pixels covers; the cell begins at `left`.
fn row_mask(span: &Range<i32>, left: i32) -> u64 {
    let [from, to] = [span.start, span.end].map(|at| (at - left).clamp(0, CELL as i32));
    if from >= to { 0 } else { (0xff >> (CELL as i32 - (to - from)) << from) as u64 }
}

/// Corners of a convex face.
#[derive(Default)]
struct ClippedPolygon {
    corners: [Vec4; MAX_CORNERS],
    count: usize,
}

impl ClippedPolygon {
    /// Adds a corner; one too many is left out, which leaves a smaller face.
    fn push(&mut self, corner: Vec4) {
        if let Some(place) = self.corners.get_mut(self.count) {
            *place = corner;
            self.count += 1;
        }
    }

    fn get(&self) -> &[Vec4] {
        &self.corners[..self.count]
    }

    /// Clips a face against the near plane (I. Sutherland and G. Hodgman, "Reentrant Polygon
    /// Clipping", 1974).
    fn beyond_near(&self) -> Self {
        let beyond = |corner: &Vec4| corner.w - corner.z;
        let mut clipped = Self::default();
        for (index, to) in self.get().iter().enumerate() {
            let from = &self.corners[(index + self.count - 1) % self.count];
            let [before, after] = [beyond(from), beyond(to)];
            if (before < 0.0) != (after < 0.0) {
                clipped.push(from.lerp(*to, before / (before - after)));
            }
            if after >= 0.0 {
                clipped.push(*to);
            }
        }
        clipped
    }
}

/// Edge function of a face: positive inside.
#[derive(Clone, Copy, Default)]
struct Edge {
    across: Vec2,
    offset: f32,
    /// Crossing of a pixel line with the edge, unless they are parallel: slope by y, and position
    /// at the top.
    crossing: Vec2,
}

/// A face on the screen, pixels.
struct ScreenPolygon {
    edges: [Edge; MAX_CORNERS],
    count: usize,
    least: Vec2,
    most: Vec2,
    /// Depth: by x, by y, and at the upper left corner.
    depth: Vec3,
    least_depth: f32,
}

impl ScreenPolygon {
    /// Projects a face. `None` where it is nearly edge-on or its screen positions are unreliable.
    /// `margins` shrink its edges: anywhere, and at a distance of one.
    fn new(corners: &[Vec4], size: [u32; 2], margins: [f32; 2]) -> Option<Self> {
        let scale = Vec2::new(size[0] as f32, size[1] as f32) * 0.5;
        let mut places = [Vec3::ZERO; MAX_CORNERS];
        for (place, corner) in places.iter_mut().zip(corners) {
            let depth = corner.w.recip();
            *place = (Vec2::new(corner.x, corner.y) * depth * scale + scale).extend(depth);
        }
        let places = &places[..corners.len()];
        let Bounds { min: least, max: most } = Bounds::from_points(places.iter().copied())?;
        let farthest = least.abs().max(most.abs()).truncate().max_element();
        let are_places = places.iter().all(|place| place.is_finite()) && farthest < MAX_PLACE;
        if places.len() < 3 || !are_places {
            return None;
        }
        // The plane by the largest of the triangles around its first corner.
        let normal = |pair: &[Vec3]| (pair[0] - places[0]).cross(pair[1] - places[0]);
        let normals = places[1..].windows(2).map(normal);
        let normal = normals.max_by(|a, b| a.z.abs().total_cmp(&b.z.abs()))?;
        if !(normal.is_finite() && normal.z.abs() >= 1.0) {
            return None;
        }
        let slope = -normal.truncate() / normal.z;
        // No nearer than at any corner, though not all are in one plane to the last digit.
        let at_left = |place: &Vec3| place.z - slope.dot(place.truncate());
        let at_corner = places.iter().map(at_left).fold(f32::INFINITY, f32::min);
        let depth = slope.extend(at_corner - most.z * ROUNDING);
        let margin = margins[0] + margins[1] * most.z + farthest * ROUNDING;
        let mut face = Self {
            edges: [Edge::default(); MAX_CORNERS],
            count: places.len(),
            least: least.truncate(),
            most: most.truncate(),
            depth,
            least_depth: least.z,
        };
        for (index, edge) in face.edges[..places.len()].iter_mut().enumerate() {
            let [from, to] =
                [index, (index + 1) % places.len()].map(|index| places[index].truncate());
            let across = (to - from).perp() * normal.z.signum();
            let drawn_in = margin * (across.x.abs() + across.y.abs());
            let offset = -across.dot(from) - drawn_in;
            let crossing = Vec2::new(across.y, offset) / -across.x;
            if across.x != 0.0 && !crossing.is_finite() {
                return None;
            }
            *edge = Edge { across, offset, crossing };
        }
        Some(face)
    }

    /// Returns the pixels of a line whose middles the face covers.
    fn span(&self, line: u32, width: u32) -> Range<i32> {
        let y = line as f32 + 0.5;
        let (mut from, mut to) = (0.0_f32, width as f32);
        for Edge { across, offset, crossing } in &self.edges[..self.count] {
            if across.x > 0.0 {
                from = from.max(crossing.x * y + crossing.y);
            } else if across.x < 0.0 {
                to = to.min(crossing.x * y + crossing.y);
            } else if across.y * y + offset < 0.0 {
                return 0..0;
            }
        }
        // Truncated, for what is below zero was cut off.
        let [start, end] = [from, to.max(0.0)].map(|at| (at + 0.5) as i32);
        let span = start..end.min(width as i32);
        if span.is_empty() { 0..0 } else { span }
    }

    /// Returns a lower bound of the depth within the cell around a point.
    fn least_depth_around(&self, middle: Vec2) -> f32 {
        let slope = self.depth.truncate();
        let in_cell = CELL as f32 * 0.5 * (slope.x.abs() + slope.y.abs());
        (slope.dot(middle) + self.depth.z - in_cell).max(self.least_depth)
    }
}

#[cfg(test)]
#[path = "masked_occlusion_tests.rs"]
mod tests;
