//! Registry of the simulators that run on this machine, as a folder with a file for each.
//!
//! A view marks the values of an instance as simulated while a socket of it is connected to
//! one of these processes. Neither side needs to know the protocol. The folder is the
//! user's own: simulators of other users, in containers, behind relays or brokers and on
//! other machines are not in it.

use std::fs::{self, DirBuilder, File, OpenOptions};
use std::io::{self, Read, Write};
use std::os::unix::fs::{DirBuilderExt, MetadataExt, OpenOptionsExt, PermissionsExt};
use std::path::{Path, PathBuf};

use rustix::fs::OFlags;
use rustix::process::geteuid;
use serde::{Deserialize, Serialize};

use crate::socket_table::start_ticks;

/// Version of the files.
const VERSION: u32 = 1;
/// Largest file that is read.
const MAX_FILE_BYTES: u64 = 4096;
/// Files that are read at most.
const MAX_FILES: usize = 256;
/// Permissions of the folder: the user's alone.
const FOLDER_MODE: u32 = 0o700;
const FILE_MODE: u32 = 0o600;
/// Permission bits of group and others.
const MODE_OF_OTHERS: u32 = 0o077;

/// A process that simulates devices, with its children.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
struct Entry {
    version: u32,
    pid: u32,
    /// Start of the process, clock ticks since the machine's start: another process may
    /// have its number later on.
    start_ticks: u64,
}

/// Entry of this process in the registry, removed when this is dropped.
#[derive(Debug)]
pub struct SimulatorRegistration {
    file: PathBuf,
}

impl SimulatorRegistration {
    /// Registers this process and its children, before they listen. Entries of processes
    /// that are gone are removed.
    ///
    /// # Errors
    /// No folder can be made that is the user's alone.
    pub fn new() -> io::Result<Self> {
        Self::in_folders(&folders())
    }

    fn in_folders(folders: &[PathBuf]) -> io::Result<Self> {
        let mut last = io::Error::from(io::ErrorKind::NotFound);
        for folder in folders {
            match Self::in_folder(folder) {
                Ok(registration) => return Ok(registration),
                Err(error) => {
                    last = io::Error::new(error.kind(), format!("{}: {error}", folder.display()));
                }
            }
        }
        Err(last)
    }

    fn in_folder(folder: &Path) -> io::Result<Self> {
        let parent = folder.parent().ok_or(io::ErrorKind::NotFound)?;
        for made in [parent, folder] {
            match DirBuilder::new().mode(FOLDER_MODE).create(made) {
                Err(error) if error.kind() != io::ErrorKind::AlreadyExists => return Err(error),
                _ => {}
            }
        }
        check_folder(parent)?;
        check_folder(folder)?;
        for (file, entry) in entries(folder) {
            if entry.is_none_or(|entry| !entry.is_running()) {
                let _ = fs::remove_file(file);
            }
        }
        let pid = std::process::id();
        let start_ticks = start_ticks(pid).ok_or(io::ErrorKind::NotFound)?;
        let entry = Entry { version: VERSION, pid, start_ticks };
        // Several of one process, as in tests, each have their own.
        let number = fastrand::u64(..);
        let file = folder.join(format!("{pid}-{number:016x}.json"));
        let mut options = OpenOptions::new();
        options.write(true).create_new(true).mode(FILE_MODE);
        options.open(&file)?.write_all(&serde_json::to_vec(&entry)?)?;
        Ok(Self { file })
    }
}

impl Drop for SimulatorRegistration {
    fn drop(&mut self) {
        let _ = fs::remove_file(&self.file);
    }
}

impl Entry {
    fn is_running(&self) -> bool {
        start_ticks(self.pid) == Some(self.start_ticks)
    }
}

/// Processes of this machine that are registered and run.
pub(crate) fn registered_simulators() -> Vec<u32> {
    registered_in(&folders())
}

fn registered_in(folders: &[PathBuf]) -> Vec<u32> {
    let sound = folders.iter().filter(|folder| check_folder(folder).is_ok());
    let running = sound.flat_map(|folder| entries(folder)).filter_map(|(_, entry)| entry);
    let mut pids: Vec<u32> = running.filter(Entry::is_running).map(|entry| entry.pid).collect();
    pids.sort_unstable();
    pids.dedup();
    pids
}

