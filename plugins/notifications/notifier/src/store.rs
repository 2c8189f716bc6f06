//! State file: open alarms and messages that wait, kept across a restart.
//!
//! The file is replaced as a whole: written beside its place, synchronized, renamed. A lock file
//! keeps two instances from sharing it.

use std::fs::{File, TryLockError};
use std::io::{self, Read, Write};
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use crate::dispatcher::Dispatcher;

/// Version of the file's layout.
const VERSION: u32 = 1;
/// Longest file that is read or written, bytes.
const MAX_FILE_BYTES: u64 = 32 << 20;

/// Lock and place of a state file.
pub(crate) struct Store {
    path: PathBuf,
    _lock: File,
}

#[derive(Deserialize)]
struct Document {
    version: u32,
    state: Dispatcher,
}

#[derive(Serialize)]
struct DocumentRef<'a> {
    version: u32,
    state: &'a Dispatcher,
}

impl Store {
    /// Locks the file of this path, and reads it. A file that is damaged is set aside, and told by
    /// the text; there is no state then.
    ///
    /// # Errors
    /// In words: another instance has the file, or its folder cannot be written.
    pub(crate) fn open(path: &str) -> Result<(Self, Option<Dispatcher>, Option<String>), String> {
        let path = PathBuf::from(path);
        let lock_path = beside(&path, "lock");
        let fault = |error: io::Error| {
            format!(
                "state_file: '{}': {error}; give it a folder that can be written",
                path.display()
            )
        };
        let lock = File::options()
            .create(true)
            .truncate(false)
            .write(true)
            .open(&lock_path)
            .map_err(fault)?;
        lock.try_lock().map_err(|error| match error {
            TryLockError::WouldBlock => format!(
                "state_file: '{}' is used by another instance; give each its own",
                path.display()
            ),
            TryLockError::Error(error) => fault(error),
        })?;
        let store = Self { path, _lock: lock };
        match store.read() {
            Ok(state) => Ok((store, state, None)),
            Err(fault) => {
                let aside = beside(&store.path, "damaged");
                let moved = std::fs::rename(&store.path, &aside);
                let place = moved.map_or_else(
                    |_| "it is replaced".to_owned(),
                    |()| format!("it is kept as '{}'", aside.display()),
                );
                let path = store.path.display();
                let text =
                    format!("'{path}': {fault}; {place}, and messages that waited in it are lost");
                Ok((store, None, Some(text)))
            }
        }
    }

    fn read(&self) -> Result<Option<Dispatcher>, String> {
        let file = match File::open(&self.path) {
            Ok(file) => file,
            Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(None),
            Err(error) => return Err(error.to_string()),
        };
        if !file.metadata().is_ok_and(|metadata| metadata.is_file()) {
            return Err("it is no plain file".to_owned());
        }
        let mut text = Vec::new();
        let length = file.take(MAX_FILE_BYTES + 1).read_to_end(&mut text);
        if length.map_err(|error| error.to_string())? as u64 > MAX_FILE_BYTES {
            return Err(format!("it is longer than {MAX_FILE_BYTES} bytes"));
        }
        let document: Document =
            serde_json::from_slice(&text).map_err(|error| format!("it is damaged: {error}"))?;
        if document.version != VERSION {
            return Err(format!("it has version {}, not {VERSION}", document.version));
        }
        if !document.state.is_plausible() {
            return Err("it is damaged: its lists are longer than they can be".to_owned());
        }
        Ok(Some(document.state))
    }

    /// Replaces the file; on the disk when this returns.
    ///
    /// # Errors
    /// In words, with a remedy.
    pub(crate) fn write(&self, state: &Dispatcher) -> Result<(), String> {
        let text = serde_json::to_vec(&DocumentRef { version: VERSION, state })
            .map_err(|error| error.to_string())?;
        let written = match text.len() as u64 {
            0..=MAX_FILE_BYTES => replace(&self.path, &text).map_err(|error| error.to_string()),
            _ => Err(format!("it would be longer than {MAX_FILE_BYTES} bytes")),
        };
        written.map_err(|fault| {
            format!(
                "'{}' cannot be written: {fault}; messages that wait are lost at a restart until \
                 its folder can be written and has room",
                self.path.display()
            )
        })
    }
}

fn replace(path: &Path, text: &[u8]) -> io::Result<()> {
    let new = beside(path, "new");
    let mut file = File::create(&new)?;
    file.write_all(text)?;
    file.sync_all()?;
    std::fs::rename(&new, path)?;
    // The name is on the disk with the folder.
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty());
    File::open(folder.unwrap_or(Path::new(".")))?.sync_all()
}

/// Returns the path of a hidden file beside another, with one more ending.
fn beside(path: &Path, end: &str) -> PathBuf {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    path.with_file_name(format!(".{name}.{end}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn place(folder: &tempfile::TempDir) -> String {
        folder.path().join("state.json").display().to_string()
    }

    #[test]
    fn what_was_written_is_read_and_nobody_else_has_it() {
        let folder = tempfile::tempdir().unwrap();
        let (store, none, fault) = Store::open(&place(&folder)).unwrap();
        assert_eq!((none, fault), (None, None));
        let state = Dispatcher::new(7);
        store.write(&state).unwrap();
        let second = Store::open(&place(&folder)).err().unwrap();
        assert!(second.contains("another instance"), "{second}");
        drop(store);
        assert_eq!(Store::open(&place(&folder)).unwrap().1, Some(state));
    }

    #[test]
    fn a_damaged_file_is_told_and_kept_aside() {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(place(&folder), "{\"version\": 1, \"sta").unwrap();
        let (_, state, fault) = Store::open(&place(&folder)).unwrap();
        assert_eq!(state, None);
        assert!(fault.unwrap().contains("damaged"));
        assert!(folder.path().join(".state.json.damaged").exists());
    }

    #[test]
    fn a_folder_that_is_not_there_is_a_fault_with_a_remedy() {
        let fault = Store::open("/no/such/folder/state.json").err().unwrap();
        assert!(fault.contains("give it a folder"), "{fault}");
    }
}
