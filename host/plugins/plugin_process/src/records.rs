//! Plugins with records, wherever they run.

use std::sync::Arc;

use busbar_plugin_abi as abi;
use busbar_plugin_host::{PluginError, RecordPage, Records};
use busbar_records::Description;

use crate::message::{Answer, Request};
use crate::plugin::Plugin;
use crate::process::PluginProcess;

/// The records of a plugin. Calls take as long as the plugin takes: not for frames.
#[derive(Clone)]
pub enum RunningRecords {
    /// Instance in this process.
    InProcess(Records),
    /// Plugin in a supervised process.
    Isolated(Arc<PluginProcess>),
}

impl RunningRecords {
    /// The records that a plugin has.
    ///
    /// # Errors
    /// [`PluginError::WrongCapability`].
    pub fn from_plugin(plugin: &Plugin) -> Result<Self, PluginError> {
        match plugin {
            Plugin::InProcess(instance) => {
                Records::from_instance(instance.clone()).map(Self::InProcess)
            }
            Plugin::Isolated(process) => {
                process.require_capability(abi::RECORDS_ID)?;
                Ok(Self::Isolated(process.clone()))
            }
        }
    }

    /// Describes the lists of records of the plugin.
    ///
    /// # Errors
    /// What the plugin says, the rule that its answer breaks, or how its process ended.
    pub fn describe(&self) -> Result<Description, PluginError> {
        match self {
            Self::InProcess(records) => records.describe(),
            Self::Isolated(process) => match process.shared.call(Request::DescribeRecords, &[])? {
                Answer::RecordsDescribed(description) => {
                    description.check().map_err(|fault| process.broken(fault))?;
                    Ok(description)
                }
                _ => Err(process.shared.unexpected_answer()),
            },
        }
    }

    /// Reads at most `count` rows from `first` on, of a list with so many columns. With `count` 0
    /// the page has the revision alone, of any list.
    ///
    /// # Errors
    /// Returns the errors of [`RunningRecords::describe`].
    pub fn read(
        &self,
        list: u32,
        columns: u32,
        first: u64,
        count: u32,
    ) -> Result<RecordPage, PluginError> {
        match self {
            Self::InProcess(records) => records.read(list, columns, first, count),
            Self::Isolated(process) => {
                let request = Request::ReadRecords { list, columns, first, count };
                match process.shared.call(request, &[])? {
                    Answer::RecordsRead(page) => {
                        page.check(columns, count).map_err(|fault| process.broken(fault))?;
                        Ok(page)
                    }
                    _ => Err(process.shared.unexpected_answer()),
                }
            }
        }
    }
}
