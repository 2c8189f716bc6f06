//! `busbar check`.

use std::path::Path;
use std::process::ExitCode;

use busbar_viewer::LoadedScene;

use crate::output;

pub(crate) fn run(config: &Path) -> anyhow::Result<ExitCode> {
    let scene = load(config)?;
    for remark in scene.remarks(config) {
        output::line(&remark);
    }
    output::result(&format!("{}: no errors", config.display()));
    Ok(ExitCode::SUCCESS)
}

/// Loads a scene with a progress bar.
pub(crate) fn load(config: &Path) -> anyhow::Result<LoadedScene> {
    let bar = output::progress_bar();
    let scene = LoadedScene::load(config, &|stage, done, total| {
        output::show_progress(&bar, stage, done, total);
    });
    bar.finish_and_clear();
    Ok(scene?)
}
