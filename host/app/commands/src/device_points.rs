//! The points that the device of a configured plugin instance has, as its plugin lists them.

use std::fs::File;
use std::io;
use std::path::Path;

use busbar_plugin_host::CommandReport;
use busbar_plugin_process::{CommandError, Plugin};
use busbar_point_import::{
    ListFault, MAX_LIST_BYTES, PluginInstance, PointList, assign_plugins, tags,
};
use busbar_scene_loader::LoadError;
use serde_json::{Map, Value};

use crate::instance_commands::{ConfiguredInstance, offers, open_instance};

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
        let ConfiguredInstance { plugin, has_network } = open_instance(path, name, &|plugin| {
            let cause = || format!("plugin '{}' cannot list what its device has", plugin.info().id);
            let remedy = "make a point list of what the device's tool exports, and give that to \
                          `busbar import`";
            (!offers(plugin, POINTS_COMMAND)).then(|| (cause(), remedy.to_owned()))
        })?;
        Ok(Self { name: name.to_owned(), plugin, has_network })
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
