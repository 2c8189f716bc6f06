//! Plugin instances of a configuration, and whether they can do their jobs.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

use busbar_config::{Config, join_pointer};
use busbar_plugin_host::{
    Catalog, Instance, MeshOptimizer, Overlay, PluginError, Telemetry, TelemetryTag,
};
use busbar_tags::{TagHandle, TagSpec};

use super::Faults;

/// The plugins of the configured directories.
pub(super) fn catalog(config: &Config, folder: &Path) -> Catalog {
    let directories: Vec<_> =
        config.plugin_directories.iter().map(|d| folder.join(&d.path)).collect();
    Catalog::discover(&directories)
}

/// Makes every configured instance that can be made.
pub(super) fn create(
    config: &Config,
    folder: &Path,
    faults: &mut Faults<'_>,
) -> BTreeMap<String, Arc<Instance>> {
    let mut instances = BTreeMap::new();
    if config.plugins.is_empty() {
        return instances;
    }
    let catalog = catalog(config, folder);
    for (name, plugin) in &config.plugins {
        match catalog.create(name, &plugin.plugin, &plugin.settings) {
            Ok(instance) => {
                instances.insert(name.clone(), instance);
            }
            Err(error) => place(&plugin.pointer, &error, faults),
        }
    }
    instances
}

/// Puts a plugin's error where the configuration caused it.
fn place(pointer: &str, error: &PluginError, faults: &mut Faults<'_>) {
    let settings = join_pointer(pointer, "settings");
    match error {
        PluginError::Settings { id, faults: wrong } => {
            for fault in wrong {
                let cause = format!("settings of plugin '{id}': {}", fault.message);
                faults.add(&format!("{settings}{}", fault.pointer), cause, error.remedy());
            }
        }
        PluginError::Failed { settings_at_fault: true, .. } => {
            faults.add(&settings, error.to_string(), error.remedy());
        }
        _ => faults.add(&join_pointer(pointer, "plugin"), error.to_string(), error.remedy()),
    }
}

/// Whether each plugin can do what the configuration uses it for, and whether
/// its tags' addresses are usable.
pub(super) fn check_capabilities(
    config: &Config,
    instances: &BTreeMap<String, Arc<Instance>>,
    tags: &[TagSpec],
    faults: &mut Faults<'_>,
) {
    let mut add = |pointer: String, error: &PluginError| {
        faults.add(&pointer, error.to_string(), error.remedy());
    };
    for model in config.models.values() {
        let optimizer = model.optimizer.as_ref().and_then(|name| instances.get(name));
        if let Some(Err(error)) = optimizer.map(|i| MeshOptimizer::of(i.clone())) {
            add(join_pointer(&model.pointer, "optimizer"), &error);
        }
    }
    for overlay in &config.overlays {
        let instance = instances.get(&overlay.plugin);
        // Configured without bindings: the real ones follow when the view starts.
        if let Some(Err(error)) = instance.map(|i| Overlay::configure(i.clone(), Vec::new())) {
            add(overlay.pointer.clone(), &error);
        }
    }
    for (name, instance) in instances {
        check_addresses(config, name, instance, tags, &mut add);
    }
}

/// Whether a telemetry plugin can serve its tags; each fault at its address.
fn check_addresses(
    config: &Config,
    name: &str,
    instance: &Instance,
    tags: &[TagSpec],
    add: &mut impl FnMut(String, &PluginError),
) {
    let served = telemetry_tags(config, tags, name);
    let source = |tag: &TelemetryTag| config.tags.get(&tag.id).map(|tag| &tag.source.pointer);
    let Some(first) = served.first() else { return };
    let Err(error) = Telemetry::check(instance, &served) else { return };
    if let PluginError::WrongCapability { .. } = error {
        let pointer = source(first).map_or_else(String::new, |p| join_pointer(p, "plugin"));
        return add(pointer, &error);
    }
    let mut alone = 0;
    for tag in &served {
        if let (Err(error), Some(source)) =
            (Telemetry::check(instance, std::slice::from_ref(tag)), source(tag))
        {
            add(join_pointer(source, "address"), &error);
            alone += 1;
        }
    }
    // What only goes wrong together has no place of its own.
    if alone == 0 {
        add(config.plugins.get(name).map_or_else(String::new, |p| p.pointer.clone()), &error);
    }
}

/// The tags that a plugin instance serves. Handles follow the order of ids.
pub(super) fn telemetry_tags(config: &Config, tags: &[TagSpec], plugin: &str) -> Vec<TelemetryTag> {
    config
        .tags
        .iter()
        .enumerate()
        .filter(|(_, (_, tag))| tag.source.plugin == plugin)
        .map(|(index, (id, tag))| TelemetryTag {
            tag: TagHandle(index as u32),
            kind: tags[index].kind,
            freshness: Duration::from_millis(tag.freshness_millis),
            id: id.clone(),
            address_json: tag.source.address.to_string(),
        })
        .collect()
}
