//! Primitives: the accessors of one primitive, and its triangles.

use std::collections::HashMap;

use busbar_geometry::RawPrimitive;
use glam::{Vec2, Vec3};
use gltf::Semantic;
use gltf::json::accessor::{ComponentType, Type};
use gltf::json::mesh::Mode;
use gltf::json::validation::Checked;
use gltf::json::{self, Root};

use crate::accessor::Accessor;
use crate::buffers::Buffers;
use crate::error::{ImportError, ImportFault, item};
use crate::extensions::{Extensions, MESH_FEATURES, PrimitiveFeatures};
use crate::features::FeatureIds;
use crate::report::Notes;

use ComponentType::{F32, I8, I16, U8, U16, U32};

/// A primitive whose accessors all have their bytes.
pub(crate) struct Primitive<'a> {
    pub(crate) positions: Accessor<'a>,
    pub(crate) normals: Option<Accessor<'a>>,
    pub(crate) uvs: Option<Accessor<'a>>,
    pub(crate) features: Option<FeatureIds<'a>>,
    pub(crate) indices: Option<Accessor<'a>>,
    material: Option<u32>,
    mode: Mode,
}

/// Position of a primitive in the file.
#[derive(Clone, Copy)]
pub(crate) struct PrimitivePlace {
    pub(crate) mesh: usize,
    pub(crate) primitive: usize,
}

impl PrimitivePlace {
    pub(crate) fn pointer(self, field: &str) -> String {
        format!("/meshes/{}/primitives/{}{field}", self.mesh, self.primitive)
    }
}

impl<'a> Primitive<'a> {
    /// Describes a primitive; `None` for points and lines, which have no triangles.
    pub(crate) fn new(
        root: &'a Root,
        buffers: &Buffers<'a>,
        extensions: &Extensions,
        primitive: &json::mesh::Primitive,
        place: PrimitivePlace,
    ) -> Result<Option<Self>, ImportError> {
        let Checked::Valid(mode) = primitive.mode else {
            return Err(ImportFault::Invalid("unknown mode".into()).at(place.pointer("/mode")));
        };
        if !matches!(mode, Mode::Triangles | Mode::TriangleStrip | Mode::TriangleFan) {
            return Ok(None);
        }
        let material = match primitive.material {
            None => None,
            Some(material) => {
                let place = || place.pointer("/material");
                item(&root.materials, material.value(), "material", place)?;
                Some(material.value() as u32)
            }
        };
        let accessor = |index: usize, field: &str, rule: AccessorRule| {
            let accessor = Accessor::new(root, buffers, index, || place.pointer(field))?;
            rule.check(&accessor, || place.pointer(field))?;
            Ok(accessor)
        };
        let attribute = |semantic: Semantic, name: &str, rule: AccessorRule| {
            let index = primitive.attributes.get(&Checked::Valid(semantic));
            let field = format!("/attributes/{name}");
            index.map(|index| accessor(index.value(), &field, rule)).transpose()
        };
        let Some(positions) = attribute(Semantic::Positions, "POSITION", POSITION)? else {
            return Ok(None);
        };
        let normals = attribute(Semantic::Normals, "NORMAL", NORMAL)?;
        let uvs = attribute(Semantic::TexCoords(0), "TEXCOORD_0", UV)?;
        let features = extensions
            .features(place.mesh, place.primitive)
            .map(|found| feature_ids(root, buffers, extensions, &found, place))
            .transpose()?;
        let indices = primitive
            .indices
            .map(|index| accessor(index.value(), "/indices", INDEX))
            .transpose()?;
        let ids = features.as_ref().map(|features| &features.ids);
        for other in [normals.as_ref(), uvs.as_ref(), ids].into_iter().flatten() {
            if other.count != positions.count {
                let what =
                    format!("attributes of {} and {} vertices", positions.count, other.count);
                return Err(ImportFault::Invalid(what).at(place.pointer("/attributes")));
            }
        }
        Ok(Some(Self { positions, normals, uvs, features, indices, material, mode }))
    }

    /// Returns how many triangles the primitive makes.
    pub(crate) fn triangle_count(&self) -> usize {
        let corners = self.corner_count();
        match self.mode {
            Mode::TriangleStrip | Mode::TriangleFan => corners.saturating_sub(2),
            _ => corners / 3,
        }
    }

    /// Adds remarks on skipped attributes.
    pub(crate) fn note(&self, primitive: &json::mesh::Primitive, notes: &mut Notes) {
        let has = |semantic| primitive.attributes.contains_key(&Checked::Valid(semantic));
        notes.add_many("set of vertex colours ignored", has(Semantic::Colors(0)).into());
        notes.add_many("set of morph targets ignored", primitive.targets.is_some().into());
        let odd = self.mode == Mode::Triangles && !self.corner_count().is_multiple_of(3);
        notes.add_many("primitive with corners left over after its last triangle", odd.into());
    }

    /// Reads it. Of more vertices than corners only the named ones are read:
    /// exporters share one vertex array between many primitives.
    pub(crate) fn read(&self) -> RawPrimitive {
        let mut triangles = self.triangles();
        let corners = triangles.len() * 3;
        if self.positions.count <= corners {
            return self.read_vertices(0..self.positions.count, triangles);
        }
        let mut new_of_old: HashMap<u32, u32> = HashMap::new();
        let mut vertices = Vec::new();
        for corner in triangles.as_flattened_mut() {
            *corner = *new_of_old.entry(*corner).or_insert_with(|| {
                vertices.push(*corner as usize);
                vertices.len() as u32 - 1
            });
        }
        self.read_vertices(vertices.into_iter(), triangles)
    }

