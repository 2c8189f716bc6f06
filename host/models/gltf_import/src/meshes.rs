//! Meshes in two phases: everything is checked first, without building anything. Building then
//! cannot fail halfway with memory taken.

use std::cell::OnceCell;
use std::collections::{HashMap, HashSet};

use busbar_geometry::weld;

use crate::ImportLimits;
use crate::accessor::{Accessor, AccessorKey};
use crate::buffers::Buffers;
use crate::document::Document;
use crate::error::{ImportError, ImportFault};
use crate::extensions::{STRUCTURAL_METADATA, StructuralMetadata};
use crate::features::{FeatureIds, FeatureNamer, NameTables};
use crate::limits::{MAX_SHARING, MIN_ALLOWANCE};
use crate::mesh_cache::{CachedMesh, MIN_CACHED_TRIANGLES, MeshCache};
use crate::name_table::NameTable;
use crate::primitives::{
    Morph, Primitive, PrimitiveLook, PrimitivePlace, UvMapping, is_coordinate,
};
use crate::report::Notes;
use crate::schema;
use crate::shapes::MeshShape;
use crate::skins::Skinning;
use crate::vertex_colors::ColorMaterials;

const SKIPPED_FEATURES: &str =
    "set of feature ids skipped: only the first one by a vertex attribute is read";
const ASTRAY: &str = "triangle left out: a corner is no coordinate, or beyond all of them";
const ODD_WEIGHTS: &str = "weights of morph targets that cannot be read: none are shown";
const NO_CONTENT: &str =
    "primitive left out: its data are in a buffer without URI and without GLB chunk";
const LINE_ASTRAY: &str = "line or point left out: an end is no coordinate, or beyond all of them";
const UNNAMED_FEATURES: &str =
    "property table without a column of strings that its class declares: its features are numbered";

/// Faults of a mesh that leave its other primitives as they are.
struct MeshOddities {
    has_odd_weights: bool,
    /// Primitives whose buffers have no content.
    without_content: usize,
}

/// Primitives of the shown meshes, and what all of them share.
pub(crate) struct Source<'a> {
    pub(crate) buffers: &'a Buffers<'a>,
    pub(crate) metadata: StructuralMetadata,
    /// Texture coordinates by material.
    mappings: Vec<UvMapping>,
    pub(crate) max_triangles: u64,
}

impl<'a> Source<'a> {
    pub(crate) fn new(
        buffers: &'a Buffers<'a>,
        metadata: StructuralMetadata,
        mappings: Vec<UvMapping>,
        limits: &ImportLimits,
    ) -> Self {
        Self { buffers, metadata, mappings, max_triangles: limits.max_triangles }
    }

    /// Visits the primitives of a mesh that make triangles; the others are `None`. Those whose
    /// buffers have no content are left out.
    fn primitives(
        &'a self,
        shape: &MeshShape,
        mut visit: impl FnMut(
            &schema::Primitive,
            Option<Primitive<'a>>,
            PrimitivePlace,
        ) -> Result<(), ImportError>,
    ) -> Result<MeshOddities, ImportError> {
        let document = self.buffers.document();
        let MeshShape { mesh, weights, pose } = shape;
        let mesh = *mesh;
        let json: schema::Mesh<'a> = document.meshes.parse(mesh, || format!("/meshes/{mesh}"))?;
        let mut without_content = 0;
        let has_odd_weights =
            weights.is_none() && json.weights.as_ref().is_some_and(|own| own.0.is_none());
        let weights = weights.clone().unwrap_or_else(|| {
            let own = json.weights.as_ref().and_then(|weights| weights.0.as_ref());
            own.map_or_else(Vec::new, |own| own.0.iter().map(|weight| weight.0).collect())
        });
        for (index, part) in json.primitives.unwrap_or_default().0.into_iter().enumerate() {
            let place = PrimitivePlace { mesh, primitive: index };
            let json: schema::Primitive = document.parse(part, || place.pointer(""))?;
            let material = json.material.map_or(usize::MAX, |material| material.index());
            let mapping = self.mappings.get(material).copied().unwrap_or_default();
            let look = PrimitiveLook { mapping, weights: &weights, pose: pose.as_ref() };
            let primitive = match Primitive::new(self, &json, look, place) {
                Err(error) if matches!(error.fault, ImportFault::NoContent) => {
                    without_content += 1;
                    continue;
                }
                primitive => primitive?,
            };
            visit(&json, primitive, place)?;
        }
        Ok(MeshOddities { has_odd_weights, without_content })
    }
}

