//! The shape of a configuration, by its JSON Schema: keys, types, ranges.

use std::collections::HashSet;

use jsonschema::error::{TypeKind, ValidationErrorKind};
use jsonschema::{JsonType, ValidationError};
use serde_json::Value;

use crate::report::Report;
use crate::schema::CompiledSchema;
use crate::{join_pointer, pointer, suggestions};

/// Reports every value whose shape the schema refuses.
pub(crate) fn check(document: &Value, form: &'static CompiledSchema, report: &mut Report<'_>) {
    let Some(validator) = &form.validator else { return };
    if validator.is_valid(document) {
        return;
    }
    // A value may break two rules at once (not 1 or 4, and below 0): one tells.
    let mut told = HashSet::new();
    for error in validator.iter_errors(document) {
        let fault = SchemaViolation::new(&error, form);
        match error.kind() {
            ValidationErrorKind::AdditionalProperties { unexpected } => {
                for key in unexpected {
                    fault.report_unknown_key(key, report);
                }
            }
            ValidationErrorKind::Required { property } => {
                fault.report_missing_key(property.as_str().unwrap_or_default(), report);
            }
            kind => {
                if told.insert(fault.pointer.to_owned()) {
                    report.error_with(fault.pointer, || fault.describe(kind, &error));
                }
            }
        }
    }
}

/// A value that the schema refuses, and the schema that does.
struct SchemaViolation<'e> {
    pointer: &'e str,
    value: &'e Value,
    schema: &'static Value,
}

impl<'e> SchemaViolation<'e> {
    fn new(error: &'e ValidationError<'_>, form: &'static CompiledSchema) -> Self {
        let keyword_path = error.schema_path().as_str();
        let path = keyword_path.rsplit_once('/').map_or("", |(path, _)| path);
        Self {
            pointer: error.instance_path().as_str(),
            value: error.instance(),
            schema: form.schema.pointer(path).unwrap_or(&Value::Null),
        }
    }

    fn report_unknown_key(&self, key: &str, report: &mut Report<'_>) {
        let properties = self.schema["properties"].as_object();
        let known = properties.into_iter().flat_map(|p| p.keys().map(String::as_str));
        let list = || {
            let keys: Vec<String> = known.clone().map(|k| format!("'{k}'")).collect();
            format!("remove it; the keys known here are {}", keys.join(", "))
        };
        report.key_error(
            &join_pointer(self.pointer, key),
            format!("the key '{}' is not known here", suggestions::shown(key)),
            suggestions::nearest(key, known.clone())
                .map_or_else(list, |nearest| format!("did you mean '{nearest}'?")),
        );
    }

    fn report_missing_key(&self, key: &str, report: &mut Report<'_>) {
        let property = &self.schema["properties"][key];
        let remedy = match &property["examples"][0] {
            Value::Null => format!("add \"{key}\": {}", description(property)),
            example => format!("add it, such as \"{key}\": {example}"),
        };
        report.error(self.pointer, format!("the key '{key}' is missing"), remedy);
    }

    /// Returns cause and remedy of an error of the schema.
    fn describe(
        &self,
        kind: &ValidationErrorKind,
        error: &ValidationError<'_>,
    ) -> (String, String) {
        match kind {
            ValidationErrorKind::Type { kind } => self.wrong_type(kind),
            ValidationErrorKind::Minimum { limit } => (
                format!("{} is less than {limit}, the least allowed", self.value),
                self.range_remedy(),
            ),
            ValidationErrorKind::Maximum { limit } => (
                format!("{} is greater than {limit}, the most allowed", self.value),
                self.range_remedy(),
            ),
            ValidationErrorKind::Enum { options } => self.not_an_option(options.as_array()),
            ValidationErrorKind::OneOfNotValid { .. } => {
                let constants = self.schema["oneOf"].as_array().into_iter().flatten();
                self.not_an_option(Some(&constants.map(|o| o["const"].clone()).collect()))
            }
            ValidationErrorKind::Constant { expected_value } => {
                (format!("{} is not known here", self.shown()), format!("write {expected_value}"))
            }
            ValidationErrorKind::MinLength { .. } => {
                ("the text is empty".to_owned(), self.example_remedy())
            }
            ValidationErrorKind::MaxLength { limit } => (
                format!("the text has more than {limit} characters"),
                format!("shorten it to {limit} characters"),
            ),
            ValidationErrorKind::Pattern { .. } => {
                (format!("{} has not the form expected", self.shown()), self.example_remedy())
            }
            ValidationErrorKind::MinItems { limit } => (
                format!("{} elements are too few", self.count()),
                self.count_remedy("least", *limit, "elements"),
            ),
            ValidationErrorKind::MaxItems { limit } => (
                format!("{} elements are too many", self.count()),
                self.count_remedy("most", *limit, "elements"),
            ),
            ValidationErrorKind::MaxProperties { limit } => (
                format!("{} entries are too many", self.count()),
                self.count_remedy("most", *limit, "entries"),
            ),
            ValidationErrorKind::UniqueItems => {
                ("an element is given twice".to_owned(), "remove one of the two".to_owned())
            }
            _ => {
                (error.masked().to_string(), "see the schema: `busbar schema` prints it".to_owned())
            }
        }
    }

