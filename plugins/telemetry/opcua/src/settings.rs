//! Settings as typed, and the valid configuration made from them.

use std::path::PathBuf;
use std::time::Duration;

use busbar_link::{ReconnectBounds, ReconnectSettings, SettingsFaults};
use busbar_plugin_sdk::{Error, Secret};
use schemars::JsonSchema;
use serde::Deserialize;

use crate::url::Url;

/// Servers of a redundant set.
const MAX_SERVERS: usize = 8;
/// Monitored items of one subscription.
const MAX_ITEMS: u32 = 10_000;
/// Shortest and longest publishing interval, milliseconds.
const PUBLISHING_MILLIS: std::ops::RangeInclusive<u64> = 50..=60_000;
/// Longest sampling interval: an hour.
pub(crate) const MAX_SAMPLING_MILLIS: u64 = 3_600_000;
/// Shortest and longest of the other times, milliseconds.
const TIMEOUT_MILLIS: std::ops::RangeInclusive<u64> = 500..=600_000;
/// Shortest and longest session timeout: ten seconds, an hour.
const SESSION_MILLIS: std::ops::RangeInclusive<u64> = 10_000..=3_600_000;
/// Lifetime of a channel's keys that the server is asked for.
const CHANNEL_LIFETIME: Duration = Duration::from_secs(3600);
/// Longest name or URI, bytes.
const MAX_TEXT_BYTES: usize = 256;

/// An OPC UA server, or a redundant set of them with the same nodes.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Settings {
    /// URL of the server, `opc.tcp://host:port/path`; without a port it is 4840.
    #[schemars(length(min = 11, max = 1024))]
    url: String,
    /// Further servers of a redundant set, with the same nodes. They are tried in turn when one
    /// cannot be reached.
    #[serde(default)]
    #[schemars(length(max = 7))]
    redundancy: Vec<String>,
    /// Signature, or signature and encryption, of all messages. Without it there is no security.
    #[serde(default)]
    security: Option<SecuritySettings>,
    /// User as whom the client reads; without it the user is anonymous.
    #[serde(default)]
    user: Option<UserSettings>,
    /// Publishing interval, in which the server sends changes, seconds.
    #[serde(default = "default_publishing")]
    #[schemars(range(min = 0.05, max = 60.0))]
    #[schemars(extend("x-busbar-formerly" = ["publishing_millis"]))]
    publishing_seconds: f64,
    /// Sampling interval, in which the server checks a value, seconds. It defaults to the
    /// publishing interval; 0 is the fastest that the server can.
    #[serde(default)]
    #[schemars(range(min = 0.0, max = 3600.0))]
    #[schemars(extend("x-busbar-formerly" = ["sampling_millis"]))]
    sampling_seconds: Option<f64>,
    /// Silence of the server after which the connection is given up and all tags are bad,
    /// seconds. The server is asked for a sign of life three times within it.
    #[serde(default = "default_silence")]
    #[schemars(range(min = 0.5, max = 600.0))]
    #[schemars(extend("x-busbar-formerly" = ["silence_millis"]))]
    silence_seconds: f64,
    /// Deadline of the connection attempt, seconds.
    #[serde(default = "default_connect")]
    #[schemars(range(min = 0.5, max = 600.0))]
    #[schemars(extend("x-busbar-formerly" = ["connect_timeout_millis"]))]
    connect_timeout_seconds: f64,
    /// Session timeout: time for which the server keeps a session without requests, seconds.
    #[serde(default = "default_session")]
    #[schemars(range(min = 10.0, max = 3600.0))]
    #[schemars(extend("x-busbar-formerly" = ["session_timeout_millis"]))]
    session_timeout_seconds: f64,
    /// Most monitored items of one subscription; further ones get subscriptions of their own.
    #[serde(default = "default_items")]
    #[schemars(range(min = 1, max = 10_000))]
    items_per_subscription: u32,
    /// Confirmation of unchanged values by each sign of life of their subscription. Otherwise they
    /// go stale by the tag's limit.
    #[serde(default = "default_true")]
    confirm_unchanged: bool,
    /// Use of the source times that come with values.
    #[serde(default)]
    source_time: SourceTime,
    /// Mirror of all alarm conditions of the server, for the host to show them.
    #[serde(default)]
    alarms: bool,
    /// Application URI of this client, as its certificate has it.
    #[serde(default = "default_application")]
    #[schemars(length(min = 1, max = 256))]
    application_uri: String,
    /// Delay between tries to connect.
    #[serde(default)]
    reconnect: ReconnectSettings,
}

