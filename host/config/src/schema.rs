//! The JSON Schema of a configuration.

use std::sync::LazyLock;

use jsonschema::Validator;
use schemars::JsonSchema;
use serde_json::Value;

use crate::raw::RawConfig;

/// The form of configurations.
pub(crate) static CONFIGURATION: LazyLock<Form> = LazyLock::new(Form::of::<RawConfig>);

/// The form of a kind of text, generated from the types that it is read into.
pub(crate) struct Form {
    pub(crate) schema: Value,
    /// None only if the schema itself were wrong, which the tests rule out.
    pub(crate) validator: Option<Validator>,
}

impl Form {
    pub(crate) fn of<T: JsonSchema>() -> Self {
        let schema = schemars::schema_for!(T).to_value();
        let validator = jsonschema::draft202012::new(&schema).ok();
        Self { schema, validator }
    }
}

/// The JSON Schema (2020-12) of a configuration, generated from the types
/// that are read. It says all about shape and range; that names exist is
/// checked by [`crate::parse`] alone.
pub fn schema() -> Value {
    CONFIGURATION.schema.clone()
}
