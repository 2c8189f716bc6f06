//! Settings as typed, and the valid configuration made from them.

use std::collections::{BTreeMap, BTreeSet};
use std::time::Duration;

use busbar_link::{Endpoint, SettingsFaults, TlsFiles, TlsSettings};
use busbar_plugin_sdk::{
    AlarmNotification, AlarmOrigin, Error, Priority, Secret, state_file_fault,
};
use lettre::Address;
use lettre::message::Mailbox;
use schemars::JsonSchema;
use serde::Deserialize;

/// Recipients of the settings.
const MAX_RECIPIENTS: usize = 64;
/// Mail addresses, or webhooks, of a recipient.
const MAX_TARGETS: usize = 16;
/// Webhooks of the settings.
const MAX_WEBHOOKS: usize = 16;
/// Areas of a recipient.
const MAX_AREAS: usize = 100;
/// Bytes of a name, an area or an address.
const MAX_TEXT_BYTES: usize = 256;
/// Bytes of a URL.
pub(crate) const MAX_URL_BYTES: usize = 2_048;
const MAX_SECONDS: u64 = 86_400;
const MIN_REPEAT_SECONDS: u64 = 60;
const MAX_PER_MINUTE: u32 = 60;
const MAX_GIVE_UP_HOURS: u32 = 168;
const MIN_TIMEOUT_MILLIS: u64 = 1_000;
const MAX_TIMEOUT_MILLIS: u64 = 120_000;
/// Ports of mail submission: encrypted from the start, and by STARTTLS (RFC 8314, 3.3).
const TLS_PORT: u16 = 465;
const STARTTLS_PORT: u16 = 587;
const PLAIN_PORT: u16 = 25;

/// Recipients of alarms, and the servers that bring messages to them.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Settings {
    /// Recipients of messages, each told of the alarms of its areas and priorities.
    #[schemars(length(min = 1, max = MAX_RECIPIENTS))]
    recipients: Vec<RawRecipient>,
    /// Mail server that takes messages.
    #[serde(default)]
    mail: Option<RawMail>,
    /// Webhooks, by name: each message is posted to a URL as JSON.
    #[serde(default)]
    #[schemars(extend("maxProperties" = MAX_WEBHOOKS))]
    webhooks: BTreeMap<String, RawWebhook>,
    /// File that keeps open alarms and messages that wait across restarts; absolute, or after
    /// `${folder}/`. Without it a restart of the plugin loses messages that wait.
    #[serde(default)]
    state_file: Option<String>,
    /// Name of the site, which begins each subject.
    #[serde(default)]
    #[schemars(length(max = MAX_TEXT_BYTES))]
    site: String,
    /// Hours for which a message that cannot be delivered is tried again.
    #[serde(default = "default_give_up_hours")]
    #[schemars(range(min = 1, max = MAX_GIVE_UP_HOURS))]
    give_up_hours: u32,
    /// Deadline in seconds of handing over one message.
    #[serde(default = "default_timeout")]
    #[schemars(range(min = 1.0, max = 120.0))]
    timeout_seconds: f64,
}

/// Recipient of messages about alarms.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct RawRecipient {
    /// Name of the recipient, for messages and the test command.
    #[schemars(length(min = 1, max = MAX_TEXT_BYTES))]
    name: String,
    /// Mail addresses of the recipient.
    #[serde(default)]
    #[schemars(length(max = MAX_TARGETS))]
    mail: Vec<String>,
    /// Names of webhooks that reach the recipient.
    #[serde(default)]
    #[schemars(length(max = MAX_TARGETS))]
    webhooks: Vec<String>,
    /// Areas whose alarms the recipient is told of: ids of equipment or of nodes above it, or groups
    /// of alarms; `*` at the end stands for any rest. Without areas, all alarms.
    #[serde(default)]
    #[schemars(length(max = MAX_AREAS), extend("examples" = [["=S12*", "Cooling"]]))]
    areas: Vec<String>,
    /// Lowest priority of alarms that the recipient is told of.
    #[serde(default = "default_priority")]
    least_priority: Priority,
    /// Seconds for which an alarm must stay unacknowledged before the recipient is told. A longer
    /// delay makes the recipient one of the next stage: an alarm that nobody acknowledges
    /// escalates to it.
    #[serde(default)]
    #[schemars(range(max = MAX_SECONDS))]
    delay_seconds: u64,
    /// Period in seconds after which the recipient is told again while nobody acknowledges; without
    /// it once.
    #[serde(default)]
    #[schemars(range(min = MIN_REPEAT_SECONDS, max = MAX_SECONDS))]
    repeat_seconds: Option<u64>,
    /// Messages in a minute; further alarms of that minute come in one digest.
    #[serde(default = "default_per_minute")]
    #[schemars(range(min = 1, max = MAX_PER_MINUTE))]
    max_messages_per_minute: u32,
    /// Permission to tell of alarms whose values are recorded or historical; those messages say so.
    #[serde(default)]
    recorded: bool,
    /// Permission to tell who was told of an alarm that it returned, was acknowledged or shelved.
    #[serde(default = "default_true")]
    follow_up: bool,
}

