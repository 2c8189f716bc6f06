//! Results of one scene.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

/// Distribution of durations, milliseconds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Distribution {
    /// Median of the durations.
    pub p50: f64,
    /// 99th percentile, the longest one of fewer than 100.
    pub p99: f64,
    /// Number of durations measured.
    pub count: usize,
}

impl Distribution {
    /// Sums up durations, milliseconds; all zero without any.
    pub fn new(mut millis: Vec<f64>) -> Self {
        millis.sort_by(f64::total_cmp);
        let at = |share: f64| {
            let index = (millis.len() as f64 * share).ceil() as usize;
            millis.get(index.saturating_sub(1)).copied().unwrap_or_default()
        };
        Self { p50: at(0.5), p99: at(0.99), count: millis.len() }
    }
}

/// Results of one scene on this machine.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SceneResults {
    /// Name of the scene.
    pub scene: String,
    /// Name of the graphics device.
    pub device: String,
    /// Width and height of the picture, pixels.
    pub size: [u32; 2],
    /// Triangles at full detail.
    pub triangles: u64,
    /// Triangles drawn in the last frame with a moving camera.
    pub motion_triangles: u64,
    /// Number of tags that the host sets as numbers.
    pub tags: usize,
    /// Seconds from the beginning of loading to the first finished picture.
    pub start_seconds: f64,
    /// Steps of a view that has nothing new to draw, milliseconds, with the answers of its overlays;
    /// none where each step draws.
    pub rest_ms: Option<Distribution>,
    /// Frames drawn anew without a change, milliseconds until the device has finished.
    pub still_ms: Distribution,
    /// Frames with a moving camera, milliseconds until the device has finished.
    pub motion_ms: Distribution,
    /// Frames in which every tag of the host has a new value, with the wait for the overlays; none
    /// without such tags or overlays.
    pub tags_ms: Option<Distribution>,
    /// Changes of the detail of the whole scene by one hundredth, milliseconds until the picture
    /// shows it; none without an optimizer.
    pub detail_step_ms: Option<Distribution>,
    /// Changes of the detail from full to least, in the same way.
    pub detail_full_ms: Option<Distribution>,
    /// Time on the device by pass of the frames in motion, milliseconds, where it has timestamps.
    pub pass_ms: BTreeMap<String, Distribution>,
    /// Greatest resident memory of the process, bytes, where the system tells.
    pub peak_bytes: Option<u64>,
    /// Messages of the Vulkan validation layer.
    pub validation_messages: Vec<String>,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn distributions_are_those_of_their_durations() {
        let all = (1..=200).rev().map(f64::from).collect();
        assert_eq!(Distribution::new(all), Distribution { p50: 100.0, p99: 198.0, count: 200 });
        assert_eq!(Distribution::new(vec![3.0]), Distribution { p50: 3.0, p99: 3.0, count: 1 });
        assert_eq!(Distribution::new(Vec::new()), Distribution::default());
    }
}
