//! Points of a list, each valid.

use busbar_types::ValueKind;
use serde_json::Value;

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
    pub value_type: ValueKind,
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
