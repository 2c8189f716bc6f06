//! Notifications of alarms by mail (SMTP) and webhooks (HTTP).
//!
//! The JSON of settings is described in the crate's README.md. The dispatcher decides who is told of
//! what and when; delivery hands messages over on a thread of its own, one lane a server. What waits
//! is in a file before the host forgets it, so that a restart loses nothing.

mod composition;
mod delivery;
mod dispatcher;
mod mail;
mod outcome;
mod settings;
mod store;
mod test_message;
#[cfg(test)]
mod tests;
mod webhook;

use busbar_plugin_sdk::{
    Command, CommandExit, CommandInfo, Error, Host, NotificationBatch, NotificationReport, Notify,
    Plugin, Streams, export_plugin,
};

use crate::delivery::Delivery;
use crate::settings::Config;
pub use crate::settings::Settings;

/// Plugin that tells people of alarms by mail and webhooks.
pub struct Notifier {
    config: Config,
    host: Host,
    /// Delivery from the first call of the host on: commands do without it.
    delivery: Option<Delivery>,
}

impl Plugin for Notifier {
    const ID: &'static str = "notifier";
    const NAME: &'static str = "Notifier";
    const VERSION: &'static str = env!("CARGO_PKG_VERSION");
    const DESCRIPTION: &'static str =
        "Tells people of alarms by mail and webhooks, with escalation.";
    type Settings = Settings;

    fn create(settings: Settings, host: Host) -> Result<Self, Error> {
        Ok(Self { config: settings.parse()?, host, delivery: None })
    }
}

impl Notify for Notifier {
    fn notify(&mut self, batch: NotificationBatch) -> Result<NotificationReport, Error> {
        let delivery = match self.delivery.take() {
            Some(delivery) => delivery,
            None => Delivery::start(&self.config, &self.host)?,
        };
        Ok(self.delivery.insert(delivery).exchange(batch))
    }
}

impl Command for Notifier {
    const COMMANDS: &'static [CommandInfo] = &[CommandInfo {
        name: test_message::COMMAND,
        help: "send a test message to all recipients, or to those named after --",
    }];

    fn run(
        &self,
        _name: &str,
        arguments: &[&str],
        streams: &Streams<'_>,
    ) -> Result<CommandExit, Error> {
        test_message::run(&self.config, arguments, streams)
    }
}

export_plugin!(Notifier: notify, command);
