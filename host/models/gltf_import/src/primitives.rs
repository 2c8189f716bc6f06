//! Primitives: the accessors of one primitive, and its triangles.

use std::collections::{HashMap, HashSet};
use std::rc::Rc;

use busbar_geometry::RawPrimitive;
use glam::{Affine2, Vec2, Vec3, Vec4};

use crate::accessor::{Accessor, AccessorKey};
use crate::buffers::Buffers;
use crate::draco::{DracoAttribute, DracoMesh};
use crate::error::{ImportError, ImportFault, item};
use crate::extensions::{MESH_FEATURES, PrimitiveFeatures, StructuralMetadata};
use crate::features::FeatureIds;
use crate::limits::{MAX_COORDINATE, MAX_JOINT_SETS};
use crate::meshes::Source;
use crate::report::Notes;
use crate::schema::{self, ComponentType, Shape};
use crate::skins::{Pose, Skinning};
use crate::tubes::{TRIANGLES_OF_TUBE, Tubes};

use ComponentType::{F32, I8, I16, U8, U16, U32};

/// Mode of a primitive (glTF 2.0, section 3.7.2.1).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Mode {
    Points,
    Lines,
    LineLoop,
    LineStrip,
    Triangles,
    TriangleStrip,
    TriangleFan,
}

/// Texture coordinates that a material shows: a set, and KHR_texture_transform.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct UvMapping {
    pub(crate) set: u32,
    pub(crate) transform: Option<Affine2>,
}

const UNSKINNED: &str =
    "primitive of a skinned mesh without joints and weights that can be read: shown as modelled";

/// Properties of a primitive that its mesh, its material and the node that shows it decide.
#[derive(Clone, Copy)]
pub(crate) struct PrimitiveLook<'a> {
    pub(crate) mapping: UvMapping,
    /// Weights of the morph targets.
    pub(crate) weights: &'a [f32],
    pub(crate) pose: Option<&'a Rc<Pose>>,
}

/// A primitive whose accessors all have their bytes.
pub(crate) struct Primitive<'a> {
    pub(crate) positions: Accessor<'a>,
    pub(crate) normals: Option<Accessor<'a>>,
    pub(crate) uvs: Option<Accessor<'a>>,
    uv_transform: Option<Affine2>,
    pub(crate) colors: Option<Accessor<'a>>,
    pub(crate) features: Option<FeatureIds<'a>>,
    pub(crate) indices: Option<Accessor<'a>>,
    material: Option<u32>,
    mode: Mode,
    /// Morph targets whose weights are not zero.
    pub(crate) morphs: Vec<Morph<'a>>,
    pub(crate) skinning: Option<Skinning<'a>>,
    /// True for a primitive without joints in a skinned mesh.
    lacks_joints: bool,
    /// Index at which a strip or fan begins anew, if there is any.
    pub(crate) restart: Option<u32>,
    /// Mark of positions that are no coordinates.
    pub(crate) is_astray: bool,
    /// Attributes that have too few elements to be used.
    short_attributes: usize,
}

/// A morph target, and how much of it is shown.
pub(crate) struct Morph<'a> {
    weight: f32,
    positions: Option<Accessor<'a>>,
    normals: Option<Accessor<'a>>,
}

