//! Capabilities whose calls are a question and an answer: one definition gives the handle that is
//! the same wherever the plugin runs, the messages between processes, and the plugin's end.

use std::sync::Arc;

use busbar_alarms::{NotificationBatch, NotificationReport, SourceReport};
use busbar_plugin_abi as abi;
use busbar_plugin_host::{
    Alarms, Chart, ChartPage, Instance, MAX_PAGE_RECORDS, MAX_PAGE_ROWS, Notifier, PluginError,
    RecordPage, Records,
};
use serde::{Deserialize, Serialize};

use crate::message::{Answer, Request};
use crate::plugin::Plugin;
use crate::process::PluginProcess;

/// Defines capabilities. A line of a call has the method of the handle and of `busbar_plugin_host`,
/// its arguments and answer, the name of its messages, its name for people, the check of an answer
/// from another process, and the arguments whose answers may be the longest, for tests of answers
/// without a request.
macro_rules! capability_calls {
    ($($(#[$doc:meta])* $running:ident = $capability:ident, $id:ident {
        $($(#[$call_doc:meta])*
        $method:ident($($argument:ident: $type:ty),*) -> $answer:ty,
            $message:ident $name:literal, |$given:ident| $check:expr,
            any { $($any:ident: $any_value:expr),* };)+
    })+) => {
        $($(#[$doc])*
        #[derive(Clone)]
        pub enum $running {
            /// Instance in this process.
            InProcess($capability),
            /// Plugin in a supervised process.
            Isolated(Arc<PluginProcess>),
        }

        impl $running {
            /// Returns the handle of a plugin with this capability.
            ///
            /// # Errors
            /// [`PluginError::WrongCapability`].
            pub fn from_plugin(plugin: &Plugin) -> Result<Self, PluginError> {
                match plugin {
                    Plugin::InProcess(instance) => {
                        $capability::from_instance(instance.clone()).map(Self::InProcess)
                    }
                    Plugin::Isolated(process) => {
                        process.require_capability(abi::$id)?;
                        Ok(Self::Isolated(process.clone()))
                    }
                }
            }

            $($(#[$call_doc])*
            #[doc = "\n# Errors\nWhat the plugin says, the rule that its answer breaks, or how its process ended."]
            pub fn $method(&self, $($argument: $type),*) -> Result<$answer, PluginError> {
                let process = match self {
                    Self::InProcess(capability) => return capability.$method($($argument),*),
                    Self::Isolated(process) => process,
                };
                let request =
                    CapabilityRequest::$message { $($argument: Clone::clone(&$argument)),* };
                match process.shared.call(Request::Capability(request), &[])? {
                    Answer::Capability(CapabilityAnswer::$message($given)) => {
                        $check.map_err(|fault| process.broken(fault))?;
                        Ok($given)
                    }
                    _ => Err(process.shared.unexpected_answer()),
                }
            })+
        })+

        /// Calls of capabilities with their arguments.
        #[derive(Debug, Serialize, Deserialize)]
        pub(crate) enum CapabilityRequest {
            $($($message { $($argument: $type),* },)+)+
        }

        /// Answers to the calls of capabilities.
        #[derive(Debug, Serialize, Deserialize)]
        pub(crate) enum CapabilityAnswer {
            $($($message($answer),)+)+
        }

        impl CapabilityAnswer {
            /// Checks an answer as that to the request with the longest answers.
            pub(crate) fn check_for_any_request(&self) -> Result<(), String> {
                match self {
                    $($(Self::$message($given) => {
                        $(let $any = $any_value;)*
                        $check.map_err(|fault| fault.to_string())
                    })+)+
                }
            }
        }

        impl CapabilityRequest {
            /// Returns the name in messages for people.
            pub(crate) fn name(&self) -> &'static str {
                match self {
                    $($(Self::$message { .. } => $name,)+)+
                }
            }

            /// Makes the call to an instance in this process.
            pub(crate) fn answer(
                self,
                instance: &Arc<Instance>,
            ) -> Result<CapabilityAnswer, PluginError> {
                Ok(match self {
                    $($(Self::$message { $($argument),* } => {
                        let capability = $capability::from_instance(instance.clone())?;
                        CapabilityAnswer::$message(capability.$method($($argument),*)?)
                    })+)+
                })
            }
        }
    };
}

capability_calls! {
    /// Chart of a plugin. Calls take as long as the plugin takes: not for frames.
    RunningChart = Chart, CHART_ID {
        /// Describes the chart of the plugin.
        describe() -> busbar_chart::Description,
            DescribeChart "describe chart", |description| description.check(), any {};
        /// Reads at most `count` records from `first` on, of a chart with so many axes. With
        /// `count` 0 the page has the total and the revision alone.
        read(axes: u32, first: u64, count: u32) -> ChartPage,
            ReadChart "read chart", |page| page.check(axes, count),
            any { axes: busbar_chart::MAX_AXES as u32, count: MAX_PAGE_RECORDS };
        /// Explains the last record of a piece of equipment at or before an instant (nanoseconds
        /// since 1970-01-01 UTC). States are not checked against a legend yet.
        explain(equipment: String, unix_nanos: i64) -> busbar_chart::Explanation,
            Explain "explain", |explanation| explanation.check(usize::MAX), any {};
    }
    /// Records of a plugin. Calls take as long as the plugin takes: not for frames.
    RunningRecords = Records, RECORDS_ID {
        /// Describes the lists of records of the plugin.
        describe() -> busbar_records::Description,
            DescribeRecords "describe records", |description| description.check(), any {};
        /// Reads at most `count` rows from `first` on, of a list with so many columns. With
        /// `count` 0 the page has the revision alone, of any list.
        read(list: u32, columns: u32, first: u64, count: u32) -> RecordPage,
            ReadRecords "read records", |page| page.check(columns, count),
            any {
                columns: page.rows.first().map_or(0, |row| row.cells.len()) as u32,
                count: MAX_PAGE_ROWS
            };
    }
    /// Alarms of a plugin. Calls take as long as the plugin takes: not for frames.
    RunningAlarms = Alarms, ALARMS_ID {
        /// Reads the state of all alarms. A report of the revision `known` (0 for none) has no
        /// alarms.
        read(known: u64) -> SourceReport,
            ReadAlarms "read alarms", |report| report.check(known), any { known: report.revision };
    }
    /// Plugin that tells people of alarms. Calls take as long as the plugin takes: not for frames.
    RunningNotifier = Notifier, NOTIFY_ID {
        /// Hands over changes of alarms and returns the plugin's report.
        notify(batch: NotificationBatch) -> NotificationReport,
            Notify "notify", |report| report.check(batch.handed),
            any { batch: NotificationBatch { handed: report.taken, ..Default::default() } };
    }
}
