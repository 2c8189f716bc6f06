//! Liveness of a viewer: one decision on what passes for live, and on when a process is ended.
//!
//! Two questions are kept apart. *May the picture pass for live?* The age of what it shows
//! decides, however the viewer does. *Is the viewer ended and started again?* Only where nothing
//! moves in it any more: a process that is slow makes progress, and restarting it adds load to a
//! machine that has too much of it already.

use std::time::{Duration, Instant};

use busbar_protocol::progress::{Activity, PROGRESS_WINDOW, ProgressMeter};

/// Age from which a picture is not live, where a host program does not choose it.
pub const DEFAULT_SILENT: Duration = Duration::from_millis(500);
/// Time without heartbeat and without progress after which a viewer is ended, where a host program
/// does not choose it; at least that of [`DEFAULT_SILENT`] or of what it chose in its place.
pub const DEFAULT_HUNG: Duration = Duration::from_secs(1);
/// A viewer that makes progress may go without a frame this long before it counts as livelocked.
pub const MAX_WITHOUT_FRAME: Duration = Duration::from_secs(30);
/// A viewer that has a heartbeat and sleeps may go without a frame this long before its frame
/// loop counts as deadlocked.
pub const MAX_ASLEEP: Duration = Duration::from_secs(5);
/// A viewer that a signal stopped is left alone this long: somebody may debug it, and its
/// picture is marked meanwhile.
pub const MAX_STOPPED: Duration = Duration::from_secs(10);
/// Frame times that a viewer is granted for one frame, of the longest that were measured.
pub const FRAME_PATIENCE: u32 = 8;
/// The longest that measured frame times extend a limit to.
pub const MAX_FRAME_PATIENCE: Duration = Duration::from_secs(120);
/// The oldest that a live picture may be where frames take long: nobody takes a picture for
/// live that is older than a second, which leaves time to mark it.
pub const MAX_LIVE_AGE: Duration = Duration::from_millis(900);
/// Frame times that a picture is old at most, when the next one comes in time: its own, and
/// that of the next.
const FRAMES_OF_A_PICTURE: u32 = 2;
/// Time between two frames beside their own, and for handing a picture over.
const BETWEEN_FRAMES: Duration = Duration::from_millis(50);
/// Time that one look counts at most: whoever watches may be held up as well.
const MAX_SAMPLE_PERIOD: Duration = Duration::from_millis(100);
/// Silence from which the process itself is looked at.
const FIRST_DOUBT: Duration = Duration::from_millis(250);
/// Frame times that are remembered.
const FRAME_TIMES: usize = 16;

/// Limits of one view.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LivenessLimits {
    /// Age from which a picture is not live.
    pub silent: Duration,
    /// Time without heartbeat and without progress after which a viewer is ended.
    pub hung: Duration,
}

/// Signs of life of a viewer at one instant.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LivenessSample {
    /// Age of what the picture shows: time since the tag values in it were read. None before
    /// the first picture.
    pub picture_age: Option<Duration>,
    /// Observed time without a finished turn of the frame loop.
    pub without_frame: Duration,
    /// Observed time without a heartbeat.
    pub without_heartbeat: Duration,
    /// Observed time in which the process made no progress.
    pub without_progress: Duration,
    /// Longest of the last frame times.
    pub frame_time: Duration,
    /// Activity of the process.
    pub activity: Activity,
}

/// Verdict on a viewer and its picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Liveness {
    /// The picture is of now.
    Live,
    /// The picture is old; the viewer goes on, too slowly.
    Late,
    /// The picture is old; the viewer gives no sign of life, or has ended.
    Lost,
    /// The viewer must be ended and started again; its picture is old.
    Hung,
}

impl Liveness {
    /// Reports whether a picture may pass for one of now.
    pub fn is_live(self) -> bool {
        self == Self::Live
    }
}

/// Greatest age of a live picture: `silent`, or more where frames take so long that no picture
/// could be younger, up to [`MAX_LIVE_AGE`].
pub fn picture_limit(silent: Duration, frame_time: Duration) -> Duration {
    let by_frames = frame_time.saturating_mul(FRAMES_OF_A_PICTURE).saturating_add(BETWEEN_FRAMES);
    silent.max(by_frames.min(MAX_LIVE_AGE))
}

