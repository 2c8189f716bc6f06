//! Files in memory: for fuzzing, which would never find a checksum by itself.

use busbar_geometry::{CollapseStacks, Mesh, StackTables};

use crate::{CacheKey, MeshKey, WeldedMesh, file, restore, welded};

/// A whole file, with the checksum of whatever is in it.
pub fn file(key: CacheKey, ranks: &[u32], tables: &StackTables) -> Vec<u8> {
    file::parts(key, ranks, tables).concat()
}

/// Reads a file. The mesh is taken if all goes well.
///
/// # Errors
/// What is wrong with it, in words.
pub fn read(mut bytes: &[u8], key: CacheKey, mesh: &mut Mesh) -> Result<CollapseStacks, String> {
    let length = bytes.len() as u64;
    restore(&mut bytes, length, key, mesh)
}

/// A whole file of a welded mesh, with the checksum of whatever is in it.
pub fn mesh_file(key: MeshKey, welded: &WeldedMesh) -> Vec<u8> {
    welded::parts(key, &welded.mesh, &welded.feature_names, welded.report).concat()
}

/// Reads such a file.
///
/// # Errors
/// What is wrong with it, in words.
pub fn read_mesh(mut bytes: &[u8], key: MeshKey) -> Result<WeldedMesh, String> {
    let length = bytes.len() as u64;
    welded::read(&mut bytes, length, key)
}
