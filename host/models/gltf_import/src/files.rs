//! External files, read without trusting the path: regular files within limits only.

use std::collections::HashMap;
use std::fs::{File, Metadata, OpenOptions};
use std::io::Read;
use std::path::{Path, PathBuf};
use std::rc::Rc;

use crate::error::{ImportError, ImportFault};
use crate::limits::MAX_EXTERNAL_FILES;
use crate::uri;

/// Reads a regular file of at most `limit` bytes. Never blocks: a pipe or a
/// device is refused unread.
pub(crate) fn read_regular(path: &Path, limit: u64) -> Result<Vec<u8>, ImportFault> {
    let read_fault = |reason| ImportFault::Read { path: path.to_owned(), reason };
    let require_file = |metadata: Metadata| {
        if metadata.is_file() {
            Ok(metadata.len())
        } else {
            Err(ImportFault::NotAFile(path.to_owned()))
        }
    };
    require_file(std::fs::metadata(path).map_err(read_fault)?)?;
    let file = open_without_blocking(path).map_err(read_fault)?;
    // Asked again of what was opened: the path may have changed hands.
    let length = require_file(file.metadata().map_err(read_fault)?)?;
    let too_many = |count| ImportFault::TooMany { what: "bytes", count, limit };
    if length > limit {
        return Err(too_many(length));
    }
    let mut bytes = Vec::with_capacity(length as usize);
    file.take(limit.saturating_add(1)).read_to_end(&mut bytes).map_err(read_fault)?;
    if bytes.len() as u64 > limit {
        return Err(too_many(bytes.len() as u64));
    }
    Ok(bytes)
}

fn open_without_blocking(path: &Path) -> std::io::Result<File> {
    let mut options = OpenOptions::new();
    options.read(true);
    #[cfg(unix)]
    {
        use std::os::unix::fs::OpenOptionsExt;
        let flags = rustix::fs::OFlags::NONBLOCK | rustix::fs::OFlags::NOCTTY;
        options.custom_flags(flags.bits() as i32);
    }
    options.open(path)
}

/// The files that a model names, each read once.
pub(crate) struct Files<'a> {
    base: Option<&'a Path>,
    bytes_left: u64,
    known: HashMap<PathBuf, Rc<Vec<u8>>>,
}

impl<'a> Files<'a> {
    /// Makes a reader of files. Relative URIs resolve in `base` and stay below it.
    pub(crate) fn new(base: Option<&'a Path>, bytes_left: u64) -> Self {
        Self { base, bytes_left, known: HashMap::new() }
    }

    /// Loads the bytes of a data URI or a file.
    pub(crate) fn load(&mut self, uri: &str, place: &str) -> Result<Rc<Vec<u8>>, ImportError> {
        self.try_load(uri).map_err(|fault| fault.at(place))
    }

    fn try_load(&mut self, uri: &str) -> Result<Rc<Vec<u8>>, ImportFault> {
        if let Some(data) = uri::data_of(uri) {
            let bytes = uri::decode_data(data).map_err(|reason| uri_fault(uri, reason))?;
            return Ok(Rc::new(bytes));
        }
        let Some(base) = self.base else {
            return Err(uri_fault(uri, "no file may be read beside these bytes"));
        };
        let mut first = None;
        for relative in uri::relative_paths(uri).map_err(|reason| uri_fault(uri, reason))? {
            match self.read(base, &relative, uri) {
                Err(fault @ ImportFault::Read { .. }) => {
                    first.get_or_insert(fault);
                }
                read => return read,
            }
        }
        Err(first.unwrap_or_else(|| uri_fault(uri, "it names no file")))
    }

    fn read(
        &mut self,
        base: &Path,
        relative: &Path,
        uri: &str,
    ) -> Result<Rc<Vec<u8>>, ImportFault> {
        let path = resolve(base, relative, uri)?;
        if let Some(known) = self.known.get(&path) {
            return Ok(Rc::clone(known));
        }
        let (count, limit) = (self.known.len() as u64 + 1, MAX_EXTERNAL_FILES as u64);
        if count > limit {
            return Err(ImportFault::TooMany { what: "files named", count, limit });
        }
        let bytes = Rc::new(read_regular(&path, self.bytes_left)?);
        self.bytes_left -= bytes.len() as u64;
        self.known.insert(path, Rc::clone(&bytes));
        Ok(bytes)
    }
}

/// Resolves the real path, which must lie below the real base, links followed.
fn resolve(base: &Path, relative: &Path, uri: &str) -> Result<PathBuf, ImportFault> {
    let canonical = |path: &Path| {
        std::fs::canonicalize(path)
            .map_err(|reason| ImportFault::Read { path: path.to_owned(), reason })
    };
    let base = canonical(base)?;
    let path = canonical(&base.join(relative))?;
    if path.starts_with(&base) {
        Ok(path)
    } else {
        Err(uri_fault(uri, "a link in it leads out of the model's folder"))
    }
}

fn uri_fault(uri: &str, reason: &'static str) -> ImportFault {
    ImportFault::Uri { uri: crate::document::shortened(uri), reason }
}
