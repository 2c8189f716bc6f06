//! Values and qualities of cells.

use busbar_plugin_sdk::{DoublePoint, Quality, Reason, Value, ValueKind, text_value};
use source_units::units_conflict;
use text_table::{StateWords, find_quality, shorten};

use super::config::CsvConfig;

/// Meaning of a cell.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum CellValue {
    /// Cell without any text.
    Empty,
    /// A word that is no value.
    NoValue,
    /// A value, perhaps no finite number.
    Value(Value),
    /// A text, uncertain where it was cut or its file has no such character.
    Text(Value, Quality),
}

/// Reads a cell of a tag; `unit` is the unit of its column, learnt from its first cell.
///
/// # Errors
/// What the cell is not, with its text.
pub(super) fn read_cell(
    text: &str,
    kind: ValueKind,
    states: &StateWords<Value>,
    unit: &mut Option<String>,
    config: &CsvConfig,
) -> Result<CellValue, String> {
    if text.is_empty() {
        return Ok(CellValue::Empty);
    }
    if !states.is_empty() {
        if let Some(state) = states.get(text) {
            return Ok(CellValue::Value(state));
        }
        if is_no_value(text, config) {
            return Ok(CellValue::NoValue);
        }
        return Err(format!(
            "'{}' is none of the tag's states {}: add it to its address",
            shorten(text),
            states.list()
        ));
    }
    // A mode may be called `none` or `shutdown`: only words of the settings are no text.
    if (kind != ValueKind::Text || config.has_own_no_value) && is_no_value(text, config) {
        return Ok(CellValue::NoValue);
    }
    let lower = text.to_lowercase();
    let value = match (kind, lower.as_str()) {
        (ValueKind::Bool, "on" | "yes" | "true") => Value::Bool(true),
        (ValueKind::Bool, "off" | "no" | "false") => Value::Bool(false),
        (ValueKind::Bool, _) => match config.numbers.parse_i64(text) {
            Ok(state @ 0..=1) => Value::Bool(state == 1),
            _ => return Err(no_value_of(text, "true, false, 1, 0, on or off")),
        },
        (ValueKind::DoublePoint, "off" | "open") => Value::DoublePoint(DoublePoint::Off),
        (ValueKind::DoublePoint, "on" | "closed") => Value::DoublePoint(DoublePoint::On),
        (ValueKind::DoublePoint, _) => match config.numbers.parse_i64(text) {
            Ok(bits @ 0..=3) => Value::DoublePoint(DoublePoint::from_bits(bits.unsigned_abs())),
            _ => return Err(no_value_of(text, "position 0 to 3, off, on, open or closed")),
        },
        (ValueKind::F64 | ValueKind::I64, _) => {
            let (number, found) = config.numbers.split_unit(text, unit.as_deref());
            let value = match kind {
                ValueKind::I64 => config.numbers.parse_i64(number).map(Value::I64),
                _ => config.numbers.parse_f64(number).map(Value::F64),
            };
            let value = value?;
            if let Some(found) = found {
                check_unit(text, found, unit)?;
            }
            value
        }
        (ValueKind::Text, _) => return Ok(text_cell(text)),
    };
    Ok(CellValue::Value(value))
}

/// Makes the value of a text tag of a cell as it stands. Bytes that are no text in the encoding of
/// the file were replaced as it was read.
fn text_cell(text: &str) -> CellValue {
    let (value, quality) = text_value(text);
    let is_malformed = text.contains(char::REPLACEMENT_CHARACTER);
    let doubt =
        if is_malformed { Quality::Uncertain(Reason::Configuration) } else { Quality::Good };
    CellValue::Text(value, quality.worst(doubt))
}

fn no_value_of(text: &str, expected: &str) -> String {
    format!("'{}' is no {expected}; other words are `states` of the address", shorten(text))
}

/// Compares the unit of a cell with that of its column, or makes it that of the column.
fn check_unit(text: &str, found: &str, unit: &mut Option<String>) -> Result<(), String> {
    match unit {
        Some(unit) if unit.trim() == found || !units_conflict(unit, found) => Ok(()),
        Some(unit) => Err(format!(
            "'{}' is in {found}, its column or tag in {}: a tag of another unit needs a `scale`",
            shorten(text),
            shorten(unit)
        )),
        None => {
            *unit = Some(found.to_owned());
            Ok(())
        }
    }
}

fn is_no_value(text: &str, config: &CsvConfig) -> bool {
    config.no_value.contains(&text.trim().to_lowercase())
}

/// Reads a quality: a word of the settings, a known one, or a code of OPC DA, 192 being good.
/// Another text vouches for nothing, and is told.
pub(super) fn read_quality(text: &str, config: &CsvConfig) -> (Quality, Option<String>) {
    let lower = text.trim().to_lowercase();
    if let Some(quality) = config.qualities.get(&lower) {
        return (*quality, None);
    }
    match find_quality(&lower) {
        Some(level) => (Quality::new(level, Reason::Unknown), None),
        None => {
            let remark = format!(
                "quality '{}' is not known: taken as bad; csv.qualities says what it is",
                shorten(text)
            );
            (Quality::Bad(Reason::Unknown), Some(remark))
        }
    }
}
