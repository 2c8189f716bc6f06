//! The point map: which quantity lies where. JSON as typed -> [`Point`].

use anyhow::{Context, Result, bail, ensure};
use serde::Deserialize;

use crate::model::Quantity;

/// The map of one transformer bay; a table of it is in README.md.
pub(crate) const DEMO: &str = include_str!("../demo_points.json");
/// Points of a map.
const MAX_POINTS: usize = 10_000;
/// Bytes of a map file.
pub(crate) const MAX_FILE_BYTES: u64 = 16 << 20;

/// How a number lies in registers, the most significant one first.
#[derive(Clone, Copy, Debug, Deserialize, PartialEq, Eq)]
#[serde(rename_all = "lowercase")]
pub(crate) enum Format {
    U16,
    I16,
    U32,
    I32,
    F32,
    F64,
}

/// Where a point lies.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Place {
    /// Registers from `first` on, holding `value / scale`.
    Registers { first: u16, format: Format, scale: f64 },
    /// One bit.
    Bit(u16),
    /// Two bits: the first says open, the second closed.
    BitPair(u16),
}

/// What moves a point.
#[derive(Clone, Debug, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub(crate) enum Source {
    /// A quantity of the simulated bay.
    Model(Quantity),
    /// Always this.
    Constant(f64),
    /// A sine wave.
    #[serde(rename_all = "snake_case")]
    Sine { mean: f64, amplitude: f64, period_seconds: f64 },
}

