//! Subcommand `busbar check`: every fault of a configuration.

use std::path::Path;
use std::process::ExitCode;

use busbar_scene_loader::{LoadError, LoadProgress, LoadedScene};

use crate::output;

pub(crate) fn run(config: &Path) -> anyhow::Result<ExitCode> {
    load_by(config, LoadedScene::check)?;
    output::result(&format!("{}: no errors", config.display()));
    Ok(ExitCode::SUCCESS)
}

/// Loads a scene with a progress bar, and prints its remarks.
pub(crate) fn load(config: &Path) -> anyhow::Result<LoadedScene> {
    load_by(config, LoadedScene::load)
}

type Load = fn(&Path, &LoadProgress<'_>) -> Result<LoadedScene, LoadError>;

fn load_by(config: &Path, load: Load) -> anyhow::Result<LoadedScene> {
    let bar = output::progress_bar();
    let scene = load(config, &|stage, done, total| {
        output::show_progress(&bar, stage, done, total);
    });
    bar.finish_and_clear();
    let scene = scene?;
    for remark in scene.remarks(config) {
        output::line(&remark);
    }
    Ok(scene)
}
