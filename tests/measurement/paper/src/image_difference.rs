//! Similarity of two pictures: SSIM and PSNR.

use anyhow::{Context, Result, ensure};
use busbar_viewer::Picture;
use image::{GrayImage, RgbaImage};
use measure::ssim;
use serde::Serialize;

/// Largest value of a channel.
const PEAK: f64 = 255.0;

/// Difference of two pictures of equal size.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct ImageDifference {
    /// Mean structural similarity of the luma (Wang et al. 2004), 1 for equal
    /// pictures.
    pub ssim: f64,
    /// Peak signal-to-noise ratio over red, green and blue, decibels; `None`
    /// for equal pictures.
    pub psnr_db: Option<f64>,
}

impl ImageDifference {
    /// Compares two pictures of one size.
    ///
    /// # Errors
    /// When their sizes differ.
    pub fn measure(first: &Picture, second: &Picture) -> Result<Self> {
        let sizes = [first, second].map(|p| (p.width, p.height));
        ensure!(sizes[0] == sizes[1], "pictures of {:?} and {:?} pixels", sizes[0], sizes[1]);
        let (a, b) = (luma(first)?, luma(second)?);
        Ok(Self { ssim: ssim(&a, &b)?, psnr_db: psnr(&first.rgba8, &second.rgba8) })
    }
}

/// Computes the peak signal-to-noise ratio of two RGBA byte strings of equal length; alpha is
/// ignored. `None` when they are equal.
fn psnr(a: &[u8], b: &[u8]) -> Option<f64> {
    let colors = |bytes: &'_ [u8]| -> Vec<u8> {
        bytes.chunks_exact(4).flat_map(|p| [p[0], p[1], p[2]]).collect()
    };
    let (a, b) = (colors(a), colors(b));
    let squares = a.iter().zip(&b).map(|(&a, &b)| (f64::from(a) - f64::from(b)).powi(2));
    let mean = squares.sum::<f64>() / a.len().max(1) as f64;
    (mean > 0.0).then(|| 10.0 * (PEAK * PEAK / mean).log10())
}

fn luma(picture: &Picture) -> Result<GrayImage> {
    let rgba = RgbaImage::from_raw(picture.width, picture.height, picture.rgba8.clone())
        .context("a picture has another size than it says")?;
    Ok(image::DynamicImage::ImageRgba8(rgba).to_luma8())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn flat(value: u8) -> Picture {
        Picture { width: 16, height: 16, rgba8: [value, value, value, 255].repeat(256) }
    }

    #[test]
    fn equal_pictures_do_not_differ() {
        let same = ImageDifference::measure(&flat(90), &flat(90)).unwrap();
        assert_eq!(same.psnr_db, None);
        assert!((same.ssim - 1.0).abs() < 1e-6);
    }

    #[test]
    fn psnr_is_that_of_a_known_error() {
        // An error of 16 everywhere: 10 log10(255^2 / 16^2).
        let known = ImageDifference::measure(&flat(90), &flat(106)).unwrap();
        assert!((known.psnr_db.unwrap() - 24.048).abs() < 1e-3, "{known:?}");
        // One channel of one pixel in 256 off by 255: mean square 255^2 / 768.
        let mut dot = flat(0);
        dot.rgba8[1] = 255;
        let known = ImageDifference::measure(&flat(0), &dot).unwrap();
        assert!((known.psnr_db.unwrap() - 10.0 * 768_f64.log10()).abs() < 1e-9);
        assert!(known.ssim < 1.0);
    }

    #[test]
    fn pictures_of_different_sizes_are_refused() {
        let mut small = flat(0);
        (small.height, small.rgba8) = (8, [0; 4].repeat(128));
        assert!(ImageDifference::measure(&flat(0), &small).is_err());
    }
}
