//! Subcommand `busbar plugin`, and the default plugin directories.

pub(crate) mod check;
pub(crate) mod new;
pub(crate) mod run;

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::anyhow;
use busbar_commands::offered_commands;
use busbar_plugin_host::LoadRules;
use busbar_plugin_process::{Isolation, PluginCatalog};
use busbar_scene_loader::plugin_catalog;

use crate::output;

pub(crate) fn list(config: Option<&Path>, with_schema: bool) -> anyhow::Result<ExitCode> {
    let catalog = match config {
        Some(config) => plugin_catalog(config)?,
        None => {
            let directories = default_directories()?;
            PluginCatalog::discover(&directories, &LoadRules::default(), Isolation::Process)
        }
    };
    let (commands, remarks) = offered_commands(&catalog);
    remarks.iter().for_each(|remark| output::line(&format!("warning: {remark}")));
    for plugin in catalog.plugins() {
        output::result(&format!(
            "{} {}  [{}]  {}\n    {}",
            plugin.id,
            plugin.version,
            plugin.capabilities.join(", "),
            plugin.path.display(),
            plugin.description,
        ));
        for command in commands.iter().filter(|command| command.plugin == plugin.id) {
            output::result(&format!("    busbar {}: {}", command.name, command.help));
        }
        if let (true, Some(schema)) = (with_schema, &plugin.settings_schema) {
            output::result(&serde_json::to_string_pretty(schema)?);
        }
    }
    for refused in catalog.refused() {
        output::result(&format!("refused {}: {}", refused.path.display(), refused.reason));
    }
    Ok(ExitCode::SUCCESS)
}

/// Signs a library for a site.
pub(crate) fn sign(library: &Path, key: &Path) -> anyhow::Result<ExitCode> {
    let (path, text, public_key) =
        busbar_plugin_host::sign_library(library, key).map_err(|error| anyhow!(error))?;
    output::write_file(&path, text.as_bytes())?;
    output::line(&format!("{} is signed; the configuration demands it by", library.display()));
    output::result(&format!("\"signature\": {{ \"public_key\": \"{public_key}\" }}"));
    Ok(ExitCode::SUCCESS)
}

/// Hosts a plugin for the viewer that started this process.
pub(crate) fn host() -> anyhow::Result<ExitCode> {
    busbar_plugin_process::serve().map_err(|error| anyhow!(error))?;
    Ok(ExitCode::SUCCESS)
}

/// Returns `plugins` beside this program, or else the program's own directory.
pub(crate) fn default_directories() -> anyhow::Result<Vec<PathBuf>> {
    let program = std::env::current_exe()?;
    let folder = program.parent().map(PathBuf::from).unwrap_or_default();
    let plugins = folder.join("plugins");
    Ok(vec![if plugins.is_dir() { plugins } else { folder }])
}
