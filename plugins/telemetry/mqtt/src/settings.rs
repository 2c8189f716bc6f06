//! Settings as typed, and the valid configuration made from them.

use std::collections::BTreeMap;
use std::time::Duration;

use busbar_link::{
    Endpoint, ReconnectBounds, ReconnectSettings, SettingsFaults, TlsFiles, TlsSettings,
};
use busbar_plugin_sdk::{Error, Quality, QualityLevel, Reason, Secret};
use schemars::JsonSchema;
use serde::Deserialize;

use crate::availability::Availability;
use crate::availability_settings::{RawAvailability, parse_availability};
use crate::names::{MAX_TEXT, check_filter, check_name};
use crate::session::Version;
use crate::source_time::TimeUnit;

/// Ports of MQTT, plain and encrypted.
const PLAIN_PORT: u16 = 1883;
const TLS_PORT: u16 = 8883;
/// Brokers of a cluster.
const MAX_BROKERS: usize = 8;
/// Most topic filters, and most availability topics, in the settings.
const MAX_FILTERS: usize = 1000;
/// Most quality words in the settings.
const MAX_QUALITIES: usize = 100;
const MIN_KEEP_ALIVE_SECONDS: u16 = 2;
const MAX_KEEP_ALIVE_SECONDS: u16 = 600;
const MIN_TIMEOUT_MILLIS: u64 = 100;
const MAX_TIMEOUT_MILLIS: u64 = 60_000;
const MIN_PAYLOAD_BYTES: usize = 1024;
const MAX_PAYLOAD_BYTES: usize = 16 * 1024 * 1024;

/// A broker, or a cluster of brokers that carry the same.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Settings {
    /// Host name or address of the broker.
    #[schemars(length(min = 1, max = 253))]
    host: String,
    /// TCP port; without it 1883, encrypted 8883.
    #[serde(default)]
    #[schemars(range(min = 1))]
    port: Option<u16>,
    /// Further brokers of the cluster. One is connected; when it is lost, the next.
    #[serde(default)]
    #[schemars(length(max = 7))]
    cluster: Vec<RawEndpoint>,
    /// Version of the MQTT protocol.
    #[serde(default)]
    version: Version,
    /// Identifies this client to the broker, which ends an older connection of the same
    /// id. Without it one is made at each start.
    #[serde(default)]
    #[schemars(length(min = 1, max = 65535))]
    client_id: Option<String>,
    /// User name and password, by reference.
    #[serde(default)]
    login: Option<RawLogin>,
    /// Longest silence of the broker, seconds, after which the connection is lost. The broker is
    /// pinged after half of it.
    #[serde(default = "default_keep_alive")]
    #[schemars(range(min = 2, max = 600))]
    keep_alive_seconds: u16,
    /// Deadline in seconds of connecting, and of the broker's answers to it and to
    /// subscriptions.
    #[serde(default = "default_timeout")]
    #[schemars(range(min = 0.1, max = 60.0))]
    #[schemars(extend("x-busbar-formerly" = ["timeout_millis"]))]
    timeout_seconds: f64,
    /// Quality of service that is asked for; a message comes with at most its publisher's.
    #[serde(default = "default_qos")]
    #[schemars(range(max = 2))]
    qos: u8,
    /// Longest payload, bytes. Longer messages are left out, and their tags uncertain.
    #[serde(default = "default_payload")]
    #[schemars(range(min = 1024, max = 16_777_216))]
    max_payload_bytes: usize,
    /// Topic filters that bring the topics of many tags. Without them each topic is
    /// subscribed to on its own.
    #[serde(default)]
    #[schemars(length(max = 1000))]
    subscriptions: Vec<String>,
    /// Topics that tell whether the source of others is there.
    #[serde(default)]
    #[schemars(length(max = 1000))]
    availability: Vec<RawAvailability>,
    /// Treatment of retained messages without a believable time of their own, whose age is unknown.
    #[serde(default)]
    retained: Retained,
    /// Unit of source times that are counts since 1970, as numbers or, where it is set, as
    /// texts; without it numbers are milliseconds. An address may name another.
    #[serde(default)]
    time_unit: Option<TimeUnit>,
    /// Qualities by the words of payloads, whatever their case, beside `good`, `uncertain`
    /// and `bad`.
    #[serde(default)]
    #[schemars(length(max = 100))]
    qualities: BTreeMap<String, QualityLevel>,
    /// Messages that the plugin may send to Sparkplug edge nodes.
    #[serde(default)]
    sparkplug: RawSparkplug,
    /// Delay between tries to connect.
    #[serde(default)]
    reconnect: ReconnectSettings,
    /// Encryption of the connection by TLS; without it the connection is plain TCP.
    #[serde(default)]
    tls: Option<TlsSettings>,
}

