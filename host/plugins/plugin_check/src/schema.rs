//! Settings generated from a JSON Schema: the least that it accepts, and invalid ones.

use serde_json::{Map, Value, json};

/// References followed, and levels descended.
const MAX_DEPTH: u32 = 16;
/// A setting that no plugin has.
pub(crate) const UNKNOWN_SETTING: &str = "no_such_setting_of_any_plugin";

/// Generates the least settings that a simple schema accepts: defaults or examples, and required
/// keys.
pub(crate) fn least(schema: Option<&Value>) -> Value {
    match schema {
        None => json!({}),
        Some(schema) => match least_of(schema, schema, MAX_DEPTH) {
            Value::Object(object) => Value::Object(object),
            _ => json!({}),
        },
    }
}

fn least_of(root: &Value, schema: &Value, depth: u32) -> Value {
    if depth == 0 {
        return Value::Null;
    }
    if let Some(target) = schema["$ref"].as_str().and_then(|path| path.strip_prefix('#')) {
        return root.pointer(target).map_or(Value::Null, |s| least_of(root, s, depth - 1));
    }
    let first = |key: &str| schema[key].as_array().and_then(|list| list.first()).cloned();
    let known = schema.get("default").or_else(|| schema.get("const")).cloned();
    if let Some(value) = known.or_else(|| first("examples")).or_else(|| first("enum")) {
        return value;
    }
    for key in ["anyOf", "oneOf", "allOf"] {
        if let Some(choice) = first(key) {
            return least_of(root, &choice, depth - 1);
        }
    }
    let kind = match &schema["type"] {
        Value::Array(kinds) => kinds.first().and_then(Value::as_str).unwrap_or_default(),
        kind => kind.as_str().unwrap_or_default(),
    };
    match kind {
        "object" => {
            let required = schema["required"].as_array().into_iter().flatten();
            let value = |name: &str| least_of(root, &schema["properties"][name], depth - 1);
            let names = required.filter_map(Value::as_str);
            Value::Object(names.map(|name| (name.to_owned(), value(name))).collect())
        }
        "array" => {
            let count = schema["minItems"].as_u64().unwrap_or(0).min(64);
            (0..count).map(|_| least_of(root, &schema["items"], depth - 1)).collect()
        }
        "string" => {
            let least = schema["minLength"].as_u64().unwrap_or(1).clamp(1, 1024) as usize;
            "x".repeat(least).into()
        }
        "integer" | "number" => {
            let least = schema.get("minimum").or_else(|| schema.get("exclusiveMinimum"));
            let least = least.and_then(Value::as_f64).unwrap_or(0.0);
            let step = f64::from(u8::from(schema.get("exclusiveMinimum").is_some()));
            if kind == "integer" { json!((least + step) as i64) } else { json!(least + step) }
        }
        "boolean" => json!(false),
        _ => Value::Null,
    }
}

/// Generates settings with one invalid property each, from valid ones, with a description of the
/// error.
pub(crate) fn wrong(schema: &Value, right: &Map<String, Value>) -> Vec<(String, Value)> {
    let mut wrong = Vec::new();
    let mut add = |what: String, name: &str, value: Value| {
        let mut settings = right.clone();
        settings.insert(name.to_owned(), value);
        wrong.push((what, Value::Object(settings)));
    };
    add("a setting that does not exist".into(), UNKNOWN_SETTING, json!(1));
    for (name, property) in schema["properties"].as_object().into_iter().flatten() {
        // Of every JSON type one value that no plugin wants.
        let odd = [json!([[[]]]), json!({ UNKNOWN_SETTING: [] })];
        for value in odd {
            add(format!("'{name}' = {value}"), name, value);
        }
        for (bound, step) in [("minimum", -1.0), ("maximum", 1.0)] {
            if let Some(bound) = property[bound].as_f64() {
                add(format!("'{name}' = {}", bound + step), name, json!(bound + step));
            }
        }
    }
    wrong
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_least_settings_fit_their_schema() {
        for (schema, expected) in [
            (json!({"type": "object"}), json!({})),
            (
                json!({"type": "object", "required": ["host", "port", "mode"],
                    "properties": {"host": {"type": "string", "minLength": 3},
                        "port": {"type": "integer", "minimum": 1}, "extra": {"type": "number"},
                        "mode": {"$ref": "#/$defs/Mode"}},
                    "$defs": {"Mode": {"enum": ["slow", "fast"]}}}),
                json!({"host": "xxx", "port": 1, "mode": "slow"}),
            ),
            (
                json!({"type": "object", "required": ["a"], "properties": {
                    "a": {"type": "string", "examples": ["127.0.0.1:7000"]}}}),
                json!({"a": "127.0.0.1:7000"}),
            ),
        ] {
            let least = least(Some(&schema));
            assert_eq!(least, expected);
            assert!(jsonschema::is_valid(&schema, &least));
        }
        assert_eq!(least(None), json!({}));
    }

    #[test]
    fn a_schema_that_names_itself_ends() {
        let schema = json!({"type": "object", "required": ["a"],
            "properties": {"a": {"$ref": "#"}}});
        assert!(least(Some(&schema)).is_object());
    }

    #[test]
    fn wrong_settings_break_a_strict_schema() {
        let schema = json!({"type": "object", "additionalProperties": false,
            "properties": {"rate": {"type": "number", "minimum": 0, "maximum": 10}}});
        let wrong = wrong(&schema, &Map::new());
        assert_eq!(wrong.len(), 5);
        assert!(wrong.iter().all(|(_, settings)| !jsonschema::is_valid(&schema, settings)));
    }
}
