//! Scene of a model file, by name or by index.

use std::borrow::Cow;

use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::Deserialize;

use crate::limits::MAX_NAME_BYTES;

/// Scene of a model file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum ModelSceneConfig {
    /// By its name in the file.
    Name(String),
    /// By its place in the file, from 0.
    Index(u32),
}

/// Scene of a model file.
#[derive(Debug, Deserialize)]
#[serde(untagged)]
pub(crate) enum RawModelScene {
    /// By its name in the file.
    Name(String),
    /// By its place in the file, from 0.
    Index(u32),
}

/// One schema for both forms: `anyOf` would blur where a fault is.
impl JsonSchema for RawModelScene {
    fn schema_name() -> Cow<'static, str> {
        "ModelScene".into()
    }

    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        json_schema!({
            "description": "Scene of a model file: its name, or its index from 0.",
            "type": ["string", "integer"],
            "minLength": 1,
            "maxLength": MAX_NAME_BYTES,
            "minimum": 0,
            "maximum": u32::MAX,
            "examples": ["Station", 1],
        })
    }
}

impl RawModelScene {
    pub(crate) fn resolve(self) -> ModelSceneConfig {
        match self {
            Self::Name(name) => ModelSceneConfig::Name(name),
            Self::Index(index) => ModelSceneConfig::Index(index),
        }
    }
}
