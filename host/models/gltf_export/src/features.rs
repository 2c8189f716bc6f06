//! Feature export (EXT_mesh_features): an id a vertex, and a table of names a mesh.

use std::collections::HashSet;

use busbar_geometry::{Mesh, NO_FEATURE};

use crate::binary::Binary;
use crate::document::Document;
use crate::extensions::{
    Class, ClassProperty, Column, Equipment, Extensions, FeatureIdSet, MESH_FEATURES, MeshFeatures,
    PrimitiveExtensions, PropertyTable, STRUCTURAL_METADATA, Schema, StructuralMetadata,
};

/// The largest id that every reader sees exactly: wider ones are floats, since
/// glTF has no 32-bit integers as attributes (glTF 2.0, section 3.7.2.1).
pub(crate) const MAX_FEATURE_ID: u32 = 1 << 24;

/// Writer of one mesh's features.
#[derive(Clone, Copy)]
pub(crate) struct MeshFeatureWriter<'a> {
    mesh: &'a Mesh,
    /// Property table of the names, if there are names.
    table: Option<u32>,
    /// Id written for [`NO_FEATURE`]: the first id after all others.
    null: u32,
}

/// The feature ids of one primitive's vertices.
pub(crate) struct VertexFeatures {
    pub(crate) ids: Vec<u32>,
    /// Width of the ids: whether two bytes hold every id of the mesh.
    pub(crate) is_narrow: bool,
    set: FeatureIdSet,
}

impl<'a> MeshFeatureWriter<'a> {
    pub(crate) fn new(mesh: &'a Mesh, names: &[String], tables: &mut PropertyTables) -> Self {
        let used = mesh.features.iter().filter(|&&feature| feature != NO_FEATURE).max();
        let null = used.map_or(0, |&largest| largest + 1).max(names.len() as u32);
        Self { mesh, table: used.and_then(|_| tables.add(names)), null }
    }

    /// Collects the feature ids of vertices; `None` where no vertex has a feature.
    pub(crate) fn vertex_features(&self, wedges: &[u32]) -> Option<VertexFeatures> {
        let mesh = self.mesh;
        let feature = |&wedge: &u32| {
            let position = mesh.wedges.position[wedge as usize];
            mesh.features.get(position as usize).copied().unwrap_or(NO_FEATURE)
        };
        let mut different: HashSet<u32> = wedges.iter().map(feature).collect();
        let some_without = different.remove(&NO_FEATURE);
        if different.is_empty() {
            return None;
        }
        let id = |wedge| Some(feature(wedge)).filter(|&f| f != NO_FEATURE).unwrap_or(self.null);
        Some(VertexFeatures {
            ids: wedges.iter().map(id).collect(),
            is_narrow: self.null <= u16::MAX.into(),
            set: FeatureIdSet {
                feature_count: different.len(),
                null_feature_id: some_without.then_some(self.null),
                attribute: 0,
                property_table: self.table,
            },
        })
    }
}

impl VertexFeatures {
    pub(crate) fn into_extension(self) -> PrimitiveExtensions {
        PrimitiveExtensions { mesh_features: MeshFeatures { feature_ids: [self.set] } }
    }
}

/// The tables of names, one for each mesh whose features have names.
#[derive(Default)]
pub(crate) struct PropertyTables {
    tables: Vec<(usize, NameColumn)>,
}

/// Names as a column of strings.
struct NameColumn {
    bytes: Vec<u8>,
    offsets: Vec<u8>,
}

impl PropertyTables {
    fn add(&mut self, names: &[String]) -> Option<u32> {
        if names.is_empty() {
            return None;
        }
        let bytes: Vec<u8> = names.iter().flat_map(|name| name.bytes()).collect();
        let ends = names.iter().scan(0, |end, name| {
            // What saturates is refused as too large a file.
            *end = u32::saturating_add(*end, name.len() as u32);
            Some(*end)
        });
        let offsets = std::iter::once(0).chain(ends).flat_map(u32::to_le_bytes).collect();
        self.tables.push((names.len(), NameColumn { bytes, offsets }));
        Some(self.tables.len() as u32 - 1)
    }

    /// Writes the tables, and says which extensions the document uses.
    pub(crate) fn finish(self, document: &mut Document, binary: &mut Binary) {
        let primitives = || document.meshes.iter().flat_map(|mesh| &mesh.primitives);
        if primitives().any(|primitive| primitive.extensions.is_some()) {
            document.use_extension(MESH_FEATURES);
        }
        if self.tables.is_empty() {
            return;
        }
        document.use_extension(STRUCTURAL_METADATA);
        let table = |(count, column): (usize, NameColumn)| PropertyTable {
            class: "equipment",
            count,
            properties: Equipment {
                equipment: Column {
                    values: binary.embed(column.bytes),
                    string_offsets: binary.embed(column.offsets),
                    string_offset_type: "UINT32",
                },
            },
        };
        let property_tables = self.tables.into_iter().map(table).collect();
        let property = ClassProperty { value_type: "STRING", required: true };
        let class = Class { properties: Equipment { equipment: property } };
        let schema = Schema { id: "busbar", classes: Equipment { equipment: class } };
        let structural_metadata = StructuralMetadata { schema, property_tables };
        document.extensions = Some(Extensions { structural_metadata });
    }
}
