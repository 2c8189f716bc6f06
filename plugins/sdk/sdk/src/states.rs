//! Mapping of a device's state names to values: `{"OPEN": "off", "CLOSED": "on"}`.

use std::collections::BTreeMap;

use serde_json::Value as Json;

use crate::{DoublePoint, Value, ValueKind};

/// States of one tag, at most.
const MAX_STATES: usize = 64;

/// Parses the value of each state name, for a bool or a double-point tag.
///
/// # Errors
/// What is at fault with them and what helps, for the message of a tag.
pub fn parse_states(
    kind: ValueKind,
    raw: BTreeMap<String, Json>,
) -> Result<BTreeMap<String, Value>, String> {
    if raw.len() > MAX_STATES {
        return Err(format!("{} states; at most {MAX_STATES} are allowed", raw.len()));
    }
    let parse = |json: &Json| match (kind, json) {
        (ValueKind::Bool, Json::Bool(value)) => Ok(Value::Bool(*value)),
        (ValueKind::Bool, _) => Err("states of a bool tag are true and false"),
        (ValueKind::DoublePoint, json) => json
            .as_str()
            .and_then(DoublePoint::from_name)
            .map(Value::DoublePoint)
            .ok_or("states are \"off\", \"on\", \"intermediate\" and \"bad_state\""),
        _ => Err("states are for bool and double_point tags: remove them"),
    };
    raw.into_iter()
        .map(|(name, json)| Ok((name.trim().to_owned(), parse(&json)?)))
        .collect::<Result<_, &str>>()
        .map_err(str::to_owned)
}
