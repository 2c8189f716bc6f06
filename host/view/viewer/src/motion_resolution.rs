//! Resolution of the scene while the camera moves: as high as the frame time allows, and full
//! again once the camera rests.

use busbar_renderer::{FrameStats, MIN_SCENE_RESOLUTION};

/// Time without motion after which the camera rests, seconds. Events of a pointer that is moved
/// slowly are closer together.
const REST_SECONDS: f64 = 0.06;
/// Resolutions, as shares of width and height: each has half the pixels of the one before.
const RESOLUTIONS: [f32; 3] = [1.0, std::f32::consts::FRAC_1_SQRT_2, MIN_SCENE_RESOLUTION];
/// Frames longer than this share of the target are too long.
const OVERRUN_SHARE: f64 = 1.1;
/// A higher resolution is chosen if its frames would stay below this share of the target, were
/// all their time spent on pixels.
const SPARE_SHARE: f64 = 0.85;
/// Frames drawn after a change of the resolution whose times may still be of frames before it.
const LATE_FRAMES: u32 = 3;
/// Pictures of fewer pixels are always at full resolution: their pixels take little time.
const MIN_PIXELS: u64 = 640 * 360;

/// Chooses the resolution of the scene's image by the motion of the camera and by frame times.
#[derive(Debug)]
pub(crate) struct MotionResolution {
    /// Frame time to keep while the camera moves, milliseconds; none for full resolution always.
    target: Option<f64>,
    /// Place in [`RESOLUTIONS`] while the camera moves.
    step: usize,
    /// Place in [`RESOLUTIONS`] of the last frame drawn.
    drawn_step: usize,
    /// Frames drawn since that place last changed, up to [`LATE_FRAMES`].
    frames: u32,
    /// Time of the last motion, seconds of the view; none before the first.
    moved_at: Option<f64>,
    /// Time of the last frame, seconds of the view.
    now: f64,
    /// Size of the picture, pixels.
    size: [u32; 2],
}

impl MotionResolution {
    /// Creates a control that keeps frames to `target` milliseconds.
    pub(crate) fn new(target: Option<f64>) -> Self {
        Self { target, step: 0, drawn_step: 0, frames: 0, moved_at: None, now: 0.0, size: [0; 2] }
    }

    /// Sets the frame time to keep while the camera moves, milliseconds.
    pub(crate) fn set_target(&mut self, target: Option<f64>) {
        if self.target != target {
            (self.target, self.step, self.frames) = (target, 0, 0);
        }
    }

    /// Notes the time of a frame, seconds of the view, the size of its picture in pixels, and whether
    /// the camera moved since the last one.
    pub(crate) fn advance(&mut self, seconds: f64, size: [u32; 2], has_moved: bool) {
        (self.now, self.size) = (seconds, size);
        if has_moved {
            self.moved_at = Some(seconds);
        }
    }

    /// Returns the resolution of the scene in this frame, a share of the picture's.
    pub(crate) fn resolution(&self) -> f32 {
        RESOLUTIONS[self.frame_step()]
    }

    /// Returns the place of this frame's resolution.
    fn frame_step(&self) -> usize {
        let pixels = self.size.into_iter().map(u64::from).product::<u64>();
        if self.rests_in() > 0.0 && pixels >= MIN_PIXELS { self.step } else { 0 }
    }

    /// Returns the seconds until the camera rests, if it does not move again; 0 if it rests.
    fn rests_in(&self) -> f64 {
        self.moved_at.map_or(0.0, |moved| (REST_SECONDS - (self.now - moved)).max(0.0))
    }

    /// Returns the seconds until the scene is to be drawn at full resolution; none where it was.
    pub(crate) fn full_in(&self) -> Option<f64> {
        (self.drawn_step > 0).then(|| self.rests_in())
    }

    /// Reports whether the last frame drawn had a resolution between the lowest and the full one.
    pub(crate) fn is_intermediate(&self) -> bool {
        self.drawn_step > 0 && self.drawn_step + 1 < RESOLUTIONS.len()
    }

    /// Takes the time of a frame into account that was drawn at this resolution.
    pub(crate) fn note_frame(&mut self, frame: &FrameStats) {
        if frame.is_scene_kept {
            return;
        }
        let step = self.frame_step();
        self.frames = if step == self.drawn_step { (self.frames + 1).min(LATE_FRAMES) } else { 0 };
        self.drawn_step = step;
        if frame.draw_calls > 0 && self.frames == LATE_FRAMES {
            let device_millis = frame.gpu_millis.unwrap_or(0.0) + frame.occlusion_millis;
            self.evaluate(device_millis.max(frame.cpu_millis));
        }
    }

    /// Chooses the step for motion by the time of a frame at the step drawn, milliseconds.
    fn evaluate(&mut self, millis: f64) {
        let Some(target) = self.target else { return };
        let fits = |step: usize, share: f64| {
            let ratio = f64::from(RESOLUTIONS[step] / RESOLUTIONS[self.drawn_step]);
            millis * ratio * ratio <= target * share
        };
        if !fits(self.drawn_step, OVERRUN_SHARE) {
            let last = RESOLUTIONS.len() - 1;
            let lower = (self.drawn_step + 1..last).find(|&step| fits(step, OVERRUN_SHARE));
            // A lower step that motion needed before is not given up for an estimate.
            self.step = self.step.max(lower.unwrap_or(last));
        } else {
            let higher = (0..self.drawn_step).find(|&step| fits(step, SPARE_SHARE));
            self.step = higher.unwrap_or(self.drawn_step);
        }
    }
}

#[cfg(test)]
#[path = "motion_resolution_tests.rs"]
mod tests;