/// One broker of a cluster.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct RawEndpoint {
    /// Host name or address.
    #[schemars(length(min = 1, max = 253))]
    host: String,
    /// TCP port; without it 1883, encrypted 8883.
    #[serde(default)]
    #[schemars(range(min = 1))]
    port: Option<u16>,
}

/// Name and password of this client.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct RawLogin {
    /// User name for the broker, by reference.
    username: Secret,
    /// Password for the broker, by reference.
    #[serde(default)]
    #[schemars(with = "Secret")]
    password: Option<Secret>,
}

/// Messages that the plugin may send to Sparkplug edge nodes; without any it only listens.
#[derive(Clone, Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
struct RawSparkplug {
    /// Permission to ask edge nodes for new birth certificates, by the command `Node
    /// Control/Rebirth`.
    request_rebirth: bool,
    /// Id of a primary host application as which the plugin announces itself, retained, so
    /// that edge nodes that wait for this host send.
    #[schemars(length(min = 1, max = 200))]
    primary_host: Option<String>,
}

/// Treatment of retained messages that have no believable source time of their own.
#[derive(Clone, Copy, Debug, Default, Deserialize, JsonSchema, PartialEq, Eq)]
#[serde(rename_all = "lowercase")]
pub(crate) enum Retained {
    /// Values of retained messages are uncertain (source time) until the next message.
    #[default]
    Uncertain,
    /// Values of retained messages count as new.
    Good,
    /// Retained messages are left out.
    Ignore,
}

fn default_keep_alive() -> u16 {
    10
}

fn default_timeout() -> f64 {
    10.0
}

fn default_qos() -> u8 {
    1
}

fn default_payload() -> usize {
    1024 * 1024
}

/// Settings that have been checked.
#[derive(Clone, Debug)]
pub(crate) struct Config {
    /// At least one; the first is tried first.
    pub(crate) brokers: Vec<Endpoint>,
    pub(crate) version: Version,
    pub(crate) client_id: Option<String>,
    pub(crate) login: Option<(Secret, Option<Secret>)>,
    pub(crate) keep_alive: Duration,
    pub(crate) timeout: Duration,
    pub(crate) qos: u8,
    pub(crate) max_payload: usize,
    pub(crate) subscriptions: Vec<String>,
    pub(crate) availability: Vec<Availability>,
    pub(crate) retained: Retained,
    pub(crate) time_unit: Option<TimeUnit>,
    /// By words in lower case.
    pub(crate) qualities: BTreeMap<String, Quality>,
    pub(crate) requests_rebirth: bool,
    pub(crate) primary_host: Option<String>,
    pub(crate) reconnect: ReconnectBounds,
    pub(crate) tls: Option<TlsFiles>,
}

