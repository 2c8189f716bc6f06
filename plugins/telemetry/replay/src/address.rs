//! Tag addresses: JSON as typed -> [`Points`].

use std::collections::BTreeMap;

use busbar_plugin_sdk::{Error, TagSpec, Value, ValueKind, parse_states};
use serde::Deserialize;
use serde_json::Value as Json;
use text_table::StateWords;

use crate::settings::{Config, Format, Values};
use crate::table::{Column, Form};

/// Tags of one recording.
const MAX_TAGS: usize = 100_000;
/// Longest unit of an address.
const MAX_UNIT_BYTES: usize = 64;

/// A tag that can be served.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Point {
    /// Handle of the tag.
    pub(crate) tag: u32,
    /// Id of the tag, for messages.
    pub(crate) id: String,
    pub(crate) kind: ValueKind,
    pub(crate) source: Source,
    /// Side of instrument transformers.
    pub(crate) values: Values,
    /// Column of the quality, in wide form.
    pub(crate) quality: Option<Column>,
    /// Words of a table for states; empty where it has those that are known.
    pub(crate) states: StateWords<Value>,
    /// Unit that the cells of a table must have where they name one: that of the address, or the
    /// tag's.
    pub(crate) unit: Option<String>,
}

/// Columns or channels of a tag's values.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Source {
    /// A channel of COMTRADE, a column, or a name in long form.
    One(Column),
    /// Two digital channels or columns: that of off, that of on.
    Two(Column, Column),
}

impl Point {
    /// Reports whether every change of the point matters.
    pub(crate) fn is_discrete(&self) -> bool {
        is_discrete(self.kind)
    }
}

/// All tags of a recording.
#[derive(Clone, Debug)]
pub(crate) struct Points(pub(crate) Vec<Point>);

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawAddress {
    channel: Option<Column>,
    column: Option<Column>,
    name: Option<String>,
    off: Option<Column>,
    on: Option<Column>,
    values: Option<Values>,
    quality: Option<Column>,
    #[serde(default)]
    states: BTreeMap<String, Json>,
    unit: Option<String>,
}

impl Points {
    /// Parses the addresses of all tags.
    ///
    /// # Errors
    /// [`Error::settings`] with every tag at fault, each with its remedy.
    pub(crate) fn parse(tags: &[TagSpec], config: &Config) -> Result<Self, Error> {
        if tags.len() > MAX_TAGS {
            return Err(Error::settings(format!(
                "{} tags of one recording; at most {MAX_TAGS} are allowed: use several instances",
                tags.len()
            )));
        }
        let (mut points, mut faults) = (Vec::with_capacity(tags.len()), Vec::new());
        for tag in tags {
            match parse_one(tag, config) {
                Ok(point) => points.push(point),
                Err(fault) => faults.push(fault),
            }
        }
        if faults.is_empty() {
            return Ok(Self(points));
        }
        Err(Error::settings(format!(
            "{} of {} tags cannot be served: {}",
            faults.len(),
            tags.len(),
            faults.join("; ")
        )))
    }
}

fn parse_one(tag: &TagSpec, config: &Config) -> Result<Point, String> {
    let raw: RawAddress = tag.parse_address().map_err(|error| error.message().to_owned())?;
    let fault = |what: &str| Err(format!("tag '{}': {what}", tag.id));
    let is_comtrade = config.format == Format::Comtrade;
    let is_long = !is_comtrade && config.csv.form == Form::Long;
    if raw.values.is_some() && !is_comtrade {
        return fault("values is for COMTRADE: remove it");
    }
    if raw.quality.is_some() && (is_comtrade || is_long) {
        return fault("quality is for CSV in wide form: remove it");
    }
    if is_comtrade && (raw.unit.is_some() || !raw.states.is_empty()) {
        return fault("unit and states are for CSV: remove them");
    }
    if tag.kind == ValueKind::Text && is_comtrade {
        return fault("COMTRADE has no texts: take the tag from CSV, or correct its type");
    }
    if tag.kind == ValueKind::Text && raw.unit.is_some() {
        return fault("unit is that of numbers: remove it");
    }
    if raw.unit.as_ref().is_some_and(|unit| unit.trim().is_empty() || unit.len() > MAX_UNIT_BYTES) {
        return fault(&format!("a unit has 1 to {MAX_UNIT_BYTES} bytes"));
    }
    let states = parse_states(tag.kind, raw.states).and_then(StateWords::new);
    let states = states.map_err(|what| format!("tag '{}': {what}", tag.id))?;
    let named = raw.name.map(Column::Name);
    let (one, expected) = match (is_comtrade, is_long) {
        (true, _) => (raw.channel.clone(), "{\"channel\": \"IA\"}"),
        (_, true) => (named.clone(), "{\"name\": \"T1.Oil\"}"),
        _ => (raw.column.clone(), "{\"column\": \"Oil\"}"),
    };
    let given = [&raw.channel, &raw.column, &named].iter().filter(|field| field.is_some()).count();
    let source = match (one, raw.off, raw.on) {
        (Some(one), None, None) if given == 1 => Source::One(one),
        (None, Some(off), Some(on))
            if given == 0 && tag.kind == ValueKind::DoublePoint && !is_long =>
        {
            Source::Two(off, on)
        }
        (None, Some(_), _) | (None, _, Some(_)) => {
            return fault(
                "off and on go together, for a double_point of COMTRADE or of CSV in wide form",
            );
        }
        _ => return fault(&format!("its address must be as {expected}")),
    };
    let columns = match &source {
        Source::One(one) => vec![one],
        Source::Two(off, on) => vec![off, on],
    };
    if columns.into_iter().chain(&raw.quality).any(|column| *column == Column::Number(0)) {
        return fault("channels and columns are counted from 1");
    }
    if is_comtrade && tag.kind == ValueKind::DoublePoint && matches!(source, Source::One(_)) {
        return fault("a double_point is two channels: {\"off\": \"CB_OFF\", \"on\": \"CB_ON\"}");
    }
    if raw.values.is_some() && is_discrete(tag.kind) {
        return fault("values is for numbers: remove it");
    }
    Ok(Point {
        tag: tag.tag,
        id: tag.id.clone(),
        kind: tag.kind,
        source,
        values: raw.values.unwrap_or(config.values),
        quality: raw.quality,
        states,
        unit: raw.unit.or_else(|| tag_unit(tag)).map(|unit| unit.trim().to_owned()),
    })
}

/// Unit that samples of the tag must have, where it is known.
fn tag_unit(tag: &TagSpec) -> Option<String> {
    let is_unit = |unit: &String| tag.kind != ValueKind::Text && !unit.trim().is_empty();
    Some(tag.unit.clone()).filter(is_unit)
}

/// Reports whether every change of such a tag matters.
fn is_discrete(kind: ValueKind) -> bool {
    !kind.is_quantity()
}

#[cfg(test)]
#[path = "address_tests.rs"]
mod tests;
