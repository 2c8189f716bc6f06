//! Tag addresses: JSON as typed -> [`Point`], which can always be read.
//!
//! Registers are numbered from 0, as the protocol does on the wire. Manuals
//! that say 40001 for the first holding register, or 30001 for the first input
//! register, count from 1 and prefix the table: 40001 is register 0.

use std::fmt;

use busbar_plugin_sdk::{Error, TagSpec, ValueKind};
use serde::Deserialize;

use crate::plan::MAX_REGISTERS;
use crate::settings::Config;

/// Tags of one connection.
pub(crate) const MAX_TAGS: usize = 100_000;

/// Bytes of one text: those of the registers that one request reads.
const MAX_LENGTH: u8 = (2 * MAX_REGISTERS) as u8;

/// The four tables of a Modbus device.
#[derive(Clone, Copy, Debug, Deserialize, PartialEq, Eq, PartialOrd, Ord)]
#[serde(rename_all = "lowercase")]
pub(crate) enum Table {
    /// Bits that can be written; function 1 reads them.
    Coil,
    /// Bits that are read-only; function 2.
    Discrete,
    /// Registers that can be written; function 3 reads them.
    Holding,
    /// Registers that are read-only; function 4.
    Input,
}

impl Table {
    /// Reports whether the cells of this table are single bits.
    pub(crate) fn is_bits(self) -> bool {
        matches!(self, Self::Coil | Self::Discrete)
    }
}

impl fmt::Display for Table {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Coil => "coil",
            Self::Discrete => "discrete input",
            Self::Holding => "holding register",
            Self::Input => "input register",
        })
    }
}

/// Number format of one or more registers; each register is big-endian on the wire.
#[derive(Clone, Copy, Debug, Deserialize, PartialEq, Eq)]
#[serde(rename_all = "lowercase")]
pub(crate) enum Format {
    U16,
    I16,
    U32,
    I32,
    U64,
    I64,
    F32,
    F64,
}

impl Format {
    /// Registers that it takes.
    pub(crate) fn registers(self) -> u16 {
        match self {
            Self::U16 | Self::I16 => 1,
            Self::U32 | Self::I32 | Self::F32 => 2,
            Self::U64 | Self::I64 | Self::F64 => 4,
        }
    }

    fn is_float(self) -> bool {
        matches!(self, Self::F32 | Self::F64)
    }
}

/// Order of the registers (words) of a number.
#[derive(Clone, Copy, Debug, Default, Deserialize, PartialEq, Eq)]
#[serde(rename_all = "lowercase")]
pub(crate) enum WordOrder {
    /// Most significant register first, the default.
    #[default]
    Big,
    /// Least significant register first.
    Little,
}

/// Order of the two bytes of a text in each register.
#[derive(Clone, Copy, Debug, Default, Deserialize, PartialEq, Eq)]
#[serde(rename_all = "lowercase")]
pub(crate) enum ByteOrder {
    /// High byte first, the default.
    #[default]
    Big,
    /// Order of the low byte first.
    Little,
}

/// Decoding of registers or bits into a tag's value.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Decoding {
    /// `raw * scale + offset`, as f64.
    Number { format: Format, word_order: WordOrder, scale: f64, offset: f64 },
    /// Integer without scaling, as i64.
    Integer { format: Format, word_order: WordOrder },
    /// One bit of a register, 0 to 15; bit 0 is the least significant.
    RegisterBit(u8),
    /// Two bits of a register: this one says open, the next one closed.
    RegisterBitPair(u8),
    /// A coil or discrete input.
    Bit,
    /// Two coils or discrete inputs: the first says open, the second closed.
    BitPair,
    /// Text of `length` bytes, 1 to [`MAX_LENGTH`], two in each register. The second byte of an
    /// odd length's last register is not part of it.
    Text { length: u8, byte_order: ByteOrder },
}

impl Decoding {
    /// Returns the count of cells that it takes.
    fn cells(self) -> u16 {
        match self {
            Self::Number { format, .. } | Self::Integer { format, .. } => format.registers(),
            Self::BitPair => 2,
            Self::Bit | Self::RegisterBit(_) | Self::RegisterBitPair(_) => 1,
            Self::Text { length, .. } => u16::from(length.div_ceil(2)),
        }
    }
}

