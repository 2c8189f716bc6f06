//! Screen-space bounds of a projected bounding box.

use std::ops::Range;

use busbar_geometry::Bounds;
use glam::{Mat4, Vec2, Vec4};

/// A box in clip space.
pub struct ScreenBox {
    center: Vec4,
    /// From its middle to its sides.
    halves: [Vec4; 3],
    reach: Vec4,
}

impl ScreenBox {
    /// Projects a box by the transform from its space to clip space.
    #[inline]
    pub fn project(clip_from_box: &Mat4, bounds: &Bounds) -> Self {
        let half = (bounds.max - bounds.min) * 0.5;
        let halves = [
            clip_from_box.x_axis * half.x,
            clip_from_box.y_axis * half.y,
            clip_from_box.z_axis * half.z,
        ];
        let [x, y, z] = halves.map(Vec4::abs);
        let center = *clip_from_box * bounds.center().extend(1.0);
        Self { center, halves, reach: x + y + z }
    }

    /// Returns the middle of the box in clip space.
    pub fn center(&self) -> Vec4 {
        self.center
    }

    /// Returns the least distance along the line of sight. `None` where that is NaN or the box
    /// crosses the near plane, where clip space has no screen positions.
    #[inline]
    pub fn nearest(&self) -> Option<f32> {
        let Self { center, reach, .. } = *self;
        let nearest = center.w - reach.w;
        let has_places =
            (center.abs() + reach).is_finite() && nearest > (center.z + reach.z).max(0.0);
        has_places.then_some(nearest)
    }

    /// Returns the near plane's distance; a point's depth is this over its own distance. It is the
    /// same for all points without a far limit.
    pub fn near(&self) -> f32 {
        self.center.z + self.reach.z
    }

    /// Reports, for a box without a nearest distance, whether it is not wholly behind the eye.
    pub fn may_surround(&self) -> bool {
        let Self { center, reach, .. } = *self;
        let is_behind = center.w + reach.w < 0.0;
        !((center.abs() + reach).is_finite() && is_behind)
    }

    /// Returns the least and greatest screen positions of a box with a nearest distance: -1 to 1,
    /// from left to right and from the top down.
    #[inline]
    pub fn extent(&self) -> [Vec2; 2] {
        let Self { center, halves: [x, y, z], .. } = self;
        // Four of the eight corners at a time, side by side: by x, y and w.
        let sides = [*x + *y, *x - *y, *y - *x, -*x - *y];
        let of_axis = |axis: fn(&Vec4) -> f32| {
            let places = Vec4::from_array(sides.map(|side| axis(&side))) + axis(center);
            [places + axis(z), places - axis(z)]
        };
        let [one_w, other_w] = of_axis(|corner| corner.w);
        let along = |axis: fn(&Vec4) -> f32| {
            let [one, other] = of_axis(axis);
            let [one, other] = [one / one_w, other / other_w];
            [one.min(other).min_element(), one.max(other).max_element()]
        };
        let [[left, right], [top, bottom]] = [along(|corner| corner.x), along(|corner| corner.y)];
        [Vec2::new(left, top), Vec2::new(right, bottom)]
    }

    /// Returns the columns and rows of tiles that a box and a margin of pixels cover. The box must
    /// have a nearest distance; `None` beside the picture.
    #[inline]
    pub fn tiles(&self, size: [u32; 2], tile: u32, around: f32) -> Option<[Range<u32>; 2]> {
        let half = Vec2::new(size[0] as f32, size[1] as f32) * 0.5;
        let [least, most] = self.extent().map(|place| place * half + half);
        let along = |least: f32, most: f32, pixels: u32| {
            // Those whose middles lie within.
            let first = (least - around + 0.5).max(0.0) as u32;
            let end = ((most + around + 0.5).max(0.0) as u32).min(pixels);
            (first < end).then(|| first / tile..end.div_ceil(tile))
        };
        Some([along(least.x, most.x, size[0])?, along(least.y, most.y, size[1])?])
    }
}

/// Returns the range that spans two ranges.
pub fn hull(one: &Range<u32>, other: &Range<u32>) -> Range<u32> {
    one.start.min(other.start)..one.end.max(other.end)
}