/// Use of source times (SourceTimestamp of values, Time of events).
#[derive(Clone, Copy, Debug, Default, Deserialize, JsonSchema, PartialEq, Eq)]
#[serde(rename_all = "snake_case")]
pub(crate) enum SourceTime {
    /// Every value has one: a value without one is uncertain, as one is whose time is
    /// impossible.
    Required,
    /// A value may have none, and counts as of its arrival then. One whose time is
    /// impossible is uncertain.
    #[default]
    Optional,
    /// Values count as of their arrival, whatever their source times are.
    Ignored,
}

/// Security policies (OPC 10000-7, 6.6) that are not deprecated.
#[derive(Clone, Copy, Debug, Deserialize, JsonSchema, PartialEq, Eq)]
pub(crate) enum Policy {
    /// Policy `Basic256Sha256`: RSA-OAEP, SHA-256, AES-256.
    Basic256Sha256,
    /// Policy `Aes128_Sha256_RsaOaep`: RSA-OAEP, SHA-256, AES-128.
    #[serde(rename = "Aes128_Sha256_RsaOaep")]
    Aes128Sha256RsaOaep,
    /// Policy `Aes256_Sha256_RsaPss`: RSA-OAEP with SHA-256, RSA-PSS, AES-256.
    #[serde(rename = "Aes256_Sha256_RsaPss")]
    Aes256Sha256RsaPss,
}

/// Security mode of the messages.
#[derive(Clone, Copy, Debug, Default, Deserialize, JsonSchema, PartialEq, Eq)]
pub(crate) enum Mode {
    /// Signed messages: others can read but not change them.
    Sign,
    /// Signed and encrypted messages: others can neither read nor change them.
    #[default]
    SignAndEncrypt,
}

/// Files of certificates in DER or PEM form, by absolute paths. A key is a PEM file that only its
/// owner should be able to read; its contents are never shown.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct SecuritySettings {
    /// Security policy of the secure channel.
    policy: Policy,
    /// Security mode: signed, or signed and encrypted (the default).
    #[serde(default)]
    mode: Mode,
    /// Certificate file of this client.
    certificate: PathBuf,
    /// Private key file of the client's certificate.
    key: PathBuf,
    /// Certificates of trusted servers: one file, or a folder of them.
    trusted: PathBuf,
    /// Folder for the certificates of servers that are not trusted. An operator checks them there
    /// and moves them to the trusted ones.
    rejected: Option<PathBuf>,
}

/// A user: a name with a password, or a certificate with its key.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct UserSettings {
    /// Name of the user, with a password.
    #[schemars(length(min = 1, max = 256))]
    name: Option<String>,
    /// Password of the user, by reference.
    password: Option<Secret>,
    /// Permission to send the password where nothing encrypts it.
    #[serde(default)]
    allow_plain_password: bool,
    /// Certificate file of the user, in place of a name.
    certificate: Option<PathBuf>,
    /// Private key file of the user's certificate.
    key: Option<PathBuf>,
}

fn default_publishing() -> f64 {
    0.5
}

fn default_silence() -> f64 {
    10.0
}

fn default_connect() -> f64 {
    10.0
}

fn default_session() -> f64 {
    60.0
}

fn default_items() -> u32 {
    1000
}

fn default_true() -> bool {
    true
}

fn default_application() -> String {
    "urn:busbar:viewer".into()
}

/// Settings that have been checked.
#[derive(Clone, Debug)]
pub(crate) struct Config {
    /// At least one; the first is tried first.
    pub(crate) servers: Vec<Url>,
    pub(crate) security: Option<SecurityFiles>,
    pub(crate) user: User,
    pub(crate) publishing: Duration,
    pub(crate) sampling: Duration,
    pub(crate) silence: Duration,
    pub(crate) connect_timeout: Duration,
    pub(crate) session_timeout: Duration,
    /// Lifetime of the channel's keys that the server is asked for.
    pub(crate) channel_lifetime: Duration,
    pub(crate) items_per_subscription: usize,
    pub(crate) confirm_unchanged: bool,
    pub(crate) source_time: SourceTime,
    pub(crate) alarms: bool,
    pub(crate) application_uri: String,
    pub(crate) reconnect: ReconnectBounds,
}

/// Files of keys and certificates, by absolute paths.
#[derive(Clone, Debug)]
pub(crate) struct SecurityFiles {
    pub(crate) policy: Policy,
    pub(crate) mode: Mode,
    pub(crate) certificate: PathBuf,
    pub(crate) key: PathBuf,
    pub(crate) trusted: PathBuf,
    pub(crate) rejected: Option<PathBuf>,
}

