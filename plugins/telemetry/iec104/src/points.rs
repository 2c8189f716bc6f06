//! Tag addresses: JSON as typed -> [`Points`], found by the address on the wire.

use std::ops::Range;

use busbar_plugin_sdk::{Error, TagSpec, ValueKind};
use serde::Deserialize;

use crate::settings::Config;

/// Tags of one station.
const MAX_TAGS: usize = 100_000;
/// Common addresses of one connection.
const MAX_COMMON_ADDRESSES: usize = 256;
/// Fault of a text tag, and its remedy: no type of IEC 60870-5-104, 8 carries characters.
const NO_TEXT: &str = "IEC 60870-5-104 carries no text: make the tag bool, double_point, i64 or \
                       f64, or give it another source";
/// The last object address (IEC 60870-5-104, 7.4).
const MAX_OBJECT_ADDRESS: u32 = 0xFF_FFFF;

/// Kind of information object that a tag is for.
#[derive(Clone, Copy, Debug, Default, Deserialize, PartialEq, Eq)]
#[serde(rename_all = "lowercase")]
pub(crate) enum ObjectType {
    /// Whatever fits the tag's kind.
    #[default]
    Any,
    /// Types 1, 2, 30.
    Single,
    /// Types 3, 4, 31; protection events 17, 38.
    Double,
    /// Types 9 to 14, 21, 34 to 36.
    Measured,
    /// Types 5, 6, 32.
    Step,
    /// Types 15, 16, 37.
    Counter,
    /// Types 7, 8, 20, 33; protection circuits 18, 19, 39, 40.
    Bitstring,
}

/// A tag that can be served.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Point {
    /// Handle of the tag.
    pub(crate) tag: u32,
    /// Id of the tag, for messages.
    pub(crate) id: String,
    pub(crate) kind: ValueKind,
    pub(crate) object_type: ObjectType,
    pub(crate) scale: f64,
    pub(crate) offset: f64,
    /// Bit of a bitstring that is the tag.
    pub(crate) bit: Option<u8>,
    pub(crate) common_address: u16,
    pub(crate) object_address: u32,
}

impl Point {
    fn key(&self) -> (u16, u32) {
        (self.common_address, self.object_address)
    }
}

/// All tags of a station, in order of their addresses.
#[derive(Debug)]
pub(crate) struct Points(Vec<Point>);

impl Points {
    /// Parses the addresses of all tags.
    ///
    /// # Errors
    /// [`Error::settings`] with every tag at fault, each with its remedy.
    pub(crate) fn parse(tags: &[TagSpec], config: &Config) -> Result<Self, Error> {
        if tags.len() > MAX_TAGS {
            return Err(Error::settings(format!(
                "{} tags of one station; at most {MAX_TAGS} are allowed: use several instances",
                tags.len()
            )));
        }
        let parsed: Vec<Result<Point, String>> =
            tags.iter().map(|tag| parse_one(tag, config)).collect();
        let faults: Vec<_> = parsed.iter().filter_map(|p| p.as_ref().err()).cloned().collect();
        if !faults.is_empty() {
            return Err(Error::settings(format!(
                "{} of {} tags cannot be served: {}",
                faults.len(),
                tags.len(),
                faults.join("; ")
            )));
        }
        let mut points: Vec<_> = parsed.into_iter().flatten().collect();
        points.sort_by_key(Point::key);
        let points = Self(points);
        let addresses = points.common_addresses().len();
        if addresses > MAX_COMMON_ADDRESSES {
            return Err(Error::settings(format!(
                "{addresses} common addresses; at most {MAX_COMMON_ADDRESSES} are allowed on one \
                 connection: use several instances"
            )));
        }
        Ok(points)
    }

    pub(crate) fn all(&self) -> &[Point] {
        &self.0
    }

    /// The common addresses, in order.
    pub(crate) fn common_addresses(&self) -> Vec<u16> {
        let mut addresses: Vec<_> = self.0.iter().map(|point| point.common_address).collect();
        addresses.dedup();
        addresses
    }

