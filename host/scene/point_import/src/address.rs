//! Cells of addresses: JSON values, or plain texts and numbers.

use serde_json::Value;

/// The deepest nesting of arrays and objects in an address; a configuration has room for
/// more.
pub(crate) const MAX_ADDRESS_DEPTH: usize = 32;

/// A number as number, `true` as truth, JSON as JSON; all else is text.
pub fn cell_value(text: &str) -> Value {
    serde_json::from_str(text).unwrap_or_else(|_| match text.to_lowercase().as_str() {
        "true" => true.into(),
        "false" => false.into(),
        _ => text.into(),
    })
}

/// Returns the nesting depth of arrays and objects; 0 for a plain value. The JSON parser has
/// bounded it.
pub(crate) fn depth(value: &Value) -> usize {
    match value {
        Value::Array(values) => 1 + values.iter().map(depth).max().unwrap_or(0),
        Value::Object(fields) => 1 + fields.values().map(depth).max().unwrap_or(0),
        _ => 0,
    }
}