/// Folders where the registry may be, the first usable one to write to.
fn folders() -> Vec<PathBuf> {
    let user = geteuid().as_raw();
    let given = std::env::var_os("XDG_RUNTIME_DIR").map(PathBuf::from);
    let given = given.filter(|folder| folder.is_absolute());
    let of_user = PathBuf::from(format!("/run/user/{user}"));
    let mut folders: Vec<PathBuf> = given
        .into_iter()
        .chain([of_user])
        .map(|folder| folder.join("busbar/simulators"))
        .chain([PathBuf::from(format!("/tmp/busbar-{user}/simulators"))])
        .collect();
    folders.dedup();
    folders
}

/// Checks that a folder is the user's own, and closed to others.
fn check_folder(folder: &Path) -> io::Result<()> {
    let found = fs::symlink_metadata(folder)?;
    let is_own = found.is_dir() && found.uid() == geteuid().as_raw();
    if is_own && found.permissions().mode() & MODE_OF_OTHERS == 0 {
        return Ok(());
    }
    let fault = "this must be a folder of the user's own, with mode 0700";
    Err(io::Error::new(io::ErrorKind::PermissionDenied, fault))
}

/// Files of a folder with their entries; none for one that cannot be read.
fn entries(folder: &Path) -> Vec<(PathBuf, Option<Entry>)> {
    let Ok(listed) = fs::read_dir(folder) else { return Vec::new() };
    let paths = listed.take(MAX_FILES).filter_map(|entry| Some(entry.ok()?.path()));
    paths.map(|path| (path.clone(), read(&path).ok())).collect()
}

fn read(path: &Path) -> io::Result<Entry> {
    let flags = OFlags::NOFOLLOW | OFlags::NONBLOCK;
    let mut options = OpenOptions::new();
    let file: File = options.read(true).custom_flags(flags.bits() as i32).open(path)?;
    let mut bytes = Vec::new();
    file.take(MAX_FILE_BYTES).read_to_end(&mut bytes)?;
    let entry: Entry = serde_json::from_slice(&bytes)?;
    match entry.version {
        VERSION => Ok(entry),
        _ => Err(io::ErrorKind::InvalidData.into()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_registered_process_is_found_until_it_ends() {
        let base = tempfile::tempdir().unwrap();
        let folders = [base.path().join("busbar/simulators")];
        assert_eq!(registered_in(&folders), [0; 0]);
        let first = SimulatorRegistration::in_folders(&folders).unwrap();
        let second = SimulatorRegistration::in_folders(&folders).unwrap();
        assert_eq!(registered_in(&folders), [std::process::id()]);
        drop(first);
        assert_eq!(registered_in(&folders), [std::process::id()]);
        drop(second);
        assert_eq!(registered_in(&folders), [0; 0]);
    }

    #[test]
    fn entries_of_processes_that_are_gone_count_for_nothing() {
        let base = tempfile::tempdir().unwrap();
        let folders = [base.path().join("busbar/simulators")];
        let kept = SimulatorRegistration::in_folders(&folders).unwrap();
        let own = std::process::id();
        // The number of this process, which another had before; no process; no entry.
        for (name, text) in [
            ("reused.json", format!("{{\"version\":1,\"pid\":{own},\"start_ticks\":1}}")),
            ("gone.json", "{\"version\":1,\"pid\":4294967295,\"start_ticks\":1}".into()),
            ("cut.json", "{\"version\":1".into()),
        ] {
            fs::write(folders[0].join(name), text).unwrap();
        }
        assert_eq!(registered_in(&folders), [own]);
        drop(kept);
        assert_eq!(registered_in(&folders), [0; 0]);
        let again = SimulatorRegistration::in_folders(&folders).unwrap();
        assert_eq!(fs::read_dir(&folders[0]).unwrap().count(), 1, "they are removed");
        drop(again);
    }

    #[test]
    fn a_folder_that_others_may_write_is_not_believed() {
        let base = tempfile::tempdir().unwrap();
        let folder = base.path().join("busbar/simulators");
        fs::create_dir_all(&folder).unwrap();
        let open = fs::Permissions::from_mode(0o777);
        fs::set_permissions(&folder, open.clone()).unwrap();
        fs::set_permissions(folder.parent().unwrap(), open).unwrap();
        let refused = SimulatorRegistration::in_folders(std::slice::from_ref(&folder));
        assert_eq!(refused.unwrap_err().kind(), io::ErrorKind::PermissionDenied);
        let start_ticks = start_ticks(std::process::id()).unwrap();
        let entry = Entry { version: VERSION, pid: std::process::id(), start_ticks };
        fs::write(folder.join("1.json"), serde_json::to_vec(&entry).unwrap()).unwrap();
        assert_eq!(registered_in(&[folder]), [0; 0]);
    }
}
