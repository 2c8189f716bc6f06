//! Settings as typed, and the valid configuration made from them.

use std::time::Duration;

use busbar_link::{
    Endpoint, ReconnectBounds, ReconnectSettings, SettingsFaults, TlsFiles, TlsSettings,
};
use busbar_plugin_sdk::Error;
use schemars::JsonSchema;
use serde::Deserialize;

use crate::apci_session::Parameters;
use crate::codec::Zone;

/// Longest of the deadlines t0 to t3 (IEC 60870-5-104, 9.6), milliseconds.
const MAX_TIMEOUT_MILLIS: u64 = 255_000;
const MIN_TIMEOUT_MILLIS: u64 = 100;
/// Longest t3: 48 hours.
const MAX_TEST_MILLIS: u64 = 172_800_000;
/// Shortest and longest period of a request: a second, a day.
const MIN_PERIOD_MILLIS: u64 = 1000;
const MAX_PERIOD_MILLIS: u64 = 86_400_000;
/// Largest windows: half of the sequence numbers would be ambiguous.
const MAX_WINDOW: u16 = 32_767;
/// Connections of a redundancy group.
const MAX_CONNECTIONS: usize = 8;
/// No place is further from UTC.
const MAX_OFFSET_MINUTES: i16 = 14 * 60;

/// A controlled station, over one connection or a redundancy group.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Settings {
    /// Host name or address of the station.
    #[schemars(length(min = 1, max = 253))]
    host: String,
    /// Port of TCP; 2404 by default.
    #[serde(default = "default_port")]
    #[schemars(range(min = 1))]
    port: u16,
    /// Further ways to the same station. One connection carries data, the others
    /// are kept ready.
    #[serde(default)]
    #[schemars(length(max = 7))]
    redundancy: Vec<RawEndpoint>,
    /// Common address of tags that name none.
    #[serde(default = "default_common_address")]
    #[schemars(range(min = 1, max = 65534))]
    common_address: u16,
    /// Originator address in requests; 0 is none.
    #[serde(default)]
    originator: u8,
    /// Frames that may be sent without acknowledgement.
    #[serde(default = "default_k")]
    #[schemars(range(min = 1, max = 32767))]
    k: u16,
    /// Frames after which reception is acknowledged at the latest.
    #[serde(default = "default_w")]
    #[schemars(range(min = 1, max = 32767))]
    w: u16,
    /// Deadline of connecting, seconds.
    #[serde(default = "default_t0")]
    #[schemars(range(min = 0.1, max = 255.0))]
    #[schemars(extend("x-busbar-formerly" = ["t0_millis"]))]
    t0_seconds: f64,
    /// Deadline of an acknowledgement by the station, seconds.
    #[serde(default = "default_t1")]
    #[schemars(range(min = 0.1, max = 255.0))]
    #[schemars(extend("x-busbar-formerly" = ["t1_millis"]))]
    t1_seconds: f64,
    /// Latest acknowledgement by us, seconds; shorter than t1.
    #[serde(default = "default_t2")]
    #[schemars(range(min = 0.1, max = 255.0))]
    #[schemars(extend("x-busbar-formerly" = ["t2_millis"]))]
    t2_seconds: f64,
    /// Idle time after which the connection is tested, seconds.
    #[serde(default = "default_t3")]
    #[schemars(range(min = 0.1, max = 172_800.0))]
    #[schemars(extend("x-busbar-formerly" = ["t3_millis"]))]
    t3_seconds: f64,
    /// Requests all values when data transfer starts.
    #[serde(default = "default_true")]
    interrogate_on_start: bool,
    /// Period in which all values are asked for again, seconds.
    #[serde(default)]
    #[schemars(range(min = 1.0, max = 86_400.0))]
    #[schemars(extend("x-busbar-formerly" = ["interrogation_period_millis"]))]
    interrogation_period_seconds: Option<f64>,
    /// Period in which counters are asked for, at the start for the first time,
    /// seconds. Without it they are not asked for.
    #[serde(default)]
    #[schemars(range(min = 1.0, max = 86_400.0))]
    #[schemars(extend("x-busbar-formerly" = ["counter_period_millis"]))]
    counter_period_seconds: Option<f64>,
    /// Period in which the station's clock is set, at the start for the first
    /// time, seconds. Without it the clock is left alone.
    #[serde(default)]
    #[schemars(range(min = 1.0, max = 86_400.0))]
    #[schemars(extend("x-busbar-formerly" = ["clock_sync_period_millis"]))]
    clock_sync_period_seconds: Option<f64>,
    /// For stations that count local time: minutes ahead of UTC in winter. Without
    /// it the station counts UTC.
    #[serde(default)]
    #[schemars(range(min = -840, max = 840))]
    utc_offset_minutes: Option<i16>,
    /// Types of data units that carry no value of a tag, beside those that the standard
    /// has for this: private ones. Any other type that is not known makes its common
    /// address bad until it is interrogated.
    #[serde(default)]
    #[schemars(length(max = 256))]
    ignored_types: Vec<u8>,
    /// Delay between tries to connect.
    #[serde(default)]
    reconnect: ReconnectSettings,
    /// Encrypts the connections (IEC 62351-3).
    #[serde(default)]
    tls: Option<TlsSettings>,
}

