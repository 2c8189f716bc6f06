//! What tells a file from the one before, without reading it.

use std::fs::Metadata;
use std::os::unix::fs::MetadataExt;
use std::path::Path;

/// Where it is, its length, when it was written; none where there is no file.
pub(crate) type FileVersion = Option<(u64, u64, u64, i64, i64)>;

/// Of what a path leads to now.
pub(crate) fn version(path: &Path) -> FileVersion {
    let of = |file: Metadata| (file.dev(), file.ino(), file.len(), file.mtime(), file.mtime_nsec());
    std::fs::metadata(path).ok().map(of)
}
