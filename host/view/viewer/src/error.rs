//! Errors of the public interface: faulty party, place and remedy.

use std::fmt;
use std::path::PathBuf;

use busbar_config::Diagnostic;
use busbar_plugin_host::PluginError;
use busbar_renderer::RenderError;
use thiserror::Error;

/// A configuration that cannot be loaded: every fault found.
#[derive(Debug)]
pub struct LoadError {
    /// Path of the configuration file.
    pub file: PathBuf,
    /// Faults in order of place, warnings among them.
    pub diagnostics: Vec<Diagnostic>,
}

/// Error that keeps a loaded scene from being shown.
#[derive(Debug, Error)]
pub enum ViewError {
    /// Error of the graphics device.
    #[error(transparent)]
    Render(#[from] RenderError),
    /// A graphics device that fails again and again.
    #[error(
        "the graphics device failed {tries} times: {cause}\n  remedy: update the graphics driver, \
         or choose another device with `view.device` or BUSBAR_DEVICE (llvmpipe draws in software)"
    )]
    NotRecovered {
        /// Number of devices created.
        tries: u32,
        /// Error of the last try.
        cause: RenderError,
    },
    /// A plugin that cannot start.
    #[error("{error}\n  remedy: {}", error.remedy())]
    Plugin {
        /// Error of the plugin.
        error: PluginError,
    },
    /// An alarm that the host cannot set.
    #[error("{0}\n  remedy: mirror alarms that the configuration marks as \"mirrored\"")]
    Alarm(String),
    /// A camera that the configuration does not have.
    #[error("no camera '{wanted}'\n  remedy: name one of: {}", .known.join(", "))]
    UnknownCamera {
        /// Name of the requested camera.
        wanted: String,
        /// Names of the configured cameras.
        known: Vec<String>,
    },
}

impl fmt::Display for LoadError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let file = self.file.display().to_string();
        for (index, diagnostic) in self.diagnostics.iter().enumerate() {
            if index > 0 {
                writeln!(f)?;
            }
            f.write_str(&diagnostic.render(&file))?;
        }
        Ok(())
    }
}

impl std::error::Error for LoadError {}

impl From<PluginError> for ViewError {
    fn from(error: PluginError) -> Self {
        Self::Plugin { error }
    }
}
