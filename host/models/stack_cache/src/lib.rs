//! Cache of collapse stacks and welded meshes on disk, by content hash.
//!
//! Invariant: nothing that is read is trusted. A file that is shorter, longer,
//! altered, of another version or of another mesh is reported as damaged, and
//! its owner builds the stacks anew; nothing is allocated from a number in a
//! file before that number is checked against the mesh.
//!
//! Files are read, not mapped: a mapped file that somebody cuts short kills
//! the process that looks at it, and reading straight into the final arrays
//! costs no more than mapping, checking and copying (`DESIGN.md`).
#![doc = include_str!("../DESIGN.md")]

mod directory;
mod key;
mod mesh_file;
pub mod probe;
mod stack_file;

use std::borrow::Cow;
use std::fs::File;
use std::io::{Read, Write};
use std::path::{Path, PathBuf};
use std::time::SystemTime;

use busbar_geometry::{CollapseStacks, Mesh, StackTables, WeldReport};
use thiserror::Error;

pub use key::{CacheKey, OptimizerDigest};
pub use mesh_file::{MeshKey, WeldedMesh, content_digest};

/// Bytes that are written at a time. For one write the system may make one page of that size, and
/// needs that much contiguous free memory.
const PIECE_BYTES: usize = 64 << 10;

/// A directory of stacks and welded meshes, one file each.
#[derive(Clone, Debug)]
pub struct StackCache {
    directory: PathBuf,
    limit_bytes: u64,
}

/// Result of looking a mesh up.
#[derive(Debug)]
pub enum Lookup {
    /// Stacks of the mesh, which was taken.
    Found(Box<CollapseStacks>),
    /// Nothing. The mesh is left.
    Absent,
    /// A file that cannot be used, and why. The mesh is left.
    Damaged(String),
}

/// Reasons why a cache cannot be used.
#[derive(Debug, Error)]
pub enum CacheError {
    /// The directory cannot be made or looked at.
    #[error("cannot use the cache directory '{}': {source}; name one that may be written", .directory.display())]
    Directory {
        /// Directory of the cache.
        directory: PathBuf,
        /// Error of the operating system.
        source: std::io::Error,
    },
    /// Others could plant files in the directory.
    #[error("the cache directory '{}' is not private: {reason}; make it yours alone (chmod 700)", .directory.display())]
    NotPrivate {
        /// Directory of the cache.
        directory: PathBuf,
        /// Reason for the refusal.
        reason: &'static str,
    },
    /// A file cannot be written.
    #[error("cannot write into the cache directory '{}': {source}; check space and rights", .directory.display())]
    Write {
        /// Directory of the cache.
        directory: PathBuf,
        /// Error of the operating system.
        source: std::io::Error,
    },
}

impl StackCache {
    /// Opens a directory, and makes it if it is missing. Beyond the limit, the least recently used
    /// files are evicted.
    ///
    /// # Errors
    /// When it cannot be made, or others than its owner may write into it.
    pub fn open(directory: &Path, limit_bytes: u64) -> Result<Self, CacheError> {
        directory::make_private(directory)?;
        Ok(Self { directory: directory.to_owned(), limit_bytes })
    }

    /// Returns the directory of the cache.
    pub fn directory(&self) -> &Path {
        &self.directory
    }

    /// Loads the stacks of a mesh.
    pub fn load(&self, key: CacheKey, mesh: &mut Mesh) -> Lookup {
        match open(&self.path(key), |file, length| restore(file, length, key, mesh)) {
            None => Lookup::Absent,
            Some(Ok(stacks)) => Lookup::Found(Box::new(stacks)),
            Some(Err(reason)) => Lookup::Damaged(reason),
        }
    }

    /// Keeps the tables of stacks. `ranks` are those of their sequence,
    /// [`busbar_geometry::removal_ranks`].
    ///
    /// # Errors
    /// When the file cannot be written; a half-written one never shows.
    pub fn store(
        &self,
        key: CacheKey,
        ranks: &[u32],
        tables: &StackTables,
    ) -> Result<(), CacheError> {
        self.write(&self.path(key), &stack_file::parts(key, ranks, tables))
    }

    /// Loads a welded mesh; `None` if there is none.
    ///
    /// # Errors
    /// Why its file cannot be used.
    pub fn load_mesh(&self, key: MeshKey) -> Result<Option<WeldedMesh>, String> {
        let path = self.mesh_path(key);
        open(&path, |file, length| mesh_file::read(file, length, key)).transpose()
    }

    /// Keeps a welded mesh.
    ///
    /// # Errors
    /// When the file cannot be written; a half-written one never shows.
    pub fn store_mesh(
        &self,
        key: MeshKey,
        mesh: &Mesh,
        feature_names: &[String],
        report: WeldReport,
    ) -> Result<(), CacheError> {
        self.write(&self.mesh_path(key), &mesh_file::parts(key, mesh, feature_names, report))
    }

    fn write(&self, path: &Path, parts: &[Cow<'_, [u8]>]) -> Result<(), CacheError> {
        let fault = |source| CacheError::Write { directory: self.directory.clone(), source };
        let temporary = path.with_extension(format!("{}.tmp", std::process::id()));
        let written = File::create(&temporary)
            .and_then(|mut file| {
                let mut pieces = parts.iter().flat_map(|part| part.chunks(PIECE_BYTES));
                pieces.try_for_each(|piece| file.write_all(piece))
            })
            .and_then(|()| std::fs::rename(&temporary, path));
        if let Err(error) = written {
            let _ = std::fs::remove_file(&temporary);
            return Err(fault(error));
        }
        directory::evict(&self.directory, self.limit_bytes).map_err(fault)
    }

    /// Returns the path of a mesh's stack file.
    pub fn path(&self, key: CacheKey) -> PathBuf {
        self.directory.join(format!("{key}.{}", directory::STACKS))
    }

    /// Returns the path of a welded mesh's file.
    pub fn mesh_path(&self, key: MeshKey) -> PathBuf {
        self.directory.join(format!("{key}.{}", directory::MESH))
    }
}

/// Opens a file and has it read, given its length; `None` if there is no file.
fn open<T>(
    path: &Path,
    read: impl FnOnce(&mut File, u64) -> Result<T, String>,
) -> Option<Result<T, String>> {
    let unreadable = |error: std::io::Error| format!("it cannot be read: {error}");
    let mut file = match File::open(path) {
        Ok(file) => file,
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => return None,
        Err(error) => return Some(Err(unreadable(error))),
    };
    let length = file.metadata().map_err(unreadable).map(|metadata| metadata.len());
    let found = length.and_then(|length| read(&mut file, length));
    if found.is_ok() {
        // For the order of eviction; a read-only cache does without.
        let _ = file.set_modified(SystemTime::now());
    }
    Some(found)
}

/// Reads a file of this length and puts its stacks together; the mesh is taken if all
/// goes well.
fn restore(
    file: &mut impl Read,
    length: u64,
    key: CacheKey,
    mesh: &mut Mesh,
) -> Result<CollapseStacks, String> {
    let (ranks, tables) = stack_file::read(file, length, key, mesh)?;
    CollapseStacks::restore(mesh, &ranks, tables).map_err(|error| error.to_string())
}
