//! Errors of the façade: who is at fault, where, and what to do.

use std::fmt;
use std::path::PathBuf;

use busbar_config::Diagnostic;
use busbar_plugin_host::PluginError;
use busbar_renderer::RenderError;
use thiserror::Error;

/// A configuration that cannot be loaded: every fault found.
#[derive(Debug)]
pub struct LoadError {
    /// The configuration file.
    pub file: PathBuf,
    /// Faults in order of place, warnings among them.
    pub diagnostics: Vec<Diagnostic>,
}

/// Why a loaded scene cannot be shown.
#[derive(Debug, Error)]
pub enum ViewError {
    /// The graphics device.
    #[error(transparent)]
    Render(#[from] RenderError),
    /// A graphics device that fails again and again.
    #[error(
        "the graphics device failed {tries} times: {cause}\n  remedy: update the graphics driver, \
         or choose another device with `view.device` or BUSBAR_DEVICE (llvmpipe draws in software)"
    )]
    NotRecovered {
        /// Devices made.
        tries: u32,
        /// How the last one failed.
        cause: RenderError,
    },
    /// A plugin that cannot start.
    #[error("{error}\n  remedy: {}", error.remedy())]
    Plugin {
        /// What it says.
        error: PluginError,
    },
    /// An alarm that the host cannot set.
    #[error("{0}\n  remedy: mirror alarms that the configuration marks as \"mirrored\"")]
    Alarm(String),
    /// A camera that the configuration does not have.
    #[error("no camera '{wanted}'\n  remedy: name one of: {}", .known.join(", "))]
    UnknownCamera {
        /// Camera asked for.
        wanted: String,
        /// Cameras there are.
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
