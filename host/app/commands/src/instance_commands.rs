//! Commands of a configured plugin instance, with the instance's settings.

use std::fs::File;
use std::io;
use std::path::Path;

use busbar_plugin_host::CommandReport;
use busbar_plugin_process::{CommandError, Plugin};
use busbar_scene_loader::{
    DiagnosticsCollector, LoadError, config_folder, create_instances, may_use_network, read_config,
};

/// A plugin instance of a configuration, ready to run one of its commands.
pub struct InstanceCommand {
    plugin: Plugin,
    command: String,
}

/// Plugin instance as the configuration has it.
pub(crate) struct ConfiguredInstance {
    /// Plugin with the instance's settings and confinement.
    pub(crate) plugin: Plugin,
    /// True where the configuration lets it use the network.
    pub(crate) has_network: bool,
}

impl InstanceCommand {
    /// Creates the instance of this name, with its settings and confinement. Nothing else of the
    /// configuration is created.
    ///
    /// # Errors
    /// Every fault of the configuration and of the instance; also where there is none of this name,
    /// or where its plugin does not offer the command.
    pub fn open(path: &Path, name: &str, command: &str) -> Result<Self, LoadError> {
        let instance = open_instance(path, name, &|plugin| {
            (!offers(plugin, command)).then(|| {
                let id = &plugin.info().id;
                let cause = format!("plugin '{id}' offers no command '{command}'");
                let names: Vec<_> = match Plugin::offer_commands(plugin.info()) {
                    true => plugin.commands().unwrap_or_default(),
                    false => Vec::new(),
                };
                let names: Vec<_> = names.iter().map(|command| command.name.as_str()).collect();
                let remedy = match names.as_slice() {
                    [] => "name an instance of a plugin that offers commands".to_owned(),
                    names => format!("name one of its commands: {}", names.join(", ")),
                };
                (cause, remedy)
            })
        })?;
        Ok(Self { plugin: instance.plugin, command: command.to_owned() })
    }

    /// Runs the command with an empty input. `output` receives the output in order.
    ///
    /// # Errors
    /// The plugin's error, or the error of `output`.
    pub fn run(
        &self,
        arguments: &[String],
        output: &mut dyn FnMut(&[u8]) -> io::Result<()>,
    ) -> Result<CommandReport, CommandError> {
        let nothing = File::open("/dev/null").map_err(CommandError::Output)?;
        self.plugin.run_command(&self.command, arguments, nothing, output, &mut |_| {})
    }
}

impl Drop for InstanceCommand {
    fn drop(&mut self) {
        self.plugin.quit();
    }
}

/// Creates one instance of a configuration. `find_fault` returns cause and remedy where the plugin
/// is not fit for what is wanted.
pub(crate) fn open_instance(
    path: &Path,
    name: &str,
    find_fault: &dyn Fn(&Plugin) -> Option<(String, String)>,
) -> Result<ConfiguredInstance, LoadError> {
    let config = read_config(path)?;
    let mut faults = DiagnosticsCollector::new(&config);
    let mut created =
        create_instances(&config, &config_folder(path), &mut faults, &|wanted| wanted == name);
    let instance = match (config.plugins.get(name), created.remove(name)) {
        (None, _) => {
            let names: Vec<_> = config.plugins.keys().map(String::as_str).collect();
            let remedy = format!("name one of its plugin instances: {}", names.join(", "));
            faults.add("/plugins", format!("there is no plugin instance '{name}'"), remedy);
            None
        }
        // Why it was not made is told.
        (Some(_), None) => None,
        (Some(configured), Some(plugin)) => {
            if let Some((cause, remedy)) = find_fault(&plugin) {
                faults.add(&configured.pointer, cause, remedy);
            }
            let has_network = may_use_network(&config, name, configured);
            Some(ConfiguredInstance { plugin, has_network })
        }
    };
    match instance {
        Some(instance) if !faults.has_errors() => Ok(instance),
        _ => Err(LoadError { file: path.to_owned(), diagnostics: faults.found }),
    }
}

/// Reports whether a plugin offers a command.
pub(crate) fn offers(plugin: &Plugin, command: &str) -> bool {
    Plugin::offer_commands(plugin.info())
        && plugin
            .commands()
            .is_ok_and(|commands| commands.iter().any(|offered| offered.name == command))
}
