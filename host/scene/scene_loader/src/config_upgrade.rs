//! Present names of settings for a file that has former ones.

use std::path::Path;

use busbar_config::{RenamedSettings, TextKind, UpgradedText, join_pointer};
use serde_json::Value;

use crate::config_file::{config_folder, read_config_text};
use crate::diagnostics::{DiagnosticsCollector, LoadError};
use crate::plugins::{catalog, rename_settings};

/// Returns the text of a configuration or scenario with present names; settings of plugins by
/// the schemas of the plugins in the configured directories.
///
/// # Errors
/// A text that cannot be read, settings given under two names, and faults of a configuration
/// with plugins, since they hide which plugins there are.
pub fn upgraded_text(path: &Path) -> Result<UpgradedText, LoadError> {
    let faulty = |diagnostics| LoadError { file: path.to_owned(), diagnostics };
    let text = read_config_text(path).map_err(|fault| faulty(vec![fault]))?;
    let upgraded = busbar_config::upgrade(&text, |_| RenamedSettings::default());
    let upgraded = upgraded.map_err(faulty)?;
    if upgraded.kind == TextKind::Scenario {
        return Ok(upgraded);
    }
    let config = busbar_config::parse(&text).map_err(faulty)?;
    if config.plugins.is_empty() {
        return Ok(upgraded);
    }
    let mut faults = DiagnosticsCollector::new(&config);
    let catalog = catalog(&config, &config_folder(path), &mut faults);
    let catalog = catalog.ok_or_else(|| faulty(faults.found))?;
    let of_plugins = |document: &mut Value| {
        let mut all = RenamedSettings::default();
        for plugin in config.plugins.values() {
            let pointer = join_pointer(&plugin.pointer, "settings");
            if let Some(settings) = document.pointer_mut(&pointer) {
                all.extend(rename_settings(settings, plugin, &catalog));
            }
        }
        all
    };
    busbar_config::upgrade(&text, of_plugins).map_err(faulty)
}
