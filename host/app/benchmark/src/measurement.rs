//! Measurement of one scene in this process.

use std::collections::BTreeMap;
use std::f32::consts::TAU;
use std::path::Path;
use std::sync::Arc;
use std::time::{Duration, Instant};

use busbar_config::OriginConfig;
use busbar_geometry::Bounds;
use busbar_scene_loader::{LoadError, LoadedScene};
use busbar_types::ValueKind;
use busbar_viewer::{
    CameraPose, HostTagValue, RendererOptions, ViewError, Viewer, renderer_options,
};
use glam::Vec3;
use thiserror::Error;

use crate::scene_results::{Distribution, SceneResults};

/// Least number of frames in a part of the measurement.
const MIN_FRAMES: usize = 3;
/// Greatest number of frames of a part: durations are kept.
const MAX_FRAMES: usize = 20_000;
/// Frames before those that count: pipelines are compiled, caches fill.
const WARM_UP: usize = 3;
/// Time without a frame after which a view is at rest, and the longest wait for that: textures,
/// detail and overlays come later.
const AT_REST: Duration = Duration::from_millis(200);
const MAX_SETTLING: Duration = Duration::from_secs(20);
/// Camera poses of one turn around the scene.
const POSES: usize = 240;
/// Pitch of the camera above the horizon, radians, and its distance in radii of the scene.
const PITCH: f32 = 0.35;
const RADII: f32 = 2.2;
/// Share of the vertices by which a step of detail simplifies more.
const STEP: f64 = 0.01;
/// Limits of the shares at which steps begin, and of those of least detail. No share between them is
/// measured twice: a detail that was shown before is kept.
const STEP_THETA: [f64; 2] = [0.1, 0.9];
const LEAST_THETA: [f64; 2] = [0.90, 0.99];
/// Golden ratio less one: its multiples, without their whole parts, are spread evenly and do not
/// repeat.
const GOLDEN: f64 = 0.618_033_988_749_895;
/// Size of a picture that shows whether tags are shown, pixels, and values for that.
const TRIAL_SIZE: [u32; 2] = [640, 360];
const TRIAL_VALUES: [f64; 3] = [1.0, 888.0, 1.0];

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

