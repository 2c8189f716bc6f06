//! The two extensions that say whose a triangle is: EXT_mesh_features gives
//! each vertex a feature, EXT_structural_metadata gives features their names.

use serde::Deserialize;

use crate::bounded::{List, Members};
use crate::document::Document;
use crate::error::ImportError;
use crate::scalars::{Flag, Whole};
use crate::schema::Primitive;

pub(crate) const MESH_FEATURES: &str = "EXT_mesh_features";
pub(crate) const STRUCTURAL_METADATA: &str = "EXT_structural_metadata";

/// Before the number of the set, in names of vertex attributes.
const ATTRIBUTE_PREFIX: &str = "_FEATURE_ID_";

/// The set of feature ids that is read, and how many are not.
#[derive(Default, Deserialize)]
#[serde(from = "List<FeatureIdSet>")]
pub(crate) struct FeatureIdSets {
    /// The first set by a vertex attribute, and its place in the list.
    by_attribute: Option<(usize, FeatureIdSet)>,
    skipped: usize,
}

/// One set of feature ids. Its `featureCount` is not read: it bounds nothing.
#[derive(Clone, Copy, Deserialize)]
#[serde(rename_all = "camelCase", expecting = "an object")]
pub(crate) struct FeatureIdSet {
    attribute: Option<Whole>,
    pub(crate) property_table: Option<Whole>,
    pub(crate) null_feature_id: Option<Whole>,
}

#[derive(Deserialize)]
#[serde(expecting = "an object")]
struct RootExtensions {
    #[serde(rename = "EXT_structural_metadata")]
    structural_metadata: Option<StructuralMetadata>,
}

/// Property tables and the types of their columns.
#[derive(Default, Deserialize)]
#[serde(rename_all = "camelCase", expecting = "an object")]
pub(crate) struct StructuralMetadata {
    schema: Option<Schema>,
    #[serde(default)]
    property_tables: List<PropertyTable>,
}

#[derive(Deserialize)]
#[serde(expecting = "an object")]
struct Schema {
    #[serde(default)]
    classes: Members<Class>,
}

/// Types of the columns of a property table.
#[derive(Deserialize)]
#[serde(expecting = "an object")]
pub(crate) struct Class {
    #[serde(default)]
    properties: Members<ClassProperty>,
}

#[derive(Deserialize)]
#[serde(expecting = "an object")]
struct ClassProperty {
    #[serde(rename = "type")]
    value_type: String,
    #[serde(default)]
    array: Flag,
}

/// Values of features, a row each.
#[derive(Deserialize)]
#[serde(expecting = "an object")]
pub(crate) struct PropertyTable {
    class: String,
    pub(crate) count: Whole,
    #[serde(default)]
    properties: Members<Column>,
}

/// Views of a column's values.
#[derive(Deserialize)]
#[serde(rename_all = "camelCase", expecting = "an object")]
pub(crate) struct Column {
    pub(crate) values: Whole,
    pub(crate) string_offsets: Option<Whole>,
    pub(crate) string_offset_type: Option<String>,
}

/// The set that a primitive's features come from.
pub(crate) struct PrimitiveFeatures {
    /// Place in the list of sets.
    pub(crate) index: usize,
    pub(crate) set: FeatureIdSet,
    /// Accessor of its attribute, if the primitive has that.
    pub(crate) accessor: Option<Whole>,
    /// Name of its attribute.
    pub(crate) attribute: String,
}

impl Primitive {
    fn feature_id_sets(&self) -> Option<&FeatureIdSets> {
        Some(&self.extensions.as_ref()?.mesh_features.as_ref()?.feature_ids)
    }

    /// Returns the source of the feature ids, if there is any.
    pub(crate) fn features(&self) -> Option<PrimitiveFeatures> {
        let (index, set) = self.feature_id_sets()?.by_attribute?;
        let attribute = format!("{ATTRIBUTE_PREFIX}{}", set.attribute?.0);
        Some(PrimitiveFeatures { index, set, accessor: self.attribute(&attribute), attribute })
    }

    /// Returns how many further sets of feature ids there are.
    pub(crate) fn skipped_feature_id_sets(&self) -> usize {
        self.feature_id_sets().map_or(0, |sets| sets.skipped)
    }
}

impl StructuralMetadata {
    /// Parses the metadata of a file; empty without any.
    pub(crate) fn parse(document: &Document<'_>) -> Result<Self, ImportError> {
        let extensions: Option<RootExtensions> = document.extensions()?;
        Ok(extensions.and_then(|extensions| extensions.structural_metadata).unwrap_or_default())
    }

    pub(crate) fn property_tables(&self) -> &[PropertyTable] {
        &self.property_tables.0
    }

    /// Returns the class of a table, if the file itself holds it.
    pub(crate) fn class_of(&self, table: &PropertyTable) -> Option<&Class> {
        let classes = &self.schema.as_ref()?.classes.0;
        classes.iter().find(|(name, _)| *name == table.class).map(|(_, class)| class)
    }
}

impl PropertyTable {
    /// Iterates over the columns that hold one string a row, in the file's order.
    pub(crate) fn strings<'a>(
        &'a self,
        class: &'a Class,
    ) -> impl Iterator<Item = &'a (String, Column)> {
        self.properties.0.iter().filter(|(column, _)| {
            let mut properties = class.properties.0.iter();
            let property = properties.find(|(name, _)| name == column);
            property.is_some_and(|(_, p)| p.value_type == "STRING" && !p.array.0)
        })
    }
}

impl From<List<FeatureIdSet>> for FeatureIdSets {
    fn from(sets: List<FeatureIdSet>) -> Self {
        let count = sets.0.len();
        let mut indexed = sets.0.into_iter().enumerate();
        let by_attribute = indexed.find(|(_, set)| set.attribute.is_some());
        let skipped = count - usize::from(by_attribute.is_some());
        Self { by_attribute, skipped }
    }
}