    fn read_vertices(
        &self,
        vertices: impl ExactSizeIterator<Item = usize> + Clone,
        triangles: Vec<[u32; 3]>,
    ) -> RawPrimitive {
        let normals = self.normals.map(|normals| {
            normals.floats(vertices.clone(), |normal| unit_normal(Vec3::from_array(normal)))
        });
        let uvs = self.uvs.map(|uvs| uvs.floats(vertices.clone(), Vec2::from_array));
        let features =
            self.features.map(|features| vertices.clone().map(|v| features.at(v)).collect());
        RawPrimitive {
            positions: self.positions.floats(vertices.clone(), Vec3::from_array),
            normals: normals.unwrap_or_default(),
            uvs: uvs.unwrap_or_default(),
            features: features.unwrap_or_default(),
            triangles,
            material: self.material,
        }
    }

    fn corner_count(&self) -> usize {
        self.indices.as_ref().map_or(self.positions.count, |indices| indices.count)
    }

    /// Returns the corners as vertex indices (glTF 2.0, section 3.7.2.1).
    fn triangles(&self) -> Vec<[u32; 3]> {
        let corners = |i: usize| match self.mode {
            Mode::TriangleStrip => [i, i + 1 + i % 2, i + 2 - i % 2],
            Mode::TriangleFan => [i + 1, i + 2, 0],
            _ => [3 * i, 3 * i + 1, 3 * i + 2],
        };
        let places = (0..self.triangle_count()).map(corners);
        match &self.indices {
            Some(indices) => indices.triangles(places),
            None => places.map(|corners| corners.map(|place| place as u32)).collect(),
        }
    }
}

/// Reads the set of feature ids that a primitive names.
fn feature_ids<'a>(
    root: &'a Root,
    buffers: &Buffers<'a>,
    extensions: &Extensions,
    found: &PrimitiveFeatures<'_>,
    place: PrimitivePlace,
) -> Result<FeatureIds<'a>, ImportError> {
    let here = |field: &str| {
        let set = found.index;
        place.pointer(&format!("/extensions/{MESH_FEATURES}/featureIds/{set}{field}"))
    };
    let Some(accessor) = found.accessor else {
        let what = format!("the primitive has no attribute {}", found.attribute);
        return Err(ImportFault::Invalid(what).at(here("/attribute")));
    };
    let named_by = || place.pointer(&format!("/attributes/{}", found.attribute));
    let ids = Accessor::new(root, buffers, as_index(accessor), named_by)?;
    FEATURE_ID.check(&ids, named_by)?;
    if ids.normalized {
        return Err(ImportFault::Invalid("feature ids cannot be normalised".into()).at(named_by()));
    }
    let table = found.set.property_table.map(as_index);
    if let Some(table) = table {
        let tables = extensions.property_tables();
        item(tables, table, "property table", || here("/propertyTable"))?;
    }
    Ok(FeatureIds { ids, null: found.set.null_feature_id, table })
}

/// Converts a number to an index; one that does not fit becomes an index beyond all.
pub(crate) fn as_index(number: u64) -> usize {
    usize::try_from(number).unwrap_or(usize::MAX)
}

/// Requirements on an accessor for its use (glTF 2.0, section 3.7.2.1, widened by
/// KHR_mesh_quantization).
struct AccessorRule {
    what: &'static str,
    shape: Type,
    component_types: &'static [ComponentType],
}

const POSITION: AccessorRule = AccessorRule {
    what: "positions",
    shape: Type::Vec3,
    component_types: &[F32, I8, U8, I16, U16],
};
const NORMAL: AccessorRule =
    AccessorRule { what: "normals", shape: Type::Vec3, component_types: &[F32, I8, I16] };
const UV: AccessorRule =
    AccessorRule { what: "UVs", shape: Type::Vec2, component_types: &[F32, I8, U8, I16, U16] };
const FEATURE_ID: AccessorRule = AccessorRule {
    what: "feature ids",
    shape: Type::Scalar,
    component_types: &[F32, U8, U16, U32],
};
const INDEX: AccessorRule =
    AccessorRule { what: "indices", shape: Type::Scalar, component_types: &[U8, U16, U32] };

impl AccessorRule {
    fn check(
        &self,
        accessor: &Accessor<'_>,
        place: impl FnOnce() -> String,
    ) -> Result<(), ImportError> {
        let (shape, component_type) = (accessor.shape, accessor.component_type);
        if shape == self.shape && self.component_types.contains(&component_type) {
            return Ok(());
        }
        let what = format!("{} cannot be {shape:?} of {component_type:?}", self.what);
        Err(ImportFault::Invalid(what).at(place()))
    }
}

/// Normalises slightly inexact quantised normals; unit ones stay unchanged to the bit.
fn unit_normal(normal: Vec3) -> Vec3 {
    const TOLERANCE: f32 = 1e-3;
    if (normal.length_squared() - 1.0).abs() <= TOLERANCE {
        normal
    } else {
        normal.normalize_or_zero()
    }
}
