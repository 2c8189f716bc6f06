//! Data that software rasterizers keep of a resolved mesh: culling blocks and large faces.

use busbar_culling::{Occluder, TriangleBlocks, occluder_bytes, occluders_of};
use busbar_geometry::Mesh;
use busbar_gpu::BufferSlice;

use crate::mesh_preparation::{LiveTriangles, MeshData, MeshPreparation};

/// Triangles of the largest mesh that takes part in CPU culling.
const MAX_MESH_TRIANGLES: usize = 65_536;

/// Least number of live triangles from which a mesh that stands alone is culled: it pays where all
/// that is nearer hides some.
pub(super) const MIN_TRIANGLES_BY_DEPTH: usize = 64;

/// More live triangles than there are.
const NEVER_CULLED: usize = usize::MAX;

/// Live triangles of a mesh as the processor sees them.
pub(super) struct CullableTriangles {
    /// In sight of it.
    indices: BufferSlice,
    blocks: TriangleBlocks,
}

impl CullableTriangles {
    /// Pairs indices with their blocks; `None` where the processor cannot read the indices.
    pub(super) fn new(indices: &BufferSlice, blocks: TriangleBlocks) -> Option<Self> {
        indices.is_host_visible().then(|| Self { indices: indices.clone(), blocks })
    }

    pub(super) fn indices(&self) -> &BufferSlice {
        &self.indices
    }

    pub(super) fn blocks(&self) -> &TriangleBlocks {
        &self.blocks
    }

    pub(super) fn count(&self) -> usize {
        self.blocks.count()
    }

    /// Counts the triangles of so many instances.
    pub(super) fn count_of(&self, instances: u32) -> u64 {
        self.blocks.count() as u64 * u64::from(instances)
    }

    pub(super) fn bytes(&self) -> u64 {
        TriangleBlocks::bytes_of(self.blocks.count())
    }
}

/// Data that software rasterizers keep of a resolved mesh.
pub(super) struct SoftwareMesh {
    /// Culling blocks, until the indices are uploaded.
    blocks: Option<TriangleBlocks>,
    /// Triangles of CPU culling, where the mesh takes part.
    pub(super) faces: Option<CullableTriangles>,
    /// Large faces, the largest first.
    pub(super) occluders: Box<[Occluder]>,
}

impl SoftwareMesh {
    /// Preparation of resolved meshes on worker threads.
    pub(super) const PREPARATION: MeshPreparation =
        MeshPreparation { prepare: Self::prepare, max_bytes: Self::max_bytes };

    fn prepare(live: LiveTriangles<'_>) -> Option<Box<dyn MeshData>> {
        let LiveTriangles { mesh, is_part, triangles, sections } = live;
        let is_culled = triangles.len() >= min_culled_triangles(mesh, is_part);
        let blocks = is_culled.then(|| TriangleBlocks::new(mesh, triangles));
        // Slender triangles are drawn wider than they are, and not in full.
        let flat = sections.iter().map(|section| section.all.start..section.slender_from);
        let occluders = occluders_of(mesh, triangles, flat);
        Some(Box::new(Self { blocks, faces: None, occluders }))
    }

    fn max_bytes(mesh: &Mesh, is_part: bool) -> u64 {
        let triangles = mesh.triangles.len();
        let is_culled = triangles >= min_culled_triangles(mesh, is_part);
        if is_culled { TriangleBlocks::bytes_of(triangles) } else { 0 }
    }
}

impl MeshData for SoftwareMesh {
    fn attach(&mut self, indices: Option<&BufferSlice>) {
        let blocks = indices.zip(self.blocks.take());
        self.faces = blocks.and_then(|(indices, blocks)| CullableTriangles::new(indices, blocks));
    }

    fn bytes(&self) -> u64 {
        let faces = self.faces.as_ref().map_or(0, CullableTriangles::bytes);
        faces + occluder_bytes(&self.occluders)
    }
}

/// Returns the least number of live triangles from which a mesh is culled on software rasterizers.
/// Parts of a model always are; single meshes where it pays. Very large meshes never are: they gain
/// little, and their normals would take memory.
fn min_culled_triangles(mesh: &Mesh, is_part: bool) -> usize {
    match mesh.triangles.len() {
        ..=MAX_MESH_TRIANGLES if is_part => 0,
        ..=MAX_MESH_TRIANGLES => MIN_TRIANGLES_BY_DEPTH,
        _ => NEVER_CULLED,
    }
}