impl Settings {
    /// Checks all of it.
    ///
    /// # Errors
    /// [`Error::settings`] with each fault and the allowed range.
    pub(crate) fn parse(self) -> Result<Config, Error> {
        let mut faults = SettingsFaults::default();
        let default_port = if self.tls.is_some() { TLS_PORT } else { PLAIN_PORT };
        let brokers = brokers(&self.host, self.port, &self.cluster, default_port, &mut faults);
        for (name, list) in
            [("subscriptions", self.subscriptions.len()), ("availability", self.availability.len())]
        {
            if list > MAX_FILTERS {
                faults.add(format!("{name}: {list} of them; at most {MAX_FILTERS} are allowed"));
            }
        }
        for (index, filter) in self.subscriptions.iter().enumerate() {
            check_filter(filter)
                .unwrap_or_else(|fault| faults.add(format!("subscriptions[{index}]: {fault}")));
        }
        if self.client_id.as_ref().is_some_and(|id| id.is_empty() || id.len() > MAX_TEXT) {
            faults.add(format!("client_id: give 1 to {MAX_TEXT} bytes, or leave it out"));
        }
        if self.qualities.len() > MAX_QUALITIES {
            faults.add(format!("qualities: at most {MAX_QUALITIES} are allowed"));
        }
        if let Some(host) = &self.sparkplug.primary_host {
            check_name("sparkplug.primary_host", host).unwrap_or_else(|fault| faults.add(fault));
        }
        let keep_alive = faults.check(
            "keep_alive_seconds",
            self.keep_alive_seconds,
            MIN_KEEP_ALIVE_SECONDS..=MAX_KEEP_ALIVE_SECONDS,
        );
        let config = Config {
            brokers,
            version: self.version,
            client_id: self.client_id,
            login: self.login.map(|login| (login.username, login.password)),
            keep_alive: Duration::from_secs(keep_alive.into()),
            timeout: faults.seconds(
                "timeout_seconds",
                self.timeout_seconds,
                MIN_TIMEOUT_MILLIS..=MAX_TIMEOUT_MILLIS,
            ),
            qos: faults.check("qos", self.qos, 0..=2),
            max_payload: faults.check(
                "max_payload_bytes",
                self.max_payload_bytes,
                MIN_PAYLOAD_BYTES..=MAX_PAYLOAD_BYTES,
            ),
            subscriptions: self.subscriptions,
            availability: parse_availability(self.availability, &mut faults),
            retained: self.retained,
            time_unit: self.time_unit,
            qualities: qualities(&self.qualities),
            requests_rebirth: self.sparkplug.request_rebirth,
            primary_host: self.sparkplug.primary_host,
            reconnect: self.reconnect.parse(&mut faults),
            tls: self.tls.map(|tls| tls.parse(&mut faults)),
        };
        let result = faults.into_result();
        result.map(|()| config).map_err(|faults| Error::settings(format!("settings: {faults}")))
    }
}

fn brokers(
    host: &str,
    port: Option<u16>,
    others: &[RawEndpoint],
    default_port: u16,
    faults: &mut SettingsFaults,
) -> Vec<Endpoint> {
    let mut brokers = vec![Endpoint::parse("", host, port.unwrap_or(default_port), faults)];
    for (index, RawEndpoint { host, port }) in others.iter().enumerate() {
        let place = format!("cluster[{index}].");
        brokers.push(Endpoint::parse(&place, host, port.unwrap_or(default_port), faults));
    }
    if brokers.len() > MAX_BROKERS {
        let count = brokers.len();
        faults.add(format!("cluster: {count} brokers; at most {MAX_BROKERS} are allowed"));
    }
    for (index, broker) in brokers.iter().enumerate() {
        if brokers[..index].contains(broker) {
            faults.add(format!("cluster: {broker} is named twice"));
        }
    }
    brokers
}

fn qualities(words: &BTreeMap<String, QualityLevel>) -> BTreeMap<String, Quality> {
    let quality = |level| Quality::new(level, Reason::Unknown);
    let plain = [QualityLevel::Good, QualityLevel::Uncertain, QualityLevel::Bad];
    let plain = plain.into_iter().map(|level| (level.name().to_owned(), quality(level)));
    plain.chain(words.iter().map(|(text, level)| (text.to_lowercase(), quality(*level)))).collect()
}

#[cfg(test)]
#[path = "settings_tests.rs"]
mod tests;
