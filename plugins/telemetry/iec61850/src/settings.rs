//! Settings as typed, and the valid configuration made from them.

use std::time::Duration;

use busbar_link::{
    Endpoint, ReconnectBounds, ReconnectSettings, SettingsFaults, TlsFiles, TlsSettings,
};
use busbar_plugin_sdk::{Error, Secret};
use schemars::JsonSchema;
use serde::Deserialize;

use crate::addressing::{self, Selectors};
use crate::block::{RawReport, ReportBlock, report_blocks};

/// Deadlines: a tenth of a second to two minutes.
const MIN_TIMEOUT_MILLIS: u64 = 100;
const MAX_TIMEOUT_MILLIS: u64 = 120_000;
/// Shortest and longest period of polls and tests: a tenth of a second, an hour.
const MIN_PERIOD_MILLIS: u64 = 100;
const MAX_PERIOD_MILLIS: u64 = 3_600_000;
/// Ways to one server.
const MAX_ENDPOINTS: usize = 8;
/// The TCP ports of MMS: plain (RFC 1006), and with TLS (IEC 62351-4).
const PORT: u16 = 102;
const TLS_PORT: u16 = 3782;

/// A server of IEC 61850 over MMS: an IED or a gateway.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Settings {
    /// Host name or address of the server; nothing but the command `scl` goes without.
    #[serde(default)]
    #[schemars(length(min = 1, max = 253))]
    host: Option<String>,
    /// TCP port: 102, with TLS 3782.
    #[serde(default)]
    #[schemars(range(min = 1))]
    port: Option<u16>,
    /// Further ways to the same server, tried in turn.
    #[serde(default)]
    #[schemars(length(max = 7))]
    redundancy: Vec<RawEndpoint>,
    /// Period in which values are read that no report brings, milliseconds.
    #[serde(default = "default_poll")]
    #[schemars(range(min = 100, max = 3_600_000))]
    poll_millis: u64,
    /// Report control blocks that bring values as they change.
    #[serde(default)]
    #[schemars(length(max = 64))]
    reports: Vec<RawReport>,
    /// Deadline of connecting, milliseconds.
    #[serde(default = "default_connect")]
    #[schemars(range(min = 100, max = 120_000))]
    connect_millis: u64,
    /// Deadline of each answer, and of the association, milliseconds.
    #[serde(default = "default_timeout")]
    #[schemars(range(min = 100, max = 120_000))]
    timeout_millis: u64,
    /// Idle time after which the connection is tested, milliseconds.
    #[serde(default = "default_test")]
    #[schemars(range(min = 100, max = 3_600_000))]
    test_millis: u64,
    /// Names of the server's and our end below MMS.
    #[serde(default)]
    osi: addressing::RawOsi,
    /// Password of the association (IEC 61850-8-1, ACSE authentication).
    #[serde(default)]
    #[schemars(with = "Secret")]
    password: Option<Secret>,
    /// Delay between tries to connect.
    #[serde(default)]
    reconnect: ReconnectSettings,
    /// Encrypts the connections (IEC 62351-3).
    #[serde(default)]
    tls: Option<TlsSettings>,
}

/// One way to the server.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct RawEndpoint {
    /// Host name or address.
    #[schemars(length(min = 1, max = 253))]
    host: String,
    /// TCP port: 102, with TLS 3782.
    #[serde(default)]
    #[schemars(range(min = 1))]
    port: Option<u16>,
}

fn default_poll() -> u64 {
    1000
}

fn default_connect() -> u64 {
    10_000
}

fn default_timeout() -> u64 {
    5000
}

fn default_test() -> u64 {
    10_000
}

/// Settings that have been checked.
#[derive(Clone, Debug)]
pub(crate) struct Config {
    /// At least one, in the order of trying.
    pub(crate) endpoints: Vec<Endpoint>,
    pub(crate) poll: Duration,
    pub(crate) reports: Vec<ReportBlock>,
    pub(crate) connect_timeout: Duration,
    pub(crate) timeout: Duration,
    pub(crate) test: Duration,
    pub(crate) selectors: Selectors,
    pub(crate) password: Option<Secret>,
    pub(crate) reconnect: ReconnectBounds,
    pub(crate) tls: Option<TlsFiles>,
}

impl Settings {
    /// Reports whether the settings name a server.
    pub(crate) fn has_server(&self) -> bool {
        self.host.is_some()
    }

    /// Checks all of it.
    ///
    /// # Errors
    /// [`Error::settings`] with each fault and what is allowed.
    pub(crate) fn parse(self) -> Result<Config, Error> {
        let mut faults = SettingsFaults::default();
        let default_port = if self.tls.is_some() { TLS_PORT } else { PORT };
        let timeouts = MIN_TIMEOUT_MILLIS..=MAX_TIMEOUT_MILLIS;
        let periods = MIN_PERIOD_MILLIS..=MAX_PERIOD_MILLIS;
        let first = RawEndpoint { host: self.host.unwrap_or_default(), port: self.port };
        let config = Config {
            endpoints: endpoints(&first, &self.redundancy, default_port, &mut faults),
            poll: faults.millis("poll_millis", self.poll_millis, periods.clone()),
            reports: report_blocks(&self.reports, &mut faults),
            connect_timeout: faults.millis("connect_millis", self.connect_millis, timeouts.clone()),
            timeout: faults.millis("timeout_millis", self.timeout_millis, timeouts),
            test: faults.millis("test_millis", self.test_millis, periods),
            selectors: self.osi.parse(&mut faults),
            password: self.password,
            reconnect: self.reconnect.parse(&mut faults),
            tls: self.tls.map(|tls| tls.parse(&mut faults)),
        };
        let result = faults.into_result();
        result.map(|()| config).map_err(|faults| Error::settings(format!("settings: {faults}")))
    }
}

fn endpoints(
    first: &RawEndpoint,
    others: &[RawEndpoint],
    default_port: u16,
    faults: &mut SettingsFaults,
) -> Vec<Endpoint> {
    let port = |raw: &RawEndpoint| raw.port.unwrap_or(default_port);
    let mut endpoints = vec![Endpoint::parse("", &first.host, port(first), faults)];
    for (index, raw) in others.iter().enumerate() {
        let place = format!("redundancy[{index}].");
        endpoints.push(Endpoint::parse(&place, &raw.host, port(raw), faults));
    }
    let count = endpoints.len();
    if count > MAX_ENDPOINTS {
        faults.add(format!("redundancy: {count} ways; at most {MAX_ENDPOINTS} are allowed"));
    }
    for (index, endpoint) in endpoints.iter().enumerate() {
        if endpoints[..index].contains(endpoint) {
            faults.add(format!("redundancy: {endpoint} is named twice"));
        }
    }
    endpoints
}

#[cfg(test)]
#[path = "settings_tests.rs"]
mod tests;