impl<'a> Morph<'a> {
    pub(crate) fn accessors(&self) -> impl Iterator<Item = &Accessor<'a>> {
        self.positions.iter().chain(&self.normals)
    }
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
    /// Describes a primitive; `None` for one without positions.
    pub(crate) fn new(
        source: &'a Source<'a>,
        primitive: &schema::Primitive,
        look: PrimitiveLook<'_>,
        place: PrimitivePlace,
    ) -> Result<Option<Self>, ImportError> {
        let mode = match primitive.mode.map_or(4, |mode| mode.0) {
            0 => Mode::Points,
            1 => Mode::Lines,
            2 => Mode::LineLoop,
            3 => Mode::LineStrip,
            4 => Mode::Triangles,
            5 => Mode::TriangleStrip,
            6 => Mode::TriangleFan,
            _ => {
                return Err(ImportFault::Invalid("unknown mode".into()).at(place.pointer("/mode")));
            }
        };
        let Source { buffers, metadata, .. } = source;
        let document = buffers.document();
        if let Some(material) = primitive.material {
            document.materials.require(material.index(), || place.pointer("/material"))?;
        }
        let draco = DracoSource::new(source, primitive, place)?;
        let accessor = |index: usize, field: &str, rule: AccessorRule| {
            let accessor = Accessor::new(buffers, index, || place.pointer(field))?;
            rule.check(&accessor, || place.pointer(field))?;
            Ok(accessor)
        };
        let attribute = |name: &str, rule: AccessorRule| {
            let field = format!("/attributes/{name}");
            let Some(index) = primitive.attribute(name) else { return Ok(None) };
            if let Some(draco) = &draco
                && let Some(accessor) = draco.attribute(name, index.index(), place)?
            {
                rule.check(&accessor, || place.pointer(&field))?;
                return Ok(Some(accessor));
            }
            accessor(index.index(), &field, rule).map(Some)
        };
        let Some(positions) = attribute("POSITION", POSITION)? else {
            return Ok(None);
        };
        let normals = attribute("NORMAL", NORMAL)?;
        let PrimitiveLook { mapping, weights, pose } = look;
        let uvs = attribute(&format!("TEXCOORD_{}", mapping.set), UV)?;
        let colors = attribute("COLOR_0", COLOR)?;
        let features = primitive
            .features()
            .map(|found| feature_ids(buffers, metadata, (&found, draco.as_ref()), place))
            .transpose()?;
        let (indices, mode) = match &draco {
            Some(draco) => (Some(draco.corners()), Mode::Triangles),
            None => {
                let indices = primitive.indices;
                let named = indices.map(|index| accessor(index.index(), "/indices", INDEX));
                (named.transpose()?, mode)
            }
        };
        if let Some(features) = &features
            && features.ids.count != positions.count
        {
            let (vertices, ids) = (positions.count, features.ids.count);
            let what = format!("attributes of {vertices} and {ids} vertices");
            return Err(ImportFault::Invalid(what).at(place.pointer("/attributes")));
        }
        let mut morphs = Vec::new();
        let targets = primitive.targets.as_ref().map_or(&[][..], |targets| &targets.0);
        for (index, (target, &weight)) in targets.iter().zip(weights).enumerate() {
            if weight == 0.0 {
                continue;
            }
            let displacements = |name: &str, rule: &AccessorRule| {
                let Some((_, of)) = target.0.iter().find(|(known, _)| known == name) else {
                    return Ok(None);
                };
                let named_by = || place.pointer(&format!("/targets/{index}/{name}"));
                let accessor = Accessor::new(buffers, of.index(), named_by)?;
                rule.check(&accessor, named_by)?;
                Ok(Some(accessor).filter(|accessor| accessor.count >= positions.count))
            };
            let (moved, turned) =
                (displacements("POSITION", &POSITION)?, displacements("NORMAL", &NORMAL)?);
            morphs.push(Morph { weight, positions: moved, normals: turned });
        }
        let mut short_attributes = 0;
        let mut sets = Vec::new();
        for set in (0..MAX_JOINT_SETS).take_while(|_| pose.is_some()) {
            let names = [format!("JOINTS_{set}"), format!("WEIGHTS_{set}")];
            if names.iter().any(|name| primitive.attribute(name).is_none()) {
                break;
            }
            let [joints, weights] = names;
            // Skins are never at fault: without one, the mesh is there as modelled.
            let pair = (attribute(&joints, JOINTS), attribute(&weights, WEIGHTS));
            let (Ok(Some(joints)), Ok(Some(weights))) = pair else { continue };
            match joints.count.min(weights.count) >= positions.count {
                true => sets.push([joints, weights]),
                false => short_attributes += 1,
            }
        }
        let skinning = pose.and_then(|pose| Skinning::new(pose, sets));
        let mut whole = |accessor: Option<Accessor<'a>>| {
            let is_short = accessor.is_some_and(|accessor| accessor.count < positions.count);
            short_attributes += usize::from(is_short);
            accessor.filter(|_| !is_short)
        };
        Ok(Some(Self {
            positions,
            normals: whole(normals),
            uvs: whole(uvs),
            uv_transform: mapping.transform,
            // Integers are shares of the largest, though some exporters do not say so.
            colors: whole(colors).map(Accessor::into_normalized),
            features,
            indices,
            material: primitive.material.map(|material| material.0),
            mode,
            morphs,
            lacks_joints: pose.is_some() && skinning.is_none(),
            skinning,
            restart: None,
            is_astray: false,
            short_attributes,
        }))
    }

    /// Reports whether the primitive is of lines or points.
    pub(crate) fn is_thin(&self) -> bool {
        self.mode.is_thin()
    }

    /// Returns how many triangles the primitive makes at most.
    pub(crate) fn triangle_count(&self) -> usize {
        self.mode.triangle_count(self.corner_count())
    }

    /// Adds remarks on skipped attributes.
    pub(crate) fn note(&self, primitive: &schema::Primitive, notes: &mut Notes) {
        let further = primitive.attribute("COLOR_1").is_some();
        notes.add_many("further set of vertex colours ignored", further.into());
        let odd = self.mode == Mode::Triangles && !self.corner_count().is_multiple_of(3);
        notes.add_many("primitive with corners left over after its last triangle", odd.into());
        notes.add_many("attribute with too few elements ignored", self.short_attributes);
        notes.add_many(UNSKINNED, self.lacks_joints.into());
        let has_more = primitive.attribute(&format!("JOINTS_{MAX_JOINT_SETS}")).is_some();
        notes.add_many("further sets of joints ignored: 16 joints move a vertex", has_more.into());
        if let Some(skinning) = &self.skinning {
            skinning.note(self.positions.count, notes);
        }
    }

    /// Returns the index by which strips begin anew: the largest of its type (WebGL 2.0, section
    /// 5.18), which glTF forbids and exporters write.
    pub(crate) fn restart_index(&self) -> Option<u32> {
        match self.indices.as_ref()?.component_type {
            U8 => Some(u8::MAX.into()),
            U16 => Some(u16::MAX.into()),
            _ => Some(u32::MAX),
        }
    }

    /// Counts triangles or lines that name a vertex whose position is no coordinate.
    pub(crate) fn count_astray(&self) -> usize {
        let placed = |corner: &u32| self.is_placed(*corner);
        if self.mode.is_thin() {
            let lines = self.segments();
            return lines.iter().filter(|ends| !ends.iter().all(placed)).count();
        }
        self.triangles().iter().filter(|corners| !corners.iter().all(placed)).count()
    }

    fn is_placed(&self, vertex: u32) -> bool {
        is_coordinate(self.position(vertex as usize).to_array())
    }

    /// Reports whether vertices are shown at other places than their attributes say.
    pub(crate) fn is_deformed(&self) -> bool {
        !self.morphs.is_empty() || self.skinning.is_some()
    }

    /// Returns the position of a vertex, morphed, then skinned.
    fn position(&self, vertex: usize) -> Vec3 {
        let base = Vec3::from_array(self.positions.floats_at(vertex));
        let morphed = self.morphs.iter().fold(base, |position, morph| {
            let moved = morph.positions.map(|of| Vec3::from_array(of.floats_at(vertex)));
            position + moved.unwrap_or_default() * morph.weight
        });
        self.skinning.as_ref().map_or(morphed, |skinning| skinning.position(vertex, morphed))
    }

    /// Returns the normal of a vertex, morphed, then skinned.
    fn normal(&self, normals: &Accessor<'_>, vertex: usize) -> Vec3 {
        let base = Vec3::from_array(normals.floats_at(vertex));
        let morphed = self.morphs.iter().fold(base, |normal, morph| {
            let turned = morph.normals.map(|of| Vec3::from_array(of.floats_at(vertex)));
            normal + turned.unwrap_or_default() * morph.weight
        });
        self.skinning.as_ref().map_or(morphed, |skinning| skinning.normal(vertex, morphed))
    }

    /// Returns the lines as pairs of vertices; a point is a line to itself.
    fn segments(&self) -> Vec<[u32; 2]> {
        let count = self.corner_count();
        let corners: Vec<u32> = match &self.indices {
            Some(indices) => (0..count).map(|i| indices.index_at(i)).collect(),
            None => (0..count as u32).collect(),
        };
        let runs = corners.split(|&corner| self.restart == Some(corner));
        let mut segments = Vec::new();
        for run in runs {
            match self.mode {
                Mode::Points => segments.extend(run.iter().map(|&corner| [corner; 2])),
                Mode::Lines => segments.extend_from_slice(run.as_chunks().0),
                _ => segments.extend(run.array_windows().copied()),
            }
            if let (Mode::LineLoop, [first, .., last]) = (self.mode, run) {
                segments.push([*last, *first]);
            }
        }
        segments
    }

    /// Returns tubes around lines and points; `None` for triangles.
    fn tubes(&self) -> Option<Tubes> {
        let placed = |corner: &u32| self.is_placed(*corner);
        self.mode.is_thin().then(|| {
            let mut segments = self.segments();
            segments.retain(|ends| ends.iter().all(placed));
            Tubes::new(&segments, |vertex| self.position(vertex))
        })
    }

    /// Reads it. Of more vertices than corners only the named ones are read:
    /// exporters share one vertex array between many primitives.
    pub(crate) fn read(&self) -> RawPrimitive {
        if let Some(tubes) = self.tubes() {
            let Tubes { sources, offsets, triangles } = tubes;
            let mut read = self.read_vertices(sources.iter().copied(), triangles);
            for (position, offset) in read.positions.iter_mut().zip(&offsets) {
                *position += *offset;
            }
            read.normals = offsets.into_iter().map(Vec3::normalize_or_zero).collect();
            return read;
        }
        let mut triangles = self.placed_triangles();
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

    /// Reads the colours of the vertices that [`Self::read`] reads, linear; `None` without any.
    pub(crate) fn read_colors(&self) -> Option<Vec<Vec4>> {
        let colors = self.colors?;
        let has_alpha = colors.shape == Shape::Vec4;
        let tubes = self.tubes();
        let color = |values: [f32; 4]| {
            let color = Vec4::from_array(values);
            if has_alpha { color } else { color.with_w(1.0) }
        };
        if let Some(tubes) = tubes {
            return Some(colors.floats(tubes.sources.into_iter(), color));
        }
        let triangles = self.placed_triangles();
        if self.positions.count <= triangles.len() * 3 {
            return Some(colors.floats(0..self.positions.count, color));
        }
        let mut seen = HashSet::new();
        let corners = triangles.as_flattened().iter();
        let named = corners.filter(|&&corner| seen.insert(corner)).map(|&corner| corner as usize);
        Some(colors.floats(named, color))
    }

    /// Returns the triangles whose corners all are coordinates.
    fn placed_triangles(&self) -> Vec<[u32; 3]> {
        let mut triangles = self.triangles();
        if self.is_astray {
            triangles.retain(|corners| corners.iter().all(|&corner| self.is_placed(corner)));
        }
        if let Some(skinning) = &self.skinning {
            for [first, second, third] in &mut triangles {
                if skinning.is_mirrored(*first) {
                    std::mem::swap(second, third);
                }
            }
        }
        triangles
    }

    fn read_vertices(
        &self,
        vertices: impl ExactSizeIterator<Item = usize> + Clone,
        triangles: Vec<[u32; 3]>,
    ) -> RawPrimitive {
        let is_deformed = self.is_deformed();
        let normals = self.normals.map(|normals| {
            if is_deformed {
                let deformed = |vertex| unit_normal(self.normal(&normals, vertex));
                return vertices.clone().map(deformed).collect();
            }
            normals.floats(vertices.clone(), |normal| unit_normal(Vec3::from_array(normal)))
        });
        let uvs = self.uvs.map(|uvs| match self.uv_transform {
            None => uvs.floats(vertices.clone(), Vec2::from_array),
            Some(transform) => {
                let transformed = |uv| transform.transform_point2(Vec2::from_array(uv));
                uvs.floats(vertices.clone(), transformed)
            }
        });
        let features =
            self.features.map(|features| vertices.clone().map(|v| features.at(v)).collect());
        RawPrimitive {
            positions: match is_deformed {
                true => vertices.clone().map(|vertex| self.position(vertex)).collect(),
                false => self.positions.floats(vertices.clone(), Vec3::from_array),
            },
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
        let places = (0..self.triangle_count()).map(|i| self.mode.corners(i));
        match (&self.indices, self.restart) {
            (Some(indices), None) => indices.triangles(places),
            (Some(indices), Some(restart)) => {
                let corners: Vec<u32> = (0..indices.count).map(|i| indices.index_at(i)).collect();
                let runs = corners.split(|&corner| corner == restart);
                let of_run = |run: &[u32]| {
                    let count = self.mode.triangle_count(run.len());
                    let triangle = |i| self.mode.corners(i).map(|place| run[place]);
                    (0..count).map(triangle).collect::<Vec<_>>()
                };
                runs.flat_map(of_run).collect()
            }
            (None, _) => places.map(|corners| corners.map(|place| place as u32)).collect(),
        }
    }
}

impl Mode {
    /// Reports whether it makes points or lines.
    fn is_thin(self) -> bool {
        matches!(self, Self::Points | Self::Lines | Self::LineLoop | Self::LineStrip)
    }

    fn triangle_count(self, corners: usize) -> usize {
        match self {
            Self::Points | Self::LineLoop => corners.saturating_mul(TRIANGLES_OF_TUBE),
            Self::LineStrip => corners.saturating_sub(1).saturating_mul(TRIANGLES_OF_TUBE),
            Self::Lines => (corners / 2).saturating_mul(TRIANGLES_OF_TUBE),
            Self::TriangleStrip | Self::TriangleFan => corners.saturating_sub(2),
            Self::Triangles => corners / 3,
        }
    }

    /// Returns the places of a triangle's corners.
    fn corners(self, i: usize) -> [usize; 3] {
        match self {
            Self::TriangleStrip => [i, i + 1 + i % 2, i + 2 - i % 2],
            Self::TriangleFan => [i + 1, i + 2, 0],
            _ => [3 * i, 3 * i + 1, 3 * i + 2],
        }
    }
}

/// Reports whether a position is finite and within the bounds of coordinates.
pub(crate) fn is_coordinate(point: [f32; 3]) -> bool {
    point.iter().all(|c| c.abs() <= MAX_COORDINATE)
}

/// The compressed mesh of a primitive (KHR_draco_mesh_compression).
struct DracoSource<'a> {
    buffers: &'a Buffers<'a>,
    mesh: &'a DracoMesh,
    view: usize,
    /// Unique ids by the name of the attribute.
    ids: Vec<(String, u32)>,
}

