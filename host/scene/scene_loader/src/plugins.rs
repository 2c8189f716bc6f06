//! Plugin instances of a configuration, and whether they can do their jobs.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use std::time::Duration;

use busbar_config::{Config, FormerNames, Isolation, PluginConfig, RenamedSettings, join_pointer};
use busbar_plugin_host::{Digest, LoadRules, PluginError, PublicKey, TelemetryTag};
use busbar_plugin_process::{
    Confinement, Deadlines, Optimizer, Plugin, PluginCatalog, PluginOptions, RestartPolicy,
    RunningAlarms, RunningNotifier, RunningOverlay, RunningRecords, RunningTelemetry,
};
use busbar_tags::TagSpec;
use rayon::prelude::*;
use serde_json::Value;

use crate::config_file::{config_folder, read_config};
use crate::diagnostics::{DiagnosticsCollector, LoadError};
use crate::plugin_duties::{serves, telemetry_tags, tells_of_alarms};
use crate::reuse::ReusePlan;

/// Makes the catalogue of plugins that a configuration's directories hold.
///
/// # Errors
/// When the configuration itself cannot be read or names no usable key.
pub fn plugin_catalog(path: &Path) -> Result<PluginCatalog, LoadError> {
    let faulty = |diagnostics| LoadError { file: path.to_owned(), diagnostics };
    let config = read_config(path)?;
    let mut faults = DiagnosticsCollector::new(&config);
    let catalog = catalog(&config, &config_folder(path), &mut faults);
    catalog.ok_or_else(|| faulty(faults.found))
}

/// The plugins of the configured directories; none with a fault where it is not
/// known which libraries may be loaded.
pub(crate) fn catalog(
    config: &Config,
    folder: &Path,
    faults: &mut DiagnosticsCollector<'_>,
) -> Option<PluginCatalog> {
    let directories: Vec<_> =
        config.plugin_directories.iter().map(|d| folder.join(&d.path)).collect();
    let all_in_process = config.plugins.values().all(|p| p.isolation == Isolation::None);
    let isolation = if all_in_process && !config.plugins.is_empty() {
        busbar_plugin_process::Isolation::None
    } else {
        busbar_plugin_process::Isolation::Process
    };
    Some(PluginCatalog::discover(&directories, &load_rules(config, faults)?, isolation))
}

/// Returns the rules for loading libraries. If every plugin is pinned, no other library is loaded
/// at all.
fn load_rules(config: &Config, faults: &mut DiagnosticsCollector<'_>) -> Option<LoadRules> {
    let pins: Option<BTreeSet<Digest>> = config.plugins.values().map(pin).collect();
    let only = pins.filter(|pins| !pins.is_empty());
    let signed_by = match &config.signature {
        None => None,
        Some(signature) => match PublicKey::parse(&signature.public_key) {
            Ok(key) => Some(key),
            Err(remedy) => {
                let pointer = join_pointer(&signature.pointer, "public_key");
                faults.add(&pointer, "this is no public key", remedy);
                return None;
            }
        },
    };
    Some(LoadRules { only, signed_by })
}

/// Returns the pinned digest of a plugin's library; the schema ensures its form.
fn pin(plugin: &PluginConfig) -> Option<Digest> {
    plugin.sha256.as_ref().and_then(|digits| digits.parse().ok())
}

/// Keeps the unchanged instances and creates all others, several in parallel.
pub(crate) fn create(
    config: &Config,
    folder: &Path,
    reuse: &ReusePlan<'_>,
    faults: &mut DiagnosticsCollector<'_>,
) -> BTreeMap<String, Plugin> {
    let is_new = |name: &str| reuse.plugin(name).is_none();
    let mut instances = create_instances(config, folder, faults, &is_new);
    let names = config.plugins.keys();
    instances.extend(names.filter_map(|name| Some((name.clone(), reuse.plugin(name)?.clone()))));
    instances
}

