//! Tag addresses: JSON as typed -> [`Points`], by the monitored item that serves them.

use std::collections::{BTreeMap, HashMap};
use std::time::Duration;

use busbar_plugin_sdk::{Error, TagSpec, Value, ValueKind, parse_states};
use serde::Deserialize;
use serde_json::Value as Json;
use source_units::TagUnit;

use crate::conditions::Field;
use crate::node::NodeAddress;
use crate::settings::{Config, MAX_SAMPLING_MILLIS};

/// Tags of one server.
const MAX_TAGS: usize = 100_000;
/// Values of one item that a server may keep between two publishing intervals.
const MAX_QUEUE: u32 = 1000;
/// The last bit of an integer.
const MAX_BIT: u8 = 63;

/// A tag that can be served.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Point {
    /// Handle of the tag.
    pub(crate) tag: u32,
    /// Id of the tag, for messages.
    pub(crate) id: String,
    pub(crate) kind: ValueKind,
    pub(crate) freshness: Duration,
    /// Index of the array element that is the tag.
    pub(crate) index: Option<usize>,
    /// Bit of an integer that is the tag.
    pub(crate) bit: Option<u8>,
    pub(crate) scale: f64,
    pub(crate) offset: f64,
    /// Unit that the node must have where it states one; none where values are scaled.
    pub(crate) unit: TagUnit,
    /// Values of the tag by text, number or truth value; empty where the value needs no mapping.
    pub(crate) states: BTreeMap<String, Value>,
}

/// Monitored item, which all tags of the same node and parameters share.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Item {
    pub(crate) node: NodeAddress,
    pub(crate) sampling: Duration,
    pub(crate) deadband: Deadband,
    pub(crate) queue: u32,
    /// Indices of the points that the item serves.
    pub(crate) points: Vec<usize>,
}

/// Deadband below which changes are not reported (OPC 10000-4, 7.22.2).
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Deadband {
    None,
    /// Absolute deadband, in the unit of the value.
    Absolute(f64),
    /// Percent deadband, of the range EURange.
    Percent(f64),
}

/// Alarm condition and its fields that are points.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Condition {
    pub(crate) node: NodeAddress,
    pub(crate) points: Vec<(usize, Field)>,
}

/// All tags of a server, with their monitored items and conditions.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Points {
    pub(crate) all: Vec<Point>,
    pub(crate) items: Vec<Item>,
    pub(crate) conditions: Vec<Condition>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawAddress {
    node: Option<String>,
    condition: Option<String>,
    field: Option<Field>,
    index: Option<u32>,
    bit: Option<u8>,
    scale: Option<f64>,
    offset: Option<f64>,
    #[serde(default)]
    states: BTreeMap<String, Json>,
    sampling_seconds: Option<f64>,
    /// Former name of `sampling_seconds`, in milliseconds.
    sampling_millis: Option<f64>,
    deadband: Option<f64>,
    deadband_percent: Option<f64>,
    queue: Option<u32>,
}

impl RawAddress {
    /// Returns the sampling interval, seconds.
    fn sampling(&self) -> Option<f64> {
        self.sampling_seconds.or_else(|| Some(self.sampling_millis? / 1_000.0))
    }
}

/// Source of a tag: a monitored item or a condition.
enum Place {
    Item(Item),
    Condition(NodeAddress, Field),
}

/// Key by which tags share a monitored item: node, sampling interval, deadband and queue size.
#[derive(PartialEq, Eq, Hash)]
struct ItemKey(NodeAddress, Duration, [u64; 2], u32);

impl Points {
    /// Parses the addresses of all tags.
    ///
    /// # Errors
    /// [`Error::settings`] with every tag at fault, each with its remedy.
    pub(crate) fn parse(tags: &[TagSpec], config: &Config) -> Result<Self, Error> {
        if tags.len() > MAX_TAGS {
            return Err(Error::settings(format!(
                "{} tags of one server; at most {MAX_TAGS} are allowed: use several instances",
                tags.len()
            )));
        }
        let (mut points, mut faults) = (Self::default(), Vec::new());
        let mut by_key: HashMap<ItemKey, usize> = HashMap::new();
        let mut by_condition: HashMap<NodeAddress, usize> = HashMap::new();
        for tag in tags {
            match parse_one(tag, config) {
                Ok((point, Place::Item(item))) => points.add(point, item, &mut by_key),
                Ok((point, Place::Condition(node, field))) => {
                    points.add_to_condition(point, node, field, &mut by_condition);
                }
                Err(fault) => faults.push(fault),
            }
        }
        if faults.is_empty() {
            return Ok(points);
        }
        Err(Error::settings(format!(
            "{} of {} tags cannot be served: {}",
            faults.len(),
            tags.len(),
            faults.join("; ")
        )))
    }

    /// Returns the handles of all tags.
    pub(crate) fn tags(&self) -> impl Iterator<Item = u32> {
        self.all.iter().map(|point| point.tag)
    }

    fn add(&mut self, point: Point, item: Item, by_key: &mut HashMap<ItemKey, usize>) {
        let index = self.all.len();
        self.all.push(point);
        let deadband = match item.deadband {
            Deadband::None => [0, 0],
            Deadband::Absolute(value) => [1, value.to_bits()],
            Deadband::Percent(value) => [2, value.to_bits()],
        };
        let key = ItemKey(item.node.clone(), item.sampling, deadband, item.queue);
        let place = *by_key.entry(key).or_insert_with(|| {
            self.items.push(item);
            self.items.len() - 1
        });
        self.items[place].points.push(index);
    }

