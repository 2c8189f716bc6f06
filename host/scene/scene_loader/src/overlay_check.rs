//! Overlay check: the findings of every overlay about the bindings that it gets, and alarms on
//! equipment that an overlay never judges.

use std::path::Path;

use busbar_alarms::MAX_ALARMS;
use busbar_config::{AlarmOriginConfig, Config, join_pointer};
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
                    let description = running.description();
                    for finding in &description.findings {
                        let (cause, remedy) = finding.split_once("; ").unwrap_or((finding, ""));
                        let cause = format!("overlay '{}': {cause}", overlay.plugin);
                        faults.add_plugin_failure(&overlay.pointer, cause, remedy);
                    }
                    let judged = &description.equipment;
                    self.check_verdict_alarms(&config, &overlay.plugin, judged, &mut faults);
                }
                Err(error) => faults.add_plugin_error(&overlay.pointer, &error),
            }
        }
        self.plugin_failures.append(&mut faults.plugin_failures);
        self.plugin_failures.append(&mut faults.found);
        Ok(())
    }
}

/// Equipment that a remedy names.
const MAX_NAMED: usize = 5;

impl LoadedScene {
    /// Adds a failure for each alarm on equipment that is none of those that its overlay judges.
    fn check_verdict_alarms(
        &self,
        config: &Config,
        overlay: &str,
        judged: &[String],
        faults: &mut DiagnosticsCollector<'_>,
    ) {
        let follows = |origin: &AlarmOriginConfig| match origin {
            AlarmOriginConfig::Verdict { overlay: own, .. } => own == overlay,
            AlarmOriginConfig::Tag { .. } | AlarmOriginConfig::Mirrored => false,
        };
        let node = |id: &str| self.equipment.find(&self.graph, id);
        let named = || {
            let shown: Vec<&str> = judged.iter().take(MAX_NAMED).map(String::as_str).collect();
            match judged.len().saturating_sub(MAX_NAMED) {
                0 => format!("it judges {}", shown.join(", ")),
                more => format!("it judges {} and {more} more", shown.join(", ")),
            }
        };
        for alarm in config.alarms.values().filter(|alarm| follows(&alarm.origin)) {
            let pointer = join_pointer(&alarm.pointer, "verdict");
            if judged.is_empty() {
                let cause = format!("the overlay '{overlay}' judges no equipment");
                let remedy = "bind tags in its roles, or name equipment in its settings";
                faults.add_plugin_failure(&join_pointer(&pointer, "instance"), cause, remedy);
                continue;
            }
            let Some(id) = &alarm.equipment else { continue };
            let is_it = |judged: &String| {
                judged == id || node(id).is_some_and(|of| node(judged) == Some(of))
            };
            if !judged.iter().any(is_it) {
                let cause = format!("the overlay '{overlay}' does not judge '{id}'");
                faults.add_plugin_failure(&join_pointer(&pointer, "equipment"), cause, &named());
            }
        }
        let on_all = config.alarms.values().filter(|alarm| follows(&alarm.origin));
        let on_all = on_all.filter(|alarm| alarm.equipment.is_none());
        let mut count = config.alarms.len();
        for alarm in on_all {
            count += judged.len();
            if count > MAX_ALARMS {
                let cause = format!(
                    "an alarm on each of the {} pieces that '{overlay}' judges makes more than \
                     {MAX_ALARMS} alarms",
                    judged.len()
                );
                let remedy = "name the \"equipment\" of the alarms that matter";
                let pointer = join_pointer(&alarm.pointer, "verdict");
                faults.add_plugin_failure(&pointer, cause, remedy);
            }
        }
    }
}
