//! Trust in library files: location, owners, permissions, digests and signatures.
//!
//! A file is opened once. What is hashed, what a signature is checked against
//! and what is loaded are the contents behind that one descriptor, so that no
//! other file can take its place in between.

use std::collections::BTreeSet;
use std::fs::{File, Metadata, OpenOptions};
use std::os::unix::fs::{FileExt, MetadataExt, OpenOptionsExt};
use std::path::{Path, PathBuf};
use std::sync::{Arc, OnceLock};

use rustix::fs::OFlags;
use sha2::{Digest as _, Sha256};

use crate::Digest;
use crate::signature::{self, PublicKey};

/// Limit of libraries in one directory.
pub const MAX_LIBRARIES: usize = 256;
/// The largest library that is loaded.
pub const MAX_LIBRARY_BYTES: u64 = 1 << 30;
/// Others may write to it.
const OTHERS_WRITE: u32 = 0o002;
/// Sticky bit of directories: others may not replace files that are not theirs.
const STICKY: u32 = 0o1000;
/// Bytes hashed at once.
const HASHED_BYTES: usize = 1 << 16;

/// Requirements of a library besides its location.
#[derive(Clone, Debug, Default)]
pub struct LoadRules {
    /// The only contents that are loaded; none for any.
    pub only: Option<BTreeSet<Digest>>,
    /// Whose signature each library must bear.
    pub signed_by: Option<PublicKey>,
}

/// A library that may be loaded, open.
#[derive(Clone, Debug)]
pub struct LibraryFile {
    path: PathBuf,
    file: Arc<File>,
    digest: OnceLock<Digest>,
}

impl LibraryFile {
    /// Wraps a library whose path and contents the caller has verified.
    pub fn trusted(path: PathBuf, file: File) -> Self {
        Self { path, file: Arc::new(file), digest: OnceLock::new() }
    }

    /// Returns the path of the library file.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Returns the open file.
    pub fn file(&self) -> &File {
        &self.file
    }

    /// SHA-256 of its contents.
    ///
    /// # Errors
    /// When it cannot be read or is too large, in words.
    pub fn digest(&self) -> Result<Digest, String> {
        if let Some(digest) = self.digest.get() {
            return Ok(*digest);
        }
        let digest = hash(&self.file).map_err(|error| format!("cannot read it: {error}"))?;
        Ok(*self.digest.get_or_init(|| digest))
    }

    fn open(directory: &Path, path: &Path) -> Result<Self, String> {
        let target = path.canonicalize().map_err(|error| format!("cannot open it: {error}"))?;
        if !target.starts_with(directory) {
            return Err(format!(
                "it is a link out of its directory, to {}; put the library itself there",
                target.display()
            ));
        }
        // Not blocking: a FIFO under this name must not hold up the start.
        let flags = (OFlags::NOFOLLOW | OFlags::NONBLOCK).bits() as i32;
        let file = OpenOptions::new().read(true).custom_flags(flags).open(&target);
        let file = file.map_err(|error| format!("cannot open it: {error}"))?;
        let metadata = file.metadata().map_err(|error| format!("cannot look at it: {error}"))?;
        if !metadata.is_file() {
            return Err("it is no regular file; put a library there".into());
        }
        check_owner(&metadata, &target)?;
        Ok(Self::trusted(path.to_owned(), file))
    }

    fn check(&self, rules: &LoadRules) -> Result<(), String> {
        if let Some(only) = &rules.only
            && !only.contains(&self.digest()?)
        {
            return Err(format!(
                "its SHA-256 is {}, to which no plugin of the configuration is pinned; if this \
                 is the library you want, put that into the plugin's \"sha256\"",
                self.digest()?
            ));
        }
        match &rules.signed_by {
            Some(key) => signature::verify(&self.path, self.digest()?, key),
            None => Ok(()),
        }
    }
}

/// The libraries of absolute directories that may be loaded, in order of
/// directory and name, and what was refused.
pub fn libraries(
    directories: &[PathBuf],
    rules: &LoadRules,
) -> (Vec<LibraryFile>, Vec<RejectedLibrary>) {
    let (mut files, mut refused) = (Vec::new(), Vec::new());
    for directory in directories {
        let mut refuse =
            |path: &Path, reason| refused.push(RejectedLibrary { path: path.to_owned(), reason });
        let (resolved, paths) = match list(directory) {
            Ok(listed) => listed,
            Err(reason) => {
                refuse(directory, reason);
                continue;
            }
        };
        for path in paths {
            let opened = LibraryFile::open(&resolved, &path)
                .and_then(|file| file.check(rules).map(|()| file));
            match opened {
                Ok(file) => files.push(file),
                Err(reason) => refuse(&path, reason),
            }
        }
    }
    (files, refused)
}

/// Lists the files that are named like libraries in a directory, whose path is resolved.
fn list(directory: &Path) -> Result<(PathBuf, Vec<PathBuf>), String> {
    let unreadable = |error: std::io::Error| format!("cannot read this plugin directory: {error}");
    if !directory.is_absolute() {
        return Err("a plugin directory must be absolute".into());
    }
    let resolved = directory.canonicalize().map_err(unreadable)?;
    check_owner(&resolved.metadata().map_err(unreadable)?, &resolved)?;
    for above in resolved.ancestors().skip(1) {
        let mode = above.metadata().map_err(unreadable)?.mode();
        if mode & OTHERS_WRITE != 0 && mode & STICKY == 0 {
            return Err(writable(above));
        }
    }
    let entries = std::fs::read_dir(directory).map_err(unreadable)?;
    let mut paths: Vec<PathBuf> = entries
        .filter_map(|entry| entry.ok().map(|entry| entry.path()))
        .filter(|path| {
            path.extension().is_some_and(|e| e == std::env::consts::DLL_EXTENSION) && path.is_file()
        })
        .collect();
    if paths.len() > MAX_LIBRARIES {
        return Err(format!("it holds {} libraries; the limit is {MAX_LIBRARIES}", paths.len()));
    }
    paths.sort();
    Ok((resolved, paths))
}

