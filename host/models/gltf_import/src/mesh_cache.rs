//! Mesh cache interface: welded meshes kept between imports of the same bytes.

use busbar_geometry::{Mesh, WeldReport};

/// Mesh, the names of its features, and the counts of welding.
pub type CachedMesh = (Mesh, Vec<String>, WeldReport);

/// Triangles from which a mesh is worth keeping: fewer are welded sooner than found.
pub const MIN_CACHED_TRIANGLES: usize = 50_000;

/// Keeps welded meshes of at least [`MIN_CACHED_TRIANGLES`] by the content of the file that
/// they come from, and by their index in it.
pub trait MeshCache: Sync {
    /// Computes the content hash of the file's JSON and its buffers, which together decide every
    /// mesh.
    fn digest(&self, content: &[&[u8]]) -> u128;

    /// Returns a cached mesh, if there is one.
    fn get(&self, content: u128, mesh: usize) -> Option<CachedMesh>;

    /// Stores a welded mesh.
    fn insert(&self, content: u128, mesh: usize, built: &CachedMesh);
}