impl<'a> DracoSource<'a> {
    /// Decompresses the mesh of a primitive. One whose positions are there without compression is
    /// read so: they are the substitute for viewers without Draco.
    fn new(
        source: &'a Source<'a>,
        primitive: &schema::Primitive,
        place: PrimitivePlace,
    ) -> Result<Option<Self>, ImportError> {
        let extensions = primitive.extensions.as_ref();
        let Some(compressed) = extensions.and_then(|extensions| extensions.draco.as_ref()) else {
            return Ok(None);
        };
        let Some(positions) = primitive.attribute("POSITION") else { return Ok(None) };
        let named_by = || place.pointer("/attributes/POSITION");
        let buffers = source.buffers;
        let positions: schema::Accessor<'_> =
            buffers.document().accessors.parse(positions.index(), named_by)?;
        if positions.buffer_view.is_some() {
            return Ok(None);
        }
        let here = || place.pointer("/extensions/KHR_draco_mesh_compression");
        let view = compressed.buffer_view.index();
        let mesh = buffers.draco(view, source.max_triangles, here)?;
        let ids = compressed.attributes.0.iter().map(|(name, id)| (name.clone(), id.0)).collect();
        Ok(Some(Self { buffers, mesh, view, ids }))
    }

    /// Returns an attribute; `None` where it is not compressed.
    fn attribute(
        &self,
        name: &str,
        index: usize,
        place: PrimitivePlace,
    ) -> Result<Option<Accessor<'a>>, ImportError> {
        let Some(&(_, id)) = self.ids.iter().find(|(known, _)| known == name) else {
            return Ok(None);
        };
        let field = format!("/extensions/KHR_draco_mesh_compression/attributes/{name}");
        let invalid = |what: String| ImportFault::Invalid(what).at(place.pointer(&field));
        let Some((slot, attribute)) = self.mesh.attribute(id) else {
            return Err(invalid(format!("the compressed mesh has no attribute {id}")));
        };
        let named_by = || place.pointer(&format!("/attributes/{name}"));
        let json: schema::Accessor<'_> =
            self.buffers.document().accessors.parse(index, named_by)?;
        let key = AccessorKey::Draco { view: self.view, attribute: Some(slot) };
        let DracoAttribute { component_type, components, values, .. } = attribute;
        let packed = Accessor::packed((index, &json), key, *component_type, *components, values);
        let shape = || invalid("the compressed attribute has another shape".into());
        packed.ok_or_else(shape).map(Some)
    }

    fn corners(&self) -> Accessor<'a> {
        Accessor::corners(self.view, &self.mesh.corners)
    }
}