    /// Returns the range of an object's tags.
    pub(crate) fn of_object(&self, common_address: u16, object_address: u32) -> Range<usize> {
        let key = (common_address, object_address);
        let start = self.0.partition_point(|point| point.key() < key);
        let same = self.0[start..].iter().take_while(|point| point.key() == key).count();
        start..start + same
    }

    /// Returns the range of a common address's tags.
    pub(crate) fn of_station(&self, common_address: u16) -> Range<usize> {
        let start = self.0.partition_point(|point| point.common_address < common_address);
        start..self.0.partition_point(|point| point.common_address <= common_address)
    }
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawAddress {
    common_address: Option<u16>,
    ioa: u32,
    #[serde(rename = "type", default)]
    object_type: ObjectType,
    scale: Option<f64>,
    offset: Option<f64>,
    bit: Option<u8>,
}

fn parse_one(tag: &TagSpec, config: &Config) -> Result<Point, String> {
    let raw: RawAddress = tag.parse_address().map_err(|error| error.message().to_owned())?;
    let fault = |what: &str| format!("tag '{}': {what}", tag.id);
    if !(1..=MAX_OBJECT_ADDRESS).contains(&raw.ioa) {
        return Err(fault(&format!("ioa {} is not within 1 to {MAX_OBJECT_ADDRESS}", raw.ioa)));
    }
    let common_address = raw.common_address.unwrap_or(config.common_address);
    if !(1..=65_534).contains(&common_address) {
        return Err(fault(&format!("common_address {common_address} is not within 1 to 65534")));
    }
    check_type(tag.kind, &raw).map_err(|what| fault(&what))?;
    let (scale, offset) = (raw.scale.unwrap_or(1.0), raw.offset.unwrap_or(0.0));
    if !scale.is_finite() || scale == 0.0 || !offset.is_finite() {
        return Err(fault("scale must be finite and not 0, offset finite"));
    }
    Ok(Point {
        tag: tag.tag,
        id: tag.id.clone(),
        kind: tag.kind,
        object_type: raw.object_type,
        scale,
        offset,
        bit: raw.bit,
        common_address,
        object_address: raw.ioa,
    })
}

/// Checks whether an object of the type could ever be a value of the kind.
fn check_type(kind: ValueKind, raw: &RawAddress) -> Result<(), String> {
    use ObjectType::{Any, Bitstring, Counter, Double, Measured, Single, Step};
    if kind == ValueKind::Text {
        return Err(NO_TEXT.into());
    }
    if kind != ValueKind::F64 && (raw.scale.is_some() || raw.offset.is_some()) {
        return Err("scale and offset are for f64 tags: remove them, or make the tag f64".into());
    }
    if let Some(bit) = raw.bit {
        return match (kind, raw.object_type) {
            _ if bit > 31 => Err(format!("bit {bit} does not exist: a bitstring has 0 to 31")),
            (ValueKind::Bool, Any | Bitstring) => Ok(()),
            _ => Err("bit is for bool tags from a bitstring: remove it".into()),
        };
    }
    match (kind, raw.object_type) {
        (_, Any)
        | (ValueKind::Bool, Single)
        | (ValueKind::DoublePoint, Double)
        | (ValueKind::F64, Measured | Step | Counter)
        | (ValueKind::I64, Measured | Step | Counter | Bitstring) => Ok(()),
        (ValueKind::Bool, Bitstring) => {
            Err("a bool from a bitstring needs \"bit\": 0 to 31, 0 the lowest".into())
        }
        (_, Single) => Err("a single point is a bool: make the tag bool".into()),
        (_, Double) => Err("a double point is a double_point: make the tag double_point".into()),
        (_, Bitstring) => Err("a bitstring is an i64, or bools by \"bit\"".into()),
        (_, Measured | Step | Counter) => {
            Err("a number is an f64 or i64: make the tag f64 or i64".into())
        }
    }
}

#[cfg(test)]
#[path = "points_tests.rs"]
mod tests;
