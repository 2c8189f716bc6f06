//! Rules of a log, and a trial of them that writes nothing.

use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};
use std::{fs, io, thread, time::Duration};

use crate::LogError;
use crate::anchor::{self, AnchorState};
use crate::chain::{ChainKey, KeyRing};
use crate::file_names::{CURRENT, LOCK};
use crate::recovery::{Examination, examine};
use crate::storage::{DiskStorage, Storage};

/// Rights of a file by which everybody may read it.
const READ_BY_ALL: u32 = 0o004;
/// Delay before a log with faults is read again: a viewer may have been writing it.
const SECOND_LOOK: Duration = Duration::from_millis(50);

/// Place of a log, and how large it may grow.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct AuditLogOptions {
    /// Folder of the log, made where it is missing.
    pub directory: PathBuf,
    /// Size at which a new file begins, at most [`MAX_FILE_BYTES`](crate::MAX_FILE_BYTES).
    pub max_file_bytes: u64,
    /// Full files that are kept, the newest included; at least 1.
    pub max_files: u32,
    /// File with the key of the chain, outside the folder; without one anybody can make a
    /// chain that is whole.
    pub key_file: Option<PathBuf>,
    /// File that the anchor is kept in, outside the folder.
    pub anchor_file: Option<PathBuf>,
}

impl AuditLogOptions {
    /// Checks that key and anchor lie outside the folder of the log.
    pub(crate) fn check_places(&self) -> Result<(), LogError> {
        let directory = resolved(&self.directory);
        for path in self.key_file.iter().chain(&self.anchor_file) {
            let places = [resolved(path), resolved(anchor::folder_of(path))];
            if places.iter().any(|place| place.starts_with(&directory)) {
                return Err(LogError::Misplaced { path: path.clone() });
            }
        }
        Ok(())
    }
}

/// Tries whether a log can be opened, and writes nothing; faults that the next opening
/// would tell of, for people.
///
/// # Errors
/// A folder, key or anchor that cannot be used.
pub fn inspect(rules: &AuditLogOptions) -> Result<Vec<String>, LogError> {
    rules.check_places()?;
    let keys = open_keys(rules.key_file.as_deref())?;
    let mut remarks = Vec::new();
    if let Some(key) = &rules.key_file
        && fs::metadata(key).is_ok_and(|found| found.permissions().mode() & READ_BY_ALL != 0)
    {
        remarks.push(format!("its key '{}' can be read by everybody", key.display()));
    }
    if let Some(path) = &rules.anchor_file {
        let unusable = |source| LogError::Anchor { path: path.clone(), source };
        anchor::check_writable(path).map_err(unusable)?;
    }
    let unusable = |source| LogError::Unusable { path: rules.directory.clone(), source };
    match fs::metadata(&rules.directory) {
        Ok(_) => {}
        Err(error) if error.kind() == io::ErrorKind::NotFound => {
            return check_parent(&rules.directory).map(|()| remarks).map_err(unusable);
        }
        Err(error) => return Err(unusable(error)),
    }
    let storage = DiskStorage::open(&rules.directory).map_err(unusable)?;
    let mut found = read_findings(&storage, rules, &keys).map_err(unusable)?;
    if !found.is_empty() {
        thread::sleep(SECOND_LOOK);
        found = read_findings(&storage, rules, &keys).map_err(unusable)?;
    }
    remarks.extend(found);
    Ok(remarks)
}

fn read_findings(
    storage: &DiskStorage,
    rules: &AuditLogOptions,
    keys: &KeyRing,
) -> io::Result<Vec<String>> {
    storage.check_writable()?;
    let names = storage.names()?;
    // Opened for appending, and left as they are.
    for name in [CURRENT, LOCK].into_iter().filter(|name| names.iter().any(|n| n == name)) {
        storage.open(name)?;
    }
    let state = match &rules.anchor_file {
        Some(path) => anchor::read(path, keys),
        None => AnchorState::Unused,
    };
    let Examination { found, .. } = examine(storage, keys, &state)?;
    Ok(found.remarks)
}

/// Reads the key of a chain, where one is named.
pub(crate) fn open_keys(key_file: Option<&Path>) -> Result<KeyRing, LogError> {
    let Some(path) = key_file else { return Ok(KeyRing::default()) };
    let key = ChainKey::read(path);
    let key = key.map_err(|source| LogError::Key { path: path.to_owned(), source })?;
    Ok(KeyRing::new(Some(key)))
}

/// Checks that a folder which is missing can be made.
fn check_parent(directory: &Path) -> io::Result<()> {
    let directory = std::path::absolute(directory)?;
    let above = directory.ancestors().skip(1).find(|folder| folder.exists());
    let above = above.unwrap_or(Path::new("/"));
    if !above.is_dir() {
        return Err(io::Error::other(format!("'{}' is no folder", above.display())));
    }
    let access = rustix::fs::Access::WRITE_OK | rustix::fs::Access::EXEC_OK;
    Ok(rustix::fs::access(above, access)?)
}

/// The place that a path leads to, as far as it exists.
fn resolved(path: &Path) -> PathBuf {
    let absolute = std::path::absolute(path).unwrap_or_else(|_| path.to_owned());
    for known in absolute.ancestors() {
        if let (Ok(place), Ok(rest)) = (known.canonicalize(), absolute.strip_prefix(known)) {
            return if rest.as_os_str().is_empty() { place } else { place.join(rest) };
        }
    }
    absolute
}
