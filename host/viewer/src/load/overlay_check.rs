//! Overlay check: the findings of every overlay about the bindings that it gets.

use std::path::Path;

use busbar_plugin_process::RunningOverlay;

use super::{Faults, LoadError, LoadedScene, read_config};

impl LoadedScene {
    /// Configures the overlays with their bindings, and takes what they find missing for a
    /// trouble: a role that no tag has, a unit that cannot be converted.
    pub(super) fn check_overlays(&mut self, path: &Path) -> Result<(), LoadError> {
        let config = read_config(path)?;
        let mut faults = Faults::of(&config);
        for overlay in &config.overlays {
            let Some(plugin) = self.instances.get(&overlay.plugin) else { continue };
            let bindings = self.overlay_bindings(&overlay.plugin);
            match RunningOverlay::configure(plugin, bindings) {
                Ok(running) => {
                    for finding in &running.description().findings {
                        let (cause, remedy) = finding.split_once("; ").unwrap_or((finding, ""));
                        let cause = format!("overlay '{}': {cause}", overlay.plugin);
                        faults.add_trouble(&overlay.pointer, cause, remedy);
                    }
                }
                Err(error) => faults.add_of_plugin(&overlay.pointer, &error),
            }
        }
        self.troubles.append(&mut faults.troubles);
        self.troubles.append(&mut faults.found);
        Ok(())
    }
}
