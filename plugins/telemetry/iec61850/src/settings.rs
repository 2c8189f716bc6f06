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
    /// Period in which values are read that no report brings, seconds.
    #[serde(default = "default_poll")]
    #[schemars(range(min = 0.1, max = 3600.0))]
    #[schemars(extend("x-busbar-formerly" = ["poll_millis"]))]
    poll_seconds: f64,
    /// Report control blocks that bring values as they change.
    #[serde(default)]
    #[schemars(length(max = 64))]
    reports: Vec<RawReport>,
    /// Deadline of connecting, seconds.
    #[serde(default = "default_connect")]
    #[schemars(range(min = 0.1, max = 120.0))]
    #[schemars(extend("x-busbar-formerly" = ["connect_millis"]))]
    connect_seconds: f64,
    /// Deadline of each answer, and of the association, seconds.
    #[serde(default = "default_timeout")]
    #[schemars(range(min = 0.1, max = 120.0))]
    #[schemars(extend("x-busbar-formerly" = ["timeout_millis"]))]
    timeout_seconds: f64,
    /// Idle time after which the connection is tested, seconds.
    #[serde(default = "default_test")]
    #[schemars(range(min = 0.1, max = 3600.0))]
    #[schemars(extend("x-busbar-formerly" = ["test_millis"]))]
    test_seconds: f64,
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

fn default_poll() -> f64 {
    1.0
}

fn default_connect() -> f64 {
    10.0
}

fn default_timeout() -> f64 {
    5.0
}

fn default_test() -> f64 {
    10.0
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
            poll: faults.seconds("poll_seconds", self.poll_seconds, periods.clone()),
            reports: report_blocks(&self.reports, &mut faults),
            connect_timeout: faults.seconds(
                "connect_seconds",
                self.connect_seconds,
                timeouts.clone(),
            ),
            timeout: faults.seconds("timeout_seconds", self.timeout_seconds, timeouts),
            test: faults.seconds("test_seconds", self.test_seconds, periods),
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