/// Reads the set of feature ids that a primitive names.
fn feature_ids<'a>(
    buffers: &'a Buffers<'_>,
    metadata: &StructuralMetadata,
    (found, draco): (&PrimitiveFeatures, Option<&DracoSource<'a>>),
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
    let packed = match draco {
        Some(draco) => draco.attribute(&found.attribute, accessor.index(), place)?,
        None => None,
    };
    let ids = match packed {
        Some(ids) => ids,
        None => Accessor::new(buffers, accessor.index(), named_by)?,
    };
    FEATURE_ID.check(&ids, named_by)?;
    if ids.normalized {
        return Err(ImportFault::Invalid("feature ids cannot be normalised".into()).at(named_by()));
    }
    let table = found.set.property_table.map(|table| table.index());
    if let Some(table) = table {
        let tables = metadata.property_tables();
        item(tables, table, "property table", || here("/propertyTable"))?;
    }
    let null = found.set.null_feature_id.map(|id| id.0.into());
    Ok(FeatureIds { ids, null, table })
}

/// Requirements on an accessor for its use (glTF 2.0, section 3.7.2.1, widened by
/// KHR_mesh_quantization).
struct AccessorRule {
    what: &'static str,
    shapes: &'static [Shape],
    component_types: &'static [ComponentType],
}

