//! Log writer: one file that is appended to, ended ones with a manifest, quarantine.
//!
//! No byte that was written is removed or written over, but for whole files that are more
//! than are to be kept. A file with a fault ends where it is, under another name.

use std::collections::BTreeMap;
use std::fs::{DirBuilder, File};
use std::io;
use std::os::unix::fs::DirBuilderExt;

use busbar_alarms::AlarmRecord;
use busbar_types::AlarmState;
use rustix::fs::{FlockOperation, flock};

use crate::anchor::{self, Anchor, AnchorState};
use crate::chain::{Digest256, FileHasher, KeyRing};
use crate::file_header::{FileHeader, ListedFile, MAX_LISTED_FILES};
use crate::file_names::{
    CURRENT, FileRole, LOCK, SCRATCH, age_order, ended_names, role_of, unfinished_names,
};
use crate::line;
use crate::options::open_keys;
use crate::recovery::{EndingFile, Examination, examine};
use crate::storage::{DiskStorage, LogFile, Storage};
use crate::{AuditLogOptions, LogError, RecoveredLog};

/// Sizes and numbers of files.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FileRules {
    pub(crate) max_file_bytes: u64,
    pub(crate) max_files: u32,
}

/// The files of a log, open for one writer.
#[derive(Debug)]
pub(crate) struct LogWriter {
    rules: FileRules,
    storage: Box<dyn Storage>,
    keys: KeyRing,
    current: Option<CurrentFile>,
    /// The newest file, where it must end before a line is written.
    ending: Option<EndingFile>,
    /// Manifest of the ended files, the oldest first.
    files: Vec<ListedFile>,
    next_file: u64,
    /// The last record of each alarm that is not normal, and of all.
    open: BTreeMap<String, AlarmRecord>,
    last: Option<AlarmRecord>,
    last_number: u64,
    /// Faults that the next header keeps.
    remarks: Vec<String>,
    staged: Vec<AlarmRecord>,
    unwritten: Option<UnwrittenText>,
    /// True where an anchor was found or written.
    has_anchor: bool,
    /// True where its anchor may be written: the key of the last anchor is known.
    keeps_anchor: bool,
    /// Held as long as the log is open.
    _lock: Option<File>,
}

/// The file that is appended to, as far as the disk confirmed it.
#[derive(Debug)]
struct CurrentFile {
    file: Box<dyn LogFile>,
    number: u64,
    bytes: u64,
    chain: Digest256,
    hasher: FileHasher,
    /// The size from which on a new file begins: more than what that would begin with.
    rotate_at: u64,
}

/// Lines of the staged records, and how many of their bytes were written.
#[derive(Debug)]
struct UnwrittenText {
    text: Vec<u8>,
    written: usize,
    records: usize,
    chain: Digest256,
}

impl LogWriter {
    /// Opens a log, and makes its folder where there is none.
    pub(crate) fn open(rules: &AuditLogOptions) -> Result<(Self, RecoveredLog), LogError> {
        let directory = rules.directory.clone();
        let unusable = |source| LogError::Unusable { path: directory.clone(), source };
        rules.check_places()?;
        make_folder(rules).map_err(unusable)?;
        let storage = DiskStorage::open(&directory).map_err(unusable)?;
        let lock = storage.lock_file(LOCK).map_err(unusable)?;
        match flock(&lock, FlockOperation::NonBlockingLockExclusive) {
            Ok(()) => {}
            Err(rustix::io::Errno::WOULDBLOCK) => return Err(LogError::InUse { directory }),
            Err(error) => return Err(unusable(error.into())),
        }
        // Without its key a log is better than no log; the next one tells.
        let (keys, fault) = match open_keys(rules.key_file.as_deref()) {
            Ok(keys) => (keys, None),
            Err(error) => (KeyRing::default(), Some(error.to_string())),
        };
        let state = match &rules.anchor_file {
            Some(path) if fault.is_none() => anchor::read(path, &keys),
            _ => AnchorState::Unused,
        };
        let (max_file_bytes, max_files) = (rules.max_file_bytes, rules.max_files);
        let file_rules = FileRules { max_file_bytes, max_files };
        let opened = Self::with_storage(Box::new(storage), file_rules, keys, &state);
        let (mut writer, mut found) = opened.map_err(unusable)?;
        writer._lock = Some(lock);
        writer.keeps_anchor = fault.is_none();
        found.remarks.extend(fault);
        Ok((writer, found))
    }

