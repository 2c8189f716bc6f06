//! The two extensions that say whose a triangle is: EXT_mesh_features gives
//! each vertex a feature, EXT_structural_metadata gives features their names. And
//! KHR_texture_basisu, which names KTX2 images of textures.
//!
//! The types of `gltf::json` leave extensions out, so they are parsed here, in
//! a pass of their own, which builds no more than a few words a primitive and
//! a bounded number of tables.

use gltf::json::Root;
use serde::Deserialize;

use crate::bounded::{List, Members};
use crate::document::pointer;
use crate::error::ImportError;
use crate::scan::json_fault;

pub(crate) const MESH_FEATURES: &str = "EXT_mesh_features";
pub(crate) const STRUCTURAL_METADATA: &str = "EXT_structural_metadata";
pub(crate) const TEXTURE_BASISU: &str = "KHR_texture_basisu";

/// Before the number of the set, in names of vertex attributes.
const ATTRIBUTE_PREFIX: &str = "_FEATURE_ID_";

/// Contents of the supported extensions; empty where a file does not use them.
#[derive(Default, Deserialize)]
pub(crate) struct Extensions {
    #[serde(default)]
    meshes: Vec<Mesh>,
    #[serde(default)]
    textures: Vec<TextureEntry>,
    #[serde(default)]
    extensions: Option<RootExtensions>,
}

#[derive(Deserialize)]
struct TextureEntry {
    #[serde(default)]
    extensions: Option<TextureExtensions>,
}

#[derive(Deserialize)]
struct TextureExtensions {
    #[serde(rename = "KHR_texture_basisu")]
    basisu: Option<BasisSource>,
}

#[derive(Deserialize)]
struct BasisSource {
    source: Option<u64>,
}

#[derive(Deserialize)]
pub(crate) struct Mesh {
    #[serde(default)]
    primitives: Vec<Primitive>,
}

#[derive(Deserialize)]
pub(crate) struct Primitive {
    #[serde(default)]
    attributes: FeatureAttributes,
    #[serde(default)]
    extensions: Option<PrimitiveExtensions>,
}

#[derive(Deserialize)]
struct PrimitiveExtensions {
    #[serde(rename = "EXT_mesh_features")]
    mesh_features: Option<Box<MeshFeatures>>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
struct MeshFeatures {
    #[serde(default)]
    feature_ids: FeatureIdSets,
}

/// The set of feature ids that is read, and how many are not.
#[derive(Default, Deserialize)]
#[serde(from = "List<FeatureIdSet>")]
struct FeatureIdSets {
    /// The first set by a vertex attribute, and its place in the list.
    by_attribute: Option<(usize, FeatureIdSet)>,
    skipped: usize,
}

/// One set of feature ids. Its `featureCount` is not read: it bounds nothing.
#[derive(Clone, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(crate) struct FeatureIdSet {
    attribute: Option<u64>,
    pub(crate) property_table: Option<u64>,
    pub(crate) null_feature_id: Option<u64>,
}

/// Accessors of the vertex attributes that hold feature ids, by their number.
#[derive(Default, Deserialize)]
#[serde(from = "Members<u64>")]
struct FeatureAttributes(Vec<(u64, u64)>);

#[derive(Deserialize)]
struct RootExtensions {
    #[serde(rename = "EXT_structural_metadata")]
    structural_metadata: Option<StructuralMetadata>,
}

#[derive(Default, Deserialize)]
#[serde(rename_all = "camelCase")]
struct StructuralMetadata {
    schema: Option<Schema>,
    #[serde(default)]
    property_tables: List<PropertyTable>,
}

#[derive(Deserialize)]
struct Schema {
    #[serde(default)]
    classes: Members<Class>,
}

/// Types of the columns of a property table.
#[derive(Deserialize)]
pub(crate) struct Class {
    #[serde(default)]
    properties: Members<ClassProperty>,
}

#[derive(Deserialize)]
struct ClassProperty {
    #[serde(rename = "type")]
    value_type: String,
    #[serde(default)]
    array: bool,
}

