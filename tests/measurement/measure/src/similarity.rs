//! Structural similarity (SSIM) of two pictures.

use anyhow::Result;
use image::GrayImage;
use image_compare::Algorithm;

/// Computes the mean structural similarity of two pictures of equal size (Wang et al. 2004), 1 for
/// equal ones.
///
/// # Errors
/// When their sizes differ.
pub fn ssim(a: &GrayImage, b: &GrayImage) -> Result<f64> {
    Ok(image_compare::gray_similarity_structure(&Algorithm::MSSIMSimple, a, b)?.score)
}