/// Mail server that takes messages.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct RawMail {
    /// Host name or address of the mail server.
    #[schemars(length(min = 1, max = 253))]
    host: String,
    /// TCP port; without it 465 for `tls`, 587 for `starttls`, 25 for `none`.
    #[serde(default)]
    #[schemars(range(min = 1))]
    port: Option<u16>,
    /// Encryption of the connection.
    #[serde(default)]
    security: Security,
    /// Trusted authorities of the server's certificate.
    #[serde(default)]
    tls: Option<TlsSettings>,
    /// User name and password, by reference.
    #[serde(default)]
    login: Option<RawLogin>,
    /// Address that messages come from: `busbar@example.com`, or `Busbar <busbar@example.com>`.
    from: String,
}

/// Encryption of a connection to a mail server.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub(crate) enum Security {
    /// TLS from the first byte.
    #[default]
    Tls,
    /// TLS after the command STARTTLS, without which nothing is sent.
    Starttls,
    /// No encryption, for a relay on the same machine.
    None,
}

/// Name and password of a mail account.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct RawLogin {
    /// User name of the account, by reference.
    username: Secret,
    /// Password of the account, by reference.
    password: Secret,
}

/// Webhook that takes messages as JSON.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct RawWebhook {
    /// URL that messages are posted to, `https://...` or `http://...`.
    #[serde(default)]
    #[schemars(length(min = 1, max = MAX_URL_BYTES))]
    url: Option<String>,
    /// URL by reference, where it is a credential itself.
    #[serde(default)]
    secret_url: Option<Secret>,
    /// Token that is sent as `Authorization: Bearer`, by reference.
    #[serde(default)]
    token: Option<Secret>,
    /// Trusted authorities of the server's certificate; `https` needs them.
    #[serde(default)]
    tls: Option<TlsSettings>,
}

/// Valid settings of the plugin.
#[derive(Clone, Debug)]
pub(crate) struct Config {
    pub(crate) recipients: Vec<Recipient>,
    pub(crate) mail: Option<MailConfig>,
    pub(crate) webhooks: BTreeMap<String, WebhookConfig>,
    pub(crate) state_file: Option<String>,
    pub(crate) site: String,
    /// Age at which a message is given up.
    pub(crate) give_up: Duration,
    /// Deadline of handing over one message.
    pub(crate) timeout: Duration,
}

/// Recipient with its rules.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Recipient {
    pub(crate) name: String,
    pub(crate) targets: Vec<Target>,
    areas: Vec<String>,
    least_priority: Priority,
    pub(crate) delay_millis: u64,
    pub(crate) repeat_millis: Option<u64>,
    pub(crate) max_per_minute: usize,
    tells_recorded: bool,
    pub(crate) follow_up: bool,
}

/// Address that a message goes to.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, serde::Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(crate) enum Target {
    /// Mail address of a recipient.
    Mail(String),
    /// Name of a webhook.
    Webhook(String),
}

/// Mail server with its credentials by reference.
#[derive(Clone, Debug)]
pub(crate) struct MailConfig {
    pub(crate) endpoint: Endpoint,
    pub(crate) security: Security,
    pub(crate) tls: Option<TlsFiles>,
    /// User name and password.
    pub(crate) login: Option<(Secret, Secret)>,
    pub(crate) from: Mailbox,
}

/// Webhook with its credentials by reference.
#[derive(Clone, Debug)]
pub(crate) struct WebhookConfig {
    pub(crate) url: UrlSource,
    pub(crate) token: Option<Secret>,
    pub(crate) tls: Option<TlsFiles>,
}

/// Source of a webhook's URL.
#[derive(Clone, Debug)]
pub(crate) enum UrlSource {
    /// URL in the settings.
    Text(String),
    /// URL by reference, a credential.
    Secret(Secret),
}

impl std::fmt::Display for Target {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Mail(address) => write!(f, "mail to {address}"),
            Self::Webhook(name) => write!(f, "webhook {name}"),
        }
    }
}

