//! Settings as typed, and the valid configuration made from them.

use std::collections::BTreeMap;
use std::time::Duration;

use busbar_plugin_sdk::Error;
use schemars::JsonSchema;
use serde::Deserialize;

/// Shortest poll period: what a device's CPU bears.
const MIN_POLL_MILLIS: u64 = 50;
/// Longest poll period: a day.
const MAX_POLL_MILLIS: u64 = 86_400_000;
/// Shortest deadline of a request.
const MIN_TIMEOUT_MILLIS: u64 = 10;
/// Longest deadline of a request, and longest delay between two tries.
const MAX_TIMEOUT_MILLIS: u64 = 600_000;
/// Poll groups of one connection, beside the default one.
const MAX_POLL_GROUPS: usize = 64;
/// Longest host name (RFC 1035, 2.3.4).
const MAX_HOST_BYTES: usize = 253;

/// One connection to a Modbus TCP device or gateway.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Settings {
    /// Host name or address of the device.
    #[schemars(length(min = 1, max = 253))]
    host: String,
    /// TCP port.
    #[serde(default = "default_port")]
    #[schemars(range(min = 1))]
    port: u16,
    /// Unit id of tags that name none. Gateways route by it; most other
    /// devices ignore it.
    #[serde(default = "default_unit")]
    unit: u8,
    /// Period of tags that name no poll group, milliseconds.
    #[serde(default = "default_poll_millis")]
    #[schemars(range(min = 50, max = 86_400_000))]
    poll_millis: u64,
    /// Deadline of connecting and of every request, milliseconds. When it
    /// passes, the connection is dropped.
    #[serde(default = "default_timeout_millis")]
    #[schemars(range(min = 10, max = 600_000))]
    timeout_millis: u64,
    /// Delay between tries to connect.
    #[serde(default)]
    reconnect: Reconnect,
    /// Poll groups by name, for tags that need another period.
    #[serde(default)]
    #[schemars(extend("maxProperties" = 64))]
    poll_groups: BTreeMap<String, PollGroup>,
}

/// Delay between tries to connect: it doubles from `min_millis` to
/// `max_millis`, with jitter, so that clients do not come back in step.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
struct Reconnect {
    /// Shortest delay, milliseconds.
    #[schemars(range(min = 10, max = 600_000))]
    min_millis: u64,
    /// Longest delay, milliseconds.
    #[schemars(range(min = 10, max = 600_000))]
    max_millis: u64,
}

/// Tags that are read together.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct PollGroup {
    /// Period, milliseconds.
    #[schemars(range(min = 50, max = 86_400_000))]
    poll_millis: u64,
}

impl Default for Reconnect {
    fn default() -> Self {
        Self { min_millis: 500, max_millis: 30_000 }
    }
}

fn default_port() -> u16 {
    502
}

fn default_unit() -> u8 {
    1
}

fn default_poll_millis() -> u64 {
    1000
}

fn default_timeout_millis() -> u64 {
    1000
}

/// Settings that have been checked.
#[derive(Clone, Debug)]
pub(crate) struct Config {
    pub(crate) host: String,
    pub(crate) port: u16,
    pub(crate) unit: u8,
    pub(crate) timeout: Duration,
    pub(crate) reconnect_min: Duration,
    pub(crate) reconnect_max: Duration,
    /// Names of the groups; the first, without a name, is the default.
    pub(crate) group_names: Vec<String>,
    /// Period of each group.
    pub(crate) group_periods: Vec<Duration>,
}

impl Config {
    /// `host:port`, for messages; an IPv6 address in brackets.
    pub(crate) fn endpoint(&self) -> String {
        if self.host.contains(':') {
            format!("[{}]:{}", self.host, self.port)
        } else {
            format!("{}:{}", self.host, self.port)
        }
    }
}