/// Finds the materials that the primitives of meshes name.
pub(crate) fn used_materials(
    document: &Document<'_>,
    shown: &[MeshShape],
) -> Result<Vec<bool>, ImportError> {
    let mut used = vec![false; document.materials.len()];
    // Shapes of one mesh follow each other.
    for shapes in shown.chunk_by(|a, b| a.mesh == b.mesh) {
        let mesh = shapes[0].mesh;
        let json: schema::Mesh<'_> = document.meshes.parse(mesh, || format!("/meshes/{mesh}"))?;
        for (primitive, part) in json.primitives.unwrap_or_default().0.into_iter().enumerate() {
            let place = PrimitivePlace { mesh, primitive };
            let json: schema::Primitive = document.parse(part, || place.pointer(""))?;
            if let Some(used) = json.material.and_then(|material| used.get_mut(material.index())) {
                *used = true;
            }
        }
    }
    Ok(used)
}

/// Checks meshes and counts their triangles.
pub(crate) struct Checker<'a> {
    source: &'a Source<'a>,
    limits: &'a ImportLimits,
    triangles: u64,
    /// Triangles of shapes of their own, which `triangles` counts too.
    of_shapes: u64,
    visits: u64,
    /// Facts of accessors that have been gone through: many primitives share one.
    largest_indices: HashMap<AccessorKey, [u32; 2]>,
    /// Answers by accessor: all of its elements are coordinates.
    sane_positions: HashMap<AccessorKey, bool>,
    other: HashSet<AccessorKey>,
    /// Feature ids by accessor, table and null id.
    sane_features: HashSet<(AccessorKey, Option<usize>, Option<u64>)>,
    tables: NameTables<'a>,
    /// Restart values by mesh and primitive.
    restarts: HashMap<(usize, usize), u32>,
    /// Meshes whose oddities were told, without and with a pose.
    noted: HashSet<(usize, bool)>,
}

impl<'a> Checker<'a> {
    pub(crate) fn new(source: &'a Source<'a>, limits: &'a ImportLimits) -> Self {
        Self {
            source,
            limits,
            triangles: 0,
            of_shapes: 0,
            visits: 0,
            largest_indices: HashMap::new(),
            sane_positions: HashMap::new(),
            other: HashSet::new(),
            sane_features: HashSet::new(),
            tables: HashMap::new(),
            restarts: HashMap::new(),
            noted: HashSet::new(),
        }
    }

    /// Checks one mesh; says how many triangles it has.
    pub(crate) fn check(
        &mut self,
        shape: &MeshShape,
        notes: &mut Notes,
    ) -> Result<u64, ImportError> {
        let before = self.triangles;
        let source = self.source;
        let is_new = self.noted.insert((shape.mesh, shape.pose.is_some()));
        let oddities = source.primitives(shape, |json, primitive, place| {
            let Some(mut primitive) = primitive else {
                notes.add("primitive without positions skipped");
                return Ok(());
            };
            if is_new {
                primitive.note(json, notes);
            }
            notes.add_many(SKIPPED_FEATURES, json.skipped_feature_id_sets());
            self.count(&primitive, shape, place)?;
            self.check_values(&mut primitive, place, notes)?;
            match &primitive.features {
                Some(features) => self.check_features(features, notes),
                None => Ok(()),
            }
        })?;
        notes.add_many(ODD_WEIGHTS, oddities.has_odd_weights.into());
        notes.add_many(NO_CONTENT, oddities.without_content);
        Ok(self.triangles - before)
    }

    /// Counts triangles against the limit. Each takes at least a byte of some buffer, which meshes
    /// may share.
    fn count(
        &mut self,
        primitive: &Primitive<'_>,
        shape: &MeshShape,
        place: PrimitivePlace,
    ) -> Result<(), ImportError> {
        self.triangles += primitive.triangle_count() as u64;
        // Shapes of their own are bounded where they are made.
        if !shape.is_default() {
            self.of_shapes += primitive.triangle_count() as u64;
            return Ok(());
        }
        let backed = (MAX_SHARING * self.source.buffers.total_bytes()).max(MIN_ALLOWANCE);
        let limit = self.limits.max_triangles.min(backed);
        let counted = self.triangles - self.of_shapes;
        if counted <= limit {
            return Ok(());
        }
        let what = if limit == backed { "triangles for the bytes there are" } else { "triangles" };
        Err(ImportFault::TooMany { what, count: counted, limit }.at(place.pointer("")))
    }

