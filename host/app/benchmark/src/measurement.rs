//! Measurement of one scene in this process.

use std::collections::BTreeMap;
use std::f32::consts::TAU;
use std::path::Path;
use std::time::{Duration, Instant};

use busbar_geometry::Bounds;
use busbar_scene_loader::{LoadError, LoadedScene};
use busbar_viewer::{HostTagValue, RendererOptions, ViewError, Viewer, renderer_options};
use glam::Vec3;
use thiserror::Error;

use crate::scene_results::{Distribution, SceneResults};

/// Least number of frames in a part of the measurement.
const MIN_FRAMES: usize = 8;
/// Greatest number of frames of a part: durations are kept.
const MAX_FRAMES: usize = 20_000;
/// Frames before those that count: pipelines are compiled, caches fill.
const WARM_UP: usize = 5;
/// Longest wait for a view to have nothing new to draw: textures and detail come later.
const MAX_SETTLING: Duration = Duration::from_secs(60);
/// Camera poses of one turn around the scene.
const POSES: usize = 240;
/// Pitch of the camera above the horizon, radians, and its distance in radii of the scene.
const PITCH: f32 = 0.35;
const RADII: f32 = 2.2;
/// Detail of the steps of one hundredth, proportions of vertices that are simplified.
const STEP_THETA: [f64; 2] = [0.5, 0.51];
/// Size of a picture that shows whether tags are shown, pixels, and two values for that.
const TRIAL_SIZE: [u32; 2] = [640, 360];
const TRIAL_VALUES: [f64; 2] = [1.0, 888.0];
/// Full and least detail.
const FULL_THETA: [f64; 2] = [0.0, 0.95];

