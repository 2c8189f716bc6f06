//! The JSON Schema of a configuration.

use std::sync::LazyLock;

use serde_json::Value;

use crate::raw::RawConfig;

static SCHEMA: LazyLock<Value> = LazyLock::new(|| schemars::schema_for!(RawConfig).to_value());

/// The JSON Schema (2020-12) of a configuration, generated from the types
/// that are read. It says all about shape and range; that names exist is
/// checked by [`crate::parse`] alone.
pub fn schema() -> Value {
    SCHEMA.clone()
}

/// The same without a copy.
pub(crate) fn shared() -> &'static Value {
    &SCHEMA
}