    fn check_values(
        &mut self,
        primitive: &mut Primitive<'_>,
        place: PrimitivePlace,
        notes: &mut Notes,
    ) -> Result<(), ImportError> {
        let vertices = primitive.positions.count;
        let Primitive { normals, uvs, colors, .. } = &*primitive;
        for other in [normals, uvs, colors].into_iter().flatten() {
            if self.other.insert(other.key) {
                self.visit(other)?;
                other.check_sparse()?;
            }
        }
        let is_sane = self.are_coordinates(&primitive.positions)?;
        if let Some((indices, restart)) = primitive.indices.zip(primitive.restart_index()) {
            let [largest, usual] = match self.largest_indices.get(&indices.key) {
                Some(&largest) => largest,
                None => {
                    self.visit(&indices)?;
                    indices.check_sparse()?;
                    let largest = indices.largest_indices(restart);
                    self.largest_indices.insert(indices.key, largest);
                    largest
                }
            };
            let restarts = largest == restart && largest as usize >= vertices;
            let largest = if restarts { usual } else { largest };
            if indices.count > 0 && largest as usize >= vertices {
                let fault = ImportFault::Vertex { index: largest, count: vertices };
                return Err(fault.at(place.pointer("/indices")));
            }
            if restarts {
                notes.add("primitive whose indices hold the restart value: begun anew there");
                primitive.restart = Some(restart);
                self.restarts.insert((place.mesh, place.primitive), restart);
            }
        }
        for accessor in primitive.morphs.iter().flat_map(Morph::accessors) {
            if self.other.insert(accessor.key) {
                self.visit(accessor)?;
                accessor.check_sparse()?;
            }
        }
        for accessor in primitive.skinning.iter().flat_map(Skinning::accessors) {
            if self.other.insert(accessor.key) {
                self.visit(accessor)?;
            }
        }
        if !is_sane || primitive.is_deformed() {
            let note = if primitive.is_thin() { LINE_ASTRAY } else { ASTRAY };
            notes.add_many(note, primitive.count_astray());
        }
        Ok(())
    }

    /// Reports whether all stored positions are finite and within the bounds.
    fn are_coordinates(&mut self, positions: &Accessor<'_>) -> Result<bool, ImportError> {
        if let Some(&known) = self.sane_positions.get(&positions.key) {
            return Ok(known);
        }
        self.visit(positions)?;
        positions.check_sparse()?;
        let is_sane = positions.find_refused(is_coordinate).is_none();
        self.sane_positions.insert(positions.key, is_sane);
        Ok(is_sane)
    }

    fn check_features(
        &mut self,
        features: &FeatureIds<'_>,
        notes: &mut Notes,
    ) -> Result<(), ImportError> {
        let FeatureIds { ids, null, table } = features;
        if !self.sane_features.insert((ids.key, *table, *null)) {
            return Ok(());
        }
        self.visit(ids)?;
        ids.check_sparse()?;
        let mut rows = None;
        if let Some(table) = *table {
            rows = Some(self.check_table(table, notes)?);
        }
        features.check(rows)
    }

    /// Checks a property table once; says how many rows it has.
    fn check_table(&mut self, index: usize, notes: &mut Notes) -> Result<u64, ImportError> {
        let Source { buffers, metadata, .. } = self.source;
        let table = &metadata.property_tables()[index];
        if self.tables.contains_key(&index) {
            return Ok(table.count.0.into());
        }
        let place = format!("/extensions/{STRUCTURAL_METADATA}/propertyTables/{index}");
        let names = match metadata.class_of(table) {
            None => None,
            Some(class) => {
                let charge = |bytes| self.charge(bytes, &place);
                NameTable::read(table, class, buffers, &place, charge)?
            }
        };
        notes.add_many(UNNAMED_FEATURES, names.is_none().into());
        self.tables.insert(index, names);
        Ok(table.count.0.into())
    }

    /// Charges the visit of an accessor's elements, a byte each at least. This bounds the time that
    /// many accessors of the same bytes can cost.
    fn visit(&mut self, accessor: &Accessor<'_>) -> Result<(), ImportError> {
        self.charge(accessor.stored_elements(), &format!("/accessors/{}", accessor.index))
    }

