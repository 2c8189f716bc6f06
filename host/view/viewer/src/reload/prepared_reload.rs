//! Prepared reload: a changed configuration whose new plugins run already.

use std::fmt;
use std::path::Path;

use busbar_config::Changes;
use busbar_plugin_host::PluginError;
use busbar_scene_loader::{LoadError, LoadedScene, ReloadedScene};
use busbar_site::StartedPlugins;

use crate::site_definition::start_plugins;

/// A changed configuration with everything it names, ready to be shown: its new plugins run.
pub struct PreparedReload {
    pub(crate) loaded: ReloadedScene,
    /// Plugins that were started for it.
    pub(crate) started: StartedPlugins,
}

/// Error that keeps a changed configuration from being shown.
#[derive(Debug)]
pub enum ReloadError {
    /// Faults of the file and of the files it names.
    Load(LoadError),
    /// A plugin that cannot start.
    Plugin(PluginError),
}

impl fmt::Display for ReloadError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Load(error) => error.fmt(f),
            Self::Plugin(error) => write!(f, "{error}\n  remedy: {}", error.remedy()),
        }
    }
}

impl std::error::Error for ReloadError {}

impl From<LoadError> for ReloadError {
    fn from(error: LoadError) -> Self {
        Self::Load(error)
    }
}

impl From<PluginError> for ReloadError {
    fn from(error: PluginError) -> Self {
        Self::Plugin(error)
    }
}

impl PreparedReload {
    /// Loads a configuration in place of a scene and starts new or changed plugins, while that
    /// scene is still shown. Returns none if nothing has changed.
    ///
    /// # Errors
    /// Every fault of the file, of the files it names, and of what it asks of plugins. The
    /// scene goes on undisturbed.
    pub fn load(shown: &LoadedScene, path: &Path) -> Result<Option<Self>, ReloadError> {
        let Some(loaded) = shown.reload(path)? else { return Ok(None) };
        let ReloadedScene { scene, kept, .. } = &loaded;
        let started = start_plugins(scene, &|name| !kept.contains(name))?;
        Ok(Some(Self { loaded, started }))
    }

    /// Returns the changes against the previous configuration.
    pub fn changes(&self) -> &Changes {
        &self.loaded.changes
    }
}
