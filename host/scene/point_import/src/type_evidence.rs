//! Evidence of a row's kind beside its type name: unit, scale, range and address.

use busbar_types::ValueKind;
use serde_json::Value;

use crate::address::MAX_ADDRESS_DEPTH;
use crate::type_names::{TypeMeaning, iec60870_meaning, iec60870_type, meaning_of};
use crate::unit_words::{UnitNature, nature_of};

/// Fields of addresses that name a type.
const TYPE_FIELDS: [&str; 9] =
    ["type", "type_id", "typeid", "ti", "asdu_type", "data_type", "datatype", "format", "cdc"];
/// Fields of addresses of IEC 60870-5-101 and 104.
const IEC60870_FIELDS: [&str; 3] = ["ioa", "information_object", "information_object_address"];
/// Fields of addresses that only numbers have.
const NUMBER_FIELDS: [&str; 4] = ["scale", "offset", "deadband", "deadband_percent"];
/// The greatest number that a double point's range has.
const MAX_POINT: f64 = 3.0;
/// Upper ends of ranges from 0 that tools fill in for all tags.
const DEFAULT_HIGHS: [f64; 6] = [1.0, 100.0, 255.0, 1000.0, 32_767.0, 65_535.0];

/// Place of a piece of evidence.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum ClueSource {
    Unit,
    /// Factor and offset of the row.
    Scale,
    /// Plausible range or normal band.
    Band,
    Address,
    /// Factor and offset within the address.
    AddressScale,
    /// One bit of a register or bit string.
    AddressBit,
}

/// One piece of evidence.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Clue {
    pub(crate) source: ClueSource,
    /// Description for people: `the unit 'MW'`.
    pub(crate) what: String,
    /// Type, where the evidence decides it alone.
    pub(crate) kind: Option<ValueKind>,
}

/// Evidence for a number, and evidence for a point of states.
#[derive(Clone, Debug, Default)]
pub(crate) struct Evidence {
    pub(crate) number: Vec<Clue>,
    pub(crate) state: Vec<Clue>,
    /// The protocol of the address, if its lists have one reading of `Double`.
    pub(crate) family: Option<AddressFamily>,
}

/// Protocols that tell how their lists use type names.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum AddressFamily {
    /// IEC 60870-5-101 and 104, whose lists mean points by `Double` and `Single`.
    Iec60870,
    /// OPC, which knows no double points.
    Opc,
    /// Status information of IEC 61850.
    Iec61850Status,
    /// Measured values of IEC 61850.
    Iec61850Measured,
    /// Registers of Modbus whose format is given: bits of registers have none.
    ModbusNumber,
}

impl AddressFamily {
    /// Reports whether lists of this family mean points by `Double` and `Single`.
    pub(crate) fn means_points(self) -> bool {
        matches!(self, Self::Iec60870 | Self::Iec61850Status)
    }
}

impl Evidence {
    /// Adds the evidence of a row's unit.
    pub(crate) fn add_unit(&mut self, unit: &str) {
        let clue = clue(ClueSource::Unit, format!("the unit '{unit}'"), None);
        match nature_of(unit) {
            UnitNature::Measurement => self.number.push(clue),
            UnitNature::States => self.state.push(clue),
            UnitNature::Unknown => {}
        }
    }

    /// Adds the evidence of a factor or offset.
    pub(crate) fn add_scale(&mut self) {
        self.number.push(clue(ClueSource::Scale, "the scale".into(), None));
    }

    /// Adds the evidence of a plausible range or a normal band. Values that lists fill in for all
    /// tags alike, such as 0 to 100, are no evidence.
    pub(crate) fn add_band(&mut self, what: &str, band: [Option<f64>; 2]) {
        let is_default = matches!(band, [Some(low), Some(high)]
            if low == 0.0 && DEFAULT_HIGHS.contains(&high));
        let is_beyond = |value: f64| !(0.0..=MAX_POINT).contains(&value) || value.fract() != 0.0;
        if !is_default && band.into_iter().flatten().any(is_beyond) {
            self.number.push(clue(ClueSource::Band, format!("the {what}"), None));
        }
    }

    /// Adds the evidence of an address.
    pub(crate) fn add_address(&mut self, address: &Value) {
        self.family = family_of(address);
        self.add_value(address, MAX_ADDRESS_DEPTH);
    }

    fn add_value(&mut self, value: &Value, levels: usize) {
        match value {
            Value::Object(fields) if levels > 0 => {
                for (name, value) in fields {
                    self.add_field(&name.to_lowercase(), value, levels);
                }
            }
            Value::Array(values) if levels > 0 => {
                values.iter().for_each(|value| self.add_value(value, levels - 1));
            }
            Value::String(text) => self.add_meaning(iec60870_type(text), text),
            _ => {}
        }
    }

