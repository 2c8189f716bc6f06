//! Alarm mirroring: capability `busbar.alarms/1-draft`.

use std::sync::Arc;

use busbar_alarms::SourceReport;
use busbar_plugin_abi as abi;

use crate::json_output::ask_json;
use crate::{Instance, PluginError};

/// A plugin that has the alarms of another system.
#[derive(Clone)]
pub struct Alarms {
    instance: Arc<Instance>,
    table: &'static abi::BusbarAlarms,
}

impl Alarms {
    /// The alarms of an instance.
    ///
    /// # Errors
    /// [`PluginError::WrongCapability`].
    pub fn from_instance(instance: Arc<Instance>) -> Result<Self, PluginError> {
        let table: &abi::BusbarAlarms = instance.capability(abi::ALARMS_ID)?;
        if table.read.is_none() {
            return Err(instance.violation("`read` of its alarms is null"));
        }
        Ok(Self { instance, table })
    }

    /// Reads the state of all alarms. A report of the revision `known` (0 for none) has no
    /// alarms.
    ///
    /// # Errors
    /// What the plugin says, or the rule that its answer breaks.
    pub fn read(&self, known: u64) -> Result<SourceReport, PluginError> {
        let null = || self.instance.violation("`read` of its alarms is null");
        let read = self.table.read.ok_or_else(null)?;
        let limit = abi::BUSBAR_MAX_ALARM_REPORT;
        let report: SourceReport = ask_json(&self.instance, limit, |output, error| {
            // SAFETY: output and error live for the call.
            unsafe { read(self.instance.as_ptr(), known, output, error) }
        })?;
        report.check(known).map_err(|fault| self.instance.violation(fault.to_string()))?;
        Ok(report)
    }
}
