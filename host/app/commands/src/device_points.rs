//! The points that the device of a configured plugin instance has, as its plugin lists them.

use std::fs::File;
use std::io;
use std::path::Path;

use busbar_plugin_host::CommandReport;
use busbar_plugin_process::{CommandError, Plugin};
use busbar_point_import::{
    ListFault, MAX_LIST_BYTES, PluginInstance, PointList, assign_plugins, tags,
};
use busbar_scene_loader::{
    DiagnosticsCollector, LoadError, config_folder, create_instances, may_use_network, read_config,
};
use serde_json::{Map, Value};

/// The command of plugins that can list what their device has. Users reach it by
/// `busbar import` alone, for it needs the settings of an instance.
pub const POINTS_COMMAND: &str = "points";
const NETWORK_REMEDY: &str =
    "without tags it may not use the network: set \"network\": true for it";

/// A plugin instance of a configuration, whose device can be asked.
pub struct DevicePointSource {
    name: String,
    plugin: Plugin,
    has_network: bool,
}

/// Point list of a device, and the command's report.
pub struct DevicePoints {
    /// A point list, CSV.
    pub list: Vec<u8>,
    /// Report of the plugin's command.
    pub report: CommandReport,
}

impl DevicePointSource {
    /// Makes the instance of this name, as the configuration has it: with its settings and
    /// confinement. Nothing else is made.
    ///
    /// # Errors
    /// Every fault of the configuration and of the instance; also where there is none of
    /// this name, or where its plugin cannot list points.
    pub fn open(path: &Path, name: &str) -> Result<Self, LoadError> {
        let config = read_config(path)?;
        let mut faults = DiagnosticsCollector::new(&config);
        let mut created =
            create_instances(&config, &config_folder(path), &mut faults, &|wanted| wanted == name);
        let source = match (config.plugins.get(name), created.remove(name)) {
            (None, _) => {
                let names: Vec<_> = config.plugins.keys().map(String::as_str).collect();
                let remedy = format!("name one of its plugin instances: {}", names.join(", "));
                faults.add("/plugins", format!("there is no plugin instance '{name}'"), remedy);
                None
            }
            // Why it was not made is told.
            (Some(_), None) => None,
            (Some(configured), Some(plugin)) => {
                if !lists_points(&plugin) {
                    let id = &configured.plugin;
                    let cause = format!("plugin '{id}' cannot list what its device has");
                    let remedy = "make a point list of what the device's tool exports, and give \
                                  that to `busbar import`";
                    faults.add(&configured.pointer, cause, remedy);
                }
                let has_network = may_use_network(&config, name, configured);
                Some(Self { name: name.to_owned(), plugin, has_network })
            }
        };
        let faulty = |found| LoadError { file: path.to_owned(), diagnostics: found };
        match source {
            Some(source) if !faults.has_errors() => Ok(source),
            _ => Err(faulty(faults.found)),
        }
    }

    /// Asks the device. `arguments` are the plugin's own.
    ///
    /// # Errors
    /// The plugin's error, or a list that is too long.
    pub fn list_points(&self, arguments: &[String]) -> Result<DevicePoints, CommandError> {
        let nothing = File::open("/dev/null").map_err(CommandError::Output)?;
        let mut list = Vec::new();
        let mut keep = |bytes: &[u8]| {
            if list.len() + bytes.len() > MAX_LIST_BYTES {
                return Err(io::Error::other(format!("it has more than {MAX_LIST_BYTES} bytes")));
            }
            list.extend_from_slice(bytes);
            Ok(())
        };
        let report =
            self.plugin.run_command(POINTS_COMMAND, arguments, nothing, &mut keep, &mut |_| {})?;
        Ok(DevicePoints { list, report })
    }

    /// The list as tags of this instance: `{"tags": {...}}`, as a configuration has them.
    ///
    /// # Errors
    /// Every fault of the list.
    pub fn tags(&self, list: &[u8]) -> Result<Value, Vec<ListFault>> {
        let mut parsed = PointList::parse(list);
        let instance = PluginInstance {
            name: self.name.clone(),
            plugin: self.plugin.info().id.clone(),
            settings: Map::new(),
        };
        parsed.faults.extend(assign_plugins(&mut parsed.points, &[instance]));
        if parsed.faults.is_empty() { Ok(tags(&parsed.points)) } else { Err(parsed.faults) }
    }

    /// Returns the remedy if the configuration denies the instance the network.
    pub fn network_remedy(&self) -> Option<&'static str> {
        (!self.has_network).then_some(NETWORK_REMEDY)
    }
}

impl Drop for DevicePointSource {
    fn drop(&mut self) {
        self.plugin.quit();
    }
}

fn lists_points(plugin: &Plugin) -> bool {
    Plugin::offer_commands(plugin.info())
        && plugin
            .commands()
            .is_ok_and(|commands| commands.iter().any(|command| command.name == POINTS_COMMAND))
}
