//! Meshes in two phases: everything is checked first, without building anything. Building then
//! cannot fail halfway with memory taken.

use std::cell::OnceCell;
use std::collections::{HashMap, HashSet};

use busbar_geometry::weld;
use gltf::json::Root;

use crate::ImportLimits;
use crate::accessor::Accessor;
use crate::buffers::Buffers;
use crate::error::{ImportError, ImportFault};
use crate::extensions::{Extensions, PropertyTable, STRUCTURAL_METADATA};
use crate::features::{FeatureIds, FeatureNamer, NameTables};
use crate::limits::MAX_COORDINATE;
use crate::mesh_cache::{CachedMesh, MIN_CACHED_TRIANGLES, MeshCache};
use crate::name_table::NameTable;
use crate::primitives::{Primitive, PrimitivePlace};
use crate::report::Notes;

const SKIPPED_FEATURES: &str =
    "set of feature ids skipped: only the first one by a vertex attribute is read";
const UNNAMED_FEATURES: &str =
    "property table without a column of strings that its class declares: its features are numbered";

/// Checks meshes and counts their triangles.
pub(crate) struct Checker<'a> {
    root: &'a Root,
    buffers: &'a Buffers<'a>,
    extensions: &'a Extensions,
    limits: &'a ImportLimits,
    triangles: u64,
    visits: u64,
    /// Facts of accessors that have been gone through: many primitives share one.
    largest_index: HashMap<usize, u32>,
    sane_positions: HashSet<usize>,
    other: HashSet<usize>,
    /// Feature ids by accessor, table and null id.
    sane_features: HashSet<(usize, Option<usize>, Option<u64>)>,
    tables: NameTables<'a>,
}

impl<'a> Checker<'a> {
    pub(crate) fn new(
        root: &'a Root,
        buffers: &'a Buffers<'a>,
        extensions: &'a Extensions,
        limits: &'a ImportLimits,
    ) -> Self {
        Self {
            root,
            buffers,
            extensions,
            limits,
            triangles: 0,
            visits: 0,
            largest_index: HashMap::new(),
            sane_positions: HashSet::new(),
            other: HashSet::new(),
            sane_features: HashSet::new(),
            tables: HashMap::new(),
        }
    }

    /// Checks one mesh; says how many triangles it has.
    pub(crate) fn check(&mut self, mesh: usize, notes: &mut Notes) -> Result<u64, ImportError> {
        let before = self.triangles;
        for (index, json) in self.root.meshes[mesh].primitives.iter().enumerate() {
            let place = PrimitivePlace { mesh, primitive: index };
            match Primitive::new(self.root, self.buffers, self.extensions, json, place)? {
                None => notes.add("primitive of points, lines or no positions skipped"),
                Some(primitive) => {
                    primitive.note(json, notes);
                    let skipped = self.extensions.skipped_sets(mesh, index);
                    notes.add_many(SKIPPED_FEATURES, skipped);
                    self.count(&primitive, place)?;
                    self.check_values(&primitive, place)?;
                    if let Some(features) = &primitive.features {
                        self.check_features(features, notes)?;
                    }
                }
            }
        }
        Ok(self.triangles - before)
    }

    /// Counts triangles against the limit. Each takes at least a byte of some buffer; naming the
    /// same bytes a thousand times does not help.
    fn count(
        &mut self,
        primitive: &Primitive<'_>,
        place: PrimitivePlace,
    ) -> Result<(), ImportError> {
        self.triangles += primitive.triangle_count() as u64;
        let backed = self.buffers.total_bytes();
        let limit = self.limits.max_triangles.min(backed);
        if self.triangles <= limit {
            return Ok(());
        }
        let what = if limit == backed { "triangles for the bytes there are" } else { "triangles" };
        Err(ImportFault::TooMany { what, count: self.triangles, limit }.at(place.pointer("")))
    }

    fn check_values(
        &mut self,
        primitive: &Primitive<'_>,
        place: PrimitivePlace,
    ) -> Result<(), ImportError> {
        let vertices = primitive.positions.count;
        self.check_positions(&primitive.positions)?;
        for other in [&primitive.normals, &primitive.uvs].into_iter().flatten() {
            if self.other.insert(other.index) {
                self.visit(other)?;
                other.check_sparse()?;
            }
        }
        let Some(indices) = &primitive.indices else {
            return Ok(());
        };
        let largest = match self.largest_index.get(&indices.index) {
            Some(&largest) => largest,
            None => {
                self.visit(indices)?;
                indices.check_sparse()?;
                let largest = indices.largest_index();
                self.largest_index.insert(indices.index, largest);
                largest
            }
        };
        if indices.count > 0 && largest as usize >= vertices {
            let fault = ImportFault::Vertex { index: largest, count: vertices };
            return Err(fault.at(place.pointer("/indices")));
        }
        Ok(())
    }

