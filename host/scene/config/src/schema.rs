//! The JSON Schema of a configuration.

use std::sync::LazyLock;

use jsonschema::Validator;
use schemars::JsonSchema;
use serde_json::Value;

use crate::former_names::FormerNames;
use crate::raw::RawConfig;

/// The form of configurations.
pub(crate) static CONFIGURATION: LazyLock<CompiledSchema> =
    LazyLock::new(CompiledSchema::from_type::<RawConfig>);

/// The form of a kind of text, generated from the types that it is read into.
pub(crate) struct CompiledSchema {
    pub(crate) schema: Value,
    /// Compiled validator; none only for an invalid schema, which the tests rule out.
    pub(crate) validator: Option<Validator>,
    /// Former names of its settings.
    pub(crate) former_names: FormerNames,
}

impl CompiledSchema {
    pub(crate) fn from_type<T: JsonSchema>() -> Self {
        let schema = schemars::schema_for!(T).to_value();
        let validator = jsonschema::draft202012::new(&schema).ok();
        let former_names = FormerNames::new(&schema);
        Self { schema, validator, former_names }
    }
}

/// Returns the JSON Schema (2020-12) of a configuration, generated from the raw types. It covers
/// shape and ranges; that names exist is checked by [`crate::parse`] alone.
pub fn schema() -> Value {
    CONFIGURATION.schema.clone()
}
