//! File version: identity, size and modification time, compared without reading the content.

use std::fs::Metadata;
use std::os::unix::fs::MetadataExt;
use std::path::Path;

/// Device, inode, length, and modification time in seconds and nanoseconds; none without a file.
pub type FileVersion = Option<(u64, u64, u64, i64, i64)>;

/// Returns the version of the file at a path.
pub fn version(path: &Path) -> FileVersion {
    let of = |file: Metadata| (file.dev(), file.ino(), file.len(), file.mtime(), file.mtime_nsec());
    std::fs::metadata(path).ok().map(of)
}