/// User as whom the client reads.
#[derive(Clone, Debug)]
pub(crate) enum User {
    Anonymous,
    Password { name: String, password: Secret, allow_plain: bool },
    Certificate { certificate: PathBuf, key: PathBuf },
}

impl Settings {
    /// Checks all of it.
    ///
    /// # Errors
    /// [`Error::settings`] with each fault and what is allowed.
    pub(crate) fn parse(self) -> Result<Config, Error> {
        let mut faults = SettingsFaults::default();
        let publishing =
            faults.seconds("publishing_seconds", self.publishing_seconds, PUBLISHING_MILLIS);
        let sampling = self.sampling_seconds.map_or(publishing, |sampling| {
            faults.seconds("sampling_seconds", sampling, 0..=MAX_SAMPLING_MILLIS)
        });
        let items =
            faults.check("items_per_subscription", self.items_per_subscription, 1..=MAX_ITEMS);
        check_text("application_uri", &self.application_uri, &mut faults);
        let config = Config {
            servers: servers(&self.url, &self.redundancy, &mut faults),
            security: self.security.map(|security| security.parse(&mut faults)),
            user: self.user.map_or(User::Anonymous, |user| user.parse(&mut faults)),
            publishing,
            sampling,
            silence: faults.seconds("silence_seconds", self.silence_seconds, TIMEOUT_MILLIS),
            connect_timeout: faults.seconds(
                "connect_timeout_seconds",
                self.connect_timeout_seconds,
                TIMEOUT_MILLIS,
            ),
            session_timeout: faults.seconds(
                "session_timeout_seconds",
                self.session_timeout_seconds,
                SESSION_MILLIS,
            ),
            channel_lifetime: CHANNEL_LIFETIME,
            items_per_subscription: items as usize,
            confirm_unchanged: self.confirm_unchanged,
            source_time: self.source_time,
            alarms: self.alarms,
            application_uri: self.application_uri,
            reconnect: self.reconnect.parse(&mut faults),
        };
        let result = faults.into_result();
        result.map(|()| config).map_err(|faults| Error::settings(format!("settings: {faults}")))
    }
}

fn servers(first: &str, others: &[String], faults: &mut SettingsFaults) -> Vec<Url> {
    if others.len() >= MAX_SERVERS {
        let count = others.len() + 1;
        faults.add(format!("redundancy: {count} servers; at most {MAX_SERVERS} are allowed"));
    }
    let mut servers: Vec<Url> = Vec::new();
    let others = others.iter().enumerate();
    let named = others.map(|(index, text)| (format!("redundancy[{index}]"), text.as_str()));
    for (place, text) in std::iter::once(("url".to_owned(), first)).chain(named).take(MAX_SERVERS) {
        match Url::parse(text) {
            Ok(url) if servers.contains(&url) => {
                faults.add(format!("{place}: '{text}' is named twice"));
            }
            Ok(url) => servers.push(url),
            Err(what) => faults.add(format!("{place}: {what}")),
        }
    }
    servers
}

impl SecuritySettings {
    fn parse(self, faults: &mut SettingsFaults) -> SecurityFiles {
        let Self { policy, mode, certificate, key, trusted, rejected } = self;
        for path in [&certificate, &key, &trusted].into_iter().chain(&rejected) {
            check_path("security", path, faults);
        }
        SecurityFiles { policy, mode, certificate, key, trusted, rejected }
    }
}

impl UserSettings {
    fn parse(self, faults: &mut SettingsFaults) -> User {
        match (self.name, self.password, self.certificate, self.key) {
            (Some(name), Some(password), None, None) => {
                check_text("user.name", &name, faults);
                User::Password { name, password, allow_plain: self.allow_plain_password }
            }
            (None, None, Some(certificate), Some(key)) => {
                check_path("user", &certificate, faults);
                check_path("user", &key, faults);
                User::Certificate { certificate, key }
            }
            _ => {
                faults.add(
                    "user: give name and password, or certificate and key; leave user out to be \
                     anonymous",
                );
                User::Anonymous
            }
        }
    }
}

fn check_text(name: &str, text: &str, faults: &mut SettingsFaults) {
    if text.is_empty() || text.len() > MAX_TEXT_BYTES {
        faults.add(format!("{name}: give 1 to {MAX_TEXT_BYTES} bytes"));
    }
}

fn check_path(place: &str, path: &std::path::Path, faults: &mut SettingsFaults) {
    if !path.is_absolute() {
        faults.add(format!("{place}: '{}' is no absolute path", path.display()));
    }
}

#[cfg(test)]
#[path = "settings_tests.rs"]
mod tests;