    fn check_positions(&mut self, positions: &Accessor<'_>) -> Result<(), ImportError> {
        if !self.sane_positions.insert(positions.index) {
            return Ok(());
        }
        self.visit(positions)?;
        positions.check_sparse()?;
        let sane = |point: [f32; 3]| point.iter().all(|c| c.abs() <= MAX_COORDINATE);
        match positions.find_refused(sane) {
            None => Ok(()),
            Some(element) => {
                let place = format!("/accessors/{}", positions.index);
                Err(ImportFault::Coordinate(element).at(place))
            }
        }
    }

    fn check_features(
        &mut self,
        features: &FeatureIds<'_>,
        notes: &mut Notes,
    ) -> Result<(), ImportError> {
        let FeatureIds { ids, null, table } = features;
        if !self.sane_features.insert((ids.index, *table, *null)) {
            return Ok(());
        }
        self.visit(ids)?;
        ids.check_sparse()?;
        let mut rows = None;
        if let Some(index) = *table {
            let table = &self.extensions.property_tables()[index];
            self.check_table(index, table, notes)?;
            rows = Some(table.count);
        }
        features.check(rows)
    }

    fn check_table(
        &mut self,
        index: usize,
        table: &'a PropertyTable,
        notes: &mut Notes,
    ) -> Result<(), ImportError> {
        if self.tables.contains_key(&index) {
            return Ok(());
        }
        let place = format!("/extensions/{STRUCTURAL_METADATA}/propertyTables/{index}");
        let buffers = self.buffers;
        let names = match self.extensions.class_of(table) {
            None => None,
            Some(class) => {
                let charge = |bytes| self.charge(bytes, &place);
                NameTable::read(table, class, buffers, &place, charge)?
            }
        };
        notes.add_many(UNNAMED_FEATURES, names.is_none().into());
        self.tables.insert(index, names);
        Ok(())
    }

    /// Charges the visit of an accessor's elements, a byte each at least. This bounds the time that
    /// many accessors of the same bytes can cost.
    fn visit(&mut self, accessor: &Accessor<'_>) -> Result<(), ImportError> {
        self.charge(accessor.stored_elements(), &format!("/accessors/{}", accessor.index))
    }

    fn charge(&mut self, elements: u64, place: &str) -> Result<(), ImportError> {
        self.visits += elements;
        let limit = self.buffers.total_bytes();
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
    content: &'a dyn Fn() -> Vec<&'a [u8]>,
    /// Worked out once a mesh is large enough.
    digest: OnceCell<u128>,
}

impl<'a> CachedContent<'a> {
    pub(crate) fn new(cache: &'a dyn MeshCache, content: &'a dyn Fn() -> Vec<&'a [u8]>) -> Self {
        Self { cache, content, digest: OnceCell::new() }
    }

    fn digest(&self) -> u128 {
        *self.digest.get_or_init(|| self.cache.digest(&(self.content)()))
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
    root: &'a Root,
    buffers: &'a Buffers<'a>,
    extensions: &'a Extensions,
    namer: FeatureNamer<'a>,
    cached: Option<CachedContent<'a>>,
}

impl<'a> Builder<'a> {
    pub(crate) fn new(checker: Checker<'a>, cached: Option<CachedContent<'a>>) -> Self {
        let Checker { root, buffers, extensions, limits, tables, .. } = checker;
        let namer = FeatureNamer::new(tables, limits);
        Self { root, buffers, extensions, namer, cached }
    }

    /// Builds a mesh, from the cache if possible.
    pub(crate) fn build(&mut self, mesh: usize) -> Result<CachedMesh, ImportError> {
        let here = || format!("/meshes/{mesh}");
        let primitives = self.primitives(mesh)?;
        let triangles: usize = primitives.iter().map(Primitive::triangle_count).sum();
        let cached = self.cached.as_ref().filter(|_| triangles >= MIN_CACHED_TRIANGLES);
        if let Some(built) = cached.and_then(|cached| cached.find(mesh)) {
            self.namer.count(built.1.len()).map_err(|fault| fault.at(here()))?;
            return Ok(built);
        }
        let table = |primitive: &Primitive<'_>| primitive.features.and_then(|f| f.table);
        let tables: Vec<_> = primitives.iter().map(table).collect();
        let mut read: Vec<_> = primitives.iter().map(Primitive::read).collect();
        let names = self.namer.name(&mut read, &tables).map_err(|f| f.at(here()))?;
        let (welded, report) =
            weld(&read).map_err(|e| ImportFault::Invalid(e.to_string()).at(here()))?;
        drop(read);
        let built = (welded, names, report);
        if let Some(cached) = cached {
            cached.keep(mesh, &built);
        }
        Ok(built)
    }

    fn primitives(&self, mesh: usize) -> Result<Vec<Primitive<'a>>, ImportError> {
        let of_mesh = self.root.meshes[mesh].primitives.iter().enumerate();
        let primitives = of_mesh.map(|(index, json)| {
            let place = PrimitivePlace { mesh, primitive: index };
            Primitive::new(self.root, self.buffers, self.extensions, json, place).transpose()
        });
        primitives.flatten().collect()
    }
}
