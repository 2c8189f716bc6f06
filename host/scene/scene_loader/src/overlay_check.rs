//! Overlay check: the findings of every overlay about the bindings that it gets.

use std::path::Path;

use busbar_plugin_process::RunningOverlay;

use crate::config_file::read_config;
use crate::diagnostics::{DiagnosticsCollector, LoadError};
use crate::loaded_scene::LoadedScene;

impl LoadedScene {
    /// Configures the overlays with their bindings, and adds findings as failures, such as a
    /// role without a tag or a unit that cannot be converted.
    pub(crate) fn check_overlays(&mut self, path: &Path) -> Result<(), LoadError> {
        let config = read_config(path)?;
        let mut faults = DiagnosticsCollector::new(&config);
        for overlay in &config.overlays {
            let Some(plugin) = self.instances.get(&overlay.plugin) else { continue };
            let bindings = self.overlay_bindings(&overlay.plugin);
            match RunningOverlay::configure(plugin, bindings) {
                Ok(running) => {
                    for finding in &running.description().findings {
                        let (cause, remedy) = finding.split_once("; ").unwrap_or((finding, ""));
                        let cause = format!("overlay '{}': {cause}", overlay.plugin);
                        faults.add_plugin_failure(&overlay.pointer, cause, remedy);
                    }
                }
                Err(error) => faults.add_plugin_error(&overlay.pointer, &error),
            }
        }
        self.plugin_failures.append(&mut faults.plugin_failures);
        self.plugin_failures.append(&mut faults.found);
        Ok(())
    }
}