    /// Opens a log in any storage.
    pub(crate) fn with_storage(
        storage: Box<dyn Storage>,
        rules: FileRules,
        keys: KeyRing,
        anchor: &AnchorState,
    ) -> io::Result<(Self, RecoveredLog)> {
        let examination = examine(storage.as_ref(), &keys, anchor)?;
        let Examination { found, continued, ending, files, next_file, .. } = examination;
        let Examination { takes_scratch, last, kept_remarks, .. } = examination;
        if takes_scratch {
            storage.rename(SCRATCH, CURRENT)?;
            storage.sync_folder()?;
        }
        let current = match continued {
            None => None,
            Some(continued) => {
                let mut file = storage.open(CURRENT)?;
                // A line that a crash left in memory counts once it is on the disk.
                file.sync()?;
                Some(CurrentFile {
                    file,
                    number: continued.file,
                    bytes: continued.bytes,
                    chain: continued.chain,
                    hasher: continued.hasher,
                    rotate_at: rules.max_file_bytes,
                })
            }
        };
        if current.is_none() && ending.is_some() {
            storage.open(CURRENT)?.sync()?;
        }
        let mut writer = Self {
            rules,
            storage,
            keys,
            current,
            ending,
            files,
            next_file,
            open: found.open.clone(),
            last,
            last_number: found.last_number,
            remarks: kept_remarks,
            staged: Vec::new(),
            unwritten: None,
            has_anchor: matches!(anchor, AnchorState::Found(_)),
            keeps_anchor: true,
            _lock: None,
        };
        if writer.current.is_none() {
            // Where the disk is full, the first record tries again, and tells.
            let _ = writer.begin_file();
        }
        Ok((writer, found))
    }

    /// Stages records for [`LogWriter::write_staged`].
    pub(crate) fn stage(&mut self, records: Vec<AlarmRecord>) {
        self.staged.extend(records);
    }

    /// Appends the staged records and waits until they are on the disk. After an error it may be
    /// called again, and resumes.
    pub(crate) fn write_staged(&mut self) -> io::Result<()> {
        while !self.staged.is_empty() {
            self.write_some()?;
        }
        Ok(())
    }

    fn write_some(&mut self) -> io::Result<()> {
        if self.unwritten.is_none() {
            self.rotate_if_due()?;
            self.unwritten = Some(self.render_staged()?);
        }
        let (Some(current), Some(unwritten)) = (&mut self.current, &mut self.unwritten) else {
            return Err(io::Error::other("no file is open"));
        };
        while unwritten.written < unwritten.text.len() {
            match current.file.append(&unwritten.text[unwritten.written..]) {
                Ok(0) => return Err(io::ErrorKind::WriteZero.into()),
                Ok(count) => unwritten.written += count,
                Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
                Err(error) => return Err(error),
            }
        }
        if let Err(error) = current.file.sync() {
            // Which bytes are on the disk is not known: the next file has them again.
            self.unwritten = None;
            self.end_current(true);
            return Err(error);
        }
        current.hasher.update(&unwritten.text);
        current.bytes += unwritten.text.len() as u64;
        current.chain = unwritten.chain;
        let count = unwritten.records;
        self.unwritten = None;
        for record in self.staged.drain(..count) {
            self.last_number = self.last_number.max(record.number);
            if record.to == AlarmState::Normal {
                self.open.remove(&record.alarm);
            } else {
                self.open.insert(record.alarm.clone(), record.clone());
            }
            self.last = Some(record);
        }
        Ok(())
    }

    /// End of the log as the disk has it; none where nothing was written, or without its key.
    pub(crate) fn anchor(&self) -> Option<Anchor> {
        let current = self.current.as_ref().filter(|_| self.keeps_anchor)?;
        Some(Anchor {
            file: current.number,
            number: self.last_number,
            at: current.chain.to_string(),
            key: self.keys.current().id().to_owned(),
        })
    }

    /// Records that the anchor was written: from then on its loss is a fault.
    pub(crate) fn confirm_anchor(&mut self) {
        self.has_anchor = true;
    }

    pub(crate) fn keys(&self) -> &KeyRing {
        &self.keys
    }

