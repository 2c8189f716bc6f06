//! Frame times of the paper's scene along a fixed camera path.

use std::time::Instant;

use anyhow::{Result, bail};
use busbar_viewer::Viewer;
use serde::Serialize;

use crate::progress::Progress;
use crate::scene::path_camera;
use crate::series::Series;

/// Greatest number of frames after a change of theta until every cursor must stand still.
const MAX_SETTLING_FRAMES: usize = 240;

/// Number of steps of the path that are drawn at one theta before the next.
const STEPS_PER_BLOCK: usize = 5;

/// Frame times of one size and number of samples.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct FrameTimes {
    /// Width and height of the picture, pixels.
    pub size: [u32; 2],
    /// Number of samples a pixel.
    pub samples: u32,
    /// Rows in order, one a theta.
    pub rows: Vec<FrameRow>,
}

/// Frame times at one theta.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct FrameRow {
    /// Proportion of simplified vertices.
    pub theta: f64,
    /// Number of drawn triangles.
    pub triangles: u64,
    /// Times of whole frames, from their beginning to the end of drawing.
    pub frame: Series,
}

/// Linear fit of frame times over triangles.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct LinearFit {
    /// Constant part of a frame, milliseconds.
    pub fixed_ms: f64,
    /// Milliseconds for each million triangles.
    pub ms_per_million: f64,
}

impl FrameTimes {
    /// Draws the path a few steps at a time at each theta in turn, so that other load of the
    /// machine affects all thetas alike.
    ///
    /// # Errors
    /// Errors of the graphics device.
    pub fn measure(
        viewer: &mut Viewer,
        (size, samples): ([u32; 2], u32),
        thetas: &[f64],
        steps: usize,
        progress: &Progress,
    ) -> Result<Self> {
        viewer.resize(size);
        let mut triangles = Vec::with_capacity(thetas.len());
        for &theta in thetas {
            triangles.push(settle(viewer, theta)?);
        }
        let mut millis = vec![Vec::with_capacity(steps); thetas.len()];
        let all: Vec<usize> = (0..steps).collect();
        for block in all.chunks(STEPS_PER_BLOCK) {
            for (&theta, millis) in thetas.iter().zip(&mut millis) {
                // Shown before: its indices are cached.
                viewer.set_theta(theta);
                for &step in block {
                    viewer.use_camera(&path_camera(step))?;
                    millis.push(timed_frame(viewer)?);
                    progress.step();
                }
            }
        }
        let row = |((&theta, triangles), millis)| FrameRow {
            theta,
            triangles,
            frame: Series::from_millis(millis),
        };
        Ok(Self {
            size,
            samples,
            rows: thetas.iter().zip(triangles).zip(millis).map(row).collect(),
        })
    }

    /// Returns the row of a theta.
    pub fn at(&self, theta: f64) -> Option<&FrameRow> {
        self.rows.iter().find(|row| row.theta == theta)
    }

    /// Returns the frame rate divided by that at theta 0.
    pub fn fps_ratio(&self, theta: f64) -> Option<f64> {
        Some(self.at(theta)?.frame.fps() / self.at(0.0)?.frame.fps())
    }

    /// Fits a line to the rows by least squares: time = fixed + triangles times slope.
    pub fn fit(&self) -> LinearFit {
        let n = self.rows.len() as f64;
        let millions = |row: &FrameRow| row.triangles as f64 / 1e6;
        let mean_x = self.rows.iter().map(millions).sum::<f64>() / n;
        let mean_y = self.rows.iter().map(|row| row.frame.p50_ms).sum::<f64>() / n;
        let (mut xy, mut xx) = (0.0, 0.0);
        for row in &self.rows {
            let x = millions(row) - mean_x;
            xy += x * (row.frame.p50_ms - mean_y);
            xx += x * x;
        }
        let slope = if xx > 0.0 { xy / xx } else { 0.0 };
        LinearFit { fixed_ms: mean_y - slope * mean_x, ms_per_million: slope }
    }
}

/// Estimates the share of a frame that its pixels cost, from the same frame at a smaller size:
/// triangles are the same, so the difference is due to pixels.
pub fn pixel_share(large: &FrameTimes, small: &FrameTimes, theta: f64) -> Option<f64> {
    let pixels = |times: &FrameTimes| f64::from(times.size[0]) * f64::from(times.size[1]);
    let (many, few) = (large.at(theta)?.frame.p50_ms, small.at(theta)?.frame.p50_ms);
    let per_pixel = (many - few) / (pixels(large) - pixels(small));
    Some((per_pixel * pixels(large) / many).clamp(0.0, 1.0))
}

/// Moves to a theta and draws until every cursor stands still; returns the triangles drawn then.
pub(crate) fn settle(viewer: &mut Viewer, theta: f64) -> Result<u64> {
    viewer.set_theta(theta);
    let mut last = None;
    for _ in 0..MAX_SETTLING_FRAMES {
        draw(viewer)?;
        let triangles = viewer.stats().triangles;
        if last == Some(triangles) {
            return Ok(triangles);
        }
        last = Some(triangles);
    }
    bail!("theta {theta} is not reached after {MAX_SETTLING_FRAMES} frames")
}

pub(crate) fn draw(viewer: &mut Viewer) -> Result<()> {
    let input = viewer.headless_input(0.0);
    viewer.frame(input)?;
    Ok(())
}

pub(crate) fn timed_frame(viewer: &mut Viewer) -> Result<f64> {
    let started = Instant::now();
    draw(viewer)?;
    Ok(started.elapsed().as_secs_f64() * 1e3)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn times(size: [u32; 2], millis: [f64; 3]) -> FrameTimes {
        let row = |(theta, triangles, p50_ms)| FrameRow {
            theta,
            triangles,
            frame: Series { count: 1, p50_ms, p99_ms: p50_ms },
        };
        let rows = [(0.0, 1_000_000, millis[0]), (0.7, 500_000, millis[1]), (0.85, 0, millis[2])];
        FrameTimes { size, samples: 1, rows: rows.into_iter().map(row).collect() }
    }

    #[test]
    fn a_line_is_found_again() {
        let fit = times([100, 100], [60.0, 35.0, 10.0]).fit();
        assert!((fit.fixed_ms - 10.0).abs() < 1e-9 && (fit.ms_per_million - 50.0).abs() < 1e-9);
    }

    #[test]
    fn pixels_are_what_differs_between_sizes() {
        // 10 ms that every size has, and 1 ms a thousand pixels.
        let (large, small) = (times([100, 100], [20.0; 3]), times([50, 50], [12.5; 3]));
        assert_eq!(pixel_share(&large, &small, 0.7), Some(0.5));
        assert_eq!(large.fps_ratio(0.85), Some(1.0));
    }
}
