//! Payload formats in which stations publish their points.

use std::time::{SystemTime, UNIX_EPOCH};

use busbar_tags::TagHandle;
use busbar_types::ValueKind;
use clap::ValueEnum;
use serde::Serialize;
use serde_json::{Value, json};
use srad_types::payload::{DataType, Message, Metric, Payload, metric};

use busbar_plugin_host::TelemetryTag;

/// Number of points in one JSON document, as of a bay.
pub(crate) const POINTS_A_DOCUMENT: u32 = 100;
/// Freshness limit of the tags: longer than any measurement.
const FRESHNESS: std::time::Duration = std::time::Duration::from_secs(600);
const GROUP: &str = "bench";
const DEVICE: &str = "station";

/// Payload format of messages.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, ValueEnum)]
#[serde(rename_all = "lowercase")]
pub(crate) enum PayloadFormat {
    /// Sparkplug B: one message a station with all of its points, by alias.
    Sparkplug,
    /// A JSON document for every [`POINTS_A_DOCUMENT`] points.
    Json,
    /// Plain text: one topic and one text for each point.
    Text,
}

/// Message of a station to be published.
pub(crate) struct Outgoing {
    pub(crate) topic: String,
    pub(crate) payload: Vec<u8>,
}

impl PayloadFormat {
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Sparkplug => "sparkplug",
            Self::Json => "json",
            Self::Text => "text",
        }
    }

    /// Returns the topics that the plugin subscribes to.
    pub(crate) fn subscriptions(self) -> Vec<&'static str> {
        match self {
            Self::Sparkplug => Vec::new(),
            Self::Json | Self::Text => vec!["s/#"],
        }
    }

    /// Returns the tags of a number of stations.
    pub(crate) fn tags(self, stations: u32, points: u32) -> Vec<TelemetryTag> {
        let all = (0..stations).flat_map(|station| (0..points).map(move |point| (station, point)));
        let tag = |(tag, (station, point)): (u32, (u32, u32))| TelemetryTag {
            tag: TagHandle(tag),
            kind: ValueKind::I64,
            freshness: FRESHNESS,
            id: format!("S{station}.P{point}"),
            address_json: self.address(station, point).to_string(),
            unit: String::new(),
        };
        (0..).zip(all).map(tag).collect()
    }

    fn address(self, station: u32, point: u32) -> Value {
        match self {
            Self::Sparkplug => json!({
                "group": GROUP, "edge_node": station.to_string(), "device": DEVICE,
                "metric": metric_name(point)
            }),
            Self::Json => json!({
                "topic": document_topic(station, point / POINTS_A_DOCUMENT),
                "pointer": format!("/p{}", point % POINTS_A_DOCUMENT)
            }),
            Self::Text => json!({ "topic": format!("s/{station}/{point}") }),
        }
    }

    /// Returns the birth certificates that a station sends before its first values.
    pub(crate) fn births(self, station: u32, points: u32, now: i64) -> Vec<Outgoing> {
        if self != Self::Sparkplug {
            return Vec::new();
        }
        let bd_seq = Metric {
            name: Some("bdSeq".into()),
            datatype: Some(DataType::Int64 as u32),
            value: Some(metric::Value::LongValue(0)),
            ..Metric::default()
        };
        let named = |point| Metric {
            name: Some(metric_name(point)),
            alias: Some(point.into()),
            datatype: Some(DataType::Int64 as u32),
            value: Some(metric::Value::LongValue(now as u64)),
            ..Metric::default()
        };
        let of_node = sparkplug("NBIRTH", station, None, vec![bd_seq], 0);
        let metrics = (0..points).map(named).collect();
        vec![of_node, sparkplug("DBIRTH", station, Some(DEVICE), metrics, 1)]
    }

    /// Encodes one round of values of a station, each the instant of its publication.
    pub(crate) fn data(self, station: u32, points: u32, round: u64, now: i64) -> Vec<Outgoing> {
        match self {
            Self::Sparkplug => {
                let value = |point: u32| Metric {
                    alias: Some(point.into()),
                    value: Some(metric::Value::LongValue(now as u64)),
                    ..Metric::default()
                };
                let metrics = (0..points).map(value).collect();
                vec![sparkplug("DDATA", station, Some(DEVICE), metrics, (round + 2) % 256)]
            }
            Self::Json => {
                let document = |index: u32| {
                    let first = index * POINTS_A_DOCUMENT;
                    let count = POINTS_A_DOCUMENT.min(points - first);
                    let values: Vec<_> = (0..count).map(|p| format!("\"p{p}\":{now}")).collect();
                    let payload = format!("{{{}}}", values.join(",")).into_bytes();
                    Outgoing { topic: document_topic(station, index), payload }
                };
                (0..points.div_ceil(POINTS_A_DOCUMENT)).map(document).collect()
            }
            Self::Text => (0..points)
                .map(|point| Outgoing {
                    topic: format!("s/{station}/{point}"),
                    payload: now.to_string().into_bytes(),
                })
                .collect(),
        }
    }
}

fn metric_name(point: u32) -> String {
    format!("bay{}/point{}", point / POINTS_A_DOCUMENT, point % POINTS_A_DOCUMENT)
}

fn document_topic(station: u32, index: u32) -> String {
    format!("s/{station}/bay{index}")
}

fn sparkplug(
    kind: &str,
    station: u32,
    device: Option<&str>,
    metrics: Vec<Metric>,
    sequence: u64,
) -> Outgoing {
    let tail = device.map(|device| format!("/{device}")).unwrap_or_default();
    let since = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
    let timestamp = u64::try_from(since.as_millis()).ok();
    let payload = Payload { timestamp, metrics, seq: Some(sequence), ..Payload::default() };
    Outgoing {
        topic: format!("spBv1.0/{GROUP}/{kind}/{station}{tail}"),
        payload: payload.encode_to_vec(),
    }
}
