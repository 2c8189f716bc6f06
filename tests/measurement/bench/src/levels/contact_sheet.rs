//! Contact sheet: the original and some methods side by side, a row a theta.

use std::path::Path;

use anyhow::{Context, Result};
use busbar_geometry::{Bounds, Topology};
use font8x8::UnicodeFonts;
use glam::Vec3;
use image::imageops::{self, FilterType};
use image::{GrayImage, Luma};
use measure::{CREASE_DEGREES, View, creased_normals, draw};

use crate::levels::THETAS;
use crate::levels::method::Method;

/// Methods shown, in the order of their columns, after the original.
const COLUMNS: [&str; 4] =
    ["weighted, paper", "weighted, reweighted", "quadric_collapse", "meshoptimizer"];
/// Size of a picture, pixels.
const SIZE: [u32; 2] = [560, 460];
/// Supersampling factor of the pictures.
const SAMPLES: u32 = 2;
/// Height of a label's line, pixels; the size of a dot of its letters follows.
const LABEL: u32 = 24;
const DOT: u32 = 2;
const PAPER: u8 = 255;
const INK: u8 = 20;

/// Contact sheet under construction.
pub(crate) struct ContactSheet {
    name: &'static str,
    view: View,
    canvas: GrayImage,
}

impl ContactSheet {
    /// Creates a sheet of the part of a mesh that lies in a box.
    pub(crate) fn new(
        name: &'static str,
        original: &Topology,
        part: Bounds,
        towards_eye: Vec3,
    ) -> Self {
        let aspect = SIZE[0] as f32 / SIZE[1] as f32;
        let view = View::of_box(part, towards_eye, aspect);
        let (width, height) = (COLUMNS.len() as u32 + 1, THETAS.len() as u32);
        let canvas =
            GrayImage::from_pixel(width * SIZE[0], height * (SIZE[1] + LABEL), Luma([PAPER]));
        let original = picture(original, &view);
        let mut sheet = Self { name, view, canvas };
        for row in 0..THETAS.len() {
            sheet.put([0, row], &original, "original");
        }
        sheet
    }

    /// Adds the levels of a method, one a theta, if the sheet shows it.
    pub(crate) fn add(&mut self, method: Method, levels: &[Topology]) {
        let Some(column) = COLUMNS.iter().position(|&id| id == method.id) else { return };
        for (row, (level, theta)) in levels.iter().zip(THETAS).enumerate() {
            let label = format!("{} {:.0} %", method.id, theta * 100.0);
            let picture = picture(level, &self.view);
            self.put([column + 1, row], &picture, &label);
        }
    }

    /// Writes the sheet; returns its file's name.
    pub(crate) fn save(&self, folder: &Path) -> Result<String> {
        let file = format!("{}.png", self.name);
        let path = folder.join(&file);
        self.canvas.save(&path).with_context(|| format!("cannot write {}", path.display()))?;
        Ok(file)
    }

    fn put(&mut self, [column, row]: [usize; 2], picture: &GrayImage, label: &str) {
        let (x, y) = (column as u32 * SIZE[0], row as u32 * (SIZE[1] + LABEL));
        imageops::replace(&mut self.canvas, picture, i64::from(x), i64::from(y + LABEL));
        write(&mut self.canvas, [x + DOT * 4, y + (LABEL - 8 * DOT) / 2], label);
    }
}

fn picture(mesh: &Topology, view: &View) -> GrayImage {
    let normals = creased_normals(mesh, CREASE_DEGREES);
    let shot = draw(mesh, &normals, view, SIZE.map(|pixels| pixels * SAMPLES));
    imageops::resize(&shot.shades, SIZE[0], SIZE[1], FilterType::Triangle)
}

/// Writes a line of text with its upper left corner at a pixel; letters that the
/// font does not have are left out.
fn write(canvas: &mut GrayImage, [left, top]: [u32; 2], text: &str) {
    for (column, letter) in (0_u32..).zip(text.chars()) {
        let Some(rows) = font8x8::BASIC_FONTS.get(letter) else { continue };
        for (y, row) in (0_u32..).zip(rows) {
            for x in (0..8_u32).filter(|x| row >> x & 1 == 1) {
                let (x, y) = (left + (column * 8 + x) * DOT, top + y * DOT);
                for (x, y) in (0..DOT).flat_map(|i| (0..DOT).map(move |j| (x + i, y + j))) {
                    if x < canvas.width() && y < canvas.height() {
                        canvas.put_pixel(x, y, Luma([INK]));
                    }
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn letters_have_their_dots() {
        let mut canvas = GrayImage::from_pixel(40, 20, Luma([PAPER]));
        write(&mut canvas, [0, 0], "I.");
        let dark = |x: u32| (0..20).filter(|&y| canvas.get_pixel(x, y).0[0] == INK).count() as u32;
        // The stem of the I is seven dots high, a full stop two.
        assert_eq!(dark(3 * DOT), 7 * DOT);
        assert!((8 * DOT..16 * DOT).map(dark).max() == Some(2 * DOT));
    }
}