impl Recipient {
    /// Reports whether the recipient is told of an alarm at all.
    pub(crate) fn is_told_of(&self, alarm: &AlarmNotification) -> bool {
        let is_recorded = |origin: &AlarmOrigin| {
            matches!(origin, AlarmOrigin::Recorded | AlarmOrigin::Historical)
        };
        alarm.priority <= self.least_priority
            && (self.tells_recorded || !alarm.origin.iter().any(is_recorded))
            && (self.areas.is_empty() || self.areas.iter().any(|area| is_within(area, alarm)))
    }
}

/// Reports whether an alarm's equipment or group is in an area.
fn is_within(area: &str, alarm: &AlarmNotification) -> bool {
    let mut names = alarm.place.iter().chain(&alarm.group);
    match area.strip_suffix('*') {
        Some(start) => names.any(|name| name.starts_with(start)),
        None => names.any(|name| name == area),
    }
}

fn default_give_up_hours() -> u32 {
    24
}

fn default_timeout() -> f64 {
    30.0
}

fn default_priority() -> Priority {
    Priority::Low
}

fn default_per_minute() -> u32 {
    6
}

fn default_true() -> bool {
    true
}

impl Settings {
    /// Checks the settings, without reading files or secrets.
    ///
    /// # Errors
    /// [`Error::settings`] with all faults.
    pub(crate) fn parse(self) -> Result<Config, Error> {
        let mut faults = SettingsFaults::default();
        if self.webhooks.len() > MAX_WEBHOOKS {
            faults.add(format!("webhooks: there are more than {MAX_WEBHOOKS}"));
        }
        let webhooks: BTreeMap<_, _> = self
            .webhooks
            .into_iter()
            .map(|(name, raw)| {
                let webhook = raw.parse(&name, &mut faults);
                (name, webhook)
            })
            .collect();
        let has_mail = self.mail.is_some();
        let mail = self.mail.and_then(|raw| raw.parse(&mut faults));
        if self.recipients.is_empty() || self.recipients.len() > MAX_RECIPIENTS {
            faults.add(format!("recipients: give 1 to {MAX_RECIPIENTS}"));
        }
        let mut names = BTreeSet::new();
        let mut recipients = Vec::new();
        for (index, raw) in self.recipients.into_iter().enumerate() {
            let place = format!("recipients[{index}]");
            if !names.insert(raw.name.clone()) {
                faults.add(format!("{place}.name: there are two recipients '{}'", raw.name));
            }
            recipients.push(raw.parse(&place, has_mail, &webhooks, &mut faults));
        }
        if let Some(fault) = self.state_file.as_deref().and_then(state_file_fault) {
            faults.add(fault);
        }
        if !is_line(&self.site, 0) {
            faults.add(format!("site: give one line of at most {MAX_TEXT_BYTES} bytes"));
        }
        let hours = faults.check("give_up_hours", self.give_up_hours, 1..=MAX_GIVE_UP_HOURS);
        let allowed = MIN_TIMEOUT_MILLIS..=MAX_TIMEOUT_MILLIS;
        let timeout = faults.seconds("timeout_seconds", self.timeout_seconds, allowed);
        faults.into_result().map_err(Error::settings)?;
        Ok(Config {
            recipients,
            mail,
            webhooks,
            state_file: self.state_file,
            site: self.site,
            give_up: Duration::from_secs(u64::from(hours) * 3_600),
            timeout,
        })
    }
}