/// One way to the station.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct RawEndpoint {
    /// Host name or address.
    #[schemars(length(min = 1, max = 253))]
    host: String,
    /// Port of TCP; 2404 by default.
    #[serde(default = "default_port")]
    #[schemars(range(min = 1))]
    port: u16,
}

fn default_port() -> u16 {
    2404
}

fn default_common_address() -> u16 {
    1
}

fn default_k() -> u16 {
    12
}

fn default_w() -> u16 {
    8
}

fn default_t0() -> f64 {
    30.0
}

fn default_t1() -> f64 {
    15.0
}

fn default_t2() -> f64 {
    10.0
}

fn default_t3() -> f64 {
    20.0
}

fn default_true() -> bool {
    true
}

/// Settings that have been checked.
#[derive(Clone, Debug)]
pub(crate) struct Config {
    /// At least one; the first is preferred at the start.
    pub(crate) endpoints: Vec<Endpoint>,
    pub(crate) common_address: u16,
    pub(crate) originator: u8,
    pub(crate) connect_timeout: Duration,
    pub(crate) parameters: Parameters,
    pub(crate) interrogate_on_start: bool,
    pub(crate) interrogation_period: Option<Duration>,
    pub(crate) counter_period: Option<Duration>,
    pub(crate) clock_sync_period: Option<Duration>,
    pub(crate) zone: Zone,
    pub(crate) ignored_types: Vec<u8>,
    pub(crate) reconnect: ReconnectBounds,
    pub(crate) tls: Option<TlsFiles>,
}

impl Settings {
    /// Checks all of it.
    ///
    /// # Errors
    /// [`Error::settings`] with each fault and what is allowed.
    pub(crate) fn parse(self) -> Result<Config, Error> {
        let mut faults = SettingsFaults::default();
        let tls = self.tls.map(|tls| tls.parse(&mut faults));
        let timeouts = MIN_TIMEOUT_MILLIS..=MAX_TIMEOUT_MILLIS;
        let parameters = Parameters {
            k: faults.check("k", self.k, 1..=MAX_WINDOW),
            w: faults.check("w", self.w, 1..=MAX_WINDOW),
            t1: faults.seconds("t1_seconds", self.t1_seconds, timeouts.clone()),
            t2: faults.seconds("t2_seconds", self.t2_seconds, timeouts.clone()),
            t3: faults.seconds("t3_seconds", self.t3_seconds, MIN_TIMEOUT_MILLIS..=MAX_TEST_MILLIS),
        };
        if parameters.t2 >= parameters.t1 {
            faults.add("t2_seconds: must be less than t1_seconds, or the station gives up first");
        }
        let periods = MIN_PERIOD_MILLIS..=MAX_PERIOD_MILLIS;
        let mut period = |name: &str, period: Option<f64>| {
            period.map(|period| faults.seconds(name, period, periods.clone()))
        };
        let interrogation_period =
            period("interrogation_period_seconds", self.interrogation_period_seconds);
        let counter_period = period("counter_period_seconds", self.counter_period_seconds);
        let clock_sync_period = period("clock_sync_period_seconds", self.clock_sync_period_seconds);
        let zone = self.utc_offset_minutes.map_or(Zone::Utc, |offset| Zone::Local {
            offset_minutes: faults.check(
                "utc_offset_minutes",
                offset,
                -MAX_OFFSET_MINUTES..=MAX_OFFSET_MINUTES,
            ),
        });
        let config = Config {
            endpoints: endpoints(&self.host, self.port, &self.redundancy, &mut faults),
            common_address: faults.check("common_address", self.common_address, 1..=65_534),
            originator: self.originator,
            connect_timeout: faults.seconds("t0_seconds", self.t0_seconds, timeouts),
            parameters,
            interrogate_on_start: self.interrogate_on_start,
            interrogation_period,
            counter_period,
            clock_sync_period,
            zone,
            ignored_types: ignored_types(self.ignored_types, &mut faults),
            reconnect: self.reconnect.parse(&mut faults),
            tls,
        };
        let result = faults.into_result();
        result.map(|()| config).map_err(|faults| Error::settings(format!("settings: {faults}")))
    }
}

/// Types that may be left out: those of values may not.
fn ignored_types(types: Vec<u8>, faults: &mut SettingsFaults) -> Vec<u8> {
    for type_id in types.iter().filter(|type_id| (1..=40).contains(*type_id)) {
        faults.add(format!("ignored_types: {type_id} is a type of values: leave it out"));
    }
    types
}

fn endpoints(
    host: &str,
    port: u16,
    others: &[RawEndpoint],
    faults: &mut SettingsFaults,
) -> Vec<Endpoint> {
    let mut endpoints = vec![Endpoint::parse("", host, port, faults)];
    for (index, RawEndpoint { host, port }) in others.iter().enumerate() {
        let place = format!("redundancy[{index}].");
        endpoints.push(Endpoint::parse(&place, host, *port, faults));
    }
    if endpoints.len() > MAX_CONNECTIONS {
        faults.add(format!(
            "redundancy: {} connections; at most {MAX_CONNECTIONS} are allowed",
            endpoints.len()
        ));
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