/// Creates the selected instances of the configuration, several in parallel.
pub fn create_instances(
    config: &Config,
    folder: &Path,
    faults: &mut DiagnosticsCollector<'_>,
    is_wanted: &(dyn Fn(&str) -> bool + Sync),
) -> BTreeMap<String, Plugin> {
    if !config.plugins.keys().any(|name| is_wanted(name)) {
        return BTreeMap::new();
    }
    let Some(catalog) = catalog(config, folder, faults) else { return BTreeMap::new() };
    let created: Vec<_> = config
        .plugins
        .par_iter()
        .filter(|(name, _)| is_wanted(name))
        .map(|(name, plugin)| {
            let options = options(config, name, plugin);
            let mut settings = in_folder(&plugin.settings, folder);
            let renamed = rename_settings(&mut settings, plugin, &catalog);
            (plugin, renamed, name, catalog.create(name, &plugin.plugin, &settings, &options))
        })
        .collect();
    let mut instances = BTreeMap::new();
    for (plugin, renamed, name, created) in created {
        faults.add_renamed(&renamed);
        match created {
            Ok(instance) => {
                instances.insert(name.clone(), instance);
            }
            Err(error) => report_plugin_error(&plugin.pointer, &error, faults),
        }
    }
    instances
}

/// Gives settings of an instance their present names, which the plugin's schema tells.
pub(crate) fn rename_settings(
    settings: &mut Value,
    plugin: &PluginConfig,
    catalog: &PluginCatalog,
) -> RenamedSettings {
    let mut infos = catalog.plugins();
    let info = infos.find(|info| info.id == plugin.plugin);
    let Some(schema) = info.and_then(|info| info.settings_schema.as_ref()) else {
        return RenamedSettings::default();
    };
    FormerNames::new(schema).rename(settings).below(&join_pointer(&plugin.pointer, "settings"))
}

/// Prefix of a settings text that names a file beside the configuration. Plugins take absolute
/// paths only.
const FOLDER: &str = "${folder}/";

/// Settings with [`FOLDER`] as the folder of the configuration.
fn in_folder(settings: &Value, folder: &Path) -> Value {
    match settings {
        Value::String(text) => match text.strip_prefix(FOLDER) {
            Some(rest) => Value::String(folder.join(rest).display().to_string()),
            None => settings.clone(),
        },
        Value::Array(all) => all.iter().map(|one| in_folder(one, folder)).collect(),
        Value::Object(all) => {
            all.iter().map(|(name, one)| (name.clone(), in_folder(one, folder))).collect()
        }
        _ => settings.clone(),
    }
}

/// Reports whether an instance may use the network. By default sources of tags or alarms
/// may, and those that tell of alarms.
pub fn may_use_network(config: &Config, name: &str, plugin: &PluginConfig) -> bool {
    plugin.network.unwrap_or_else(|| serves(config, name) || tells_of_alarms(config, name))
}

/// Returns isolation, limits and restart policy of a plugin.
fn options(config: &Config, name: &str, plugin: &PluginConfig) -> PluginOptions {
    let supervision = &config.supervision;
    PluginOptions {
        isolation: match plugin.isolation {
            Isolation::Process => busbar_plugin_process::Isolation::Process,
            Isolation::None => busbar_plugin_process::Isolation::None,
        },
        confinement: Confinement {
            memory_bytes: u64::from(plugin.memory_megabytes) * 1_000_000,
            network: may_use_network(config, name, plugin),
        },
        policy: RestartPolicy {
            first_delay: Duration::from_millis(supervision.restart_millis),
            longest_delay: Duration::from_millis(supervision.max_restart_millis),
            max_deaths: supervision.max_deaths,
            window: Duration::from_secs(supervision.window_seconds),
        },
        deadlines: Deadlines {
            lifecycle: Duration::from_millis(supervision.call_millis),
            optimize: Duration::from_millis(supervision.optimize_millis),
        },
        pin: pin(plugin),
    }
}

/// Adds a plugin's error where the configuration of the instance caused it.
pub fn report_plugin_error(
    pointer: &str,
    error: &PluginError,
    faults: &mut DiagnosticsCollector<'_>,
) {
    let settings = join_pointer(pointer, "settings");
    match error {
        PluginError::Settings { id, faults: wrong } => {
            for fault in wrong {
                let cause = format!("settings of plugin '{id}': {}", fault.message);
                faults.add(&format!("{settings}{}", fault.pointer), cause, error.remedy());
            }
        }
        PluginError::Pinned { .. } => {
            faults.add(&join_pointer(pointer, "sha256"), error.to_string(), error.remedy());
        }
        PluginError::Failed { settings_at_fault: true, .. } => {
            faults.add(&settings, error.to_string(), error.remedy());
        }
        _ => faults.add(&join_pointer(pointer, "plugin"), error.to_string(), error.remedy()),
    }
}