    fn charge(&mut self, elements: u64, place: &str) -> Result<(), ImportError> {
        self.visits += elements;
        let limit = self.source.buffers.total_bytes().max(MIN_ALLOWANCE);
        if self.visits <= limit {
            return Ok(());
        }
        let what = "elements for the bytes there are";
        Err(ImportFault::TooMany { what, count: self.visits, limit }.at(place))
    }
}

/// Mesh cache with the content of the file.
pub(crate) struct CachedContent<'a> {
    cache: &'a dyn MeshCache,
    buffers: &'a Buffers<'a>,
    /// Worked out once a mesh is large enough.
    digest: OnceCell<u128>,
}

impl<'a> CachedContent<'a> {
    pub(crate) fn new(cache: &'a dyn MeshCache, buffers: &'a Buffers<'a>) -> Self {
        Self { cache, buffers, digest: OnceCell::new() }
    }

    fn digest(&self) -> u128 {
        *self.digest.get_or_init(|| self.cache.digest(&self.buffers.content()))
    }

    fn find(&self, mesh: usize) -> Option<CachedMesh> {
        self.cache.get(self.digest(), mesh)
    }

    fn keep(&self, mesh: usize, built: &CachedMesh) {
        self.cache.insert(self.digest(), mesh, built);
    }
}

/// Builds checked meshes, and names their features.
pub(crate) struct Builder<'a> {
    source: &'a Source<'a>,
    namer: FeatureNamer<'a>,
    sane_positions: HashMap<AccessorKey, bool>,
    restarts: HashMap<(usize, usize), u32>,
    cached: Option<CachedContent<'a>>,
}

impl<'a> Builder<'a> {
    pub(crate) fn new(checker: Checker<'a>, cached: Option<CachedContent<'a>>) -> Self {
        let Checker { source, limits, tables, sane_positions, restarts, .. } = checker;
        let namer = FeatureNamer::new(tables, limits);
        Self { source, namer, sane_positions, restarts, cached }
    }

    /// Builds a mesh, from the cache if possible.
    pub(crate) fn build(
        &mut self,
        shape: &MeshShape,
        colors: &mut ColorMaterials<'_>,
        notes: &mut Notes,
    ) -> Result<CachedMesh, ImportError> {
        let mesh = shape.mesh;
        let here = || format!("/meshes/{mesh}");
        let primitives = self.primitives(shape)?;
        let triangles: usize = primitives.iter().map(Primitive::triangle_count).sum();
        // Colours decide materials of the whole model, which a cached mesh does not bring. Weights and
        // poses are no part of the key.
        let is_colored = primitives.iter().any(|primitive| primitive.colors.is_some());
        let is_kept = triangles >= MIN_CACHED_TRIANGLES && !is_colored && shape.is_default();
        let cached = self.cached.as_ref().filter(|_| is_kept);
        if let Some(built) = cached.and_then(|cached| cached.find(mesh)) {
            self.namer.count(built.1.len()).map_err(|fault| fault.at(here()))?;
            return Ok(built);
        }
        let table = |primitive: &Primitive<'_>| primitive.features.and_then(|f| f.table);
        let tables: Vec<_> = primitives.iter().map(table).collect();
        let mut read: Vec<_> = primitives.iter().map(Primitive::read).collect();
        let names = self.namer.name(&mut read, &tables).map_err(|f| f.at(here()))?;
        if is_colored {
            let colored = read.into_iter().zip(&primitives).flat_map(|(raw, primitive)| {
                match primitive.read_colors() {
                    Some(of_vertices) => colors.split(raw, of_vertices, notes),
                    None => vec![raw],
                }
            });
            read = colored.collect();
        }
        let (welded, report) =
            weld(&read).map_err(|e| ImportFault::Invalid(e.to_string()).at(here()))?;
        drop(read);
        let built = (welded, names, report);
        if let Some(cached) = cached {
            cached.keep(mesh, &built);
        }
        Ok(built)
    }

    fn primitives(&self, shape: &MeshShape) -> Result<Vec<Primitive<'a>>, ImportError> {
        let mut primitives = Vec::new();
        self.source.primitives(shape, |_, primitive, place| {
            if let Some(mut primitive) = primitive {
                let key = (place.mesh, place.primitive);
                primitive.restart = self.restarts.get(&key).copied();
                let is_sane = self.sane_positions.get(&primitive.positions.key);
                primitive.is_astray = is_sane == Some(&false) || primitive.is_deformed();
                primitives.push(primitive);
            }
            Ok(())
        })?;
        Ok(primitives)
    }
}
