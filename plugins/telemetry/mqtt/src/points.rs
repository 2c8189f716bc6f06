//! Tag addresses: JSON as typed -> points and where their values are.

use std::borrow::Borrow;
use std::collections::BTreeMap;

use busbar_plugin_sdk::{Error, TagSpec, Value, ValueKind};
use serde::Deserialize;
use source_units::TagUnit;

use crate::convert::Mapping;
use crate::names::{MAX_TEXT, check_name, check_pointer, check_topic};
use crate::payload_format::{ByteOrder, BytesForm, FormatName, PayloadFormat, RawFormat};
use crate::source_time::TimeUnit;

/// Tags of one cluster of brokers.
const MAX_TAGS: usize = 1_000_000;
/// Tags at fault that one error names.
const MAX_FAULTS_TOLD: usize = 20;
/// Words of one tag's `values`.
const MAX_VALUES: usize = 100;

/// A tag that can be served.
#[derive(Clone, Debug)]
pub(crate) struct Point {
    /// Handle of the tag.
    pub(crate) tag: u32,
    /// Id of the tag, for messages.
    pub(crate) id: Box<str>,
    pub(crate) mapping: Mapping,
    /// Unit that the source must have where it states one; none where values are scaled.
    pub(crate) unit: TagUnit,
}

/// Source of a point's value: a topic or a Sparkplug metric.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Place {
    Topic { topic: String, pointers: Pointers },
    Metric(MetricPlace),
}

/// Metric of Sparkplug B; without a device it is the edge node's own.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct MetricPlace {
    pub(crate) group: String,
    pub(crate) edge_node: String,
    pub(crate) device: Option<String>,
    pub(crate) metric: String,
}

/// Places of value, time, quality and unit in a JSON payload (RFC 6901), and their forms. Without
/// a place of the value, the payload is the value.
#[derive(Clone, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Pointers {
    pub(crate) value: Option<String>,
    pub(crate) time: Option<String>,
    pub(crate) quality: Option<String>,
    pub(crate) unit: Option<String>,
    /// Unit of counts of time, if the address has another than the settings.
    pub(crate) time_unit: Option<TimeUnit>,
    pub(crate) format: PayloadFormat,
}

