//! Files in memory: for fuzzing, which would never find a checksum by itself.

use busbar_geometry::{CollapseStacks, Mesh, StackTables};

use crate::{CacheKey, file, restore};

/// A whole file, with the checksum of whatever is in it.
pub fn file(key: CacheKey, ranks: &[u32], tables: &StackTables) -> Vec<u8> {
    file::bytes(key, ranks, tables)
}

/// Reads a file. The mesh is taken if all goes well.
///
/// # Errors
/// What is wrong with it, in words.
pub fn read(mut bytes: &[u8], key: CacheKey, mesh: &mut Mesh) -> Result<CollapseStacks, String> {
    let length = bytes.len() as u64;
    restore(&mut bytes, length, key, mesh)
}