    fn wrong_type(&self, expected: &TypeKind) -> (String, String) {
        let expected: Vec<&str> = match expected {
            TypeKind::Single(one) => vec![with_article(*one)],
            TypeKind::Multiple(several) => several.iter().map(with_article).collect(),
        };
        let expected = expected.join(" or ");
        let name = pointer::last_token(self.pointer);
        let found = found(self.value);
        let cause = match name.parse::<usize>() {
            Ok(index) => format!("element {index} must be {expected}, not {found}"),
            Err(_) if name.is_empty() => {
                let title = self.schema["title"].as_str().unwrap_or("text");
                format!(
                    "the {} must be {expected}, not {found}",
                    title.trim_start_matches("Busbar ")
                )
            }
            Err(_) => format!("'{}' must be {expected}, not {found}", suggestions::shown(&name)),
        };
        let remedy = match &self.schema["examples"][0] {
            Value::Null => format!("write {expected}"),
            example => format!("write {expected}, such as {example}"),
        };
        (cause, remedy)
    }

    fn not_an_option(&self, options: Option<&Vec<Value>>) -> (String, String) {
        let options = options.map(Vec::as_slice).unwrap_or_default();
        let names = options.iter().filter_map(Value::as_str);
        let nearest = self.value.as_str().and_then(|text| suggestions::nearest(text, names));
        let remedy = match nearest {
            Some(nearest) => format!("did you mean \"{nearest}\"?"),
            None => {
                let options: Vec<String> = options.iter().map(Value::to_string).collect();
                format!("write one of {}", options.join(", "))
            }
        };
        (format!("{} is not allowed here", self.shown()), remedy)
    }

    fn range_remedy(&self) -> String {
        let (least, most) = (&self.schema["minimum"], &self.schema["maximum"]);
        match (least, most) {
            (Value::Null, most) => format!("write at most {most}"),
            (least, Value::Null) => format!("write at least {least}"),
            (least, most) => format!("write a number from {least} to {most}"),
        }
    }

    fn count_remedy(&self, bound: &str, limit: u64, what: &str) -> String {
        let (least, most) = (&self.schema["minItems"], &self.schema["maxItems"]);
        if least == most && !least.is_null() {
            format!("write exactly {limit} {what}")
        } else {
            format!("write at {bound} {limit} {what}")
        }
    }

    fn example_remedy(&self) -> String {
        match &self.schema["examples"][0] {
            Value::Null => "write a text".to_owned(),
            example => format!("write a text such as {example}"),
        }
    }

    fn count(&self) -> usize {
        match self.value {
            Value::Array(elements) => elements.len(),
            Value::Object(entries) => entries.len(),
            _ => 0,
        }
    }

    fn shown(&self) -> String {
        match self.value {
            Value::String(text) => format!("\"{}\"", suggestions::shown(text)),
            Value::Array(_) | Value::Object(_) => found(self.value).to_owned(),
            scalar => scalar.to_string(),
        }
    }
}

/// Returns the description of a property as the end of a remedy.
fn description(property: &Value) -> String {
    let text = property["description"].as_str().unwrap_or_default();
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}

fn with_article(expected: JsonType) -> &'static str {
    match expected {
        JsonType::Array => "an array",
        JsonType::Boolean => "true or false",
        JsonType::Integer => "a whole number",
        JsonType::Null => "null",
        JsonType::Number => "a number",
        JsonType::Object => "an object",
        JsonType::String => "a text",
    }
}

fn found(value: &Value) -> &'static str {
    match value {
        Value::Null => "null",
        Value::Bool(_) => "true or false",
        Value::Number(n) if n.is_f64() => "a number with fraction",
        Value::Number(_) => "a number",
        Value::String(_) => "a text",
        Value::Array(_) => "an array",
        Value::Object(_) => "an object",
    }
}