/// Parses the addresses of all tags, each of which may go once it is parsed; points come in
/// order of their places.
///
/// # Errors
/// [`Error::settings`] with the tags at fault, each with its remedy.
pub(crate) fn parse<T: Borrow<TagSpec>>(
    tags: impl ExactSizeIterator<Item = T>,
) -> Result<Vec<(Place, Point)>, Error> {
    let count = tags.len();
    if count > MAX_TAGS {
        return Err(Error::settings(format!(
            "{count} tags; at most {MAX_TAGS} are allowed: use several instances"
        )));
    }
    let (mut points, mut told, mut faults) = (Vec::with_capacity(count), Vec::new(), 0);
    for tag in tags {
        match parse_one(tag.borrow()) {
            Ok(point) => points.push(point),
            Err(fault) => {
                faults += 1;
                told.extend((faults <= MAX_FAULTS_TOLD).then_some(fault));
            }
        }
    }
    if faults > 0 {
        return Err(Error::settings(format!(
            "{faults} of {count} tags cannot be served: {}",
            told.join("; ")
        )));
    }
    points.sort_by(|(place, _), (other, _)| place.cmp(other));
    Ok(points)
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawAddress {
    topic: Option<String>,
    pointer: Option<String>,
    time: Option<String>,
    quality: Option<String>,
    unit: Option<String>,
    group: Option<String>,
    edge_node: Option<String>,
    device: Option<String>,
    metric: Option<String>,
    time_unit: Option<TimeUnit>,
    format: Option<FormatName>,
    byte_order: Option<ByteOrder>,
    word_order: Option<ByteOrder>,
    byte: Option<u32>,
    bytes: Option<BytesForm>,
    scale: Option<f64>,
    offset: Option<f64>,
    #[serde(default)]
    values: BTreeMap<String, serde_json::Value>,
}

fn parse_one(tag: &TagSpec) -> Result<(Place, Point), String> {
    let raw: RawAddress = tag.parse_address().map_err(|error| error.message().to_owned())?;
    let fault = |what: String| format!("tag '{}': {what}", tag.id);
    let mapping = mapping_of(tag.kind, &raw).map_err(fault)?;
    let is_number = tag.kind.is_quantity();
    let is_scaled = raw.scale.is_some() || raw.offset.is_some();
    if raw.unit.is_some() && (is_scaled || !is_number) {
        return Err(fault(
            "unit is that of numbers as they come: remove it, or scale and offset".into(),
        ));
    }
    let unit = if is_number && !is_scaled { TagUnit::new(&tag.unit) } else { TagUnit::default() };
    let point = Point { tag: tag.tag, id: tag.id.as_str().into(), mapping, unit };
    Ok((place_of(raw).map_err(fault)?, point))
}

impl RawAddress {
    fn format(&self) -> RawFormat {
        RawFormat {
            format: self.format,
            byte_order: self.byte_order,
            word_order: self.word_order,
            byte: self.byte,
            bytes: self.bytes,
        }
    }
}

fn place_of(raw: RawAddress) -> Result<Place, String> {
    let (format, time_unit) = (raw.format(), raw.time_unit);
    let RawAddress {
        topic, pointer, time, quality, unit, group, edge_node, device, metric, ..
    } = raw;
    match (topic, group, edge_node, metric) {
        (Some(topic), None, None, None) if device.is_none() => {
            check_topic(&topic)?;
            let pointers =
                [("pointer", &pointer), ("time", &time), ("quality", &quality), ("unit", &unit)];
            for (name, pointer) in pointers {
                check_pointer(pointer.as_deref()).map_err(|fault| format!("{name}: {fault}"))?;
            }
            if pointer.is_none() && (time.is_some() || quality.is_some() || unit.is_some()) {
                return Err(
                    "time, quality and unit are parts of a JSON payload: say by pointer where \
                            the value is in it"
                        .into(),
                );
            }
            if time_unit.is_some() && time.is_none() {
                return Err("time_unit is of counts of time: say by time where they are".into());
            }
            let format = format.parse(pointer.is_some())?;
            let value = pointer;
            Ok(Place::Topic {
                topic,
                pointers: Pointers { value, time, quality, unit, time_unit, format },
            })
        }
        (None, Some(group), Some(edge_node), Some(metric)) => {
            if pointer.is_some() || time.is_some() || quality.is_some() || unit.is_some() {
                return Err("a metric has its own time, quality and unit: remove pointer, time, \
                            quality and unit"
                    .into());
            }
            if !format.is_empty() || time_unit.is_some() {
                return Err("a metric has its own type, and its time is in milliseconds: remove \
                            format, byte_order, word_order, byte, bytes and time_unit"
                    .into());
            }
            check_name("group", &group)?;
            check_name("edge_node", &edge_node)?;
            device.as_deref().map_or(Ok(()), |device| check_name("device", device))?;
            if metric.is_empty() || metric.len() > MAX_TEXT {
                return Err(format!("metric: give 1 to {MAX_TEXT} bytes"));
            }
            Ok(Place::Metric(MetricPlace { group, edge_node, device, metric }))
        }
        _ => Err("name either a topic, or group, edge_node and metric (and device)".into()),
    }
}

fn mapping_of(kind: ValueKind, raw: &RawAddress) -> Result<Mapping, String> {
    if kind != ValueKind::F64 && (raw.scale.is_some() || raw.offset.is_some()) {
        return Err("scale and offset are for f64 tags: remove them, or make the tag f64".into());
    }
    let (scale, offset) = (raw.scale.unwrap_or(1.0), raw.offset.unwrap_or(0.0));
    if !scale.is_finite() || scale == 0.0 || !offset.is_finite() {
        return Err("scale must be finite and not 0, offset finite".into());
    }
    if kind == ValueKind::Text && !raw.values.is_empty() {
        return Err("values are names of numbers and states: remove them, for a text tag has the \
                    text itself"
            .into());
    }
    if kind == ValueKind::Text && matches!(raw.format, Some(FormatName::F32 | FormatName::F64)) {
        return Err(
            "format: a text tag takes texts and whole numbers: set it to text, hex, u8, i16 \
                    or the like, or make the tag f64"
                .into(),
        );
    }
    if raw.values.len() > MAX_VALUES {
        return Err(format!("values: at most {MAX_VALUES} are allowed"));
    }
    let parse = |(text, value): (&String, &serde_json::Value)| -> Result<(String, Value), String> {
        let parsed = match value {
            serde_json::Value::Number(_) | serde_json::Value::Bool(_) => {
                kind.parse(&value.to_string())
            }
            _ => None,
        };
        let parsed = parsed.ok_or_else(|| {
            format!("values: '{text}' stands for {value}, which the tag's type does not have")
        })?;
        Ok((text.trim().to_owned(), parsed))
    };
    let values = raw.values.iter().map(parse).collect::<Result<_, _>>()?;
    Ok(Mapping { kind, scale, offset, values })
}

#[cfg(test)]
#[path = "points_tests.rs"]
mod tests;
