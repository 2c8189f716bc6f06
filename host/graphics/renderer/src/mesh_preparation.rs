//! Data that a draw reduction prepares for resolved meshes, on worker threads.

use std::any::Any;

use busbar_geometry::Mesh;
use busbar_gpu::BufferSlice;

use crate::slender::SectionRange;

/// Data of a draw reduction, kept beside the triangles of a resolved mesh.
pub(crate) trait MeshData: Any + Send {
    /// Takes the uploaded indices over; `None` where no triangle lives.
    fn attach(&mut self, indices: Option<&BufferSlice>);

    /// Returns the memory of the data, bytes.
    fn bytes(&self) -> u64;
}

/// Live triangles of a mesh at a cursor, as they are resolved.
#[derive(Clone, Copy)]
pub(crate) struct LiveTriangles<'a> {
    pub(crate) mesh: &'a Mesh,
    /// Part of a model: other meshes stand in the same place.
    pub(crate) is_part: bool,
    /// Corners as wedge indices.
    pub(crate) triangles: &'a [[u32; 3]],
    /// For each section, its range in `triangles`.
    pub(crate) sections: &'a [SectionRange],
}

/// Preparation of resolved meshes by a draw reduction.
#[derive(Clone, Copy)]
pub(crate) struct MeshPreparation {
    /// Makes the data of a mesh at a cursor.
    pub(crate) prepare: fn(LiveTriangles<'_>) -> Option<Box<dyn MeshData>>,
    /// Returns the greatest size of the data of a mesh, bytes; the flag tells parts of a model.
    pub(crate) max_bytes: fn(&Mesh, bool) -> u64,
}

impl MeshPreparation {
    /// Preparation without any data.
    pub(crate) const NONE: Self = Self { prepare: |_| None, max_bytes: |_, _| 0 };
}
