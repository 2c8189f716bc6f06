//! Subcommand `busbar benchmark`: what the machine at hand can show.

use std::path::Path;
use std::process::{Command, ExitCode, Stdio};

use anyhow::{Context, bail};
use busbar_benchmark::{
    MeasureOptions, ScenePlugins, SceneResults, SceneSize, format_table, measure, shows_tags,
    write_scene,
};
use busbar_plugin_host::LoadRules;
use busbar_plugin_process::{Isolation, PluginCatalog};
use serde::{Deserialize, Serialize};

use crate::arguments::{BenchmarkOptions, Size};
use crate::plugin::default_directories;
use crate::{output, render};

/// Results as a file has them.
#[derive(Debug, Serialize, Deserialize)]
struct BenchmarkFile {
    /// Version of the program.
    busbar: String,
    /// Plugins of generated scenes.
    optimizer: Option<String>,
    overlay: Option<String>,
    scenes: Vec<SceneResults>,
}

pub(crate) fn run(options: &BenchmarkOptions) -> anyhow::Result<ExitCode> {
    let (plugins, scenes) = match &options.config {
        Some(config) => {
            let BenchmarkOptions { size, seconds, validation, .. } = *options;
            let options = MeasureOptions { size: size.0, part: seconds, validation };
            (ScenePlugins::default(), vec![measure(config, options)?])
        }
        None => measure_generated(options)?,
    };
    output::result(format_table(&scenes).trim_end());
    let messages = scenes.iter().flat_map(|scene| scene.validation_messages.clone());
    let messages: Vec<String> = messages.collect();
    if let Some(path) = &options.json {
        let busbar = env!("CARGO_PKG_VERSION").to_owned();
        let ScenePlugins { optimizer, overlay, .. } = plugins;
        output::write_json(path, &BenchmarkFile { busbar, optimizer, overlay, scenes })?;
    }
    Ok(render::verdict(&messages))
}

/// Measures generated scenes of every size, each in a process of its own.
fn measure_generated(
    options: &BenchmarkOptions,
) -> anyhow::Result<(ScenePlugins, Vec<SceneResults>)> {
    let folder = tempfile::tempdir().context("no temporary folder; set TMPDIR")?;
    let plugins = choose_plugins(options)?;
    let lacks = |what: &str, option: &str| {
        output::line(&format!("warning: {what} is not measured: name a plugin by {option}"));
    };
    if plugins.optimizer.is_none() {
        lacks("other detail", "--optimizer");
    }
    if plugins.overlay.is_none() {
        lacks("showing values", "--overlay");
    }
    let measured = SceneSize::ALL.into_iter().map(|size| {
        output::line(&format!("measuring: {} …", size.name()));
        let config = write_scene(folder.path(), size, &plugins)?;
        measure_in_process(&config, options)
    });
    let scenes = measured.collect::<anyhow::Result<_>>()?;
    Ok((plugins, scenes))
}

/// Chooses the plugins of generated scenes: those that are named, or else the first optimizer and
/// the first overlay that can show the scene's tags.
fn choose_plugins(options: &BenchmarkOptions) -> anyhow::Result<ScenePlugins> {
    let directories = match &options.plugins {
        Some(folder) => vec![folder.canonicalize().with_context(|| {
            format!("no folder '{}'; name that of the plugin libraries", folder.display())
        })?],
        None => default_directories()?,
    };
    let catalog = PluginCatalog::discover(&directories, &LoadRules::default(), Isolation::Process);
    let named = options.optimizer.clone();
    let optimizer = named.or_else(|| catalog.optimizers().next().map(|plugin| plugin.id.clone()));
    let mut plugins = ScenePlugins { directories, optimizer, overlay: options.overlay.clone() };
    if plugins.overlay.is_some() {
        return Ok(plugins);
    }
    // A folder of its own: what is cached there does not make the measured start quicker.
    let folder = tempfile::tempdir().context("no temporary folder; set TMPDIR")?;
    for overlay in catalog.overlays() {
        let tried = ScenePlugins { overlay: Some(overlay.id.clone()), ..plugins.clone() };
        let config = write_scene(folder.path(), SceneSize::Bay, &tried)?;
        match shows_tags(&config) {
            Ok(true) => {
                plugins = tried;
                break;
            }
            Ok(false) => {}
            Err(error) => tracing::debug!(overlay = overlay.id, %error, "an overlay that cannot"),
        }
    }
    Ok(plugins)
}

fn measure_in_process(config: &Path, options: &BenchmarkOptions) -> anyhow::Result<SceneResults> {
    let results = config.with_extension("results.json");
    let Size([width, height]) = options.size;
    let mut command = Command::new(std::env::current_exe()?);
    command.arg("benchmark").arg(config).arg("--json").arg(&results);
    command.args(["--size", &format!("{width}x{height}")]);
    command.args(["--seconds", &options.seconds.as_secs_f64().to_string()]);
    if options.validation {
        command.arg("--validation");
    }
    let status = command.stdin(Stdio::null()).stdout(Stdio::null()).status()?;
    // Messages of the validation layer are in the results too.
    let text = std::fs::read_to_string(&results).unwrap_or_default();
    let Ok(file) = serde_json::from_str::<BenchmarkFile>(&text) else {
        bail!("the scene was not measured ({status}); the reason is above");
    };
    file.scenes.into_iter().next().context("a scene without results, a fault of Busbar")
}
