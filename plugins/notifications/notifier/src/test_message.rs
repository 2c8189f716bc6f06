//! Command `test-message`: a message to each address of the recipients, and what came of it.

use std::future::pending;
use std::io::Write;

use busbar_link::IoLoop;
use busbar_plugin_sdk::{CommandExit, Error, LogLevel, Streams};

use crate::composition;
use crate::dispatcher::Message;
use crate::mail::MailSender;
use crate::outcome::Outcome;
use crate::settings::{Config, Target};
use crate::webhook::WebhookSender;

/// Name of the command.
pub(crate) const COMMAND: &str = "test-message";

/// Sends test messages and writes a line for each. Recipients may be named.
pub(crate) fn run(
    config: &Config,
    arguments: &[&str],
    streams: &Streams<'_>,
) -> Result<CommandExit, Error> {
    let names: Vec<&str> = config.recipients.iter().map(|one| one.name.as_str()).collect();
    if let Some(unknown) = arguments.iter().find(|name| !names.contains(*name)) {
        let text = format!("there is no recipient '{unknown}'; name some of: {}", names.join(", "));
        streams.diagnose(LogLevel::Error, None, &text);
        return Ok(CommandExit::WrongUse);
    }
    let failed = |error: std::io::Error| Error::failed(error.to_string());
    let mail =
        config.mail.as_ref().map(|mail| MailSender::new(mail, config.timeout)).transpose()?;
    let mut output = streams.output();
    let mut has_failed = false;
    let io_loop = || IoLoop::new(1).map_err(failed);
    for recipient in &config.recipients {
        if !arguments.is_empty() && !arguments.contains(&recipient.name.as_str()) {
            continue;
        }
        for target in &recipient.targets {
            let message = test_message(config, &recipient.name, target);
            let mut outcome = Outcome::Failed("nothing sends to this address".to_owned());
            match (target, &mail) {
                (Target::Mail(address), Some(sender)) => io_loop()?
                    .run_until(pending(), async { outcome = sender.send(&message, address).await }),
                (Target::Webhook(name), _) => {
                    if let Some(webhook) = config.webhooks.get(name) {
                        let sender = WebhookSender::new(name, webhook, config.timeout)?;
                        io_loop()?
                            .run_until(pending(), async { outcome = sender.send(&message).await });
                    }
                }
                (Target::Mail(_), None) => {}
            }
            let words = match &outcome {
                Outcome::Delivered => "delivered",
                Outcome::Refused(words) | Outcome::Failed(words) => {
                    has_failed = true;
                    words
                }
            };
            writeln!(output, "{}, {target}: {words}", recipient.name).map_err(failed)?;
        }
    }
    Ok(if has_failed { CommandExit::InputAtFault } else { CommandExit::Done })
}

fn test_message(config: &Config, recipient: &str, target: &Target) -> Message {
    let composed = composition::test(&config.site, recipient);
    Message {
        key: format!("{:016x}-test", fastrand::u64(..)),
        recipient: recipient.to_owned(),
        target: target.clone(),
        kind: composed.kind.to_owned(),
        subject: composed.subject,
        text: composed.text,
        alarms: composed.alarms,
        created: 0,
        tries: 0,
        is_in_flight: false,
    }
}
