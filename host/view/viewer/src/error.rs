//! Errors of the public interface: faulty party, place and remedy.

use busbar_plugin_host::PluginError;
use busbar_renderer::RenderError;
use thiserror::Error;

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

impl From<PluginError> for ViewError {
    fn from(error: PluginError) -> Self {
        Self::Plugin { error }
    }
}
