//! Fuzzing entry points: cache files in memory, with valid checksums, which a fuzzer would never
//! find by itself.

use busbar_geometry::{CollapseStacks, Mesh, StackTables};

use crate::{CacheKey, MeshKey, WeldedMesh, mesh_file as mesh_format, restore, stack_file};

/// Builds a whole stack file, with a valid checksum.
pub fn file(key: CacheKey, ranks: &[u32], tables: &StackTables) -> Vec<u8> {
    stack_file::parts(key, ranks, tables).concat()
}

/// Reads a stack file. The mesh is taken if all goes well.
///
/// # Errors
/// What is wrong with it, in words.
pub fn read(mut bytes: &[u8], key: CacheKey, mesh: &mut Mesh) -> Result<CollapseStacks, String> {
    let length = bytes.len() as u64;
    restore(&mut bytes, length, key, mesh)
}

/// Builds a whole mesh file, with a valid checksum.
pub fn mesh_file(key: MeshKey, welded: &WeldedMesh) -> Vec<u8> {
    mesh_format::parts(key, &welded.mesh, &welded.feature_names, welded.report).concat()
}

/// Reads a mesh file.
///
/// # Errors
/// What is wrong with it, in words.
pub fn read_mesh(mut bytes: &[u8], key: MeshKey) -> Result<WeldedMesh, String> {
    let length = bytes.len() as u64;
    mesh_format::read(&mut bytes, length, key)
}