    fn render_staged(&self) -> io::Result<UnwrittenText> {
        let Some(current) = &self.current else {
            return Err(io::Error::other("no file is open"));
        };
        let (mut text, mut chain) = (Vec::new(), current.chain);
        for record in &self.staged {
            chain = line::write(&mut text, line::NEWS, record, &chain, self.keys.current())?;
        }
        Ok(UnwrittenText { text, written: 0, records: self.staged.len(), chain })
    }

    /// Begins a new file where there is none, or the current one is full or gone.
    fn rotate_if_due(&mut self) -> io::Result<()> {
        if let Some(current) = &self.current {
            let at_its_name = self.storage.id_of(CURRENT)?;
            if at_its_name != Some(current.file.id()?) {
                self.lose_current(at_its_name.is_some());
            } else if current.bytes >= current.rotate_at {
                self.end_current(false);
            }
        }
        if self.current.is_none() { self.begin_file() } else { Ok(()) }
    }

    /// Ends the current file where the disk confirmed it last.
    fn end_current(&mut self, is_unsynced: bool) {
        if let Some(current) = self.current.take() {
            let (file, digest) = (current.number, Some((current.bytes, current.hasher.digest())));
            self.ending = Some(EndingFile { file, digest, is_damaged: false, is_unsynced });
        }
    }

    /// Records that the current file was removed or replaced while it was written. It stays in
    /// the manifest, so that verification reports it; a file in its place is set aside.
    fn lose_current(&mut self, is_replaced: bool) {
        let Some(current) = self.current.take() else { return };
        let file = current.number;
        self.remarks.push(format!("file {file} was removed or renamed while it was written"));
        self.files.push(ListedFile {
            name: ended_names(file, false).next().unwrap_or_default(),
            bytes: current.bytes,
            sha256: current.hasher.digest().to_string(),
            is_unsynced: false,
        });
        if is_replaced {
            let file = self.next_file;
            self.next_file += 1;
            let (is_damaged, is_unsynced) = (true, false);
            self.ending = Some(EndingFile { file, digest: None, is_damaged, is_unsynced });
        }
    }

    /// Starts a new file with a header, the last record of every alarm that is not normal, and
    /// the last record. After a power cut in any step the files give the state of all alarms,
    /// whichever operations before a sync reached the disk.
    fn begin_file(&mut self) -> io::Result<()> {
        let names = self.storage.names()?;
        if names.iter().any(|name| name == SCRATCH) {
            let name = free_name(&names, unfinished_names(self.next_file))?;
            self.storage.rename(SCRATCH, &name)?;
            self.storage.sync_folder()?;
        }
        let end = match &self.ending {
            None => None,
            Some(ending) => {
                let name = free_name(&names, ended_names(ending.file, ending.is_damaged))?;
                let (bytes, digest) = match ending.digest {
                    Some(known) => known,
                    None => self.storage.digest(CURRENT, u64::MAX)?,
                };
                let is_unsynced = ending.is_unsynced;
                Some(ListedFile { name, bytes, sha256: digest.to_string(), is_unsynced })
            }
        };
        let (header, removed) = self.header(&names, end.as_ref())?;
        let (text, chain) = self.render_beginning(&header)?;
        let mut file = self.storage.create(SCRATCH)?;
        let written = write_all(file.as_mut(), &text)
            .and_then(|()| file.sync())
            .and_then(|()| self.storage.sync_folder());
        if let Err(error) = written {
            // It was made here and has nothing that other files do not have.
            let _ = self.storage.remove(SCRATCH);
            return Err(error);
        }
        if let Some(end) = end {
            self.storage.rename(CURRENT, &end.name)?;
            self.ending = None;
            self.files.push(end);
            self.storage.sync_folder()?;
        }
        self.storage.rename(SCRATCH, CURRENT)?;
        self.storage.sync_folder()?;
        let mut hasher = FileHasher::default();
        hasher.update(&text);
        let bytes = text.len() as u64;
        let rotate_at = self.rules.max_file_bytes.max(bytes * 2);
        let number = header.file;
        self.current = Some(CurrentFile { file, number, bytes, chain, hasher, rotate_at });
        self.next_file = header.file + 1;
        self.files = header.files;
        self.remarks.clear();
        // One that stays for now is removed with the next.
        removed.iter().for_each(|name| drop(self.storage.remove(name)));
        Ok(())
    }

