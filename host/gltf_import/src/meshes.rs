//! Meshes: everything is checked first, without building anything; what is
//! built then cannot fail halfway with memory taken.

use std::collections::{HashMap, HashSet};

use busbar_geometry::{Mesh, WeldReport, weld};
use gltf::json::Root;

use crate::ImportLimits;
use crate::accessor::Accessor;
use crate::buffers::Buffers;
use crate::error::{Fault, ImportError};
use crate::limits::MAX_COORDINATE;
use crate::primitives::{Place, Primitive};
use crate::report::Notes;

/// Checks meshes and counts their triangles.
pub(crate) struct Checker<'a> {
    root: &'a Root,
    buffers: &'a Buffers<'a>,
    limits: &'a ImportLimits,
    triangles: u64,
    visits: u64,
    /// Facts of accessors that have been gone through: many primitives share one.
    largest_index: HashMap<usize, u32>,
    sane_positions: HashSet<usize>,
    other: HashSet<usize>,
}

impl<'a> Checker<'a> {
    pub(crate) fn new(root: &'a Root, buffers: &'a Buffers<'a>, limits: &'a ImportLimits) -> Self {
        Self {
            root,
            buffers,
            limits,
            triangles: 0,
            visits: 0,
            largest_index: HashMap::new(),
            sane_positions: HashSet::new(),
            other: HashSet::new(),
        }
    }

    /// Checks one mesh; says how many triangles it has.
    pub(crate) fn check(&mut self, mesh: usize, notes: &mut Notes) -> Result<u64, ImportError> {
        let before = self.triangles;
        for (index, json) in self.root.meshes[mesh].primitives.iter().enumerate() {
            let place = Place { mesh, primitive: index };
            match Primitive::new(self.root, self.buffers, json, place)? {
                None => notes.add("primitive of points, lines or no positions skipped"),
                Some(primitive) => {
                    primitive.note(json, notes);
                    self.count(&primitive, place)?;
                    self.check_values(&primitive, place)?;
                }
            }
        }
        Ok(self.triangles - before)
    }

    /// A triangle takes a byte of some buffer at the very least; the same bytes
    /// named a thousand times are no thousand triangles.
    fn count(&mut self, primitive: &Primitive<'_>, place: Place) -> Result<(), ImportError> {
        self.triangles += primitive.triangle_count() as u64;
        let backed = self.buffers.total_bytes();
        let limit = self.limits.max_triangles.min(backed);
        if self.triangles <= limit {
            return Ok(());
        }
        let what = if limit == backed { "triangles for the bytes there are" } else { "triangles" };
        Err(Fault::TooMany { what, count: self.triangles, limit }.at(place.pointer("")))
    }

    fn check_values(&mut self, primitive: &Primitive<'_>, place: Place) -> Result<(), ImportError> {
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
            let fault = Fault::Vertex { index: largest, count: vertices };
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
                Err(Fault::Coordinate(element).at(place))
            }
        }
    }

    /// An element takes a byte at least: this bounds the time that many
    /// accessors of the same bytes can cost.
    fn visit(&mut self, accessor: &Accessor<'_>) -> Result<(), ImportError> {
        self.visits += accessor.stored_elements();
        let limit = self.buffers.total_bytes();
        if self.visits <= limit {
            return Ok(());
        }
        let what = "elements for the bytes there are";
        let fault = Fault::TooMany { what, count: self.visits, limit };
        Err(fault.at(format!("/accessors/{}", accessor.index)))
    }
}

/// Reads and welds one checked mesh.
pub(crate) fn build(
    root: &Root,
    buffers: &Buffers<'_>,
    mesh: usize,
) -> Result<(Mesh, WeldReport), ImportError> {
    let mut primitives = Vec::new();
    for (index, json) in root.meshes[mesh].primitives.iter().enumerate() {
        let place = Place { mesh, primitive: index };
        if let Some(primitive) = Primitive::new(root, buffers, json, place)? {
            primitives.push(primitive.read());
        }
    }
    weld(&primitives).map_err(|e| Fault::Invalid(e.to_string()).at(format!("/meshes/{mesh}")))
}
