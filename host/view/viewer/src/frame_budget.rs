//! Keeps frames to their time: where they take longer, detail that follows the error on
//! the screen gets coarser, a step at a time, and comes back when there is time to spare.

use std::collections::VecDeque;

use busbar_renderer::FrameStats;

/// Frames whose median is judged; as many are let pass after each step.
const MEDIAN_FRAMES: usize = 15;
/// Each step lets so much more error show.
const STEP: f32 = std::f32::consts::SQRT_2;
/// The most steps: 16 times the error.
const MAX_STEPS: u32 = 8;
/// Frames longer than this share of the target are too long.
const OVERRUN_SHARE: f64 = 1.1;
/// Frames shorter than this share leave time to spare. A step back may cost as much as
/// [`STEP`] times what there was, and must not be too long then.
const SPARE_SHARE: f64 = 0.6;
/// A step that leaves more than this share of the time is no help.
const NO_GAIN: f64 = 0.95;
/// Frames after which a step is tried again that was no help, or had to be taken back.
const RETRY_FRAMES: u32 = 600;

/// Judges the frames and asks for coarser detail, or finer.
#[derive(Debug)]
pub(crate) struct FrameBudget {
    target: Option<f64>,
    steps: u32,
    /// The last frames, milliseconds.
    frames: VecDeque<f64>,
    /// Median frame time before the last step to coarser detail, milliseconds.
    before: Option<f64>,
    /// Frames until the next step may be taken to coarser detail, and to finer.
    cooldown: [u32; 2],
}

impl FrameBudget {
    /// Creates a budget of `target` milliseconds a frame; without one, detail is never reduced.
    pub(crate) fn new(target: Option<f64>) -> Self {
        let frames = VecDeque::with_capacity(MEDIAN_FRAMES);
        Self { target, steps: 0, frames, before: None, cooldown: [0; 2] }
    }

    /// Returns the factor on the permitted screen error.
    pub(crate) fn coarseness(&self) -> f32 {
        STEP.powi(self.steps as i32)
    }

    /// Takes a frame into account. One that still waits for meshes at their new detail
    /// says nothing, nor does one that was skipped.
    pub(crate) fn record_frame(&mut self, frame: &FrameStats) {
        let device_millis = frame.gpu_millis.unwrap_or(0.0) + frame.occlusion_millis;
        let millis = device_millis.max(frame.cpu_millis);
        if frame.waiting == 0 && frame.draw_calls > 0 {
            self.evaluate(millis);
        }
    }

    fn evaluate(&mut self, millis: f64) {
        let Some(target) = self.target else { return };
        self.cooldown = self.cooldown.map(|frames| frames.saturating_sub(1));
        self.frames.push_back(millis);
        if self.frames.len() < MEDIAN_FRAMES {
            return;
        }
        let median = median(&self.frames);
        let [is_coarsening_paused, is_refining_paused] = self.cooldown.map(|frames| frames > 0);
        let had_no_gain = self.before.take().is_some_and(|before| median > before * NO_GAIN);
        if had_no_gain {
            // What takes its time is not the triangles.
            self.cooldown[0] = RETRY_FRAMES;
            self.step_to(self.steps - 1);
        } else if median > target * OVERRUN_SHARE && self.steps < MAX_STEPS && !is_coarsening_paused
        {
            self.before = Some(median);
            self.cooldown[1] = RETRY_FRAMES;
            self.step_to(self.steps + 1);
        } else if median < target * SPARE_SHARE && self.steps > 0 && !is_refining_paused {
            self.step_to(self.steps - 1);
        } else {
            self.frames.pop_front();
        }
    }

    fn step_to(&mut self, steps: u32) {
        self.steps = steps;
        self.frames.clear();
    }
}

fn median(values: &VecDeque<f64>) -> f64 {
    let mut sorted: Vec<f64> = values.iter().copied().collect();
    sorted.sort_by(f64::total_cmp);
    sorted[sorted.len() / 2]
}

#[cfg(test)]
#[path = "frame_budget_tests.rs"]
mod tests;