/// Decides on a viewer by its signs of life.
pub fn assess(signs: &LivenessSample, limits: &LivenessLimits) -> Liveness {
    let LivenessLimits { silent, hung } = *limits;
    let by_frames = signs.frame_time.saturating_mul(FRAME_PATIENCE).min(MAX_FRAME_PATIENCE);
    let patience = |bound: Duration| bound.max(hung).max(by_frames);
    let is_silent = signs.without_heartbeat.min(signs.without_progress) >= silent;
    let is_hung = match signs.activity {
        // There is nothing to wait for.
        Activity::Gone => true,
        Activity::Stopped => signs.without_frame >= MAX_STOPPED.max(hung),
        _ => {
            signs.without_heartbeat.min(signs.without_progress) >= hung
                || signs.without_frame.min(signs.without_progress) >= patience(MAX_ASLEEP)
                || signs.without_frame >= patience(MAX_WITHOUT_FRAME)
        }
    };
    let limit = picture_limit(silent, signs.frame_time);
    let is_old = signs.picture_age.is_none_or(|age| age > limit);
    match signs.activity {
        _ if is_hung => Liveness::Hung,
        Activity::Stopped => Liveness::Lost,
        _ if !is_old => Liveness::Live,
        _ if is_silent => Liveness::Lost,
        _ => Liveness::Late,
    }
}

/// Instants that a viewer last showed signs of life at, nanoseconds of the clock since boot.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct LivenessInstants {
    /// Last beat of the heartbeat.
    pub heartbeat: u64,
    /// Last finished turn of the frame loop.
    pub frame: u64,
    /// Duration of that turn.
    pub frame_time: Duration,
    /// Instant of the tag values in the picture; 0 before the first picture.
    pub picture_true_at: u64,
}

/// Supervisor over the signs of life of one process, by repeated looks.
///
/// Silence counts by looks and not by a clock: where the watching process itself was stopped,
/// suspended or starved, nobody is late for that time.
#[derive(Debug)]
pub struct LivenessMonitor {
    meter: ProgressMeter,
    last_sample: Instant,
    last: LivenessInstants,
    without_frame: Duration,
    without_heartbeat: Duration,
    without_progress: Duration,
    frame_times: [Duration; FRAME_TIMES],
    next_frame_time: usize,
}

impl LivenessMonitor {
    /// Creates the watch over a process that was just started, or is just seen.
    pub fn new(pid: u32, now: Instant) -> Self {
        Self {
            meter: ProgressMeter::new(pid),
            last_sample: now,
            last: LivenessInstants::default(),
            without_frame: Duration::ZERO,
            without_heartbeat: Duration::ZERO,
            without_progress: Duration::ZERO,
            frame_times: [Duration::ZERO; FRAME_TIMES],
            next_frame_time: 0,
        }
    }

    /// Takes one look: `beats` is what the process showed last, and `boot_now` the instant now on
    /// the same clock.
    pub fn sample(
        &mut self,
        beats: LivenessInstants,
        boot_now: u64,
        now: Instant,
    ) -> LivenessSample {
        let passed = now.saturating_duration_since(self.last_sample).min(MAX_SAMPLE_PERIOD);
        self.last_sample = now;
        let before = std::mem::replace(&mut self.last, beats);
        if beats.frame != before.frame {
            self.frame_times[self.next_frame_time] = beats.frame_time.min(MAX_FRAME_PATIENCE);
            self.next_frame_time = (self.next_frame_time + 1) % FRAME_TIMES;
        }
        let count = |silence: &mut Duration, is_silent: bool| {
            *silence = if is_silent { *silence + passed } else { Duration::ZERO };
        };
        count(&mut self.without_frame, beats.frame == before.frame);
        count(&mut self.without_heartbeat, beats.heartbeat == before.heartbeat);
        let activity = self.observe_process(now, passed);
        LivenessSample {
            picture_age: (beats.picture_true_at != 0).then(|| {
                // One in the future was never noted by a viewer that is well.
                let age = boot_now.checked_sub(beats.picture_true_at);
                age.map_or(Duration::MAX, Duration::from_nanos)
            }),
            without_frame: self.without_frame,
            without_heartbeat: self.without_heartbeat,
            without_progress: self.without_progress,
            frame_time: self.frame_times.iter().max().copied().unwrap_or_default(),
            activity,
        }
    }

    /// Reads the process only where it gives reason to: that takes some file reads a thread.
    fn observe_process(&mut self, now: Instant, passed: Duration) -> Activity {
        if self.without_heartbeat.max(self.without_frame) < FIRST_DOUBT {
            self.meter.reset();
            self.without_progress = Duration::ZERO;
            return Activity::Running;
        }
        let activity = self.meter.observe(now);
        self.without_progress = match self.without_progress {
            _ if activity.is_progress() => Duration::ZERO,
            // The window that was compared went by without progress.
            Duration::ZERO => PROGRESS_WINDOW,
            silence => silence + passed,
        };
        activity
    }
}

#[cfg(test)]
#[path = "liveness_tests.rs"]
mod tests;
