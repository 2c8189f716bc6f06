//! Points of a list, each valid.

use serde_json::Value;

/// Type of a tag's value, as the configuration has it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum PointType {
    /// A number with fraction.
    #[default]
    F64,
    /// Type of whole numbers.
    I64,
    /// Type of on and off.
    Bool,
    /// A switch position in two bits.
    DoublePoint,
}

/// A point of a list.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Point {
    /// Line in the list, from 1.
    pub line: u64,
    /// Id of the tag.
    pub tag: String,
    /// Name shown to people; may be empty.
    pub description: String,
    /// Type of its value.
    pub value_type: PointType,
    /// Unit; may be empty.
    pub unit: String,
    /// Plausible range: least, greatest.
    pub range: [Option<f64>; 2],
    /// Normal band: least, greatest.
    pub limits: [Option<f64>; 2],
    /// Age past which a value is stale, milliseconds.
    pub freshness_millis: Option<u64>,
    /// Factor and offset from the number that comes to the unit.
    pub scale: Option<[f64; 2]>,
    /// The node that the list binds it to; empty for none.
    pub node: String,
    /// Role of the value for the node; empty where the list gives none.
    pub role: String,
    /// Name of the plugin instance; empty for the only one.
    pub plugin: String,
    /// Address, which only the plugin understands.
    pub address: Value,
}

impl PointType {
    /// The word of the configuration.
    pub fn word(self) -> &'static str {
        match self {
            Self::F64 => "f64",
            Self::I64 => "i64",
            Self::Bool => "bool",
            Self::DoublePoint => "double_point",
        }
    }

    /// Reports whether the type is a state, as opposed to a measured value.
    pub fn is_state(self) -> bool {
        matches!(self, Self::Bool | Self::DoublePoint)
    }
}