impl Settings {
    /// Checks all of it.
    ///
    /// # Errors
    /// [`Error::settings`] with each fault and what is allowed.
    pub(crate) fn parse(self) -> Result<Config, Error> {
        let mut faults = Vec::new();
        let mut check = |name: &str, value: u64, min: u64, max: u64| {
            if !(min..=max).contains(&value) {
                faults.push(format!("{name}: {value} is not within {min} to {max}"));
            }
            Duration::from_millis(value)
        };
        let timeout =
            check("timeout_millis", self.timeout_millis, MIN_TIMEOUT_MILLIS, MAX_TIMEOUT_MILLIS);
        let reconnect_min = check(
            "reconnect.min_millis",
            self.reconnect.min_millis,
            MIN_TIMEOUT_MILLIS,
            MAX_TIMEOUT_MILLIS,
        );
        let reconnect_max = check(
            "reconnect.max_millis",
            self.reconnect.max_millis,
            MIN_TIMEOUT_MILLIS,
            MAX_TIMEOUT_MILLIS,
        );
        let mut poll =
            |name: &str, millis: u64| check(name, millis, MIN_POLL_MILLIS, MAX_POLL_MILLIS);
        let mut group_names = vec![String::new()];
        let mut group_periods = vec![poll("poll_millis", self.poll_millis)];
        for (name, group) in self.poll_groups.iter().take(MAX_POLL_GROUPS) {
            let place = format!("poll_groups.{name}.poll_millis");
            group_periods.push(poll(&place, group.poll_millis));
            group_names.push(name.clone());
        }
        if self.poll_groups.len() > MAX_POLL_GROUPS {
            faults.push(format!(
                "poll_groups: {} groups; at most {MAX_POLL_GROUPS} are allowed",
                self.poll_groups.len()
            ));
        }
        if self.poll_groups.contains_key("") {
            faults.push("poll_groups: a group needs a name".into());
        }
        if reconnect_min > reconnect_max {
            faults.push("reconnect: min_millis is larger than max_millis".into());
        }
        if self.host.trim().is_empty() || self.host.len() > MAX_HOST_BYTES {
            faults.push(format!("host: give a name or an address of 1 to {MAX_HOST_BYTES} bytes"));
        }
        if self.port == 0 {
            faults.push("port: 0 is not within 1 to 65535".into());
        }
        if !faults.is_empty() {
            return Err(Error::settings(format!("settings: {}", faults.join("; "))));
        }
        Ok(Config {
            host: self.host.trim().to_owned(),
            port: self.port,
            unit: self.unit,
            timeout,
            reconnect_min,
            reconnect_max,
            group_names,
            group_periods,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(json: serde_json::Value) -> Result<Config, Error> {
        serde_json::from_value::<Settings>(json).expect("well-formed").parse()
    }

    #[test]
    fn defaults_are_as_documented() {
        let config = parse(serde_json::json!({"host": "::1"})).unwrap();
        assert_eq!(config.endpoint(), "[::1]:502");
        assert_eq!(config.unit, 1);
        assert_eq!(config.timeout, Duration::from_secs(1));
        assert_eq!(config.reconnect_min, Duration::from_millis(500));
        assert_eq!(config.reconnect_max, Duration::from_secs(30));
        assert_eq!(config.group_periods, [Duration::from_secs(1)]);
    }

    #[test]
    fn every_fault_is_named() {
        let error = parse(serde_json::json!({
            "host": " ", "port": 0, "poll_millis": 49, "timeout_millis": 0,
            "reconnect": {"min_millis": 100, "max_millis": 50},
            "poll_groups": {"fast": {"poll_millis": 1}, "": {"poll_millis": 100}}
        }))
        .unwrap_err();
        for part in [
            "host:",
            "port: 0",
            "poll_millis: 49",
            "timeout_millis: 0",
            "min_millis is larger",
            "poll_groups.fast.poll_millis: 1 is not within 50 to 86400000",
            "a group needs a name",
        ] {
            assert!(error.message().contains(part), "{part} in {error}");
        }
    }

    #[test]
    fn the_schema_describes_each_setting() {
        let schema = serde_json::to_value(schemars::schema_for!(Settings)).unwrap();
        for (name, property) in schema["properties"].as_object().unwrap() {
            assert!(property["description"].is_string(), "{name} has no description");
        }
        assert_eq!(schema["properties"]["poll_millis"]["minimum"], 50);
        assert_eq!(schema["additionalProperties"], false);
    }
}
