//! Subcommand `busbar import`: a scene from a model and a point list.

mod device;

use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::{anyhow, bail};
use busbar_commands::{SceneRequest, import_scene};
use busbar_scene_loader::{LoadError, LoadedScene};

use crate::arguments::ImportOptions;
use crate::{output, plugin};

pub(crate) fn run(options: &ImportOptions) -> anyhow::Result<ExitCode> {
    match (&options.from, &options.points, &options.out) {
        (Some(instance), ..) => device::run(options, instance),
        (None, Some(points), Some(out)) => make_scene(options, points, out),
        _ => bail!("a scene needs a point list and --out\n  remedy: name both, or add --from"),
    }
}

fn make_scene(options: &ImportOptions, points: &Path, out: &Path) -> anyhow::Result<ExitCode> {
    let reports = ["csv", "md"].map(|extension| beside(out, extension));
    let [report_csv, report_markdown] = &reports;
    if !options.force {
        check_free(&[out, report_csv, report_markdown])?;
    }
    let scene = import_scene(&SceneRequest {
        model: options.source.clone(),
        points: points.to_owned(),
        encoding: options.encoding,
        out: out.to_owned(),
        id: options.id.clone(),
        plugins: options.plugin.clone(),
        overlays: options.overlay.clone(),
        optimizer: options.optimizer.clone(),
        plugin_directories: directories(options, out)?,
        skips_bad_rows: options.skip_bad_rows,
    })?;
    write_checked(out, &scene.text)?;
    output::write_file(report_csv, scene.report_csv.as_bytes())?;
    output::write_file(report_markdown, scene.report_markdown.as_bytes())?;
    let list = points.display().to_string();
    for fault in &scene.skipped {
        output::line(&fault.render(&list).replacen(": error: ", ": warning: skipped: ", 1));
    }
    if !scene.unused_columns.is_empty() {
        let columns = scene.unused_columns.join("', '");
        output::line(&format!("{list}: warning: columns not used: '{columns}'"));
    }
    for remark in &scene.remarks {
        output::line(&format!("{list}: warning: {remark}"));
    }
    scene.notes.iter().for_each(|note| output::line(&format!("warning: {note}")));
    let doubtful = scene.tags - scene.bound;
    output::result(&format!(
        "{}: {} tags, {} bound, {doubtful} in doubt; {} has the reasons",
        out.display(),
        scene.tags,
        scene.bound,
        report_markdown.display(),
    ));
    Ok(ExitCode::SUCCESS)
}

/// Returns a path beside the scene, such as `scene.import.csv` beside `scene.json`.
fn beside(out: &Path, extension: &str) -> PathBuf {
    out.with_extension(format!("import.{extension}"))
}

fn check_free(paths: &[&Path]) -> anyhow::Result<()> {
    match paths.iter().find(|path| path.symlink_metadata().is_ok()) {
        Some(path) => bail!(
            "'{}' is there already\n  remedy: name another --out, or add --force to replace it",
            path.display()
        ),
        None => Ok(()),
    }
}

/// Returns the plugin directories: those of the arguments; else `plugins` beside the scene; else
/// those of this program.
fn directories(options: &ImportOptions, out: &Path) -> anyhow::Result<Vec<PathBuf>> {
    if !options.plugins.is_empty() {
        return Ok(options.plugins.clone());
    }
    let own = out.with_file_name("plugins");
    if own.is_dir() { Ok(vec![own]) } else { plugin::default_directories() }
}

/// Writes the scene if it has no fault, and not at all otherwise.
fn write_checked(out: &Path, text: &str) -> anyhow::Result<()> {
    let mut name = OsString::from(".");
    name.push(out.file_name().ok_or_else(|| anyhow!("--out names no file\n  remedy: name one"))?);
    name.push(format!(".{}.new", std::process::id()));
    let trial = out.with_file_name(name);
    output::write_file(&trial, text.as_bytes())?;
    let bar = output::progress_bar();
    let checked = LoadedScene::check(&trial, &|stage, done, total| {
        output::show_progress(&bar, stage, done, total);
    });
    bar.finish_and_clear();
    let result = match checked {
        Ok(_) => output::write_file(out, text.as_bytes()),
        Err(error) => {
            output::line("the scene that this would give has faults; nothing is written:");
            Err(LoadError { file: out.to_owned(), ..error }.into())
        }
    };
    let _ = std::fs::remove_file(&trial);
    result
}
