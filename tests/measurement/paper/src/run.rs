//! Run of all measurements, one after another, in one process.

use std::path::Path;
use std::sync::Arc;

use anyhow::{Context, Result};
use busbar_geometry::{CollapseStacks, Mesh};
use busbar_gltf_import::{ImportLimits, import_file};
use busbar_scene_loader::LoadedScene;
use busbar_viewer::{Picture, RendererOptions, Viewer};

use crate::effort::Effort;
use crate::frames::{self, FrameTimes};
use crate::image_difference::ImageDifference;
use crate::lossless::LosslessWalk;
use crate::machine::Machine;
use crate::optimise::{Optimiser, weld_millis};
use crate::picks::PickChanges;
use crate::progress::Progress;
use crate::results::{Results, SceneLevel, Stages};
use crate::scene::{OVERVIEW, PaperScene};
use crate::studio::save;
use crate::study::Study;
use crate::theta_change::ThetaChange;
use crate::topology::{Shells, live};

/// Thetas of Table I, with two more.
pub const THETAS: [f64; 5] = [0.0, 0.5, 0.7, 0.85, 0.95];
/// Theta whose picks are compared with those at 0.
pub const PICK_THETA: f64 = 0.7;
/// Size of pictures, and of frames bound by pixels.
pub const LARGE: [u32; 2] = [1280, 720];
/// Size of frames bound by vertices and triangles.
pub const SMALL: [u32; 2] = [320, 180];
/// Number of samples a pixel of the pictures.
const PICTURE_SAMPLES: u32 = 4;

/// Measures everything; pictures go to `out`, the scene to a folder in it, and
/// plugins come from `plugins`.
///
/// # Errors
/// When a file cannot be written, a plugin is missing, or the device fails.
pub fn measure(
    out: &Path,
    plugins: &Path,
    effort: &Effort,
    progress: &Progress,
) -> Result<Results> {
    progress.stage("substation", 1);
    let scene = PaperScene::make(&out.join("scene"), plugins, effort.path_frames)?;
    progress.stage("collapse stacks", 1);
    let mesh = imported(&scene.model)?;
    let weld = weld_millis(&mesh)?;
    let stacks = Optimiser::load(plugins)?.stacks(mesh)?;

    let (mut pictured, first) = load(&scene, PICTURE_SAMPLES)?;
    let (mut plain, second) = load(&scene, 1)?;
    let machine = Machine::detect(&plain.stats().gpu);
    let levels = levels(&stacks, &mut pictured, out, progress)?;
    let frames =
        frame_times(&mut [(1, &mut plain), (PICTURE_SAMPLES, &mut pictured)], effort, progress)?;
    drop(pictured);
    progress.stage("changes of theta", effort.theta_changes);
    let theta_change =
        ThetaChange::measure(&stacks, &mut plain, SMALL, effort.theta_changes, progress)?;
    progress.stage("picks", 1);
    let picks = PickChanges::measure(&mut plain, LARGE, PICK_THETA, effort.pixels)?;
    drop(plain);
    progress.stage("lossless walk", effort.moves);
    let lossless = LosslessWalk::walk(&stacks, effort.moves, progress)?;
    let study = Study::make(&scene.transformer, effort.surface_samples, out, progress)?;
    Ok(Results {
        machine,
        quick: effort.quick,
        levels,
        frames,
        stages: Stages { first, second, weld },
        theta_change,
        study,
        lossless,
        picks,
    })
}

/// Imports the only mesh of the flattened scene.
fn imported(model: &Path) -> Result<Mesh> {
    let model = import_file(model, &ImportLimits::default())?.model;
    let [mesh] =
        <[Mesh; 1]>::try_from(model.meshes).ok().context("the flattened scene is not one mesh")?;
    Ok(mesh)
}

/// Loads the scene; returns its viewer, and the milliseconds of its stages of loading.
fn load(
    scene: &PaperScene,
    samples: u32,
) -> Result<(Viewer, std::collections::BTreeMap<String, f64>)> {
    let loaded = LoadedScene::load(&scene.config, &|_, _, _| {})?;
    let viewer =
        Viewer::new_headless(loaded, RendererOptions { samples, ..Default::default() }, LARGE)?;
    let millis = viewer.stats().load_ms;
    Ok((viewer, millis))
}

fn levels(
    stacks: &Arc<CollapseStacks>,
    viewer: &mut Viewer,
    out: &Path,
    progress: &Progress,
) -> Result<Vec<SceneLevel>> {
    progress.stage("levels of the scene", THETAS.len());
    let shells = Shells::new(&live(stacks, 0));
    viewer.resize(LARGE);
    viewer.use_camera(OVERVIEW)?;
    let mut full: Option<Picture> = None;
    let mut levels = Vec::with_capacity(THETAS.len());
    for theta in THETAS {
        let cursor = stacks.cursor_for_theta(theta);
        let counts = shells.count(&live(stacks, cursor), stacks.surviving(cursor));
        frames::settle(viewer, theta)?;
        let shown = viewer.read_picture()?;
        let picture = format!("scene-{:02.0}.png", theta * 100.0);
        save(&shown, &out.join(&picture))?;
        let difference = ImageDifference::measure(full.as_ref().unwrap_or(&shown), &shown)?;
        full.get_or_insert(shown);
        levels.push(SceneLevel { theta, counts, difference, picture });
        progress.step();
    }
    Ok(levels)
}

fn frame_times(
    viewers: &mut [(u32, &mut Viewer)],
    effort: &Effort,
    progress: &Progress,
) -> Result<Vec<FrameTimes>> {
    let mut sets = Vec::new();
    for (samples, viewer) in viewers.iter_mut().filter(|(s, _)| effort.samples.contains(s)) {
        for size in [LARGE, SMALL] {
            let [width, height] = size;
            let name = format!("frames, {width} x {height}, samples: {samples}");
            progress.stage(&name, effort.path_frames * THETAS.len());
            let steps = effort.path_frames;
            sets.push(FrameTimes::measure(viewer, (size, *samples), &THETAS, steps, progress)?);
        }
    }
    Ok(sets)
}
