//! Messages between processes of capabilities whose calls are a question and an answer, and the
//! plugin's end.

use std::sync::Arc;

use busbar_alarms::{NotificationBatch, NotificationReport, SourceReport};
use busbar_plugin_host::{
    Alarms, Chart, ChartPage, Instance, MAX_PAGE_RECORDS, MAX_PAGE_ROWS, Notifier, PluginError,
    RecordPage, Records,
};
use serde::{Deserialize, Serialize};

use crate::capability_definitions::capability_definitions;

macro_rules! define_messages {
    ($($(#[$doc:meta])* $running:ident = $capability:ident, $id:ident {
        $($(#[$call_doc:meta])*
        $method:ident($($argument:ident: $type:ty),*) -> $answer:ty,
            $message:ident $name:literal, |$given:ident| $check:expr,
            any { $($any:ident: $any_value:expr),* };)+
    })+) => {
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

capability_definitions!(define_messages);