/// Values of features, a row each.
#[derive(Deserialize)]
pub(crate) struct PropertyTable {
    class: String,
    pub(crate) count: u64,
    #[serde(default)]
    properties: Members<Column>,
}

/// Views of a column's values.
#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(crate) struct Column {
    pub(crate) values: u64,
    pub(crate) string_offsets: Option<u64>,
    pub(crate) string_offset_type: Option<String>,
}

/// The set that a primitive's features come from.
pub(crate) struct PrimitiveFeatures<'a> {
    /// Place in the list of sets.
    pub(crate) index: usize,
    pub(crate) set: &'a FeatureIdSet,
    /// Accessor of its attribute, if the primitive has that.
    pub(crate) accessor: Option<u64>,
    /// Name of its attribute.
    pub(crate) attribute: String,
}

/// Parses the contents of these extensions, if the file uses them.
pub(crate) fn parse(json: &[u8], root: &Root) -> Result<Extensions, ImportError> {
    let is_known = |name: &String| [MESH_FEATURES, TEXTURE_BASISU].contains(&name.as_str());
    if !root.extensions_used.iter().any(is_known) {
        return Ok(Extensions::default());
    }
    let parser = &mut serde_json::Deserializer::from_slice(json);
    serde_path_to_error::deserialize(parser)
        .map_err(|e: serde_path_to_error::Error<_>| json_fault(e.inner()).at(pointer(e.path())))
}

impl Extensions {
    fn sets(&self, mesh: usize, primitive: usize) -> Option<(&Primitive, &FeatureIdSets)> {
        let primitive = self.meshes.get(mesh)?.primitives.get(primitive)?;
        let features = primitive.extensions.as_ref()?.mesh_features.as_ref()?;
        Some((primitive, &features.feature_ids))
    }

    /// Returns the source of a primitive's feature ids, if it has any.
    pub(crate) fn features(&self, mesh: usize, primitive: usize) -> Option<PrimitiveFeatures<'_>> {
        let (primitive, sets) = self.sets(mesh, primitive)?;
        let (index, set) = sets.by_attribute.as_ref()?;
        let number = set.attribute?;
        let known = primitive.attributes.0.iter().find(|(known, _)| *known == number);
        Some(PrimitiveFeatures {
            index: *index,
            set,
            accessor: known.map(|&(_, accessor)| accessor),
            attribute: format!("{ATTRIBUTE_PREFIX}{number}"),
        })
    }

    /// Returns the image that KHR_texture_basisu names for a texture.
    pub(crate) fn basis_source(&self, texture: usize) -> Option<usize> {
        let source = self.textures.get(texture)?.extensions.as_ref()?.basisu.as_ref()?.source?;
        usize::try_from(source).ok()
    }

    /// Returns how many further sets of feature ids a primitive has.
    pub(crate) fn skipped_sets(&self, mesh: usize, primitive: usize) -> usize {
        self.sets(mesh, primitive).map_or(0, |(_, sets)| sets.skipped)
    }

    pub(crate) fn property_tables(&self) -> &[PropertyTable] {
        self.metadata().map_or(&[], |metadata| &metadata.property_tables.0)
    }

    /// Returns the class of a table, if the file itself holds it.
    pub(crate) fn class_of(&self, table: &PropertyTable) -> Option<&Class> {
        let classes = &self.metadata()?.schema.as_ref()?.classes.0;
        classes.iter().find(|(name, _)| *name == table.class).map(|(_, class)| class)
    }

    fn metadata(&self) -> Option<&StructuralMetadata> {
        self.extensions.as_ref()?.structural_metadata.as_ref()
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
            property.is_some_and(|(_, p)| p.value_type == "STRING" && !p.array)
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

impl From<Members<u64>> for FeatureAttributes {
    fn from(attributes: Members<u64>) -> Self {
        let number = |name: &str| name.strip_prefix(ATTRIBUTE_PREFIX)?.parse().ok();
        let attributes = attributes.0.into_iter();
        Self(attributes.filter_map(|(name, accessor)| Some((number(&name)?, accessor))).collect())
    }
}
