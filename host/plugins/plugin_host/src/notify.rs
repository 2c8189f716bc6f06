//! Notifications of alarms: capability `busbar.notify/1-draft`.

use std::sync::Arc;

use busbar_alarms::{NotificationBatch, NotificationReport};
use busbar_plugin_abi as abi;

use crate::json_output::ask_json;
use crate::{Instance, PluginError};

const _: () = assert!(
    busbar_alarms::MAX_BATCH_CHANGES == abi::BUSBAR_MAX_NOTIFY_CHANGES
        && busbar_alarms::MAX_STANDING_ALARMS == abi::BUSBAR_MAX_NOTIFY_STANDING
        && busbar_alarms::MAX_DELIVERY_MESSAGE_BYTES == abi::BUSBAR_MAX_NOTIFY_MESSAGE
);

/// A plugin that tells people of alarms.
#[derive(Clone)]
pub struct Notifier {
    instance: Arc<Instance>,
    table: &'static abi::BusbarNotify,
}

impl Notifier {
    /// Returns the notifier of an instance.
    ///
    /// # Errors
    /// [`PluginError::WrongCapability`].
    pub fn from_instance(instance: Arc<Instance>) -> Result<Self, PluginError> {
        let table: &abi::BusbarNotify = instance.capability(abi::NOTIFY_ID)?;
        if table.notify.is_none() {
            return Err(instance.violation("`notify` is null"));
        }
        Ok(Self { instance, table })
    }

    /// Hands over changes of alarms and returns the plugin's report.
    ///
    /// # Errors
    /// What the plugin says, or the rule that its answer breaks.
    pub fn notify(&self, batch: NotificationBatch) -> Result<NotificationReport, PluginError> {
        let notify =
            self.table.notify.ok_or_else(|| self.instance.violation("`notify` is null"))?;
        let text = serde_json::to_string(&batch)
            .map_err(|error| self.instance.violation(format!("a batch is no JSON: {error}")))?;
        let limit = abi::BUSBAR_MAX_NOTIFY_REPORT;
        let report: NotificationReport = ask_json(&self.instance, limit, |output, error| {
            let batch = abi::BusbarStr::from_borrowed(&text);
            // SAFETY: the text, the output and the error live for the call.
            unsafe { notify(self.instance.as_ptr(), batch, output, error) }
        })?;
        report.check(batch.handed).map_err(|fault| self.instance.violation(fault.to_string()))?;
        Ok(report)
    }
}
