//! `busbar check`.

use std::path::Path;
use std::process::ExitCode;

use busbar_viewer::LoadedScene;

use crate::output;

pub(crate) fn run(config: &Path) -> anyhow::Result<ExitCode> {
    load(config)?;
    output::result(&format!("{}: no errors", config.display()));
    Ok(ExitCode::SUCCESS)
}

/// Loads a scene with a progress bar, and prints what there is to remark.
pub(crate) fn load(config: &Path) -> anyhow::Result<LoadedScene> {
    let bar = output::progress_bar();
    let scene = LoadedScene::load(config, &|stage, done, total| {
        output::show_progress(&bar, stage, done, total);
    });
    bar.finish_and_clear();
    let scene = scene?;
    for remark in scene.remarks(config) {
        output::line(&remark);
    }
    Ok(scene)
}
