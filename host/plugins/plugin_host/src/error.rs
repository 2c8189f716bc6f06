//! Errors of plugins, with who must act.

use std::path::PathBuf;

use busbar_geometry::SequenceError;
use busbar_plugin_abi as abi;
use serde::{Deserialize, Serialize};
use thiserror::Error;

use crate::Digest;
use crate::trust::RejectedLibrary;

/// Errors that keep a plugin from doing its configured work.
#[derive(Debug, Error)]
pub enum PluginError {
    /// No library in the plugin directories has the plugin.
    #[error(
        "no plugin '{id}' in {}{}",
        searched_list(.searched),
        refused_list(.refused)
    )]
    NotFound {
        /// Plugin id asked for.
        id: String,
        /// Directories that were searched.
        searched: Vec<PathBuf>,
        /// Libraries there that were refused: one of them may be the plugin.
        refused: Vec<RejectedLibrary>,
    },
    /// The plugin exists but cannot do this.
    #[error("plugin '{id}' has no capability {wanted}; it has {}", .has.join(", "))]
    WrongCapability {
        /// Id of the plugin.
        id: String,
        /// Capability that was asked for.
        wanted: &'static str,
        /// Capabilities that the plugin has.
        has: Vec<String>,
    },
    /// The settings do not fit the plugin's schema.
    #[error("settings of plugin '{id}': {}", .faults.iter().map(|f| f.message.as_str()).collect::<Vec<_>>().join("; "))]
    Settings {
        /// Id of the plugin.
        id: String,
        /// All errors of the settings.
        faults: Vec<SettingsError>,
    },
    /// The plugin refused or failed, in its own words.
    #[error("plugin '{id}': {message}")]
    Failed {
        /// Id of the plugin.
        id: String,
        /// True where the user's settings or addresses are the cause.
        settings_at_fault: bool,
        /// Message from the plugin.
        message: String,
    },
    /// The caller asked the plugin to stop.
    #[error("cancelled")]
    Cancelled,
    /// The plugin broke a rule of the ABI: its author must act.
    #[error("plugin '{id}' broke the plugin ABI: {what}")]
    Violation {
        /// Id of the plugin.
        id: String,
        /// Rule that the plugin broke.
        what: String,
    },
    /// The plugin's process has ended, or is being restarted.
    #[error("plugin '{id}': {reason}")]
    Lost {
        /// Id of the plugin.
        id: String,
        /// Cause of the end, or event that the restart waits for.
        reason: String,
    },
    /// The library is not the one that the configuration is pinned to.
    #[error("plugin '{id}' is in {}, whose SHA-256 is {found}, not the configured one", .path.display())]
    Pinned {
        /// Id of the plugin.
        id: String,
        /// Path of the library.
        path: PathBuf,
        /// Digest of the library found.
        found: Digest,
    },
    /// The plugin's collapse sequence is none.
    #[error("plugin '{id}' gave an invalid collapse sequence: {source}")]
    Sequence {
        /// Id of the plugin.
        id: String,
        /// The rule it breaks.
        source: SequenceError,
    },
}

/// One fault of a plugin's settings.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct SettingsError {
    /// JSON pointer within the settings.
    pub pointer: String,
    /// Explanation of the error at that place.
    pub message: String,
}

impl PluginError {
    /// Creates an error from a status that is not OK.
    pub(crate) fn from_status(id: &str, status: abi::BusbarStatusNumber, message: String) -> Self {
        let id = id.to_owned();
        let message =
            if message.is_empty() { format!("failed with status {status}") } else { message };
        match status {
            abi::BUSBAR_CANCELLED => Self::Cancelled,
            abi::BUSBAR_INVALID_ARGUMENT => Self::Violation { id, what: message },
            _ => Self::Failed {
                id,
                settings_at_fault: status == abi::BUSBAR_INVALID_SETTINGS,
                message,
            },
        }
    }

    /// Reports whether the plugin itself failed, rather than the configured task.
    pub fn is_reported_by_plugin(&self) -> bool {
        matches!(
            self,
            Self::Lost { .. }
                | Self::Violation { .. }
                | Self::Sequence { .. }
                | Self::Failed { settings_at_fault: false, .. }
        )
    }

    /// Returns the action that helps the user.
    pub fn remedy(&self) -> &'static str {
        match self {
            Self::NotFound { refused, .. } if refused.is_empty() => {
                "put the plugin's library into a plugin directory, or correct the id"
            }
            Self::NotFound { .. } => {
                "rebuild or replace the refused library, put the plugin's library into a plugin \
                 directory, or correct the id"
            }
            Self::WrongCapability { .. } => "name a plugin that has this capability here",
            Self::Settings { .. } => {
                "correct the settings; `busbar plugin list --schema` shows their schema"
            }
            Self::Failed { settings_at_fault: true, .. } => "correct the settings or addresses",
            Self::Failed { .. } => "see the plugin's message; the log has more",
            Self::Cancelled => "start it again",
            Self::Lost { .. } => {
                "it is started again by itself where it can be; the log has its last words; \
                 report crashes to the plugin's author"
            }
            Self::Pinned { .. } => {
                "put the right library there, or, if this is the one you want, its SHA-256 into \
                 \"sha256\""
            }
            Self::Violation { .. } | Self::Sequence { .. } => {
                "report this to the plugin's author; remove the plugin until it is mended"
            }
        }
    }
}

fn searched_list(searched: &[PathBuf]) -> String {
    let names: Vec<_> = searched.iter().map(|path| path.display().to_string()).collect();
    if names.is_empty() { "any directory (none is configured)".into() } else { names.join(", ") }
}

fn refused_list(refused: &[RejectedLibrary]) -> String {
    refused.iter().map(|r| format!("; refused {}: {}", r.path.display(), r.reason)).collect()
}
