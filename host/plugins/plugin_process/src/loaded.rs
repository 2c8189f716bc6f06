//! A library in a process, before there is an instance.

use std::sync::Arc;
use std::thread;

use busbar_plugin_host::{LibraryFile, PluginError, PluginInfo, shown};

use crate::catalog::PluginOptions;
use crate::environment::Environment;
use crate::message::{Answer, Confinement, Request};
use crate::process::PluginProcess;
use crate::process_spawn::spawn;
use crate::process_state::{Connection, InstanceSetup, ProcessPhase, Shared};
use crate::sandbox::REFUSED;
use crate::supervisor::{load_request, supervise};

/// Plugins that one library may hold.
const MAX_PLUGINS: usize = 64;
/// Bytes of a plugin's id.
const MAX_ID_BYTES: usize = 256;
/// Process that loaded a library, with the plugins found there.
pub(crate) struct LoadedLibrary {
    // Ends the process when nobody makes an instance of it.
    process: PluginProcess,
    pub(crate) plugins: Vec<PluginInfo>,
    pub(crate) confinement: Confinement,
    pub(crate) environment: Environment,
}

impl LoadedLibrary {
    /// Starts a process and loads a library there.
    ///
    /// # Errors
    /// Why that gives no plugins, in words.
    pub(crate) fn load(
        library: &LibraryFile,
        confinement: Confinement,
        environment: &Environment,
    ) -> Result<Self, String> {
        let text = |error: std::io::Error| error.to_string();
        let spawned = spawn(environment)?;
        let connection = Connection::new(spawned.socket.try_clone().map_err(text)?);
        let pid = spawned.child.id();
        let shared =
            Shared::new(library.clone(), confinement, environment.clone(), connection, pid);
        let shared = Arc::new(shared.map_err(text)?);
        let supervised = shared.clone();
        let name = shared.state().name.clone();
        let builder = thread::Builder::new().name(format!("plugin {name}"));
        let supervisor = builder.spawn(move || supervise(&supervised, spawned)).map_err(text)?;
        let info = nameless(library);
        let process = PluginProcess { shared, supervisor: Some(supervisor), info, name };
        match process.shared.call(load_request(&process.shared), &[library.file()]) {
            Ok(Answer::Loaded { plugins, confined }) => {
                check_infos(&plugins)?;
                let path = library.path();
                let here = |info| PluginInfo { path: path.to_owned(), ..info };
                let plugins = plugins.into_iter().map(here).collect();
                let confined: Vec<_> = confined.iter().map(|text| shown(text, 200)).collect();
                let (path_shown, all) = (path.display(), confined.join(", "));
                if confined.iter().any(|text| text.starts_with(REFUSED)) {
                    tracing::warn!("{path_shown} is confined only in part: {all}");
                } else {
                    tracing::debug!("{path_shown} is confined: {all}");
                }
                let environment = environment.clone();
                Ok(Self { process, plugins, confinement, environment })
            }
            Ok(_) => Err(process.shared.unexpected_answer().to_string()),
            // The library is named by whoever asked.
            Err(PluginError::Violation { what, .. }) => Err(what),
            Err(PluginError::Lost { reason, .. }) => {
                Err(format!("its process ended while loading it: {reason}"))
            }
            Err(other) => Err(other.to_string()),
        }
    }

    /// Creates the instance of this process.
    ///
    /// # Errors
    /// As for an instance in the host's process.
    pub(crate) fn create(
        self,
        name: &str,
        info: &PluginInfo,
        settings: &serde_json::Value,
        options: &PluginOptions,
    ) -> Result<PluginProcess, PluginError> {
        let mut process = self.process;
        let setup = InstanceSetup {
            name: name.to_owned(),
            plugin: info.id.clone(),
            settings: settings.to_string(),
            policy: options.policy,
        };
        {
            let mut state = process.shared.state();
            if state.phase == ProcessPhase::Ended {
                let reason = state.last_death.clone().unwrap_or_default();
                return Err(PluginError::Lost { id: info.id.clone(), reason });
            }
            (state.name, state.id) = (name.to_owned(), info.id.clone());
            state.deadlines = options.deadlines;
            // From here on it is started again whenever it dies.
            state.instance = Some(setup.clone());
        }
        (process.name, process.info) = (setup.name.clone(), info.clone());
        let InstanceSetup { name, plugin, settings, .. } = setup;
        process.configure_or_recover(Request::Create { name, plugin, settings }, &[])?;
        Ok(process)
    }
}

/// Describes a plugin before there is an instance.
fn nameless(library: &LibraryFile) -> PluginInfo {
    PluginInfo {
        id: String::new(),
        name: String::new(),
        version: String::new(),
        description: String::new(),
        capabilities: Vec::new(),
        settings_schema: None,
        path: library.path().to_owned(),
    }
}

/// Validates the plugin descriptions that a process sent.
pub(crate) fn check_infos(plugins: &[PluginInfo]) -> Result<(), String> {
    if plugins.len() > MAX_PLUGINS {
        return Err(format!("it claims {} plugins; the limit is {MAX_PLUGINS}", plugins.len()));
    }
    for info in plugins {
        let printable = |text: &str| !text.chars().any(char::is_control);
        if info.id.is_empty() || info.id.len() > MAX_ID_BYTES || !printable(&info.id) {
            return Err("a plugin has an id that is empty, too long or not printable".into());
        }
        if ![&info.name, &info.version, &info.description].into_iter().all(|t| printable(t)) {
            return Err(format!("'{}' describes itself in control characters", info.id));
        }
    }
    Ok(())
}
