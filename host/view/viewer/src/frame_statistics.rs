//! Frame statistics: times of the last frames and of their parts.

use std::collections::VecDeque;
use std::time::{Duration, Instant};

use busbar_renderer::FrameStats;
use busbar_site::SiteStepMillis;
use busbar_ui::FrameTimes;

use crate::reload::ReloadCounters;
use crate::stats;
use busbar_scene_loader::millis_since;

/// Frame times kept for statistics.
const MAX_FRAME_TIMES: usize = 1024;
/// Shortest time between two changes of the displayed frame times: they are no reason to draw.
const DISPLAY_PERIOD: Duration = Duration::from_secs(1);

/// CPU time of parts of the last frame, milliseconds of this thread. Waiting time, such as for an
/// overlay's process, is not included.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FrameStageMillis {
    /// Taking over what plugins brought; histories.
    pub tags: f64,
    /// Stepping alarms, listing them, their marks in the scene.
    pub alarms: f64,
    /// Running overlays, their labels and tints.
    pub overlays: f64,
    /// Laying out and tessellating panels and labels.
    pub panels: f64,
}

impl From<SiteStepMillis> for FrameStageMillis {
    fn from(SiteStepMillis { tags, alarms, overlays }: SiteStepMillis) -> Self {
        Self { tags, alarms, overlays, panels: 0.0 }
    }
}

/// Statistics of the frames so far.
#[derive(Default)]
pub(crate) struct FrameStatistics {
    /// CPU time of the last frame, milliseconds.
    pub(crate) cpu_millis: f64,
    /// CPU time of parts of the last frame.
    pub(crate) stages: FrameStageMillis,
    /// Counters of configuration reloads.
    pub(crate) reloads: ReloadCounters,
    frame_millis: VecDeque<f64>,
    frames: u64,
    /// Times as panels display them, and when they changed last.
    displayed: (Option<Instant>, FrameTimes),
}

impl FrameStatistics {
    /// Records the time of a frame since its start.
    pub(crate) fn record_frame(&mut self, started: Instant, drawn: &FrameStats) {
        self.frames += 1;
        if self.frame_millis.len() == MAX_FRAME_TIMES {
            self.frame_millis.pop_front();
        }
        self.frame_millis.push_back(millis_since(started));
        if self.displayed.0.is_none_or(|at| at.elapsed() >= DISPLAY_PERIOD) {
            let stages = stats::gpu_millis(drawn).into_iter().collect();
            let times = FrameTimes { frame: self.last_millis(), gpu_stages: stages };
            self.displayed = (Some(Instant::now()), times);
        }
    }

    /// Returns the times of a frame as panels display them.
    pub(crate) fn displayed(&self) -> &FrameTimes {
        &self.displayed.1
    }

    /// Returns the number of frames drawn.
    pub(crate) fn frames(&self) -> u64 {
        self.frames
    }

    /// Returns the time of the last frame, milliseconds; 0 before the first.
    pub(crate) fn last_millis(&self) -> f64 {
        self.frame_millis.back().copied().unwrap_or(0.0)
    }

    /// Returns the time of the last frame.
    pub(crate) fn last_time(&self) -> Duration {
        Duration::from_secs_f64(self.last_millis() / 1e3)
    }

    /// Returns the frame times at shares of all recent ones, milliseconds: 0.5 for the median.
    pub(crate) fn percentiles<const N: usize>(&self, shares: [f64; N]) -> [f64; N] {
        let mut millis: Vec<f64> = self.frame_millis.iter().copied().collect();
        millis.sort_by(f64::total_cmp);
        shares.map(|share| {
            let rank = (share * millis.len().saturating_sub(1) as f64).round() as usize;
            millis.get(rank).copied().unwrap_or(0.0)
        })
    }
}
