//! Variables -> rows of a point list for `busbar import`.

use std::collections::HashMap;
use std::io::{self, Write};

use async_opcua::types::{AttributeId, NodeId, Variant};

use super::attributes::{Reader, given};
use super::browse::{Found, Variable};
use super::data_type::{DataType, DataTypes, Nature};
use super::references::Browser;
use super::variable::{Attributes, Meaning, Properties, Shape, meaning, settle};
use crate::fault::{Fault, in_words};
use crate::node::NodeAddress;

/// Variables that are read at once.
const CHUNK: usize = 1000;
/// Rows, as many as one instance serves.
const MAX_ROWS: usize = 100_000;
/// The longest id and description, and the longest unit, bytes, as a configuration has them.
const MAX_NAME_BYTES: usize = 200;
const MAX_UNIT_BYTES: usize = 32;
const HEADER: &str = "tag,description,type,unit,low,high,address.node,address.index,address.states";
/// Attributes that are read of each variable, in the order of [`Attributes`].
const ATTRIBUTES: [AttributeId; 6] = [
    AttributeId::DataType,
    AttributeId::ValueRank,
    AttributeId::ArrayDimensions,
    AttributeId::AccessLevel,
    AttributeId::UserAccessLevel,
    AttributeId::Description,
];

/// Variables that can be tags, and those that cannot.
#[derive(Debug, Default)]
pub(crate) struct Listing {
    pub(super) rows: Vec<Row>,
    /// Paths of refused variables, each with the reason.
    pub(super) refused: Vec<(String, String)>,
    pub(super) remarks: Vec<String>,
}

/// A value that can be a tag.
#[derive(Debug)]
pub(super) struct Row {
    tag: String,
    description: String,
    meaning: Meaning,
    unit: String,
    range: Option<[f64; 2]>,
    node: String,
    index: Option<usize>,
}

/// Reads the attributes and properties of all variables and lists them.
///
/// # Errors
/// Faults of the connection.
pub(super) async fn list_variables(
    found: Found,
    browser: &mut Browser<'_>,
    reader: &mut Reader<'_>,
) -> Result<Listing, Fault> {
    let mut listing = Listing { remarks: found.remarks, ..Listing::default() };
    let mut types = DataTypes::default();
    for chunk in found.variables.chunks(CHUNK) {
        if listing.rows.len() > MAX_ROWS {
            break;
        }
        let mut known = Vec::new();
        for (variable, attributes) in chunk.iter().zip(attributes_of(chunk, reader).await?) {
            match known_of(&attributes, &mut types, browser, reader).await? {
                Ok((data_type, shape)) => {
                    known.push(Known { variable, attributes, data_type, shape })
                }
                Err(why) => listing.refuse(variable, why),
            }
        }
        let values = values_of(&known, reader).await?;
        let properties = properties_of(&known, reader).await?;
        for ((known, value), properties) in known.iter().zip(values).zip(&properties) {
            match settle(known.data_type.nature, known.shape, value.as_ref()) {
                Ok((nature, shape)) => {
                    listing.add(known, nature, shape, properties, browser.namespaces);
                }
                Err(why) => listing.refuse(known.variable, why),
            }
        }
    }
    listing.finish();
    Ok(listing)
}

/// A variable, of which the attributes are known.
struct Known<'a> {
    variable: &'a Variable,
    attributes: Attributes,
    data_type: DataType,
    shape: Option<Shape>,
}

impl Known<'_> {
    fn needs_value(&self) -> bool {
        self.shape.is_none() || self.data_type.nature == Nature::Any
    }
}