    fn add_field(&mut self, name: &str, value: &Value, levels: usize) {
        let what = || format!("the address, whose '{name}' is {value}");
        match value {
            Value::String(text) if TYPE_FIELDS.contains(&name) => {
                self.add_meaning(self.meaning_in_address(text), &format!("{name}: {text}"));
            }
            Value::Number(number) if TYPE_FIELDS.contains(&name) => {
                let meaning = number.as_u64().filter(|_| self.is_iec60870());
                self.add_meaning(meaning.and_then(iec60870_meaning), &format!("{name}: {number}"));
            }
            Value::Number(number) if NUMBER_FIELDS.contains(&name) => {
                let plain = if name == "scale" { 1.0 } else { 0.0 };
                if number.as_f64() != Some(plain) {
                    self.number.push(clue(ClueSource::AddressScale, what(), None));
                }
            }
            Value::Number(_) if name == "bit" => {
                // IEC 104 takes one bit of a bit string, Modbus one of a register.
                let kind = Some(ValueKind::Bool);
                self.state.push(clue(ClueSource::AddressBit, what(), kind));
            }
            Value::Number(_) if name == "bits" => {
                let kind = Some(ValueKind::DoublePoint);
                self.state.push(clue(ClueSource::AddressBit, what(), kind));
            }
            Value::String(table) if name == "table" && is_bits(table) => {
                self.state.push(clue(ClueSource::Address, what(), None));
            }
            Value::Object(_) if name == "states" => {
                self.state.push(clue(ClueSource::Address, what(), None))
            }
            value => self.add_value(value, levels - 1),
        }
    }

    /// Finds the meaning of a type that an address names. `single` and `double` are points only
    /// where the protocol has no other.
    fn meaning_in_address(&self, text: &str) -> Option<TypeMeaning> {
        match meaning_of(text, self.is_iec60870()) {
            TypeMeaning::NumberOrPoint(kind) if self.is_iec60870() => Some(TypeMeaning::Kind(kind)),
            meaning => Some(meaning),
        }
    }

    fn add_meaning(&mut self, meaning: Option<TypeMeaning>, text: &str) {
        let what = || format!("the address, which says '{text}'");
        match meaning {
            Some(TypeMeaning::Kind(kind)) if kind.is_state() => {
                self.state.push(clue(ClueSource::Address, what(), Some(kind)));
            }
            // A text says neither of a number nor of a state.
            Some(TypeMeaning::Kind(ValueKind::Text)) => {}
            Some(TypeMeaning::Kind(kind)) => {
                self.number.push(clue(ClueSource::Address, what(), Some(kind)))
            }
            // Registers and bit strings hold states as well; counters and steps do not.
            Some(TypeMeaning::Integer) if self.is_iec60870() && !is_bit_string(text) => {
                self.number.push(clue(ClueSource::Address, what(), None));
            }
            _ => {}
        }
    }

    fn is_iec60870(&self) -> bool {
        self.family == Some(AddressFamily::Iec60870)
    }
}

fn clue(source: ClueSource, what: String, kind: Option<ValueKind>) -> Clue {
    Clue { source, what, kind }
}

/// Reports whether a type of IEC 60870-5-101 is a bit string, whose bits are states.
fn is_bit_string(text: &str) -> bool {
    let text = text.to_lowercase();
    let numbers = ["type: 7", "type: 8", "type: 33", "type_id: 7", "type_id: 8", "type_id: 33"];
    text.contains("bitstring") || text.contains("m_bo") || numbers.contains(&text.as_str())
}

fn is_bits(table: &str) -> bool {
    let table = table.to_lowercase();
    ["coil", "discrete"].iter().any(|bits| table.starts_with(bits))
}

/// Finds the protocol of an address, by its fields.
pub(crate) fn family_of(address: &Value) -> Option<AddressFamily> {
    let is_node = |text: &str| {
        ["ns=", "nsu=", "svr="].iter().any(|start| text.starts_with(start))
            || ["i=", "s=", "g=", "b="].iter().any(|start| text.starts_with(start))
    };
    match address {
        Value::String(text) if is_node(text) => Some(AddressFamily::Opc),
        Value::Object(fields) => {
            let field = |name: &str| {
                fields
                    .iter()
                    .find(|(key, _)| key.eq_ignore_ascii_case(name))
                    .map(|(_, value)| value)
            };
            let constraint = field("fc").and_then(Value::as_str).unwrap_or_default();
            if IEC60870_FIELDS.iter().any(|name| field(name).is_some()) {
                Some(AddressFamily::Iec60870)
            } else if field("node").and_then(Value::as_str).is_some_and(is_node) {
                Some(AddressFamily::Opc)
            } else if field("register").is_some() && field("type").is_some() {
                Some(AddressFamily::ModbusNumber)
            } else if constraint.eq_ignore_ascii_case("ST") {
                Some(AddressFamily::Iec61850Status)
            } else if constraint.eq_ignore_ascii_case("MX") {
                Some(AddressFamily::Iec61850Measured)
            } else {
                None
            }
        }
        _ => None,
    }
}
