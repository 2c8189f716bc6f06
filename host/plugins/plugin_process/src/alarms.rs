//! Plugins that have the alarms of another system, wherever they run.

use std::sync::Arc;

use busbar_alarms::SourceReport;
use busbar_plugin_abi as abi;
use busbar_plugin_host::{Alarms, PluginError};

use crate::message::{Answer, Request};
use crate::plugin::Plugin;
use crate::process::PluginProcess;

/// The alarms of a plugin. Calls take as long as the plugin takes: not for frames.
#[derive(Clone)]
pub enum RunningAlarms {
    /// Instance in this process.
    InProcess(Alarms),
    /// Plugin in a supervised process.
    Isolated(Arc<PluginProcess>),
}

impl RunningAlarms {
    /// The alarms that a plugin has.
    ///
    /// # Errors
    /// [`PluginError::WrongCapability`].
    pub fn from_plugin(plugin: &Plugin) -> Result<Self, PluginError> {
        match plugin {
            Plugin::InProcess(instance) => {
                Alarms::from_instance(instance.clone()).map(Self::InProcess)
            }
            Plugin::Isolated(process) => {
                process.require_capability(abi::ALARMS_ID)?;
                Ok(Self::Isolated(process.clone()))
            }
        }
    }

    /// Reads the state of all alarms. A report of the revision `known` (0 for none) has no
    /// alarms.
    ///
    /// # Errors
    /// What the plugin says, the rule that its answer breaks, or how its process ended.
    pub fn read(&self, known: u64) -> Result<SourceReport, PluginError> {
        match self {
            Self::InProcess(alarms) => alarms.read(known),
            Self::Isolated(process) => {
                match process.shared.call(Request::ReadAlarms { known }, &[])? {
                    Answer::AlarmsRead(report) => {
                        report.check(known).map_err(|fault| process.broken(fault))?;
                        Ok(report)
                    }
                    _ => Err(process.shared.unexpected_answer()),
                }
            }
        }
    }
}