/// Measures the scene of a configuration. Nobody is told of the values that it is measured with, and
/// no log keeps them.
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
    let host_tags = measured.find_host_tags();
    measured.set_tags(&host_tags, |_| TRIAL_VALUES[0]);
    measured.settle()?;
    let rest_ms = measured.measure_rest()?;
    let still_ms = measured.repeat(|view, _| {
        view.viewer.forget_picture();
        view.frame()
    })?;
    let tags_ms = measured.measure_tags(&host_tags)?;
    let [detail_step_ms, detail_full_ms] = measured.measure_detail()?;
    // Last, for the camera stays where it was put.
    let (motion_ms, pass_ms) = measured.measure_motion()?;
    let stats = measured.viewer.stats();
    let name = config.file_stem().map_or_else(String::new, |n| n.to_string_lossy().into_owned());
    Ok(SceneResults {
        scene: name,
        device: stats.gpu,
        size,
        triangles: stats.triangles_full,
        motion_triangles: stats.triangles,
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

/// Reports whether the picture of a configuration follows the tags that the host sets, and nothing
/// else.
///
/// # Errors
/// [`BenchmarkError`] names what keeps the scene from being drawn.
pub fn shows_tags(config: &Path) -> Result<bool, BenchmarkError> {
    let mut measured = MeasuredView::open(config, TRIAL_SIZE, false, Duration::ZERO)?;
    let ids = measured.find_host_tags();
    let mut pictures = Vec::new();
    for number in TRIAL_VALUES {
        measured.set_tags(&ids, |_| number);
        measured.settle()?;
        pictures.push(measured.viewer.read_picture()?.rgba8);
    }
    Ok(pictures[0] != pictures[1] && pictures[0] == pictures[2])
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
        let mut scene = LoadedScene::load(config, &|_, _, _| {})?;
        // What is measured with is no event of the plant.
        scene.audit_log = None;
        let settings = Arc::make_mut(&mut scene.config);
        settings.notifications.clear();
        // Frames take the time that they take: neither resolution nor detail follows it.
        settings.view.target_frame_millis = None;
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
        let mut drawn_at = begun;
        while drawn_at.elapsed() < AT_REST && begun.elapsed() < MAX_SETTLING {
            if self.step()? {
                self.viewer.finish_frame();
                drawn_at = Instant::now();
            }
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

    /// Measures steps that draw nothing; none where each one draws.
    fn measure_rest(&mut self) -> Result<Option<Distribution>, BenchmarkError> {
        let (begun, mut millis) = (Instant::now(), Vec::new());
        while begun.elapsed() < self.part.max(AT_REST) && millis.len() < MAX_FRAMES {
            let step = Instant::now();
            if !self.step()? {
                millis.push(step.elapsed().as_secs_f64() * 1e3);
            }
        }
        Ok((!millis.is_empty()).then(|| Distribution::new(millis)))
    }

    /// Finds the numbers that a host sets.
    fn find_host_tags(&self) -> Vec<String> {
        let tags = self.viewer.scene().config.tags.iter();
        let of_host = tags.filter(|(_, tag)| {
            tag.origin == OriginConfig::Host && tag.value_type == ValueKind::F64
        });
        of_host.map(|(id, _)| id.clone()).collect()
    }

    fn set_tags(&mut self, ids: &[String], number: impl Fn(usize) -> f64) {
        for (index, id) in ids.iter().enumerate() {
            // Never refused: these are numbers of the host.
            let _ = self.viewer.set_tag(id, HostTagValue::from_number(number(index)));
        }
    }

    /// Measures frames in which each of these tags has a new value; none without tags or overlays.
    fn measure_tags(&mut self, ids: &[String]) -> Result<Option<Distribution>, BenchmarkError> {
        if ids.is_empty() || self.viewer.scene().config.overlays.is_empty() {
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

    /// Measures changes of detail by a step and from full to least; none without a model that has
    /// other detail.
    fn measure_detail(&mut self) -> Result<[Option<Distribution>; 2], BenchmarkError> {
        // A frame then waits until it shows the detail that was asked for.
        self.viewer.set_settles(true);
        let (_, full) = self.show_detail(0.0)?;
        let (_, least) = self.show_detail(LEAST_THETA[0])?;
        let mut found = [None; 2];
        if full != least {
            found[0] = Some(self.repeat(|view, number| {
                let before = place_between(STEP_THETA, number);
                view.show_detail(before)?;
                Ok(view.show_detail(before + STEP)?.0)
            })?);
            found[1] = Some(self.repeat(|view, number| {
                view.show_detail(0.0)?;
                Ok(view.show_detail(place_between(LEAST_THETA, number))?.0)
            })?);
        }
        self.viewer.use_policies();
        self.viewer.set_settles(false);
        self.settle()?;
        Ok(found)
    }

    /// Shows all models in a detail; returns the duration and the number of triangles.
    fn show_detail(&mut self, theta: f64) -> Result<(Duration, u64), BenchmarkError> {
        self.viewer.set_theta(theta);
        let took = self.frame()?;
        Ok((took, self.viewer.stats().triangles))
    }

    /// Measures frames with a camera that turns around the scene, and the device's time by pass.
    fn measure_motion(
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
            let graph = &view.viewer.scene().graph;
            let [eye, target] = [eye, center].map(|point| graph.point_to_world(point));
            view.viewer.set_camera_pose(&CameraPose { eye, target, is_orthographic: false });
            let took = view.frame()?;
            // The times are those of the frame before.
            if number > WARM_UP {
                for (pass, millis) in view.viewer.stats().gpu_ms {
                    passes.entry(pass.to_owned()).or_default().push(millis);
                }
            }
            Ok(took)
        })?;
        let passes = passes.into_iter().map(|(pass, all)| (pass, Distribution::new(all)));
        Ok((motion, passes.collect()))
    }
}

/// Returns a place between two limits, another one for each number.
fn place_between([from, to]: [f64; 2], number: usize) -> f64 {
    from + (to - from) * (number as f64 * GOLDEN).fract()
}

/// Reads the greatest resident memory of this process, bytes (Linux, proc_pid_status(5)).
fn peak_bytes() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    let kibibytes: u64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    Some(kibibytes * 1024)
}
