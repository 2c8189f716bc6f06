//! Handles of capabilities whose calls are a question and an answer: the same wherever the plugin
//! runs.

use std::sync::Arc;

use busbar_alarms::{NotificationBatch, NotificationReport, SourceReport};
use busbar_plugin_abi as abi;
use busbar_plugin_host::{Alarms, Chart, ChartPage, Notifier, PluginError, RecordPage, Records};

use crate::capability_definitions::capability_definitions;
use crate::capability_messages::{CapabilityAnswer, CapabilityRequest};
use crate::message::{Answer, Request};
use crate::plugin::Plugin;
use crate::process::PluginProcess;

macro_rules! define_handles {
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
    };
}

capability_definitions!(define_handles);
