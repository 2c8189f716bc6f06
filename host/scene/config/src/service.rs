//! Log file and metrics of an unattended view.

use std::net::SocketAddr;

use schemars::JsonSchema;
use serde::Deserialize;
use serde_json::Value;

use crate::limits::*;
use crate::report::Report;

/// The log of `busbar view` as a file, besides standard error. Arguments go before.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
#[schemars(rename = "Log")]
pub(crate) struct RawLog {
    /// The file, relative to this one or absolute; where missing there is none.
    #[schemars(length(min = 1, max = MAX_PATH_BYTES), extend("examples" = ["busbar.log"]))]
    file: Option<String>,
    /// Format of its lines.
    #[schemars(extend("examples" = ["text"]))]
    format: LogFormatConfig,
    /// Size at which a new file begins, in 10^6 bytes.
    #[schemars(range(min = 1, max = MAX_VIEW_LOG_MEGABYTES), extend("examples" = [16]))]
    megabytes: u32,
    /// Files that are kept, the newest included.
    #[schemars(range(min = 1, max = MAX_VIEW_LOG_FILES), extend("examples" = [10]))]
    files: u32,
}

impl Default for RawLog {
    fn default() -> Self {
        Self { file: None, format: LogFormatConfig::Text, megabytes: 16, files: 10 }
    }
}

impl RawLog {
    pub(crate) fn resolve(self) -> Option<LogConfig> {
        let Self { file, format, megabytes, files } = self;
        Some(LogConfig { file: file?, format, megabytes, files })
    }
}

/// Numbers of `busbar view` for Prometheus. Arguments go before.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "Metrics")]
pub(crate) struct RawMetrics {
    /// Address and port where they are served, at /metrics.
    #[schemars(length(min = 1, max = MAX_ADDRESS_BYTES))]
    #[schemars(extend("examples" = ["127.0.0.1:9187"]))]
    address: String,
    /// Allows other machines to read the metrics.
    #[serde(default)]
    #[schemars(extend("examples" = [false]))]
    public: bool,
}

impl RawMetrics {
    /// The rules ensure that it is an address.
    pub(crate) fn resolve(self) -> Option<MetricsConfig> {
        Some(MetricsConfig { address: self.address.parse().ok()?, public: self.public })
    }
}

/// Format of a log file's lines.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
#[schemars(rename = "LogFormat")]
pub enum LogFormatConfig {
    /// Plain text for people.
    #[default]
    Text,
    /// An object of JSON a line.
    Json,
}

/// A log file, rotated by size.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LogConfig {
    /// Path as written: relative to the configuration file, or absolute.
    pub file: String,
    /// Format of its lines.
    pub format: LogFormatConfig,
    /// Size at which a new file begins, in 10^6 bytes.
    pub megabytes: u32,
    /// Files that are kept, the newest included.
    pub files: u32,
}

/// Address on which metrics are served.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MetricsConfig {
    /// Socket address, of this machine alone unless the metrics are public.
    pub address: SocketAddr,
    /// True where other machines may read the metrics.
    pub public: bool,
}

/// Reports an address that is none, or that others reach and shall not.
pub(crate) fn check(document: &Value, report: &mut Report<'_>) {
    const POINTER: &str = "/metrics/address";
    let metrics = &document["metrics"];
    let Some(text) = metrics["address"].as_str() else { return };
    match text.parse::<SocketAddr>() {
        Err(_) => report.error(
            POINTER,
            format!("'{text}' is no address with a port"),
            "write an IP address and a port, such as \"127.0.0.1:9187\"",
        ),
        Ok(address) if !address.ip().is_loopback() && metrics["public"] != true => report.error(
            POINTER,
            format!("{address} can be reached from other machines"),
            "serve metrics at 127.0.0.1, or add \"public\": true",
        ),
        Ok(_) => {}
    }
}