/// Error that keeps a scene from being measured.
#[derive(Debug, Error)]
pub enum BenchmarkError {
    /// The configuration or one of its files is at fault.
    #[error(transparent)]
    Load(#[from] LoadError),
    /// The graphics device or a plugin is at fault.
    #[error(transparent)]
    View(#[from] ViewError),
    /// The device stopped drawing.
    #[error("the graphics device lost a frame: update its driver, and measure again")]
    LostFrame,
}

/// Conditions of a measurement.
#[derive(Clone, Copy, Debug)]
pub struct MeasureOptions {
    /// Width and height of the picture, pixels.
    pub size: [u32; 2],
    /// Duration of each part of the measurement.
    pub part: Duration,
    /// Use of the Vulkan validation layer, which makes all slower.
    pub validation: bool,
}

/// Measures the scene of a configuration.
///
/// # Errors
/// [`BenchmarkError`] names what keeps the scene from being drawn.
pub fn measure(config: &Path, options: MeasureOptions) -> Result<SceneResults, BenchmarkError> {
    let MeasureOptions { size, part, validation } = options;
    let start = Instant::now();
    let mut measured = MeasuredView::open(config, size, validation, part)?;
    measured.frame()?;
    measured.viewer.read_picture()?;
    let start_seconds = start.elapsed().as_secs_f64();
    measured.viewer.set_morph_seconds(0.0);
    let host_tags = measured.host_tags();
    measured.settle()?;
    let rest_ms = measured.repeat(|view, _| {
        let begun = Instant::now();
        view.step()?;
        Ok(begun.elapsed())
    })?;
    let still_ms = measured.repeat(|view, _| {
        view.viewer.forget_picture();
        view.frame()
    })?;
    let tags_ms = measured.tags_ms(&host_tags)?;
    let [detail_step_ms, detail_full_ms] = measured.detail_ms()?;
    // Last, for the camera stays where it was put.
    let (motion_ms, pass_ms) = measured.motion_ms()?;
    let stats = measured.viewer.stats();
    let name = config.file_stem().map_or_else(String::new, |n| n.to_string_lossy().into_owned());
    Ok(SceneResults {
        scene: name,
        device: stats.gpu,
        size,
        triangles: stats.triangles_full,
        tags: host_tags.len(),
        start_seconds,
        rest_ms,
        still_ms,
        motion_ms,
        tags_ms,
        detail_step_ms,
        detail_full_ms,
        pass_ms,
        peak_bytes: peak_bytes(),
        validation_messages: stats.validation_messages,
    })
}

/// Reports whether the picture of a configuration changes with the tags that the host sets.
///
/// # Errors
/// [`BenchmarkError`] names what keeps the scene from being drawn.
pub fn shows_tags(config: &Path) -> Result<bool, BenchmarkError> {
    let mut measured = MeasuredView::open(config, TRIAL_SIZE, false, Duration::ZERO)?;
    measured.viewer.set_settles(true);
    let ids = measured.host_tags();
    let mut pictures = Vec::new();
    for number in TRIAL_VALUES {
        measured.set_tags(&ids, |_| number);
        for _ in 0..WARM_UP {
            measured.frame()?;
        }
        pictures.push(measured.viewer.read_picture()?.rgba8);
    }
    Ok(pictures[0] != pictures[1])
}

/// View that is measured.
struct MeasuredView {
    viewer: Viewer,
    started: Instant,
    part: Duration,
}

impl MeasuredView {
    fn open(
        config: &Path,
        size: [u32; 2],
        validation: bool,
        part: Duration,
    ) -> Result<Self, BenchmarkError> {
        let scene = LoadedScene::load(config, &|_, _, _| {})?;
        let options = RendererOptions { validation, ..renderer_options(&scene) };
        let viewer = Viewer::new_offscreen(scene, options, size)?;
        Ok(Self { viewer, started: Instant::now(), part })
    }

    /// Steps the view; reports whether it drew a frame.
    fn step(&mut self) -> Result<bool, BenchmarkError> {
        let input = self.viewer.headless_input(self.started.elapsed().as_secs_f64());
        Ok(self.viewer.frame(input)?.is_drawn)
    }

    /// Steps the view and waits for the device; returns the duration.
    fn frame(&mut self) -> Result<Duration, BenchmarkError> {
        let begun = Instant::now();
        self.step()?;
        if !self.viewer.finish_frame() {
            return Err(BenchmarkError::LostFrame);
        }
        Ok(begun.elapsed())
    }

    /// Waits until the view has nothing new to draw; a scene that never rests is measured as it is.
    fn settle(&mut self) -> Result<(), BenchmarkError> {
        let begun = Instant::now();
        let mut at_rest = 0;
        while at_rest < MIN_FRAMES && begun.elapsed() < MAX_SETTLING {
            at_rest = if self.step()? { 0 } else { at_rest + 1 };
            self.viewer.finish_frame();
        }
        Ok(())
    }

    /// Repeats something for the duration of a part, after some times that do not count. It gets
    /// the number of the repetition.
    fn repeat(
        &mut self,
        mut once: impl FnMut(&mut Self, usize) -> Result<Duration, BenchmarkError>,
    ) -> Result<Distribution, BenchmarkError> {
        for number in 0..WARM_UP {
            once(self, number)?;
        }
        let (begun, mut millis) = (Instant::now(), Vec::new());
        while millis.len() < MIN_FRAMES || begun.elapsed() < self.part && millis.len() < MAX_FRAMES
        {
            let took = once(self, WARM_UP + millis.len())?;
            millis.push(took.as_secs_f64() * 1e3);
        }
        Ok(Distribution::new(millis))
    }

    /// Lists the tags that a host sets as numbers; each has a value then.
    fn host_tags(&mut self) -> Vec<String> {
        let ids: Vec<String> = self.viewer.stats().tags.into_iter().map(|tag| tag.id).collect();
        let takes_number =
            |id: &String| self.viewer.set_tag(id, &HostTagValue::from_number(0.0)).is_ok();
        ids.into_iter().filter(takes_number).collect()
    }

    fn set_tags(&mut self, ids: &[String], number: impl Fn(usize) -> f64) {
        for (index, id) in ids.iter().enumerate() {
            // Each took a number before.
            let _ = self.viewer.set_tag(id, &HostTagValue::from_number(number(index)));
        }
    }

    /// Measures frames in which each of these tags has a new value, until overlays show it; none
    /// without tags.
    fn tags_ms(&mut self, ids: &[String]) -> Result<Option<Distribution>, BenchmarkError> {
        if ids.is_empty() {
            return Ok(None);
        }
        // A frame then waits for the overlays, which have processes of their own.
        self.viewer.set_settles(true);
        let measured = self.repeat(|view, number| {
            let begun = Instant::now();
            view.set_tags(ids, |index| (number * 7 + index * 13) as f64 % 1000.0);
            view.frame()?;
            Ok(begun.elapsed())
        })?;
        self.viewer.set_settles(false);
        Ok(Some(measured))
    }

    /// Measures changes of detail by a step and in full; none without a model that has other detail.
    fn detail_ms(&mut self) -> Result<[Option<Distribution>; 2], BenchmarkError> {
        // A frame then waits until it shows the detail that was asked for.
        self.viewer.set_settles(true);
        let mut triangles = Vec::new();
        for theta in FULL_THETA {
            self.viewer.set_theta(theta);
            self.frame()?;
            triangles.push(self.viewer.stats().triangles);
        }
        let mut found = [None; 2];
        if triangles[0] != triangles[1] {
            for (found, thetas) in found.iter_mut().zip([STEP_THETA, FULL_THETA]) {
                *found = Some(self.repeat(|view, number| {
                    view.viewer.set_theta(thetas[number % 2]);
                    view.frame()
                })?);
            }
        }
        self.viewer.use_policies();
        self.viewer.set_settles(false);
        self.settle()?;
        Ok(found)
    }

    /// Measures frames with a camera that turns around the scene, and the device's time by pass.
    fn motion_ms(
        &mut self,
    ) -> Result<(Distribution, BTreeMap<String, Distribution>), BenchmarkError> {
        let bounds = self.viewer.scene().graph.bounds();
        let bounds = bounds.unwrap_or(Bounds { min: Vec3::NEG_ONE, max: Vec3::ONE });
        let center = bounds.center();
        let distance = (bounds.max - bounds.min).length() * 0.5 * RADII;
        let mut passes: BTreeMap<String, Vec<f64>> = BTreeMap::new();
        let motion = self.repeat(|view, number| {
            let yaw = number as f32 / POSES as f32 * TAU;
            let level = Vec3::new(yaw.sin(), 0.0, yaw.cos()) * PITCH.cos();
            let eye = center + (level + Vec3::Y * PITCH.sin()) * distance;
            view.viewer.look_from(eye.into(), center.into());
            let took = view.frame()?;
            for (pass, millis) in view.viewer.stats().gpu_ms {
                passes.entry(pass.to_owned()).or_default().push(millis);
            }
            Ok(took)
        })?;
        let passes = passes.into_iter().map(|(pass, all)| (pass, Distribution::new(all)));
        Ok((motion, passes.collect()))
    }
}

/// Reads the greatest resident memory of this process, bytes (Linux, proc_pid_status(5)).
fn peak_bytes() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    let kibibytes: u64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    Some(kibibytes * 1024)
}