async fn attributes_of(
    variables: &[Variable],
    reader: &mut Reader<'_>,
) -> Result<Vec<Attributes>, Fault> {
    let wanted: Vec<_> = variables
        .iter()
        .flat_map(|variable| ATTRIBUTES.map(|attribute| (variable.node.clone(), attribute)))
        .collect();
    let mut values = reader.read(&wanted).await?.into_iter().map(given);
    let mut next = || values.next().unwrap_or(Ok(Variant::Empty));
    let attributes = variables.iter().map(|_| Attributes {
        data_type: next(),
        rank: next(),
        dimensions: next(),
        access: next(),
        user_access: next(),
        description: next(),
    });
    Ok(attributes.collect())
}

/// Data type and shape, or why it can be no tag.
async fn known_of(
    attributes: &Attributes,
    types: &mut DataTypes,
    browser: &mut Browser<'_>,
    reader: &mut Reader<'_>,
) -> Result<Result<(DataType, Option<Shape>), String>, Fault> {
    if let Some(why) = attributes.refusal() {
        return Ok(Err(why));
    }
    let node = match &attributes.data_type {
        Ok(Variant::NodeId(node)) => node,
        Ok(_) => return Ok(Err("the server does not tell its data type".into())),
        Err(status) => return Ok(Err(format!("its DataType: {}", in_words(*status)))),
    };
    let data_type = types.data_type_at(node, browser, reader).await?;
    Ok(match (data_type.nature, attributes.shape()) {
        (Nature::Unfit(why), _) => Err(why.to_owned()),
        (_, shape) => shape.map(|shape| (data_type, shape)),
    })
}