    fn add_to_condition(
        &mut self,
        point: Point,
        node: NodeAddress,
        field: Field,
        by_condition: &mut HashMap<NodeAddress, usize>,
    ) {
        let index = self.all.len();
        self.all.push(point);
        let place = *by_condition.entry(node.clone()).or_insert_with(|| {
            self.conditions.push(Condition { node, points: Vec::new() });
            self.conditions.len() - 1
        });
        self.conditions[place].points.push((index, field));
    }
}

fn parse_one(tag: &TagSpec, config: &Config) -> Result<(Point, Place), String> {
    let raw: RawAddress = tag.parse_address().map_err(|error| error.message().to_owned())?;
    let fault = |what: String| format!("tag '{}': {what}", tag.id);
    check_numbers(tag.kind, &raw).map_err(fault)?;
    let place = match (&raw.node, &raw.condition, raw.field) {
        (Some(node), None, None) => {
            Place::Item(item_of(NodeAddress::parse(node).map_err(fault)?, &raw, config))
        }
        (None, Some(condition), Some(field)) => {
            check_condition(tag.kind, &raw, field).map_err(fault)?;
            Place::Condition(NodeAddress::parse(condition).map_err(fault)?, field)
        }
        _ => return Err(fault("give node, or condition and field, one of them".into())),
    };
    let is_scaled = raw.scale.is_some() || raw.offset.is_some();
    let is_compared = tag.kind.is_quantity() && !is_scaled && raw.states.is_empty();
    let point = Point {
        tag: tag.tag,
        id: tag.id.clone(),
        kind: tag.kind,
        freshness: tag.freshness,
        index: raw.index.map(|index| index as usize),
        bit: raw.bit,
        scale: raw.scale.unwrap_or(1.0),
        offset: raw.offset.unwrap_or(0.0),
        unit: if is_compared { TagUnit::new(&tag.unit) } else { TagUnit::default() },
        states: parse_states(tag.kind, raw.states).map_err(fault)?,
    };
    Ok((point, place))
}

fn item_of(node: NodeAddress, raw: &RawAddress, config: &Config) -> Item {
    Item {
        node,
        sampling: raw.sampling().map_or(config.sampling, Duration::from_secs_f64),
        deadband: match (raw.deadband, raw.deadband_percent) {
            (Some(value), _) => Deadband::Absolute(value),
            (None, Some(percent)) => Deadband::Percent(percent),
            (None, None) => Deadband::None,
        },
        queue: raw.queue.unwrap_or(1),
        points: Vec::new(),
    }
}

fn check_condition(kind: ValueKind, raw: &RawAddress, field: Field) -> Result<(), String> {
    if !field.suits(kind) {
        return Err("Severity is an i64 or f64, all other fields are bool: correct the type".into());
    }
    let has_more = raw.index.is_some()
        || raw.bit.is_some()
        || raw.scale.is_some()
        || raw.offset.is_some()
        || !raw.states.is_empty()
        || raw.sampling().is_some()
        || raw.deadband.is_some()
        || raw.deadband_percent.is_some()
        || raw.queue.is_some();
    if has_more {
        return Err("a condition has a field and nothing else: remove the rest".into());
    }
    Ok(())
}

fn check_numbers(kind: ValueKind, raw: &RawAddress) -> Result<(), String> {
    if (raw.scale.is_some() || raw.offset.is_some()) && kind != ValueKind::F64 {
        return Err("scale and offset are for f64 tags: remove them".into());
    }
    let numbers = [("scale", raw.scale), ("offset", raw.offset)];
    let numbers = numbers.into_iter().filter_map(|(name, value)| Some((name, value?)));
    for (name, value) in numbers {
        if !value.is_finite() || name == "scale" && value == 0.0 {
            return Err(format!("{name}: {value} is no number to calculate with"));
        }
    }
    if raw.bit.is_some() && (kind != ValueKind::Bool || !raw.states.is_empty()) {
        return Err("bit is for bool tags without states: remove it".into());
    }
    if raw.bit.is_some_and(|bit| bit > MAX_BIT) {
        return Err(format!("bit: 0 to {MAX_BIT}, 0 the lowest"));
    }
    if kind == ValueKind::Text && !raw.states.is_empty() {
        return Err(
            "states are for bool and double_point tags, a text is taken as it is: remove them"
                .into(),
        );
    }
    if kind == ValueKind::Text && (raw.deadband.is_some() || raw.deadband_percent.is_some()) {
        return Err("a text has no deadband: remove deadband and deadband_percent".into());
    }
    if raw.deadband.is_some() && raw.deadband_percent.is_some() {
        return Err("give deadband or deadband_percent, not both".into());
    }
    if raw.deadband.is_some_and(|band| !(band.is_finite() && band > 0.0)) {
        return Err("deadband: give a number above 0, in units of the node".into());
    }
    if raw.deadband_percent.is_some_and(|band| !(band > 0.0 && band <= 100.0)) {
        return Err("deadband_percent: above 0, at most 100".into());
    }
    let most = MAX_SAMPLING_MILLIS as f64 / 1_000.0;
    if raw.sampling().is_some_and(|sampling| !(0.0..=most).contains(&sampling)) {
        return Err(format!("sampling_seconds: 0 to {most}"));
    }
    if raw.sampling_seconds.is_some() && raw.sampling_millis.is_some() {
        return Err("sampling_millis is a former name of sampling_seconds: remove it".into());
    }
    if raw.queue.is_some_and(|queue| !(1..=MAX_QUEUE).contains(&queue)) {
        return Err(format!("queue: 1 to {MAX_QUEUE}"));
    }
    Ok(())
}

#[cfg(test)]
#[path = "points_tests.rs"]
mod tests;
