//! Costs of a change of theta of the whole scene.

use std::time::Instant;

use anyhow::Result;
use busbar_geometry::CollapseStacks;
use busbar_viewer::Viewer;
use serde::Serialize;

use crate::frames;
use crate::progress::Progress;
use crate::scene::OVERVIEW;
use crate::series::Series;

/// Greatest excess of a frame in which theta changed over its neighbour, as a share of a frame at
/// theta 0.
pub const MAX_SHARE_OF_FRAME: f64 = 0.1;

/// Costs of a change of theta.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct ThetaChange {
    /// Times of [`CollapseStacks::resolve`] alone, on one thread.
    pub resolve: Series,
    /// Difference between the frame in which theta changed and the next one, which shows the same:
    /// resolve, upload and the setting itself.
    pub change: Series,
    /// Frames at theta 0 of the same view, measured between the changes.
    pub full_frame: Series,
    /// Size of that view, pixels.
    pub size: [u32; 2],
}

impl ThetaChange {
    /// Measures `count` moves to random thetas.
    ///
    /// # Errors
    /// Errors of the graphics device.
    pub fn measure(
        stacks: &CollapseStacks,
        viewer: &mut Viewer,
        size: [u32; 2],
        count: usize,
        progress: &Progress,
    ) -> Result<Self> {
        viewer.resize(size);
        viewer.use_camera(OVERVIEW)?;
        let mut random = fastrand::Rng::with_seed(2015);
        let (mut resolve, mut change) = (Vec::with_capacity(count), Vec::with_capacity(count));
        let mut full_frame = Vec::with_capacity(count);
        for _ in 0..count {
            let theta = random.f64();
            resolve.push(timed_resolve(stacks, theta));
            let started = Instant::now();
            viewer.set_theta(theta);
            frames::draw(viewer)?;
            let first = started.elapsed().as_secs_f64() * 1e3;
            change.push(first - frames::timed_frame(viewer)?);
            // Theta 0 is cached: its frame shows no change.
            viewer.set_theta(0.0);
            full_frame.push(frames::timed_frame(viewer)?);
            progress.step();
        }
        Ok(Self {
            resolve: Series::from_millis(resolve),
            change: Series::from_millis(change),
            full_frame: Series::from_millis(full_frame),
            size,
        })
    }
}

fn timed_resolve(stacks: &CollapseStacks, theta: f64) -> f64 {
    let cursor = stacks.cursor_for_theta(theta);
    let started = Instant::now();
    let resolved = stacks.resolve(cursor);
    let millis = started.elapsed().as_secs_f64() * 1e3;
    std::hint::black_box(&resolved);
    millis
}