/// Reports the plugins that died during loading; they are restarted.
pub(crate) fn report_crashed_plugins(
    config: &Config,
    instances: &BTreeMap<String, Plugin>,
    faults: &mut DiagnosticsCollector<'_>,
) {
    for (name, instance) in instances {
        let Some(reason) = instance.status().last_death else { continue };
        let lost = PluginError::Lost {
            id: instance.info().id.clone(),
            reason: format!("it died while the scene was loaded: {reason}"),
        };
        let pointer = config.plugins.get(name).map_or("", |plugin| &plugin.pointer);
        faults.add_plugin_failure(
            &join_pointer(pointer, "plugin"),
            lost.to_string(),
            lost.remedy(),
        );
    }
}

/// Checks that each plugin has the capabilities its use requires, and that its tags' addresses are
/// usable.
pub(crate) fn check_capabilities(
    config: &Config,
    instances: &BTreeMap<String, Plugin>,
    tags: &[TagSpec],
    reuse: &ReusePlan<'_>,
    faults: &mut DiagnosticsCollector<'_>,
) {
    // What goes on was asked before, and is not to be disturbed.
    let is_new = |name: &String| reuse.plugin(name).is_none();
    let mut add = |pointer: String, error: &PluginError| faults.add_plugin_error(&pointer, error);
    for model in config.models.values() {
        let optimizer = model.optimizer.as_ref().and_then(|name| instances.get(name));
        if let Some(Err(error)) = optimizer.map(Optimizer::from_plugin) {
            add(join_pointer(&model.pointer, "optimizer"), &error);
        }
    }
    for overlay in config.overlays.iter().filter(|overlay| is_new(&overlay.plugin)) {
        let instance = instances.get(&overlay.plugin);
        // Configured without bindings: the real ones follow when the view starts.
        if let Some(Err(error)) = instance.map(|i| RunningOverlay::configure(i, Vec::new())) {
            add(overlay.pointer.clone(), &error);
        }
    }
    for records in &config.records {
        if let Some(Err(error)) = instances.get(&records.plugin).map(RunningRecords::from_plugin) {
            add(records.pointer.clone(), &error);
        }
    }
    for source in &config.alarm_handling.sources {
        if let Some(Err(error)) = instances.get(&source.plugin).map(RunningAlarms::from_plugin) {
            add(join_pointer(&source.pointer, "instance"), &error);
        }
    }
    for entry in &config.notifications {
        if let Some(Err(error)) = instances.get(&entry.plugin).map(RunningNotifier::from_plugin) {
            add(join_pointer(&entry.pointer, "instance"), &error);
        }
    }
    for (name, instance) in instances.iter().filter(|(name, _)| is_new(name)) {
        check_addresses(config, name, instance, tags, &mut add);
    }
}

/// Checks that a telemetry plugin can serve its tags; reports each fault at its address.
fn check_addresses(
    config: &Config,
    name: &str,
    instance: &Plugin,
    tags: &[TagSpec],
    add: &mut impl FnMut(String, &PluginError),
) {
    let served = telemetry_tags(config, tags, name);
    let source =
        |tag: &TelemetryTag| config.tags.get(&tag.id)?.source().map(|source| &source.pointer);
    let Some(first) = served.first() else { return };
    let Err(error) = RunningTelemetry::check(instance, &served) else { return };
    if let PluginError::Lost { .. } = error {
        // Told with the other deaths.
        return;
    }
    if let PluginError::WrongCapability { .. } = error {
        let pointer = source(first).map_or_else(String::new, |p| join_pointer(p, "instance"));
        return add(pointer, &error);
    }
    if error.is_reported_by_plugin() {
        // What lies outside the configuration, such as a file, is no fault of an address.
        return add(
            config.plugins.get(name).map_or_else(String::new, |p| p.pointer.clone()),
            &error,
        );
    }
    let mut alone = 0;
    for tag in &served {
        if let (Err(error), Some(source)) =
            (RunningTelemetry::check(instance, std::slice::from_ref(tag)), source(tag))
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
