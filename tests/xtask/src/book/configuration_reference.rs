//! Configuration reference, from the JSON Schema.

use anyhow::{Context, Result};
use serde_json::{Map, Value};

const INTRODUCTION: &str = "\
# Configuration keys

`cargo xtask book` generates this page from `config/busbar.schema.json`, which editors use to
complete and check a file. A key that is marked **required** must be given.
";
/// Start of a reference to another type of the schema.
const REFERENCE: &str = "#/$defs/";

/// Length of the longest example that is shown.
const MAX_EXAMPLE_BYTES: usize = 80;

/// Returns the page; the file and each type of the schema have a section.
pub(super) fn page(schema: &Value) -> Result<String> {
    let mut page = INTRODUCTION.to_owned();
    add_type("The file", schema, &mut page);
    let types = schema["$defs"].as_object().context("the schema has no types")?;
    for (name, definition) in types {
        add_type(name, definition, &mut page);
    }
    Ok(page)
}

fn add_type(name: &str, definition: &Value, page: &mut String) {
    *page += &format!("\n## {name}\n\n{}\n", cell(description(definition)));
    if let Some(properties) = definition["properties"].as_object() {
        add_keys(properties, &definition["required"], page);
    }
    for choice in choices(definition) {
        if let Some(properties) = choice["properties"].as_object() {
            let text = cell(description(choice));
            *page += &format!(
                "\nOne form{}\n",
                if text.is_empty() { ":".into() } else { format!(": {text}") }
            );
            add_keys(properties, &choice["required"], page);
        } else {
            *page += &format!("\n- {}: {}\n", type_of(choice), cell(description(choice)));
        }
    }
    if let Some(values) = definition["enum"].as_array() {
        let values: Vec<_> = values.iter().map(|value| format!("`{value}`")).collect();
        *page += &format!("\nOne of {}.\n", values.join(", "));
    }
}

fn add_keys(properties: &Map<String, Value>, required: &Value, page: &mut String) {
    *page += "\n| key | type | default | meaning |\n|---|---|---|---|\n";
    let is_required = |key: &str| {
        required.as_array().is_some_and(|keys| keys.iter().any(|required| required == key))
    };
    for (key, property) in properties {
        let default = match &property["default"] {
            _ if is_required(key) => "**required**".to_owned(),
            Value::Null => String::new(),
            value => format!("`{}`", cell(&short(value))),
        };
        *page += &format!(
            "| `{key}` | {} | {default} | {} |\n",
            type_of(property),
            cell(description(property)) + &limits(property) + &example(property)
        );
    }
}

/// Returns the type of a key, with a link where the page has a section for it.
fn type_of(property: &Value) -> String {
    if let Some(name) = property["$ref"].as_str().and_then(|r| r.strip_prefix(REFERENCE)) {
        return format!("[{name}](#{})", name.to_lowercase());
    }
    if let Some(value) = property.get("const") {
        return format!("`{}`", cell(&value.to_string()));
    }
    let alternatives = choices(property);
    if !alternatives.is_empty() {
        let mut types: Vec<_> =
            alternatives.iter().filter(|c| c["type"] != "null").map(|c| type_of(c)).collect();
        types.dedup();
        return types.join(" or ");
    }
    match &property["type"] {
        Value::String(name) if name == "array" => {
            format!("list of {}", type_of(&property["items"]))
        }
        Value::String(name) if name == "object" && property["additionalProperties"].is_object() => {
            format!("object of {}", type_of(&property["additionalProperties"]))
        }
        Value::String(name) => name.clone(),
        Value::Array(names) => {
            let names = names.iter().filter_map(Value::as_str).filter(|name| *name != "null");
            names.collect::<Vec<_>>().join(" or ")
        }
        _ => "any".to_owned(),
    }
}

fn choices(definition: &Value) -> Vec<&Value> {
    let lists = ["oneOf", "anyOf"].iter().filter_map(|name| definition[*name].as_array());
    lists.flatten().collect()
}

/// Returns the least and greatest value of a number, in parentheses.
fn limits(property: &Value) -> String {
    match (property.get("minimum"), property.get("maximum")) {
        (Some(least), Some(greatest)) => format!(" ({} to {})", short(least), short(greatest)),
        (Some(least), None) => format!(" (at least {})", short(least)),
        (None, Some(greatest)) => format!(" (at most {})", short(greatest)),
        (None, None) => String::new(),
    }
}

/// Returns the first example of a key, where it is short.
fn example(property: &Value) -> String {
    let example = property["examples"].get(0).map(|value| cell(&short(value)));
    let example = example.filter(|text| text.len() <= MAX_EXAMPLE_BYTES);
    example.map(|text| format!(" Such as `{text}`.")).unwrap_or_default()
}

/// Returns a value as JSON; whole numbers have no fraction.
fn short(value: &Value) -> String {
    let text = value.to_string();
    text.strip_suffix(".0").filter(|_| value.is_number()).map_or(text.clone(), str::to_owned)
}

fn description(definition: &Value) -> &str {
    definition["description"].as_str().unwrap_or_default()
}

/// Returns a text as the cell of a table.
fn cell(text: &str) -> String {
    text.replace('\n', " ").replace('|', "\\|").replace('<', "&lt;")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keys_have_type_default_and_meaning() {
        let schema = serde_json::json!({
            "description": "A file.",
            "properties": {
                "alarms": {
                    "type": "object", "additionalProperties": {"$ref": "#/$defs/Alarm"},
                    "description": "Alarms\nby id."
                },
                "view": {"type": ["number", "null"], "default": 0.0, "minimum": 0, "maximum": 2.0,
                         "description": "A number", "examples": [1.5]}
            },
            "required": ["alarms"],
            "$defs": {"Alarm": {"description": "An alarm.", "enum": ["a", "b"]}}
        });
        let page = page(&schema).unwrap();
        for line in [
            "## The file",
            "| `alarms` | object of [Alarm](#alarm) | **required** | Alarms by id. |",
            "| `view` | number | `0` | A number (0 to 2) Such as `1.5`. |",
            "## Alarm",
            "One of `\"a\"`, `\"b\"`.",
        ] {
            assert!(page.lines().any(|l| l == line), "{line} in\n{page}");
        }
    }
}
