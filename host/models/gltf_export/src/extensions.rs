//! JSON of EXT_mesh_features (features of a primitive's vertices), of EXT_structural_metadata
//! (names of the features) and of KHR_materials_emissive_strength.

use serde::Serialize;

pub(crate) const MESH_FEATURES: &str = "EXT_mesh_features";
pub(crate) const STRUCTURAL_METADATA: &str = "EXT_structural_metadata";
pub(crate) const EMISSIVE_STRENGTH: &str = "KHR_materials_emissive_strength";

#[derive(Serialize)]
pub(crate) struct MaterialExtensions {
    #[serde(rename = "KHR_materials_emissive_strength")]
    pub(crate) emissive_strength: EmissiveStrength,
}

/// Factor of the emitted light, which the material's own factor keeps below one.
#[derive(Serialize)]
#[serde(rename_all = "camelCase")]
pub(crate) struct EmissiveStrength {
    pub(crate) emissive_strength: f32,
}

#[derive(Serialize)]
pub(crate) struct PrimitiveExtensions {
    #[serde(rename = "EXT_mesh_features")]
    pub(crate) mesh_features: MeshFeatures,
}

#[derive(Serialize)]
#[serde(rename_all = "camelCase")]
pub(crate) struct MeshFeatures {
    pub(crate) feature_ids: [FeatureIdSet; 1],
}

/// Features by a vertex attribute, `_FEATURE_ID_<attribute>`.
#[derive(Serialize)]
#[serde(rename_all = "camelCase")]
pub(crate) struct FeatureIdSet {
    pub(crate) feature_count: usize,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) null_feature_id: Option<u32>,
    pub(crate) attribute: u32,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) property_table: Option<u32>,
}

#[derive(Serialize)]
pub(crate) struct Extensions {
    #[serde(rename = "EXT_structural_metadata")]
    pub(crate) structural_metadata: StructuralMetadata,
}

#[derive(Serialize)]
#[serde(rename_all = "camelCase")]
pub(crate) struct StructuralMetadata {
    pub(crate) schema: Schema,
    pub(crate) property_tables: Vec<PropertyTable>,
}

/// One class with one property, both called `equipment`.
#[derive(Serialize)]
pub(crate) struct Schema {
    pub(crate) id: &'static str,
    pub(crate) classes: Equipment<Class>,
}

#[derive(Serialize)]
pub(crate) struct Class {
    pub(crate) properties: Equipment<ClassProperty>,
}

#[derive(Serialize)]
pub(crate) struct ClassProperty {
    #[serde(rename = "type")]
    pub(crate) value_type: &'static str,
    pub(crate) required: bool,
}

#[derive(Serialize)]
pub(crate) struct PropertyTable {
    pub(crate) class: &'static str,
    pub(crate) count: usize,
    pub(crate) properties: Equipment<Column>,
}

/// Strings one after another, and where each begins and the last one ends.
#[derive(Serialize)]
#[serde(rename_all = "camelCase")]
pub(crate) struct Column {
    pub(crate) values: u32,
    pub(crate) string_offsets: u32,
    pub(crate) string_offset_type: &'static str,
}

/// An object with the only key that is written.
#[derive(Serialize)]
pub(crate) struct Equipment<T> {
    pub(crate) equipment: T,
}
