//! Settings as typed, and the valid configuration made from them.

use std::collections::BTreeMap;
use std::time::Duration;

use busbar_link::{ReconnectBounds, ReconnectSettings, SettingsFaults, TlsSettings};
use busbar_plugin_sdk::Error;
use schemars::JsonSchema;
use serde::Deserialize;

use crate::transport::{RawTransport, SerialSettings, Transport};

/// Shortest poll period, milliseconds, which a device's CPU can bear.
const MIN_POLL_MILLIS: u64 = 50;
/// Longest poll period: a day.
const MAX_POLL_MILLIS: u64 = 86_400_000;
/// Shortest deadline of a request.
const MIN_TIMEOUT_MILLIS: u64 = 10;
/// Longest deadline of a request.
const MAX_TIMEOUT_MILLIS: u64 = 600_000;
/// Poll groups of one connection, beside the default one.
const MAX_POLL_GROUPS: usize = 64;

/// One Modbus device or gateway in a network, or the devices of a serial line.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Settings {
    /// Host name or address of the device, for Modbus TCP.
    #[schemars(length(min = 1, max = 253))]
    host: Option<String>,
    /// TCP port: 502 by default, 802 with `tls`.
    #[schemars(range(min = 1))]
    port: Option<u16>,
    /// Encrypts the connection (Modbus/TCP Security).
    tls: Option<TlsSettings>,
    /// A serial line, for Modbus RTU, instead of `host`.
    serial: Option<SerialSettings>,
    /// Unit id of tags that name none. Serial devices and gateways go by it; most
    /// others ignore it.
    #[serde(default = "default_unit")]
    unit: u8,
    /// Period of tags that name no poll group, seconds.
    #[serde(default = "default_poll")]
    #[schemars(range(min = 0.05, max = 86_400.0))]
    #[schemars(extend("x-busbar-formerly" = ["poll_millis"]))]
    poll_seconds: f64,
    /// Deadline of connecting and of every answer, seconds; on a serial line
    /// without the time that the bytes take. When it passes, the connection is
    /// dropped, or the serial device left alone for a while.
    #[serde(default = "default_timeout")]
    #[schemars(range(min = 0.01, max = 600.0))]
    #[schemars(extend("x-busbar-formerly" = ["timeout_millis"]))]
    timeout_seconds: f64,
    /// Delay between tries to connect, or to reach a silent serial device.
    #[serde(default)]
    reconnect: ReconnectSettings,
    /// Poll groups by name, for tags that need another period.
    #[serde(default)]
    #[schemars(extend("maxProperties" = 64))]
    poll_groups: BTreeMap<String, PollGroup>,
}

/// Tags that are read together.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct PollGroup {
    /// Polling period of the group, seconds.
    #[schemars(range(min = 0.05, max = 86_400.0))]
    #[schemars(extend("x-busbar-formerly" = ["poll_millis"]))]
    poll_seconds: f64,
}

fn default_unit() -> u8 {
    1
}

fn default_poll() -> f64 {
    1.0
}

fn default_timeout() -> f64 {
    1.0
}

/// Settings that have been checked.
#[derive(Clone, Debug)]
pub(crate) struct Config {
    pub(crate) transport: Transport,
    pub(crate) unit: u8,
    pub(crate) timeout: Duration,
    pub(crate) reconnect: ReconnectBounds,
    /// Names of the groups; the first, without a name, is the default.
    pub(crate) group_names: Vec<String>,
    /// Period of each group.
    pub(crate) group_periods: Vec<Duration>,
}

impl Settings {
    /// Checks all of it.
    ///
    /// # Errors
    /// [`Error::settings`] with each fault and the allowed range.
    pub(crate) fn parse(self) -> Result<Config, Error> {
        let mut faults = SettingsFaults::default();
        let raw =
            RawTransport { host: self.host, port: self.port, tls: self.tls, serial: self.serial };
        let transport = raw.parse(&mut faults);
        let unit = transport
            .as_ref()
            .map_or(self.unit, |transport| faults.check("unit", self.unit, transport.units()));
        let timeouts = MIN_TIMEOUT_MILLIS..=MAX_TIMEOUT_MILLIS;
        let timeout = faults.seconds("timeout_seconds", self.timeout_seconds, timeouts);
        let reconnect = self.reconnect.parse(&mut faults);
        let (group_names, group_periods) = groups(self.poll_seconds, self.poll_groups, &mut faults);
        let result = faults.into_result();
        let invalid = |faults| Error::settings(format!("settings: {faults}"));
        result.map_err(invalid)?;
        // Without a fault there is a transport.
        let transport = transport.ok_or_else(|| invalid("no transport".into()))?;
        Ok(Config { transport, unit, timeout, reconnect, group_names, group_periods })
    }
}

/// Names and periods of the poll groups, the default one first.
fn groups(
    poll_seconds: f64,
    others: BTreeMap<String, PollGroup>,
    faults: &mut SettingsFaults,
) -> (Vec<String>, Vec<Duration>) {
    let periods = MIN_POLL_MILLIS..=MAX_POLL_MILLIS;
    let count = others.len();
    if count > MAX_POLL_GROUPS {
        faults.add(format!("poll_groups: {count} groups; at most {MAX_POLL_GROUPS} are allowed"));
    }
    if others.contains_key("") {
        faults.add("poll_groups: a group needs a name");
    }
    let default = (String::new(), faults.seconds("poll_seconds", poll_seconds, periods.clone()));
    let others = others.into_iter().take(MAX_POLL_GROUPS).map(|(name, group)| {
        let place = format!("poll_groups.{name}.poll_seconds");
        let period = faults.seconds(&place, group.poll_seconds, periods.clone());
        (name, period)
    });
    std::iter::once(default).chain(others).unzip()
}

#[cfg(test)]
#[path = "settings_tests.rs"]
mod tests;