/// Checks that only root and the user of the viewer may change a file.
fn check_owner(metadata: &Metadata, path: &Path) -> Result<(), String> {
    let owner = metadata.uid();
    if owner != 0 && owner != rustix::process::geteuid().as_raw() {
        return Err(format!(
            "it belongs to user {owner}; it must be root's or your own: `chown` it, or copy it"
        ));
    }
    if metadata.mode() & OTHERS_WRITE != 0 {
        return Err(writable(path));
    }
    Ok(())
}

fn writable(path: &Path) -> String {
    let path = path.display();
    format!("everybody may write to {path}; take that right away: chmod o-w '{path}'")
}

fn hash(file: &File) -> std::io::Result<Digest> {
    let mut sha = Sha256::new();
    let mut buffer = vec![0; HASHED_BYTES];
    let mut offset = 0;
    loop {
        let read = file.read_at(&mut buffer, offset)?;
        if read == 0 {
            return Ok(Digest(sha.finalize().into()));
        }
        sha.update(&buffer[..read]);
        offset += read as u64;
        if offset > MAX_LIBRARY_BYTES {
            return Err(std::io::Error::other(format!(
                "it has more than {MAX_LIBRARY_BYTES} bytes"
            )));
        }
    }
}

/// A file or directory that gave no plugin, and why.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RejectedLibrary {
    /// The file or directory.
    pub path: PathBuf,
    /// Reason of the rejection.
    pub reason: String,
}

#[cfg(test)]
mod tests {
    use std::fs::{self, Permissions};
    use std::os::unix::fs::{PermissionsExt, symlink};

    use tempfile::TempDir;

    use super::*;

    const NAME: &str = "libone.so";

    fn folder() -> TempDir {
        let folder = tempfile::tempdir().unwrap();
        fs::write(folder.path().join(NAME), "library").unwrap();
        folder
    }

    fn look(folder: &TempDir, rules: &LoadRules) -> Result<LibraryFile, String> {
        let (mut files, mut refused) = libraries(&[folder.path().to_owned()], rules);
        match (files.pop(), refused.pop()) {
            (Some(file), None) => Ok(file),
            (None, Some(refused)) => Err(refused.reason),
            other => panic!("{other:?}"),
        }
    }

    #[track_caller]
    fn assert_refused(folder: &TempDir, words: &str) {
        let reason = look(folder, &LoadRules::default()).unwrap_err();
        assert!(reason.contains(words), "{reason}");
    }

    fn set_mode(path: &Path, mode: u32) {
        fs::set_permissions(path, Permissions::from_mode(mode)).unwrap();
    }

    #[test]
    fn a_library_of_ones_own_may_be_loaded() {
        let file = look(&folder(), &LoadRules::default()).unwrap();
        assert_eq!(file.digest().unwrap(), Digest(Sha256::digest("library").into()));
    }

    #[test]
    fn what_everybody_may_write_to_is_refused() {
        let folder = folder();
        set_mode(&folder.path().join(NAME), 0o666);
        assert_refused(&folder, "chmod o-w");
        set_mode(&folder.path().join(NAME), 0o644);
        set_mode(folder.path(), 0o777);
        assert_refused(&folder, "chmod o-w");
        set_mode(folder.path(), 0o755);
        assert!(look(&folder, &LoadRules::default()).is_ok());
    }

    #[test]
    fn a_directory_under_one_that_everybody_may_write_to_is_refused() {
        let folder = folder();
        let below = folder.path().join("plugins");
        fs::create_dir(&below).unwrap();
        fs::write(below.join(NAME), "library").unwrap();
        let look = || libraries(std::slice::from_ref(&below), &LoadRules::default()).0.len();
        set_mode(folder.path(), 0o777);
        assert_eq!(look(), 0);
        set_mode(folder.path(), 0o1777);
        assert_eq!(look(), 1);
    }

    #[test]
    fn a_link_out_of_the_directory_is_refused_and_one_within_is_not() {
        let (folder, elsewhere) = (folder(), folder());
        let library = folder.path().join(NAME);
        fs::rename(&library, folder.path().join("libone.so.1")).unwrap();
        symlink("libone.so.1", &library).unwrap();
        assert!(look(&folder, &LoadRules::default()).is_ok());
        fs::remove_file(&library).unwrap();
        symlink(elsewhere.path().join(NAME), &library).unwrap();
        assert_refused(&folder, "it is a link out of its directory");
    }

    #[test]
    fn a_relative_directory_is_refused() {
        let (files, refused) = libraries(&[PathBuf::from("plugins")], &LoadRules::default());
        assert!(files.is_empty());
        assert!(refused[0].reason.contains("absolute"));
    }

    #[test]
    fn contents_that_nothing_is_pinned_to_are_refused() {
        let folder = folder();
        let digest = |text: &str| Digest(Sha256::digest(text).into());
        let rules = |text| LoadRules { only: Some([digest(text)].into()), signed_by: None };
        assert!(look(&folder, &rules("library")).is_ok());
        let reason = look(&folder, &rules("another")).unwrap_err();
        assert!(reason.contains(&digest("library").to_string()), "{reason}");
    }
}
