//! Tag addresses: JSON as typed -> [`Points`], grouped by the data object they are in.

use busbar_plugin_sdk::{Error, TagSpec, ValueKind};
use iec61850_rs::{Fc, ObjectReference};
use serde::Deserialize;
use source_units::TagUnit;

use crate::service::Name;

/// Tags of one server.
const MAX_TAGS: usize = 100_000;
/// Longest object reference (IEC 61850-7-2, 6.1.2.4), bytes.
const MAX_REFERENCE_BYTES: usize = 129;
/// Constraints of data; the others are of commands and control blocks.
const CONSTRAINTS: [Fc; 12] = [
    Fc::ST,
    Fc::MX,
    Fc::SP,
    Fc::SV,
    Fc::CF,
    Fc::DC,
    Fc::SG,
    Fc::SE,
    Fc::SR,
    Fc::OR,
    Fc::BL,
    Fc::EX,
];

/// A tag that can be served.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Point {
    /// Handle of the tag.
    pub(crate) tag: u32,
    /// Id of the tag, for messages.
    pub(crate) id: String,
    pub(crate) kind: ValueKind,
    pub(crate) scale: f64,
    pub(crate) offset: f64,
    /// Unit that the server must have where it states one; none where values are scaled.
    pub(crate) unit: TagUnit,
    /// Data object under its functional constraint, such as `MMXU1$MX$PhV`.
    pub(crate) object: Name,
    /// Path below the data object: `phsA`, `cVal`, `mag`, `f`.
    pub(crate) path: Vec<String>,
}

impl Point {
    /// Returns the reference as typed.
    pub(crate) fn reference(&self) -> String {
        let path: String = self.path.iter().map(|part| format!("${part}")).collect();
        format!("{}{path}", self.object)
    }
}

/// All tags of a server, those of a data object side by side.
#[derive(Debug)]
pub(crate) struct Points(Vec<Point>);

impl Points {
    /// Parses the addresses of all tags.
    ///
    /// # Errors
    /// [`Error::settings`] with every tag at fault, each with its remedy.
    pub(crate) fn parse(tags: &[TagSpec]) -> Result<Self, Error> {
        if tags.len() > MAX_TAGS {
            return Err(Error::settings(format!(
                "{} tags of one server; at most {MAX_TAGS} are allowed: use several instances",
                tags.len()
            )));
        }
        let (mut points, mut faults) = (Vec::with_capacity(tags.len()), Vec::new());
        for tag in tags {
            match parse_one(tag) {
                Ok(point) => points.push(point),
                Err(fault) => faults.push(fault),
            }
        }
        if !faults.is_empty() {
            return Err(Error::settings(format!(
                "{} of {} tags cannot be served: {}",
                faults.len(),
                tags.len(),
                faults.join("; ")
            )));
        }
        points.sort_by(|a, b| (&a.object, &a.path).cmp(&(&b.object, &b.path)));
        Ok(Self(points))
    }

    pub(crate) fn all(&self) -> &[Point] {
        &self.0
    }

    /// The data objects, each with where its points are.
    pub(crate) fn objects(&self) -> Vec<(Name, std::ops::Range<usize>)> {
        let mut start = 0;
        let mut objects = Vec::new();
        for same in self.0.chunk_by(|a, b| a.object == b.object) {
            let end = start + same.len();
            objects.push((same[0].object.clone(), start..end));
            start = end;
        }
        objects
    }
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawAddress {
    reference: String,
    fc: Option<String>,
    scale: Option<f64>,
    offset: Option<f64>,
}

fn parse_one(tag: &TagSpec) -> Result<Point, String> {
    let raw: RawAddress = tag.parse_address().map_err(|error| error.message().to_owned())?;
    let fault = |what: &str| format!("tag '{}': {what}", tag.id);
    let (object, path) = place(&raw.reference, raw.fc.as_deref()).map_err(|what| fault(&what))?;
    if tag.kind != ValueKind::F64 && (raw.scale.is_some() || raw.offset.is_some()) {
        return Err(fault("scale and offset are for f64 tags: remove them, or make the tag f64"));
    }
    let is_compared = tag.kind == ValueKind::F64 && raw.scale.is_none() && raw.offset.is_none();
    let unit = if is_compared { TagUnit::new(&tag.unit) } else { TagUnit::default() };
    let (scale, offset) = (raw.scale.unwrap_or(1.0), raw.offset.unwrap_or(0.0));
    if !scale.is_finite() || scale == 0.0 || !offset.is_finite() {
        return Err(fault("scale must be finite and not 0, offset finite"));
    }
    let (tag, id, kind) = (tag.tag, tag.id.clone(), tag.kind);
    Ok(Point { tag, id, kind, scale, offset, unit, object, path })
}

/// The data object of a reference, and what follows it.
fn place(text: &str, constraint: Option<&str>) -> Result<(Name, Vec<String>), String> {
    if text.len() > MAX_REFERENCE_BYTES {
        return Err(format!("reference: longer than {MAX_REFERENCE_BYTES} bytes"));
    }
    let reference = ObjectReference::parse(text).map_err(|error| {
        format!("reference '{text}': {error}; write it as \"IED1LD0/MMXU1.TotW\"")
    })?;
    if !reference.selection().is_empty() {
        return Err(format!("reference '{text}': elements of arrays are not supported"));
    }
    let given = constraint.map(|text| {
        let known = Fc::parse(text).filter(|found| CONSTRAINTS.contains(found));
        known.ok_or_else(|| {
            let all: Vec<_> = CONSTRAINTS.iter().map(|fc| fc.as_str()).collect();
            format!("fc '{text}' is none of data: give one of {}", all.join(", "))
        })
    });
    let constraint = match (given.transpose()?, reference.fc) {
        (Some(given), Some(found)) if given != found => {
            return Err(format!("fc {given} contradicts the {found} of reference '{text}'"));
        }
        (Some(given), _) => given,
        (None, Some(found)) if CONSTRAINTS.contains(&found) => found,
        (None, Some(found)) => return Err(format!("reference '{text}': {found} is none of data")),
        (None, None) => {
            return Err("fc: give the functional constraint, such as \"MX\" or \"ST\"".into());
        }
    };
    let mut path = reference.path().map(str::to_owned);
    let object = path.next().ok_or_else(|| {
        format!("reference '{text}' names no data object: write it as \"IED1LD0/MMXU1.TotW\"")
    })?;
    let item = format!("{}${constraint}${object}", reference.ln);
    Ok((Name { domain: reference.ld.into(), item }, path.collect()))
}

#[cfg(test)]
#[path = "points_tests.rs"]
mod tests;