/// A point that can be served.
#[derive(Clone, Debug)]
pub(crate) struct Point {
    pub(crate) name: String,
    pub(crate) place: Place,
    pub(crate) source: Source,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawMap {
    points: Vec<RawPoint>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawPoint {
    name: String,
    /// For people.
    #[serde(default, rename = "unit")]
    _unit: String,
    register: Option<u16>,
    #[serde(rename = "type")]
    format: Option<Format>,
    scale: Option<f64>,
    bit: Option<u16>,
    bit_pair: Option<u16>,
    source: Source,
}

/// Reads a map.
pub(crate) fn parse(json: &str) -> Result<Vec<Point>> {
    let raw: RawMap = serde_json::from_str(json).context("the point map is not as it should be")?;
    ensure!(
        raw.points.len() <= MAX_POINTS,
        "{} points; at most {MAX_POINTS} are allowed",
        raw.points.len()
    );
    raw.points
        .into_iter()
        .map(|raw| {
            let place = place(&raw).with_context(|| format!("point '{}'", raw.name))?;
            Ok(Point { name: raw.name, place, source: raw.source })
        })
        .collect()
}

fn place(raw: &RawPoint) -> Result<Place> {
    if let Source::Sine { period_seconds, .. } = raw.source {
        ensure!(period_seconds > 0.0, "period_seconds must be greater than 0");
    }
    let place = match (raw.register, raw.bit, raw.bit_pair) {
        (Some(first), None, None) => {
            let format =
                raw.format.context("a register needs \"type\": u16, i16, u32, i32, f32 or f64")?;
            let scale = raw.scale.unwrap_or(1.0);
            ensure!(scale.is_finite() && scale != 0.0, "scale must be finite and not 0");
            Place::Registers { first, format, scale }
        }
        (None, Some(bit), None) => Place::Bit(bit),
        (None, None, Some(first)) => Place::BitPair(first),
        _ => bail!("give one of \"register\", \"bit\" and \"bit_pair\""),
    };
    let (first, count) = place.cells();
    ensure!(usize::from(first) + count <= 1 << 16, "its cells pass 65535");
    Ok(place)
}

impl Place {
    /// First cell and number of cells.
    pub(crate) fn cells(self) -> (u16, usize) {
        match self {
            Self::Registers { first, format, .. } => (
                first,
                match format {
                    Format::U16 | Format::I16 => 1,
                    Format::U32 | Format::I32 | Format::F32 => 2,
                    Format::F64 => 4,
                },
            ),
            Self::Bit(first) => (first, 1),
            Self::BitPair(first) => (first, 2),
        }
    }

    /// Whether its cells are bits.
    pub(crate) fn is_bits(self) -> bool {
        !matches!(self, Self::Registers { .. })
    }

    /// The cells for a value; what a type cannot hold ends at its limits.
    pub(crate) fn encode(self, value: f64) -> Vec<u16> {
        match self {
            Self::Registers { format, scale, .. } => {
                let raw = value / scale;
                let rounded = raw.round();
                match format {
                    Format::U16 => vec![rounded as u16],
                    Format::I16 => vec![rounded as i16 as u16],
                    Format::U32 => words(u64::from(rounded as u32), 2),
                    Format::I32 => words(u64::from(rounded as i32 as u32), 2),
                    Format::F32 => words(u64::from((raw as f32).to_bits()), 2),
                    Format::F64 => words(raw.to_bits(), 4),
                }
            }
            Self::Bit(_) => vec![u16::from(value != 0.0)],
            // 0 travelling, 1 open, 2 closed, 3 faulty.
            Self::BitPair(_) => vec![value as u16 & 1, value as u16 >> 1 & 1],
        }
    }
}

fn words(bits: u64, count: u32) -> Vec<u16> {
    (0..count).rev().map(|i| (bits >> (16 * i)) as u16).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn registers(format: Format, scale: f64) -> Place {
        Place::Registers { first: 0, format, scale }
    }

    #[test]
    fn values_become_cells() {
        let cases: &[(Place, f64, &[u16])] = &[
            (registers(Format::U16, 1.0), 70_000.0, &[65535]),
            (registers(Format::I16, 0.1), -12.34, &[0xFF85]),
            (registers(Format::U32, 1.0), 65_538.0, &[1, 2]),
            (registers(Format::I32, 1.0), -3.0, &[0xFFFF, 0xFFFD]),
            (registers(Format::F32, 1.0), 230.5, &[0x4366, 0x8000]),
            (registers(Format::F64, 1.0), 1.0, &[0x3FF0, 0, 0, 0]),
            (Place::Bit(0), 1.0, &[1]),
            (Place::BitPair(0), 1.0, &[1, 0]),
            (Place::BitPair(0), 2.0, &[0, 1]),
        ];
        for (place, value, expected) in cases {
            assert_eq!(place.encode(*value), *expected, "{place:?} {value}");
        }
    }

    #[test]
    fn a_wrong_map_says_what_is_wrong() {
        let with = |point: &str| format!(r#"{{"points": [{{"name": "x", {point}}}]}}"#);
        let source = r#""source": {"constant": 1}"#;
        let cases = [
            (with(source), "give one of"),
            (with(&format!(r#""bit": 1, "bit_pair": 1, {source}"#)), "give one of"),
            (with(&format!(r#""register": 1, {source}"#)), "needs \"type\""),
            (with(&format!(r#""register": 65535, "type": "f32", {source}"#)), "pass 65535"),
            (with(&format!(r#""register": 1, "type": "u16", "scale": 0, {source}"#)), "not 0"),
            (with(r#""bit": 1, "source": {"model": "luck"}"#), "unknown variant `luck`"),
            ("{".into(), "not as it should be"),
        ];
        for (json, part) in cases {
            let error = format!("{:#}", parse(&json).unwrap_err());
            assert!(error.contains(part), "{json}: {error}");
        }
    }

    #[test]
    fn the_table_in_the_readme_is_the_demo_map() {
        let raw: serde_json::Value = serde_json::from_str(DEMO).unwrap();
        let readme = include_str!("../README.md");
        for point in raw["points"].as_array().unwrap() {
            let text = |key: &str| point[key].as_str().unwrap_or("").to_owned();
            let scale = point["scale"].as_f64();
            let (cells, kind) = if let Some(first) = point["register"].as_u64() {
                let kind = scale.map_or(text("type"), |s| format!("{} x {s}", text("type")));
                (format!("register {first}"), kind)
            } else if let Some(bit) = point["bit"].as_u64() {
                (format!("bit {bit}"), "bool".into())
            } else {
                let first = point["bit_pair"].as_u64().unwrap();
                (format!("bits {first}, {}", first + 1), "double point".into())
            };
            let row = format!("| {cells} | {kind} | {} | {} |", text("name"), text("unit"));
            assert!(readme.contains(&row), "README.md lacks: {row}");
        }
        assert_eq!(parse(DEMO).unwrap().len(), raw["points"].as_array().unwrap().len());
    }
}
