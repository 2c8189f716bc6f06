//! Tag addresses: JSON as typed -> [`Points`], found by what a query or a payload names.

use std::collections::{BTreeMap, HashMap};

use busbar_plugin_sdk::{Error, TagSpec, Value, ValueKind, parse_states};
use serde::Deserialize;
use serde_json::Value as Json;
use source_units::TagUnit;
use text_table::StateWords;

use crate::settings::{Config, QueryConfig};

/// Tags of one instance.
const MAX_TAGS: usize = 100_000;
/// The longest key, column or name of a state, bytes.
pub(crate) const MAX_NAME_BYTES: usize = 256;

/// A tag that can be served.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Point {
    /// Handle of the tag.
    pub(crate) tag: u32,
    /// Id of the tag, for messages.
    pub(crate) id: String,
    pub(crate) kind: ValueKind,
    /// Values of the source's words for states; empty where it has numbers.
    pub(crate) states: StateWords<Value>,
    /// Unit that the source must have where it states one.
    pub(crate) unit: TagUnit,
}

/// The tags of one query.
#[derive(Debug, Default)]
pub(crate) struct Points {
    pub(crate) all: Vec<Point>,
    pub(crate) shape: Shape,
}

/// Form in which a query returns its values.
#[derive(Debug, Default)]
pub(crate) enum Shape {
    /// Query that no tag uses.
    #[default]
    Unused,
    /// One row, a column a tag; by point.
    Wide(Vec<Columns>),
    /// A row a value; points by key.
    Long(HashMap<String, Vec<usize>>),
}

/// The columns of one tag.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Columns {
    pub(crate) value: String,
    pub(crate) quality: Option<String>,
    pub(crate) time: Option<String>,
    pub(crate) unit: Option<String>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawAddress {
    query: String,
    column: Option<String>,
    key: Option<String>,
    quality: Option<String>,
    time: Option<String>,
    unit: Option<String>,
    #[serde(default)]
    states: BTreeMap<String, Json>,
}

impl RawAddress {
    /// All names besides the query's.
    fn names(&self) -> impl Iterator<Item = &String> {
        let named = [&self.column, &self.key, &self.quality, &self.time, &self.unit];
        named.into_iter().flatten().chain(self.states.keys())
    }
}

enum Place {
    Column(Columns),
    Key(String),
}

/// Parses the addresses of all tags; the result is by query, as the settings have them.
///
/// # Errors
/// [`Error::settings`] with every tag at fault, each with its remedy.
pub(crate) fn parse(tags: &[TagSpec], config: &Config) -> Result<Vec<Points>, Error> {
    if tags.len() > MAX_TAGS {
        return Err(Error::settings(format!(
            "{} tags of one database; at most {MAX_TAGS} are allowed: use several instances",
            tags.len()
        )));
    }
    let mut points: Vec<_> = config.queries.iter().map(|_| Points::default()).collect();
    let mut faults = Vec::new();
    for tag in tags {
        let parsed = parse_one(tag, &config.queries);
        let added = parsed.and_then(|(query, point, place)| points[query].add(point, place));
        faults.extend(added.err());
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

impl Points {
    /// The handles of all tags.
    pub(crate) fn tags(&self) -> impl Iterator<Item = u32> {
        self.all.iter().map(|point| point.tag)
    }

    fn add(&mut self, point: Point, place: Place) -> Result<(), String> {
        let index = self.all.len();
        if index == 0 {
            self.shape = match place {
                Place::Column(_) => Shape::Wide(Vec::new()),
                Place::Key(_) => Shape::Long(HashMap::new()),
            };
        }
        match (&mut self.shape, place) {
            (Shape::Wide(columns), Place::Column(of_tag)) => columns.push(of_tag),
            (Shape::Long(by_key), Place::Key(key)) => by_key.entry(key).or_default().push(index),
            _ => {
                return Err(format!(
                    "tag '{}': other tags of its query name their values by {}: a query gives \
                     one row with a column a tag, or a row a key, not both",
                    point.id,
                    if matches!(self.shape, Shape::Wide(_)) { "column" } else { "key" }
                ));
            }
        }
        self.all.push(point);
        Ok(())
    }
}

fn parse_one(tag: &TagSpec, queries: &[QueryConfig]) -> Result<(usize, Point, Place), String> {
    let raw: RawAddress = tag.parse_address().map_err(|error| error.message().to_owned())?;
    let fault = |what: String| format!("tag '{}': {what}", tag.id);
    let query = queries.iter().position(|query| query.name == raw.query).ok_or_else(|| {
        let names: Vec<_> = queries.iter().map(|query| query.name.as_str()).collect();
        fault(format!("there is no query of this name; there is '{}'", names.join("', '")))
    })?;
    if raw.names().any(|name| name.is_empty() || name.len() > MAX_NAME_BYTES) {
        return Err(fault(format!("a name has to have 1 to {MAX_NAME_BYTES} bytes")));
    }
    if tag.kind == ValueKind::Text && raw.unit.is_some() {
        return Err(fault("unit is that of numbers: remove it, or correct the tag's type".into()));
    }
    let place = match (raw.column, raw.key) {
        (Some(value), None) => {
            Place::Column(Columns { value, quality: raw.quality, time: raw.time, unit: raw.unit })
        }
        (None, Some(_)) if raw.quality.is_some() || raw.time.is_some() || raw.unit.is_some() => {
            return Err(fault(
                "quality, time and unit name columns beside `column`; rows with a key have the \
                 columns quality, time and unit"
                    .into(),
            ));
        }
        (None, Some(key)) => Place::Key(key),
        _ => {
            return Err(fault(
                "name the value by \"column\" (of one row) or by \"key\" (of many), by one of \
                 them"
                    .into(),
            ));
        }
    };
    let unit = if tag.kind.is_quantity() { TagUnit::new(&tag.unit) } else { TagUnit::default() };
    let states = parse_states(tag.kind, raw.states).and_then(StateWords::new).map_err(fault)?;
    Ok((query, Point { tag: tag.tag, id: tag.id.clone(), kind: tag.kind, states, unit }, place))
}

#[cfg(test)]
#[path = "points_tests.rs"]
mod tests;
