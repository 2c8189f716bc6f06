//! The files: one that is appended to, and older ones.

use std::collections::BTreeMap;
use std::fs::{self, DirBuilder, File, OpenOptions};
use std::io::{self, Read, Write};
use std::os::unix::fs::{DirBuilderExt, OpenOptionsExt};
use std::path::{Path, PathBuf};

use busbar_alarms::{Record, State};
use rustix::fs::{FlockOperation, flock};

use crate::recovery::Reading;
use crate::{LogError, MAX_FILE_BYTES, Recovered, line};

const NAME: &str = "alarms.jsonl";
/// A file that is being begun.
const NEXT: &str = "alarms.jsonl.new";
const LOCK: &str = "lock";

/// Where a log is, and how large it may grow.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LogRules {
    /// Its folder, made where it is missing.
    pub directory: PathBuf,
    /// Size at which a new file begins, at most [`MAX_FILE_BYTES`].
    pub max_file_bytes: u64,
    /// Files that are kept, the newest included; at least 1.
    pub max_files: u32,
}

/// The files of a log, open for one writer.
#[derive(Debug)]
pub(crate) struct Journal {
    rules: LogRules,
    file: File,
    /// Where the file ends after the last line that is whole.
    bytes: u64,
    /// The size from which on a new file begins: more than what that would begin with.
    rotate_at: u64,
    /// The last record of each alarm that is not normal, and of all.
    open: BTreeMap<String, Record>,
    last: Option<Record>,
    /// Held as long as the log is open.
    _lock: File,
}

impl Journal {
    /// Opens a log, makes it where there is none, and cuts off what a crash left half
    /// written.
    pub(crate) fn open(rules: LogRules) -> Result<(Self, Recovered), LogError> {
        let directory = rules.directory.clone();
        let unusable = |source| LogError::Unusable { path: directory.clone(), source };
        DirBuilder::new().recursive(true).mode(0o700).create(&directory).map_err(unusable)?;
        let lock = appended(&directory.join(LOCK)).map_err(unusable)?;
        match flock(&lock, FlockOperation::NonBlockingLockExclusive) {
            Ok(()) => {}
            Err(rustix::io::Errno::WOULDBLOCK) => return Err(LogError::InUse { directory }),
            Err(error) => return Err(unusable(error.into())),
        }
        let path = directory.join(NAME);
        if !path.exists() && directory.join(NEXT).exists() && older(&rules, 1).exists() {
            // Between two renames: what was begun holds all that is needed.
            fs::rename(directory.join(NEXT), &path).map_err(unusable)?;
        }
        let file = appended(&path).map_err(unusable)?;
        let Reading { found, good_bytes, .. } = read(&path).map_err(unusable)?;
        file.set_len(good_bytes).and_then(|()| file.sync_all()).map_err(unusable)?;
        sync_folder(&directory).map_err(unusable)?;
        let rotate_at = rules.max_file_bytes;
        // The newest of a file that only was begun is among those that it began with.
        let last = found.tail.back().or(found.open.values().max_by_key(|record| record.number));
        let (open, last) = (found.open.clone(), last.cloned());
        let journal = Self { rules, file, bytes: good_bytes, rotate_at, open, last, _lock: lock };
        Ok((journal, found))
    }

    /// Appends records and waits until they are on the disk. After an error none of them
    /// is there, and they may be written again.
    pub(crate) fn append(&mut self, records: &[Record]) -> io::Result<()> {
        if self.bytes >= self.rotate_at {
            self.rotate()?;
        }
        let lines: io::Result<String> = records.iter().map(line::write).collect();
        let lines = lines?;
        let written = self.file.write_all(lines.as_bytes()).and_then(|()| self.file.sync_data());
        if let Err(error) = written {
            // Half a line must not stand before the next one.
            self.file.set_len(self.bytes)?;
            return Err(error);
        }
        self.bytes += lines.len() as u64;
        for record in records {
            if record.to == State::A {
                self.open.remove(&record.alarm);
            } else {
                self.open.insert(record.alarm.clone(), record.clone());
            }
        }
        self.last = records.last().cloned().or(self.last.take());
        Ok(())
    }

    /// Begins a new file with the last record of every alarm that is not normal, and the
    /// last of all, for its number. At each moment there is a file that tells how all
    /// alarms stand.
    fn rotate(&mut self) -> io::Result<()> {
        let directory = &self.rules.directory;
        let next = directory.join(NEXT);
        match fs::remove_file(&next) {
            Err(error) if error.kind() != io::ErrorKind::NotFound => return Err(error),
            _ => {}
        }
        let mut carried: Vec<&Record> = self.open.values().chain(&self.last).collect();
        carried.sort_by_key(|record| record.number);
        carried.dedup_by_key(|record| record.number);
        let lines: io::Result<String> = carried.into_iter().map(line::write_carried).collect();
        let lines = lines?;
        let mut file = appended(&next)?;
        file.write_all(lines.as_bytes())?;
        file.sync_all()?;
        for age in (1..self.rules.max_files).rev() {
            let from = if age == 1 { directory.join(NAME) } else { older(&self.rules, age - 1) };
            match fs::rename(&from, older(&self.rules, age)) {
                Err(error) if error.kind() != io::ErrorKind::NotFound => return Err(error),
                _ => {}
            }
        }
        fs::rename(&next, directory.join(NAME))?;
        sync_folder(directory)?;
        (self.file, self.bytes) = (file, lines.len() as u64);
        self.rotate_at = self.rules.max_file_bytes.max(self.bytes * 2);
        Ok(())
    }
}

/// An older file; the newest of them is 1.
fn older(rules: &LogRules, age: u32) -> PathBuf {
    rules.directory.join(format!("alarms.{age}.jsonl"))
}

/// A file of the user's own to append to.
fn appended(path: &Path) -> io::Result<File> {
    OpenOptions::new().append(true).create(true).mode(0o600).open(path)
}

fn sync_folder(path: &Path) -> io::Result<()> {
    File::open(path)?.sync_all()
}

fn read(path: &Path) -> io::Result<Reading> {
    let mut bytes = Vec::new();
    File::open(path)?.take(MAX_FILE_BYTES + 1).read_to_end(&mut bytes)?;
    if bytes.len() as u64 > MAX_FILE_BYTES {
        let what = format!("{} has more than {MAX_FILE_BYTES} bytes", path.display());
        return Err(io::Error::other(what));
    }
    Ok(Reading::of(&bytes))
}

#[cfg(test)]
#[path = "journal_tests.rs"]
mod tests;
