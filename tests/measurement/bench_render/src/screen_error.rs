//! Frame times with theta from the screen error, beside the best peer at full detail.

use std::fs;
use std::path::Path;

use anyhow::{Context, Result};
use report_writer::Series;
use serde::Serialize;
use serde_json::json;

use crate::camera::{Camera, orbit, walk};
use crate::many_stations::MAX_ERROR_PX;
use crate::renderer_process::{RendererCommand, RendererProcess};
use crate::scenes::Scenes;

const POSES: usize = 6;
/// Distance ratio of the far path to one that fills the picture.
const FARTHER: f32 = 4.0;
/// Optimizer of the levels of detail.
const OPTIMIZER: &str = "quadric_collapse";

/// Results of one camera path.
#[derive(Debug, Serialize)]
pub(crate) struct PathResult {
    pub(crate) path: &'static str,
    pub(crate) triangles: u64,
    pub(crate) millis: Series,
    pub(crate) full_millis: Series,
    /// Name and frame times of the best peer at full detail.
    pub(crate) peer: Option<(&'static str, Series)>,
    /// Similarity to the pictures in full detail.
    pub(crate) likeness: PictureSimilarity,
}

/// Similarity of pictures at levels of detail to those in full detail: the worst of each measure.
#[derive(Clone, Copy, Debug, Serialize)]
pub(crate) struct PictureSimilarity {
    pub(crate) least_ssim: f64,
    pub(crate) greatest_flip: f64,
}

/// Measures the near and the far path.
pub(crate) fn measure(
    scenes: &Scenes,
    renderers: &[RendererCommand],
    (core, rounds): (&str, usize),
    folder: &Path,
    pictures: &Path,
) -> Result<Vec<PathResult>> {
    let full = scenes.levels.first().context("no scene")?;
    let followed = folder.join("followed.json");
    let file = full.glb.file_name().map(|name| name.to_string_lossy());
    fs::write(
        &followed,
        json!({
            "version": 1,
            "plugin_directories": ["plugins"],
            "plugins": { "optimizer": { "plugin": OPTIMIZER } },
            "models": { "paper": {
                "file": file,
                "optimizer": "optimizer",
                "theta": { "max_error_px": MAX_ERROR_PX },
            } },
            "scene": [{ "id": "paper", "model": "paper" }],
            "graphics": { "samples": 1 },
        })
        .to_string(),
    )?;
    let paths =
        [("near", walk(scenes.bounds, POSES)), ("far", orbit(scenes.bounds, POSES, FARTHER))];
    let mut found = Vec::new();
    for (path, cameras) in paths {
        let ours = renderers.first().context("nobody draws")?;
        let mut detail = RendererProcess::start(ours, core, &full.glb, 1)?;
        let mut followed = RendererProcess::start(ours, core, &followed, 1)?;
        let likeness =
            PictureSimilarity::compare([&mut detail, &mut followed], &cameras, path, pictures)?;
        let mut processes = vec![(detail, Vec::new()), (followed, Vec::new())];
        for peer in &renderers[1..] {
            // Who cannot was told of already.
            processes.extend(
                RendererProcess::start(peer, core, &full.glb, 1)
                    .map(|process| (process, Vec::new())),
            );
        }
        let mut triangles = 0;
        for round in 0..=rounds {
            for (index, (process, millis)) in processes.iter_mut().enumerate() {
                let answer = process.frames(&cameras)?;
                if index == 1 {
                    triangles = answer.triangles;
                }
                // The first warms up.
                if round > 0 {
                    millis.extend(answer.millis);
                }
            }
        }
        let mut series = processes
            .into_iter()
            .map(|(process, millis)| (process.name, Series::from_values(millis)));
        let mut own = || series.next().map_or_else(Series::default, |(_, series)| series);
        let (full_millis, millis) = (own(), own());
        let peer = series.min_by(|(_, a), (_, b)| a.p50.total_cmp(&b.p50));
        found.push(PathResult { path, triangles, millis, full_millis, peer, likeness });
    }
    Ok(found)
}

impl PictureSimilarity {
    /// Compares the pictures of a path, which are kept by its name.
    pub(crate) fn compare(
        [detail, followed]: [&mut RendererProcess; 2],
        cameras: &[Camera],
        path: &str,
        pictures: &Path,
    ) -> Result<Self> {
        let mut worst = Self { least_ssim: 1.0, greatest_flip: 0.0 };
        for (number, &camera) in cameras.iter().enumerate() {
            let files = ["full", "followed"]
                .map(|what| pictures.join(format!("{path}_{number}_{what}.png")));
            detail.picture(camera, &files[0])?;
            followed.picture(camera, &files[1])?;
            let [full, less] = [image::open(&files[0])?, image::open(&files[1])?];
            let ssim = measure::ssim(&full.to_luma8(), &less.to_luma8())?;
            worst.least_ssim = worst.least_ssim.min(ssim);
            worst.greatest_flip = worst.greatest_flip.max(flip(&full.to_rgb8(), &less.to_rgb8())?);
        }
        Ok(worst)
    }
}

/// Computes the mean FLIP (P. Andersson et al., "FLIP: A Difference Evaluator for Alternating
/// Images", HPG 2020) at its default pixels a degree.
fn flip(reference: &image::RgbImage, test: &image::RgbImage) -> Result<f64> {
    let (width, height) = reference.dimensions();
    anyhow::ensure!(test.dimensions() == (width, height), "pictures of different sizes");
    let [reference, test] =
        [reference, test].map(|image| nv_flip::FlipImageRgb8::with_data(width, height, image));
    let errors = nv_flip::flip(reference, test, nv_flip::DEFAULT_PIXELS_PER_DEGREE);
    Ok(f64::from(nv_flip::FlipPool::from_image(&errors).mean()))
}

#[cfg(test)]
mod tests {
    use image::{Rgb, RgbImage};

    use super::*;

    #[test]
    fn flip_tells_pictures_apart() {
        let gray = RgbImage::from_pixel(32, 32, Rgb([128; 3]));
        let mut spotted = gray.clone();
        (0..8).for_each(|i| spotted.put_pixel(i, i, Rgb([255, 0, 0])));
        assert!(flip(&gray, &gray).unwrap() < 1e-6);
        let little = flip(&gray, &spotted).unwrap();
        let much = flip(&gray, &RgbImage::new(32, 32)).unwrap();
        assert!(little > 1e-3 && much > little, "{little} {much}");
    }
}