impl RawRecipient {
    fn parse(
        self,
        place: &str,
        has_mail: bool,
        webhooks: &BTreeMap<String, WebhookConfig>,
        faults: &mut SettingsFaults,
    ) -> Recipient {
        if !is_line(&self.name, 1) {
            faults.add(format!("{place}.name: give one line of 1 to {MAX_TEXT_BYTES} bytes"));
        }
        if self.mail.is_empty() && self.webhooks.is_empty() {
            faults.add(format!("{place}: nothing reaches it; add \"mail\" or \"webhooks\""));
        }
        if self.mail.len() > MAX_TARGETS || self.webhooks.len() > MAX_TARGETS {
            faults.add(format!("{place}: it has more than {MAX_TARGETS} addresses or webhooks"));
        }
        if !self.mail.is_empty() && !has_mail {
            faults.add(format!("{place}.mail: there is no mail server; add \"mail\""));
        }
        for address in &self.mail {
            let fits = address.is_ascii() && address.len() <= MAX_TEXT_BYTES;
            if !fits || address.parse::<Address>().is_err() {
                faults.add(format!("{place}.mail: '{address}' is no mail address in ASCII"));
            }
        }
        for name in self.webhooks.iter().filter(|name| !webhooks.contains_key(*name)) {
            faults.add(format!("{place}.webhooks: there is no webhook '{name}'"));
        }
        if self.areas.len() > MAX_AREAS || !self.areas.iter().all(|area| is_line(area, 1)) {
            faults.add(format!(
                "{place}.areas: give at most {MAX_AREAS} of one line and 1 to {MAX_TEXT_BYTES} bytes"
            ));
        }
        let seconds =
            faults.check(&format!("{place}.delay_seconds"), self.delay_seconds, 0..=MAX_SECONDS);
        let repeat = self.repeat_seconds.map(|seconds| {
            let name = format!("{place}.repeat_seconds");
            faults.check(&name, seconds, MIN_REPEAT_SECONDS..=MAX_SECONDS)
        });
        let per_minute = faults.check(
            &format!("{place}.max_messages_per_minute"),
            self.max_messages_per_minute,
            1..=MAX_PER_MINUTE,
        );
        let mail = self.mail.into_iter().map(Target::Mail);
        Recipient {
            name: self.name,
            targets: mail.chain(self.webhooks.into_iter().map(Target::Webhook)).collect(),
            areas: self.areas,
            least_priority: self.least_priority,
            delay_millis: seconds * 1_000,
            repeat_millis: repeat.map(|seconds| seconds * 1_000),
            max_per_minute: per_minute as usize,
            tells_recorded: self.recorded,
            follow_up: self.follow_up,
        }
    }
}

impl RawMail {
    /// Checks the mail server; none with a fault of its sender.
    fn parse(self, faults: &mut SettingsFaults) -> Option<MailConfig> {
        let usual = match self.security {
            Security::Tls => TLS_PORT,
            Security::Starttls => STARTTLS_PORT,
            Security::None => PLAIN_PORT,
        };
        let endpoint = Endpoint::parse("mail.", &self.host, self.port.unwrap_or(usual), faults);
        let tls = self.tls.map(|tls| tls.parse(faults));
        match (self.security, tls.is_some()) {
            (Security::None, true) => {
                faults.add("mail.tls: it has no effect without \"security\"; remove one of them");
            }
            (Security::Tls | Security::Starttls, false) => faults.add(
                "mail.tls: name the trusted authorities: \
                 \"tls\": {\"ca\": \"/etc/ssl/certs/ca-certificates.crt\"}",
            ),
            _ => {}
        }
        if self.security == Security::None && self.login.is_some() {
            faults.add("mail.login: it would be sent unencrypted; make \"security\" \"tls\"");
        }
        let login = self.login.map(|login| (login.username, login.password));
        match self.from.parse::<Mailbox>() {
            Ok(from) if self.from.is_ascii() => {
                Some(MailConfig { endpoint, security: self.security, tls, login, from })
            }
            _ => {
                faults.add(format!("mail.from: '{}' is no mail address in ASCII", self.from));
                None
            }
        }
    }
}

impl RawWebhook {
    fn parse(self, name: &str, faults: &mut SettingsFaults) -> WebhookConfig {
        let place = format!("webhooks.{name}");
        if !is_line(name, 1) {
            faults.add(format!("{place}: give it a name of one line, 1 to {MAX_TEXT_BYTES} bytes"));
        }
        let url = match (self.url, self.secret_url) {
            (Some(url), None) => {
                match crate::webhook::parse_url(&url) {
                    Ok(parsed) if parsed.is_encrypted && self.tls.is_none() => faults.add(format!(
                        "{place}.tls: name the trusted authorities: \
                         \"tls\": {{\"ca\": \"/etc/ssl/certs/ca-certificates.crt\"}}"
                    )),
                    Ok(_) => {}
                    Err(fault) => faults.add(format!("{place}.url: {fault}")),
                }
                UrlSource::Text(url)
            }
            (None, Some(secret)) => UrlSource::Secret(secret),
            _ => {
                faults.add(format!("{place}: give either \"url\" or \"secret_url\""));
                UrlSource::Text(String::new())
            }
        };
        let tls = self.tls.map(|tls| tls.parse(faults));
        WebhookConfig { url, token: self.token, tls }
    }
}

/// Reports whether a text is one line of allowed length.
fn is_line(text: &str, least: usize) -> bool {
    (least..=MAX_TEXT_BYTES).contains(&text.len()) && !text.chars().any(char::is_control)
}