/// A tag that can be read.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Point {
    /// Handle of the tag.
    pub(crate) tag: u32,
    /// Id of the tag, for messages.
    pub(crate) id: String,
    /// Unit id of the device.
    pub(crate) unit: u8,
    /// Table of the cells.
    pub(crate) table: Table,
    /// Index of the poll group.
    pub(crate) group: usize,
    /// Address of the first cell, counted from 0.
    pub(crate) first: u16,
    /// Number of cells, at least one; `first + count` is at most 65536.
    pub(crate) count: u16,
    /// Decoding of the cells into the value.
    pub(crate) decoding: Decoding,
}

impl Point {
    /// Returns the address one past the last cell.
    pub(crate) fn end(&self) -> u32 {
        u32::from(self.first) + u32::from(self.count)
    }
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawAddress {
    table: Table,
    register: u16,
    #[serde(rename = "type")]
    format: Option<Format>,
    word_order: Option<WordOrder>,
    length: Option<u8>,
    byte_order: Option<ByteOrder>,
    scale: Option<f64>,
    offset: Option<f64>,
    bit: Option<u8>,
    bits: Option<u8>,
    poll_group: Option<String>,
    unit: Option<u8>,
}

/// Parses the addresses of all tags.
///
/// # Errors
/// [`Error::settings`] with every tag at fault, each with its remedy.
pub(crate) fn parse(tags: &[TagSpec], config: &Config) -> Result<Vec<Point>, Error> {
    if tags.len() > MAX_TAGS {
        return Err(Error::settings(format!(
            "{} tags on one connection; at most {MAX_TAGS} are allowed: use several",
            tags.len()
        )));
    }
    let mut points = Vec::with_capacity(tags.len());
    let mut faults = Vec::new();
    for tag in tags {
        match parse_one(tag, config) {
            Ok(point) => points.push(point),
            Err(fault) => faults.push(fault),
        }
    }
    if faults.is_empty() {
        return Ok(points);
    }
    Err(Error::settings(format!(
        "{} of {} tags cannot be read: {}",
        faults.len(),
        tags.len(),
        faults.join("; ")
    )))
}

fn parse_one(tag: &TagSpec, config: &Config) -> Result<Point, String> {
    let raw: RawAddress = tag.parse_address().map_err(|error| error.message().to_owned())?;
    let fault = |what: String| format!("tag '{}': {what}", tag.id);
    let decoding = decoding(tag.kind, &raw).map_err(fault)?;
    let count = decoding.cells();
    let unit = raw.unit.unwrap_or(config.unit);
    let units = config.transport.units();
    if !units.contains(&unit) {
        let (min, max) = (units.start(), units.end());
        return Err(fault(format!("unit {unit} is not within {min} to {max}")));
    }
    let point = Point {
        tag: tag.tag,
        id: tag.id.clone(),
        unit,
        table: raw.table,
        group: group(raw.poll_group.as_deref(), config).map_err(fault)?,
        first: raw.register,
        count,
        decoding,
    };
    if point.end() > 1 << 16 {
        return Err(fault(format!(
            "register {} and the {} after it pass 65535; registers are numbered from 0",
            point.first,
            count - 1
        )));
    }
    Ok(point)
}

fn group(name: Option<&str>, config: &Config) -> Result<usize, String> {
    let Some(name) = name else { return Ok(0) };
    let known = &config.group_names[1..];
    if let Some(index) = known.iter().position(|known| known == name) {
        return Ok(index + 1);
    }
    Err(if known.is_empty() {
        format!("poll_group '{name}' does not exist: add it to poll_groups in the settings")
    } else {
        format!("poll_group '{name}' does not exist; there are '{}'", known.join("', '"))
    })
}

fn decoding(kind: ValueKind, raw: &RawAddress) -> Result<Decoding, String> {
    let table = raw.table;
    match (table.is_bits(), kind) {
        (true, ValueKind::Bool | ValueKind::DoublePoint) => {
            refuse(
                raw,
                &["type", "word_order", "scale", "offset", "bit", "bits", "length", "byte_order"],
            )?;
            Ok(if kind == ValueKind::Bool { Decoding::Bit } else { Decoding::BitPair })
        }
        (true, ValueKind::F64 | ValueKind::I64) => {
            Err(format!("a {table} is a bit, not a number: make the tag bool or double_point"))
        }
        (true, ValueKind::Text) => Err(format!(
            "a {table} is a bit, not a text: name a holding or input register, or make the tag \
             bool or double_point"
        )),
        (false, ValueKind::Text) => {
            refuse(raw, &["type", "word_order", "scale", "offset", "bit", "bits"])?;
            let length = raw.length.ok_or_else(|| {
                format!("a text needs \"length\": its bytes, 1 to {MAX_LENGTH}, two in a register")
            })?;
            if !(1..=MAX_LENGTH).contains(&length) {
                return Err(format!(
                    "length {length} is not within 1 to {MAX_LENGTH} bytes, which is what one \
                     request reads"
                ));
            }
            Ok(Decoding::Text { length, byte_order: raw.byte_order.unwrap_or_default() })
        }
        (false, ValueKind::Bool) => {
            refuse(raw, &["word_order", "scale", "offset", "bits", "length", "byte_order"])?;
            one_register(raw)?;
            let bit =
                raw.bit.ok_or("a bool from a register needs \"bit\": 0 to 15, 0 the lowest")?;
            if bit > 15 {
                return Err(format!(
                    "bit {bit} does not exist: a register has 0 to 15; higher ones are in the \
                     next register"
                ));
            }
            Ok(Decoding::RegisterBit(bit))
        }
        (false, ValueKind::DoublePoint) => {
            refuse(raw, &["word_order", "scale", "offset", "bit", "length", "byte_order"])?;
            one_register(raw)?;
            let first = raw.bits.ok_or(
                "a double_point from a register needs \"bits\": the lower of its two bits, 0 to 14",
            )?;
            if first > 14 {
                return Err(format!(
                    "bits {first} and {} are not both within 0 to 15",
                    u16::from(first) + 1
                ));
            }
            Ok(Decoding::RegisterBitPair(first))
        }
        (false, ValueKind::F64) => {
            refuse(raw, &["bit", "bits", "length", "byte_order"])?;
            let scale = raw.scale.unwrap_or(1.0);
            let offset = raw.offset.unwrap_or(0.0);
            if !scale.is_finite() || scale == 0.0 || !offset.is_finite() {
                return Err("scale must be finite and not 0, offset finite".into());
            }
            Ok(Decoding::Number {
                format: format(raw)?,
                word_order: raw.word_order.unwrap_or_default(),
                scale,
                offset,
            })
        }
        (false, ValueKind::I64) => {
            refuse(raw, &["scale", "offset", "bit", "bits", "length", "byte_order"])
                .map_err(|fault| format!("{fault}, or make the tag f64"))?;
            let format = format(raw)?;
            if format.is_float() {
                return Err(
                    "an i64 tag cannot come from a floating-point type: make the tag f64".into()
                );
            }
            Ok(Decoding::Integer { format, word_order: raw.word_order.unwrap_or_default() })
        }
    }
}

fn format(raw: &RawAddress) -> Result<Format, String> {
    raw.format.ok_or_else(|| {
        "a number needs \"type\": u16, i16, u32, i32, u64, i64, f32 or f64".to_owned()
    })
}

fn one_register(raw: &RawAddress) -> Result<(), String> {
    match raw.format {
        None | Some(Format::U16 | Format::I16) => Ok(()),
        Some(_) => Err(
            "bits are of one register: leave \"type\" away, name the register that holds the bit, \
             or make the tag f64 or i64"
                .into(),
        ),
    }
}

/// Fails for fields that would have no effect.
fn refuse(raw: &RawAddress, names: &[&str]) -> Result<(), String> {
    let present = |name: &str| match name {
        "type" => raw.format.is_some(),
        "word_order" => raw.word_order.is_some(),
        "scale" => raw.scale.is_some(),
        "offset" => raw.offset.is_some(),
        "bit" => raw.bit.is_some(),
        "length" => raw.length.is_some(),
        "byte_order" => raw.byte_order.is_some(),
        _ => raw.bits.is_some(),
    };
    let present: Vec<_> = names.iter().copied().filter(|name| present(name)).collect();
    if present.is_empty() {
        return Ok(());
    }
    Err(format!("{} has no meaning for this table and kind: remove it", present.join(", ")))
}

#[cfg(test)]
#[path = "address_tests.rs"]
mod tests;
