//! Picture comparison: differences, regions and golden pictures.

use std::path::Path;

use image::{Rgb, RgbImage};

use crate::workspace_path;

/// Greatest difference of a channel that is not a visible one.
const MAX_CHANNEL_DIFFERENCE: u8 = 24;
/// Greatest share of pixels that differ visibly from a golden picture.
const MAX_DIFFERENT_SHARE: f64 = 0.005;
/// Greatest mean absolute difference of channels from a golden picture, of 255.
const MAX_MEAN_DIFFERENCE: f64 = 0.5;
/// Output folder of pictures that failed.
const FAILURES: &str = "target/golden-failures";

/// Rectangle of pixels, its ends inside.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Region {
    /// Left and top pixel.
    pub min: [u32; 2],
    /// Right and bottom pixel, inclusive.
    pub max: [u32; 2],
}

impl Region {
    /// Returns the region grown by a margin.
    pub fn grow(self, margin: u32) -> Self {
        Self {
            min: self.min.map(|side| side.saturating_sub(margin)),
            max: self.max.map(|side| side + margin),
        }
    }

    /// Reports whether another region is inside this one.
    pub fn contains(&self, other: Self) -> bool {
        [0, 1]
            .iter()
            .all(|&axis| self.min[axis] <= other.min[axis] && other.max[axis] <= self.max[axis])
    }

    /// Iterates over the pixels, row by row.
    pub fn pixels(self) -> impl Iterator<Item = [u32; 2]> {
        let [left, top] = self.min;
        let [right, bottom] = self.max;
        (top..=bottom).flat_map(move |y| (left..=right).map(move |x| [x, y]))
    }

    /// Returns width and height.
    pub fn size(&self) -> [u32; 2] {
        [0, 1].map(|axis| self.max[axis] - self.min[axis] + 1)
    }
}

/// Reads a picture file.
///
/// # Panics
/// When it is missing or is no picture.
pub fn load(path: &Path) -> RgbImage {
    let opened = image::open(path);
    opened.unwrap_or_else(|error| panic!("{}: {error}", path.display())).to_rgb8()
}

/// Returns the bounding region of the differences between two pictures of one size.
///
/// # Panics
/// When their sizes differ.
pub fn difference(a: &RgbImage, b: &RgbImage) -> Option<Region> {
    assert_eq!(a.dimensions(), b.dimensions());
    let pixels = a.enumerate_pixels().zip(b.pixels());
    let different = pixels.filter(|((_, _, a), b)| a != b).map(|((x, y, _), _)| [x, y]);
    different.map(|at| Region { min: at, max: at }).reduce(|a, b| Region {
        min: [0, 1].map(|axis| a.min[axis].min(b.min[axis])),
        max: [0, 1].map(|axis| a.max[axis].max(b.max[axis])),
    })
}

/// Compares a picture with `golden/<name>.png`; with `BUSBAR_BLESS` set, makes
/// it the golden one instead.
///
/// # Panics
/// When they differ, leaving the picture and the difference in
/// `target/golden-failures`.
pub fn assert_golden(name: &str, actual_path: &Path) {
    let golden_path = workspace_path("tests/end_to_end/e2e/golden").join(format!("{name}.png"));
    if std::env::var_os("BUSBAR_BLESS").is_some() {
        std::fs::copy(actual_path, &golden_path).expect("the golden folder can be written");
    }
    let (actual, golden) = (load(actual_path), load(&golden_path));
    assert_eq!(actual.dimensions(), golden.dimensions(), "size of {name}");
    let differences = RgbImage::from_fn(actual.width(), actual.height(), |x, y| {
        let (a, b) = (actual.get_pixel(x, y), golden.get_pixel(x, y));
        Rgb(std::array::from_fn(|channel| a[channel].abs_diff(b[channel])))
    });
    let pixels = f64::from(actual.width()) * f64::from(actual.height());
    let visible = |pixel: &&Rgb<u8>| pixel.0.iter().any(|&d| d > MAX_CHANNEL_DIFFERENCE);
    let share = differences.pixels().filter(visible).count() as f64 / pixels;
    let mean = differences.iter().map(|&d| f64::from(d)).sum::<f64>() / (3.0 * pixels);
    if share > MAX_DIFFERENT_SHARE || mean > MAX_MEAN_DIFFERENCE {
        let folder = workspace_path(FAILURES);
        std::fs::create_dir_all(&folder).expect("the target folder can be written");
        for (what, picture) in [("actual", &actual), ("difference", &differences)] {
            let path = folder.join(format!("{name}-{what}.png"));
            picture.save(path).expect("the target folder can be written");
        }
        panic!(
            "{name}.png: {:.2} % of pixels differ visibly, channels by {mean:.2} on average; see \
             {FAILURES}, and bless with BUSBAR_BLESS=1 if the new picture is right",
            share * 100.0
        );
    }
}