/// Values of those that need one.
async fn values_of(
    known: &[Known<'_>],
    reader: &mut Reader<'_>,
) -> Result<Vec<Option<Result<Variant, async_opcua::types::StatusCode>>>, Fault> {
    let needy = known.iter().filter(|known| known.needs_value());
    let wanted: Vec<_> =
        needy.map(|known| (known.variable.node.clone(), AttributeId::Value)).collect();
    let mut values = reader.read(&wanted).await?.into_iter().map(given);
    Ok(known.iter().map(|known| known.needs_value().then(|| values.next()).flatten()).collect())
}

async fn properties_of(
    known: &[Known<'_>],
    reader: &mut Reader<'_>,
) -> Result<Vec<Properties>, Fault> {
    let mut wanted: Vec<(NodeId, AttributeId)> = Vec::new();
    let mut places = Vec::new();
    for (index, known) in known.iter().enumerate() {
        for name in Properties::NAMES {
            if let Some(node) = known.variable.properties.get(name) {
                wanted.push((node.clone(), AttributeId::Value));
                places.push((index, name));
            }
        }
    }
    let mut all: Vec<_> = known.iter().map(|_| Properties::default()).collect();
    for ((index, name), value) in places.into_iter().zip(reader.read(&wanted).await?) {
        if let Ok(value) = given(value) {
            all[index].0.insert(name.to_owned(), value);
        }
    }
    Ok(all)
}

impl Listing {
    fn refuse(&mut self, variable: &Variable, why: String) {
        self.refused.push((variable.path.clone(), why));
    }

    fn add(
        &mut self,
        known: &Known<'_>,
        nature: Nature,
        shape: Shape,
        properties: &Properties,
        namespaces: &[String],
    ) {
        let variable = known.variable;
        let node = NodeAddress::lasting(&variable.node, namespaces).to_string();
        let read_back = NodeAddress::parse(&node).ok().and_then(|node| node.resolve(namespaces));
        if read_back.as_ref() != Some(&variable.node) {
            return self.refuse(variable, "its node id cannot be written as an address".into());
        }
        let indices: Vec<_> = match shape {
            None => vec![None],
            Some(count) => (0..count).map(Some).collect(),
        };
        for index in indices {
            let meaning = meaning(nature, &known.data_type, properties);
            let is_measured = matches!(meaning.kind, "f64" | "i64");
            let place = index.map(|index| format!("[{index}]")).unwrap_or_default();
            self.rows.push(Row {
                tag: format!("{}{place}", variable.path),
                description: description(known, &meaning),
                unit: properties.unit().filter(|_| is_measured).map(one_line).unwrap_or_default(),
                range: properties.range().filter(|_| is_measured),
                meaning,
                node: node.clone(),
                index,
            });
        }
    }

    /// Makes ids unique, and puts all in order.
    fn finish(&mut self) {
        let mut count: HashMap<String, usize> = HashMap::new();
        for row in &self.rows {
            *count.entry(row.tag.clone()).or_default() += 1;
        }
        // Each of them, so that no id depends on which came first.
        for row in self.rows.iter_mut().filter(|row| count[&row.tag] > 1) {
            row.tag = format!("{} ({})", row.tag, one_line(row.node.clone()));
        }
        self.rows.sort_by(|a, b| a.tag.cmp(&b.tag));
        let (refused, mut last) = (&mut self.refused, None);
        self.rows.retain(|row| {
            let why = if row.tag.len() > MAX_NAME_BYTES {
                format!("its id would have more than {MAX_NAME_BYTES} bytes")
            } else if last.as_ref() == Some(&row.tag) {
                "another variable is called like it, node and all".to_owned()
            } else {
                last = Some(row.tag.clone());
                return true;
            };
            refused.push((row.tag.clone(), why));
            false
        });
        self.refused.sort();
        if self.rows.len() > MAX_ROWS {
            self.rows.truncate(MAX_ROWS);
            self.remarks.push(format!(
                "there are more than {MAX_ROWS} values, and the rest is left out: begin at nodes \
                 further down, with an instance for each"
            ));
        }
    }

    /// Writes it as CSV (RFC 4180).
    pub(crate) fn write(&self, output: &mut impl Write) -> io::Result<()> {
        writeln!(output, "{HEADER}")?;
        for row in &self.rows {
            let states = match row.meaning.states.is_empty() {
                true => String::new(),
                false => serde_json::to_string(&row.meaning.states)?,
            };
            let [low, high] =
                row.range.map_or_else(Default::default, |range| range.map(|r| r.to_string()));
            let unit = if row.unit.len() > MAX_UNIT_BYTES { "" } else { &row.unit };
            let index = row.index.map(|index| index.to_string()).unwrap_or_default();
            let node = exact(&row.node)?;
            let kind = row.meaning.kind.to_owned();
            let cells =
                [&row.tag, &row.description, &kind, unit, &low, &high, &node, &index, &states];
            writeln!(output, "{}", cells.map(|text: &str| cell(text)).join(","))?;
        }
        Ok(())
    }
}

/// The server's description, or its display name, where that says more than the path; and
/// what states are called.
fn description(known: &Known<'_>, meaning: &Meaning) -> String {
    let says_more = |text: &String| !known.variable.path.ends_with(text.trim());
    let text = known.attributes.description().filter(says_more);
    let display = || Some(known.variable.display_name.clone()).filter(says_more);
    let text = text.or_else(display).unwrap_or_default();
    let mut text = match (text.is_empty(), meaning.names.is_empty()) {
        (_, true) => text,
        (true, false) => meaning.names.clone(),
        (false, false) => format!("{text} ({})", meaning.names),
    };
    text = one_line(text);
    text.truncate(text.floor_char_boundary(MAX_NAME_BYTES));
    text
}

fn one_line(text: String) -> String {
    let text: String = text.chars().map(|c| if c.is_control() { ' ' } else { c }).collect();
    text.trim().to_owned()
}

/// A text that the reader of the list takes as it is: what it would trim, or read as
/// something else, is written as JSON.
fn exact(text: &str) -> io::Result<String> {
    let is_plain = text.trim() == text && !text.chars().any(char::is_control);
    if is_plain { Ok(text.to_owned()) } else { Ok(serde_json::to_string(text)?) }
}

/// Quotes a cell of CSV where it needs that.
fn cell(text: &str) -> String {
    if text.contains([',', '"', '\n', '\r']) {
        format!("\"{}\"", text.replace('"', "\"\""))
    } else {
        text.to_owned()
    }
}