    /// Builds the header of the next file, and names the files that are removed for it.
    fn header(
        &self,
        names: &[String],
        end: Option<&ListedFile>,
    ) -> io::Result<(FileHeader, Vec<String>)> {
        let mut files = self.files.clone();
        for name in names {
            let is_ended = matches!(
                role_of(name),
                FileRole::Ended(_) | FileRole::Quarantined(_) | FileRole::Aged(_)
            );
            if is_ended && !files.iter().any(|file| file.name == *name) {
                // What is no file, or cannot be read, is none of the log's.
                let Ok((bytes, digest)) = self.storage.digest(name, u64::MAX) else { continue };
                let (name, sha256) = (name.clone(), digest.to_string());
                files.push(ListedFile { name, bytes, sha256, is_unsynced: false });
            }
        }
        files.extend(end.cloned());
        files.sort_by_key(|file| age_order(role_of(&file.name)));
        let removed = self.remove_surplus(&mut files);
        let mut header = FileHeader {
            file: self.next_file,
            key: self.keys.current().id().to_owned(),
            after: self.last_number,
            carried: self.carried().len() as u64,
            has_anchor: self.has_anchor,
            files,
            removed: removed.clone(),
            remarks: Vec::new(),
        };
        header.keep_remarks(&self.remarks);
        Ok((header, removed))
    }

    /// Removes surplus files from a manifest. Files that ended early do not count, so that a
    /// fault evicts no evidence; quarantined ones stay.
    fn remove_surplus(&self, files: &mut Vec<ListedFile>) -> Vec<String> {
        let max_full = (self.rules.max_files.max(1) - 1) as usize;
        let is_full = |file: &ListedFile| file.bytes >= self.rules.max_file_bytes;
        let is_kept = |file: &ListedFile| matches!(role_of(&file.name), FileRole::Quarantined(_));
        let mut full = 0;
        let mut first = 0;
        for (index, file) in files.iter().enumerate().rev() {
            full += usize::from(is_full(file) && !is_kept(file));
            if full > max_full {
                first = index + 1;
                break;
            }
        }
        let mut index = 0;
        let mut removed = Vec::new();
        files.retain(|file| {
            index += 1;
            let goes = index <= first && !is_kept(file);
            if goes {
                removed.push(file.name.clone());
            }
            !goes
        });
        // Beyond the limit files lie there unlisted, and are not removed.
        let surplus = files.len().saturating_sub(MAX_LISTED_FILES);
        files.drain(..surplus);
        removed
    }

    /// Records that a new file begins with.
    fn carried(&self) -> Vec<&AlarmRecord> {
        let mut carried: Vec<&AlarmRecord> = self.open.values().chain(&self.last).collect();
        carried.sort_by_key(|record| record.number);
        carried.dedup_by_key(|record| record.number);
        carried
    }

    fn render_beginning(&self, header: &FileHeader) -> io::Result<(Vec<u8>, Digest256)> {
        let (key, mut text) = (self.keys.current(), Vec::new());
        let mut chain = line::write(&mut text, line::HEADER, header, &Digest256::default(), key)?;
        for record in self.carried() {
            chain = line::write(&mut text, line::CARRIED, record, &chain, key)?;
        }
        Ok((text, chain))
    }
}

fn write_all(file: &mut dyn LogFile, text: &[u8]) -> io::Result<()> {
    let mut written = 0;
    while written < text.len() {
        match file.append(&text[written..]) {
            Ok(0) => return Err(io::ErrorKind::WriteZero.into()),
            Ok(count) => written += count,
            Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
            Err(error) => return Err(error),
        }
    }
    Ok(())
}

/// The first name that no file has.
fn free_name(names: &[String], mut wanted: impl Iterator<Item = String>) -> io::Result<String> {
    wanted
        .find(|name| !names.contains(name))
        .ok_or_else(|| io::Error::other("too many files are kept aside: move them elsewhere"))
}

/// Creates the folder of a log with its parents, and syncs it.
fn make_folder(rules: &AuditLogOptions) -> io::Result<()> {
    if rules.directory.is_dir() {
        return Ok(());
    }
    DirBuilder::new().recursive(true).mode(0o700).create(&rules.directory)?;
    File::open(anchor::folder_of(&rules.directory))?.sync_all()
}

#[cfg(test)]
#[path = "log_writer_tests.rs"]
pub(crate) mod tests;
