//! Cache directory: private to its owner, and of bounded size.

use std::fs::DirBuilder;
use std::os::unix::fs::{DirBuilderExt, MetadataExt};
use std::path::{Path, PathBuf};
use std::time::SystemTime;

use crate::CacheError;

/// File name extensions of collapse stacks and of welded meshes.
pub(crate) const STACKS: &str = "stacks";
pub(crate) const MESH: &str = "mesh";

/// Entries looked at when room is made; more than any cache of full files has.
const MAX_ENTRIES: usize = 1 << 20;

/// Makes a directory that only its owner may write, or checks the existing one. Anyone who can
/// plant files here decides what operators see.
pub(crate) fn make_private(directory: &Path) -> Result<(), CacheError> {
    let fault = |source| CacheError::Directory { directory: directory.to_owned(), source };
    DirBuilder::new().recursive(true).mode(0o700).create(directory).map_err(fault)?;
    let metadata = std::fs::metadata(directory).map_err(fault)?;
    let not_private = |reason| Err(CacheError::NotPrivate { directory: directory.into(), reason });
    if metadata.uid() != rustix::process::geteuid().as_raw() {
        return not_private("it belongs to another user");
    }
    if metadata.mode() & 0o022 != 0 {
        return not_private("others may write into it");
    }
    Ok(())
}

struct Entry {
    used: SystemTime,
    bytes: u64,
    path: PathBuf,
}

/// Removes files, the one used longest ago first, down to the limit.
pub(crate) fn evict(directory: &Path, limit_bytes: u64) -> std::io::Result<()> {
    let mut entries = Vec::new();
    for entry in std::fs::read_dir(directory)?.take(MAX_ENTRIES) {
        let path = entry?.path();
        // Another process may have removed it meanwhile.
        let is_ours = path.extension().is_some_and(|e| e == STACKS || e == MESH);
        if let (true, Ok(metadata)) = (is_ours, path.metadata()) {
            let used = metadata.modified().unwrap_or(SystemTime::UNIX_EPOCH);
            entries.push(Entry { used, bytes: metadata.len(), path });
        }
    }
    let mut bytes: u64 = entries.iter().map(|entry| entry.bytes).sum();
    entries.sort_by(|a, b| a.used.cmp(&b.used).then(a.path.cmp(&b.path)));
    for entry in entries {
        if bytes <= limit_bytes {
            break;
        }
        if std::fs::remove_file(&entry.path).is_ok() {
            bytes -= entry.bytes;
        }
    }
    Ok(())
}