const POSITION: AccessorRule = AccessorRule {
    what: "positions",
    shapes: &[Shape::Vec3],
    component_types: &[F32, I8, U8, I16, U16],
};
const NORMAL: AccessorRule =
    AccessorRule { what: "normals", shapes: &[Shape::Vec3], component_types: &[F32, I8, I16] };
const UV: AccessorRule =
    AccessorRule { what: "UVs", shapes: &[Shape::Vec2], component_types: &[F32, I8, U8, I16, U16] };
const COLOR: AccessorRule = AccessorRule {
    what: "vertex colours",
    shapes: &[Shape::Vec3, Shape::Vec4],
    component_types: &[F32, U8, U16],
};
const JOINTS: AccessorRule =
    AccessorRule { what: "joints", shapes: &[Shape::Vec4], component_types: &[F32, U8, U16, U32] };
const WEIGHTS: AccessorRule = AccessorRule {
    what: "weights of joints",
    shapes: &[Shape::Vec4],
    component_types: &[F32, U8, U16],
};
const FEATURE_ID: AccessorRule = AccessorRule {
    what: "feature ids",
    shapes: &[Shape::Scalar],
    component_types: &[F32, U8, U16, U32],
};
const INDEX: AccessorRule =
    AccessorRule { what: "indices", shapes: &[Shape::Scalar], component_types: &[U8, U16, U32] };

impl AccessorRule {
    fn check(
        &self,
        accessor: &Accessor<'_>,
        place: impl FnOnce() -> String,
    ) -> Result<(), ImportError> {
        let (shape, component_type) = (accessor.shape, accessor.component_type);
        if self.shapes.contains(&shape) && self.component_types.contains(&component_type) {
            return Ok(());
        }
        let what = format!("{} cannot be {} of {}", self.what, shape.name(), component_type.name());
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
