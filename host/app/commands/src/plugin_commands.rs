//! Commands that plugins offer, found by their names.

use busbar_plugin_host::PluginError;
use busbar_plugin_process::{Plugin, PluginCatalog, PluginOptions};
use serde_json::{Value, json};

use crate::device_points::POINTS_COMMAND;

/// A command and the plugin that offers it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct OfferedCommand {
    /// Command name on the command line.
    pub name: String,
    /// Help text of one line.
    pub help: String,
    /// Id of the plugin.
    pub plugin: String,
}

/// The commands that plugins of some directories offer without settings, in order of their
/// libraries, and why some plugins could not be asked.
pub fn offered_commands(catalog: &PluginCatalog) -> (Vec<OfferedCommand>, Vec<String>) {
    let (mut offered, mut remarks) = (Vec::new(), Vec::new());
    for info in catalog.plugins().filter(|info| Plugin::offer_commands(info)) {
        // A command's name is known before its settings are.
        let asked = catalog
            .create(&info.id, &info.id, &json!({}), &PluginOptions::default())
            .and_then(|plugin| plugin.commands());
        match asked {
            Ok(commands) => {
                let typed = commands.into_iter().filter(|command| command.name != POINTS_COMMAND);
                offered.extend(typed.map(|command| OfferedCommand {
                    name: command.name,
                    help: command.help,
                    plugin: info.id.clone(),
                }));
            }
            // Its commands are those of configured instances.
            Err(PluginError::Settings { .. }) => {}
            Err(error) => remarks.push(format!("{error}; {}", error.remedy())),
        }
    }
    (offered, remarks)
}

/// The plugin that offers a command, with these settings, ready to run it.
///
/// # Errors
/// A text with a remedy: no plugin or several offer it, or its plugin rejects the settings.
pub fn plugin_with_command(
    catalog: &PluginCatalog,
    name: &str,
    settings: &Value,
) -> Result<Plugin, String> {
    let (offered, remarks) = offered_commands(catalog);
    let ids: Vec<_> = offered.iter().filter(|command| command.name == name).collect();
    let id = match ids.as_slice() {
        [one] => &one.plugin,
        [] => return Err(missing_command_message(name, &offered, &remarks)),
        several => {
            let ids: Vec<_> = several.iter().map(|command| command.plugin.as_str()).collect();
            return Err(format!(
                "several plugins offer the command '{name}': {}\n  remedy: name the folder of \
                 the one that you want by --plugin-directory, or remove the others",
                ids.join(", ")
            ));
        }
    };
    let plugin = catalog.create(name, id, settings, &PluginOptions::default());
    plugin.map_err(|error| format!("{error}\n  remedy: {}", error.remedy()))
}

fn missing_command_message(name: &str, offered: &[OfferedCommand], remarks: &[String]) -> String {
    let mut names: Vec<_> = offered.iter().map(|command| command.name.as_str()).collect();
    names.sort_unstable();
    let known = match names.as_slice() {
        [] => "none of them offers a command".to_owned(),
        names => format!("they offer {}", names.join(", ")),
    };
    let mut text = format!(
        "there is no command '{name}', neither here nor of a plugin: {known}\n  remedy: see \
         `busbar --help`, or put the plugin that offers it into a plugin directory"
    );
    for remark in remarks {
        text += &format!("\n  {remark}");
    }
    text
}
