//! Duties of plugin instances: the tags that each serves, and the bindings that overlays get.

use std::time::Duration;

use busbar_config::{Config, TagConfig};
use busbar_plugin_host::{FreshnessBasis, OverlayBinding, SourcePolicy, TelemetryTag};
use busbar_plugin_process::{Plugin, RunningTelemetry};
use busbar_tags::{TagHandle, TagSpec};
use busbar_types::Origin;

use crate::loaded_scene::LoadedScene;

impl LoadedScene {
    /// The tags that a plugin serves, if it is to serve: a source of alarms does without any.
    pub fn served_tags(&self, name: &str, plugin: &Plugin) -> Option<Vec<TelemetryTag>> {
        let tags = telemetry_tags(&self.config, self.tags.specs(), name);
        let has_alarms = has_alarms(&self.config, name);
        let serves = !tags.is_empty() || has_alarms && RunningTelemetry::has_telemetry(plugin);
        serves.then_some(tags)
    }

    /// The bindings that an overlay gets.
    pub fn overlay_bindings(&self, overlay: &str) -> Vec<OverlayBinding> {
        let roles = self.config.plugins.get(overlay).map_or(&[][..], |plugin| &plugin.roles);
        bindings_in_roles(self, roles)
    }
}

/// Reports whether a plugin instance is the source of a tag or of alarms.
pub(crate) fn serves(config: &Config, name: &str) -> bool {
    let mut sources = config.tags.values().filter_map(TagConfig::source);
    sources.any(|source| source.plugin == name) || has_alarms(config, name)
}

/// Reports whether a plugin is the source of external alarms.
pub(crate) fn has_alarms(config: &Config, name: &str) -> bool {
    config.alarm_handling.sources.iter().any(|source| source.plugin == name)
}

/// Reports whether a plugin tells people of alarms.
pub(crate) fn tells_of_alarms(config: &Config, name: &str) -> bool {
    config.notifications.iter().any(|entry| entry.plugin == name)
}

/// Returns the bindings in these roles, or all where there are none, as overlays get them.
fn bindings_in_roles(scene: &LoadedScene, roles: &[String]) -> Vec<OverlayBinding> {
    scene
        .bindings
        .iter()
        .filter(|binding| roles.is_empty() || roles.contains(&binding.role))
        .map(|binding| {
            let spec = &scene.tags.specs()[binding.tag.0 as usize];
            let limits = scene.config.tags.get(&spec.id).map(|tag| tag.limits).unwrap_or_default();
            OverlayBinding {
                tag: binding.tag,
                node: binding.node.0,
                kind: spec.kind,
                limit_low: limits.low,
                limit_high: limits.high,
                tag_id: spec.id.clone(),
                tag_name: spec.name.clone(),
                unit: spec.unit.clone(),
                node_id: scene.graph.node(binding.node).id(),
                role: binding.role.clone(),
            }
        })
        .collect()
}

/// Returns the tags that a plugin instance serves. Handles follow the order of ids.
pub fn telemetry_tags(config: &Config, tags: &[TagSpec], plugin: &str) -> Vec<TelemetryTag> {
    config
        .tags
        .iter()
        .enumerate()
        .filter_map(|(index, (id, tag))| {
            let source = tag.source().filter(|source| source.plugin == plugin)?;
            Some(TelemetryTag {
                tag: TagHandle(index as u32),
                kind: tags[index].kind,
                freshness: Duration::from_millis(tag.freshness_millis),
                id: id.clone(),
                address_json: source.address.to_string(),
                // Samples that are scaled to the tag's unit have another one.
                unit: tags[index].scale.map_or_else(|| tags[index].unit.clone(), |_| String::new()),
            })
        })
        .collect()
}

/// Returns the configured rules for all samples of an instance.
pub fn source_policy(config: &Config, name: &str) -> SourcePolicy {
    let Some(plugin) = config.plugins.get(name) else { return SourcePolicy::default() };
    let origin = if plugin.simulated { Origin::SIMULATED } else { Origin::LIVE };
    let basis = match plugin.freshness_by {
        busbar_config::FreshnessBasis::SourceTime => FreshnessBasis::SourceTime,
        busbar_config::FreshnessBasis::Reception => FreshnessBasis::Reception,
    };
    SourcePolicy { origin, basis }
}
