//! Recovery: state of the alarms from the files of a log when it is opened.
//!
//! Nothing is written here, so that a log can be tried before it is used.

use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::io;

use busbar_alarms::AlarmRecord;

use crate::MAX_FILE_BYTES;
use crate::anchor::AnchorState;
use crate::chain::{Digest256, FileHasher, KeyRing};
use crate::chain_check::CheckedFile;
use crate::file_header::{FileHeader, ListedFile};
use crate::file_names::{CURRENT, FileRole, LOCK, SCRATCH, age_order, role_of};
use crate::line::MAX_NUMBER;
use crate::storage::Storage;

/// State of alarms as a log knew it.
#[derive(Clone, Debug, Default)]
pub struct RecoveredLog {
    /// The last record of each alarm that is not normal, by id.
    pub open: BTreeMap<String, AlarmRecord>,
    /// The newest records, at most [`MAX_TAIL`](crate::MAX_TAIL), the oldest first.
    pub tail: VecDeque<AlarmRecord>,
    /// Number of the newest record; 0 for none.
    pub last_number: u64,
    /// Faults that were found, for people.
    pub remarks: Vec<String>,
}

/// Newest file, which is continued.
#[derive(Debug)]
pub(crate) struct ContinuedFile {
    pub(crate) file: u64,
    pub(crate) bytes: u64,
    pub(crate) chain: Digest256,
    pub(crate) hasher: FileHasher,
}

/// The newest file, which must end before another line is written.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct EndingFile {
    pub(crate) file: u64,
    /// Size and digest, where they are known already.
    pub(crate) digest: Option<(u64, Digest256)>,
    /// True where the file goes into quarantine.
    pub(crate) is_damaged: bool,
    pub(crate) is_unsynced: bool,
}

/// Condition of a log.
#[derive(Debug, Default)]
pub(crate) struct Examination {
    pub(crate) found: RecoveredLog,
    pub(crate) continued: Option<ContinuedFile>,
    pub(crate) ending: Option<EndingFile>,
    /// The manifest of the files before the newest.
    pub(crate) files: Vec<ListedFile>,
    /// Number of the next file.
    pub(crate) next_file: u64,
    /// True where the newest file still has its temporary name: a crash came between two renames.
    pub(crate) takes_scratch: bool,
    /// The newest record that is understood.
    pub(crate) last: Option<AlarmRecord>,
    /// Faults that the files themselves do not show later, so that the next header keeps them.
    pub(crate) kept_remarks: Vec<String>,
}

/// Examines the files of a folder.
pub(crate) fn examine(
    storage: &dyn Storage,
    keys: &KeyRing,
    anchor: &AnchorState,
) -> io::Result<Examination> {
    let mut names = storage.names()?;
    names.retain(|name| name != LOCK && role_of(name) != FileRole::Other);
    names.sort_by_key(|name| age_order(role_of(name)));
    let wanted = match anchor {
        AnchorState::Found(anchor) => anchor.value(),
        _ => None,
    };
    let mut examination = Examination::default();
    let has = |name: &str| names.iter().any(|known| known == name);
    let newest = newest_of(storage, keys, has(CURRENT), has(SCRATCH))?;
    let (name, bytes) = match newest {
        Some((name, bytes)) => (Some(name), bytes),
        None => (None, Vec::new()),
    };
    examination.takes_scratch = name == Some(SCRATCH);
    let is_too_large = bytes.len() as u64 > MAX_FILE_BYTES;
    let bytes = &bytes[..bytes.len().min(MAX_FILE_BYTES as usize)];

    // The files before it tell what it does not.
    let trial = CheckedFile::read(bytes, keys, None, &mut RecoveredLog::default());
    let ended: Vec<&String> = names.iter().filter(|name| is_ended(name)).collect();
    let mut found = RecoveredLog::default();
    let mut base: Option<(FileHeader, Option<String>)> =
        trial.header.clone().map(|header| (header, None));
    if !trial.is_complete() {
        let fallback = read_ended(storage, keys, &ended, &mut found)?;
        if base.is_none() {
            base = fallback.map(|(header, name)| (header, Some(name)));
        }
        found.remarks.clear();
    }
    let before = found.last_number;
    let mut reading = CheckedFile::read(bytes, keys, wanted.as_ref(), &mut found);
    let mut remarks = reading.remarks();
    if is_too_large {
        remarks.push(format!("it has more than {MAX_FILE_BYTES} bytes"));
    }
    let mut kept = Vec::new();
    let is_bare = reading.bytes == 0;
    if !ended.is_empty() && (name.is_none() || is_bare) {
        let how = if name.is_none() { "is missing" } else { "is empty" };
        kept.push(format!(
            "its newest file {how}: records after {} may be lost",
            before.max(reading.last_number)
        ));
    }
    if reading.header.is_none() && !is_bare && base.is_some() {
        remarks.push("its newest file has no header, and older ones have".to_owned());
        reading.is_checked = false;
    }

    let numbers = names.iter().filter_map(|name| number_of(name));
    let of_base = base.as_ref().map_or(0, |(header, _)| header.file);
    let highest = numbers.chain([of_base]).max().unwrap_or(0);
    let mut next_file = highest + 1;
    let anchor_remark = check_anchor(anchor, &reading, &mut found, &mut next_file, base.as_ref());
    let must_end = anchor_remark.is_some();
    kept.extend(anchor_remark);
    let own_key = keys.current().id();
    let is_current_key = reading.header.as_ref().is_some_and(|header| header.key == own_key);
    let unlisted = unlisted_of(&ended, base.as_ref());
    if !unlisted.is_empty() {
        kept.push(format!("files that its newest file does not know: {}", unlisted.join(", ")));
    }

    let goes_on = reading.may_go_on() && is_current_key && !is_too_large && !must_end;
    match (name, &reading.header, reading.chain) {
        (None, ..) => {}
        (Some(_), Some(header), Some(chain)) if goes_on => {
            let mut hasher = FileHasher::default();
            hasher.update(bytes);
            let (file, bytes) = (header.file, reading.bytes);
            examination.continued = Some(ContinuedFile { file, bytes, chain, hasher });
        }
        (Some(_), header, _) => {
            let file = header.as_ref().map_or(next_file, |header| header.file);
            next_file = next_file.max(file + 1);
            let is_damaged = reading.is_faulty() || is_too_large;
            let ending = EndingFile { file, digest: None, is_damaged, is_unsynced: false };
            examination.ending = Some(ending);
        }
    }
    if let Some((header, of)) = base {
        examination.files = header.files;
        if let Some(name) = of {
            let (bytes, digest) = storage.digest(&name, u64::MAX)?;
            let sha256 = digest.to_string();
            examination.files.push(ListedFile { name, bytes, sha256, is_unsynced: false });
        }
    }
    let last = found.tail.back().or(found.open.values().max_by_key(|record| record.number));
    examination.last = last.cloned();
    remarks.extend(kept.iter().cloned());
    (found.remarks, examination.kept_remarks) = (remarks, kept);
    (examination.found, examination.next_file) = (found, next_file);
    Ok(examination)
}

/// Returns the newest file and its bytes: the current one, or one that a crash kept from becoming
/// it.
fn newest_of(
    storage: &dyn Storage,
    keys: &KeyRing,
    has_current: bool,
    has_scratch: bool,
) -> io::Result<Option<(&'static str, Vec<u8>)>> {
    if has_current {
        return Ok(Some((CURRENT, storage.read(CURRENT, MAX_FILE_BYTES + 1)?)));
    }
    if has_scratch {
        let bytes = storage.read(SCRATCH, MAX_FILE_BYTES + 1)?;
        if is_whole_beginning(&bytes, keys) {
            return Ok(Some((SCRATCH, bytes)));
        }
    }
    Ok(None)
}

/// Reports whether these bytes are a file that was begun, and lacks only its name.
pub(crate) fn is_whole_beginning(bytes: &[u8], keys: &KeyRing) -> bool {
    let reading = CheckedFile::read(bytes, keys, None, &mut RecoveredLog::default());
    let is_understood = reading.header.is_some() || reading.carried + reading.news > 0;
    is_understood && reading.is_complete() && !reading.is_faulty() && reading.torn_bytes() == 0
}

fn is_ended(name: &str) -> bool {
    matches!(role_of(name), FileRole::Ended(_) | FileRole::Quarantined(_) | FileRole::Aged(_))
}

fn number_of(name: &str) -> Option<u64> {
    match role_of(name) {
        FileRole::Ended(file) | FileRole::Quarantined(file) | FileRole::Unfinished(file) => {
            Some(file.min(MAX_NUMBER))
        }
        _ => None,
    }
}

/// Reads ended files from the newest back to one with the state of all alarms, then applies them
/// in order. Returns the newest header with its file.
fn read_ended(
    storage: &dyn Storage,
    keys: &KeyRing,
    ended: &[&String],
    found: &mut RecoveredLog,
) -> io::Result<Option<(FileHeader, String)>> {
    let mut start = ended.len();
    let mut newest = None;
    while start > 0 {
        start -= 1;
        let bytes = read_some(storage, ended[start])?;
        let reading = CheckedFile::read(&bytes, keys, None, &mut RecoveredLog::default());
        if let (None, Some(header)) = (&newest, &reading.header) {
            newest = Some((header.clone(), ended[start].clone()));
        }
        // Of an older release each file begins with all that it rests on.
        if reading.is_complete() {
            break;
        }
    }
    for name in &ended[start..] {
        let bytes = read_some(storage, name)?;
        CheckedFile::read(&bytes, keys, None, found);
    }
    Ok(newest)
}

fn read_some(storage: &dyn Storage, name: &str) -> io::Result<Vec<u8>> {
    // What is no file, or cannot be read, tells nothing.
    Ok(storage.read(name, MAX_FILE_BYTES).unwrap_or_default())
}

/// Compares the log with its anchor; a fault, if there is one.
fn check_anchor(
    anchor: &AnchorState,
    reading: &CheckedFile,
    found: &mut RecoveredLog,
    next_file: &mut u64,
    base: Option<&(FileHeader, Option<String>)>,
) -> Option<String> {
    let anchor = match anchor {
        AnchorState::Unused => return None,
        AnchorState::Absent => {
            let had_anchor = base.is_some_and(|(header, _)| header.has_anchor);
            return had_anchor.then(|| "its anchor is missing".to_owned());
        }
        AnchorState::Unusable(cause) => return Some(format!("its anchor cannot be used: {cause}")),
        AnchorState::Found(anchor) => anchor,
    };
    *next_file = (*next_file).max(anchor.file + 1);
    let told = format!("record {} in file {}, chain {}", anchor.number, anchor.file, anchor.at);
    if anchor.number > found.last_number {
        let first = found.last_number + 1;
        found.last_number = anchor.number;
        let last = anchor.number;
        return Some(format!("records {first} to {last} are missing: its anchor has {told}"));
    }
    let is_there = match &reading.header {
        Some(header) if anchor.file == header.file => reading.has_wanted,
        // It was begun after the anchor was written, under the same key, and knows the file
        // before.
        Some(header) => {
            let is_later = anchor.file < header.file && anchor.number <= header.after;
            let listed = header.files.iter().map(|file| &file.name).chain(&header.removed);
            let knows = listed.filter_map(|name| number_of(name)).any(|file| file == anchor.file);
            is_later && knows && reading.is_checked && header.key == anchor.key
        }
        None => false,
    };
    (!is_there).then(|| format!("it is another log than its anchor knows, which has {told}"))
}

/// Ended files that neither the manifest nor the removals of the newest header name.
fn unlisted_of<'a>(
    ended: &[&'a String],
    base: Option<&(FileHeader, Option<String>)>,
) -> Vec<&'a str> {
    let Some((header, of)) = base else { return Vec::new() };
    let listed = header.files.iter().map(|file| file.name.as_str());
    let removed = header.removed.iter().map(String::as_str);
    let known: BTreeSet<&str> = listed.chain(removed).chain(of.as_deref()).collect();
    ended.iter().map(|name| name.as_str()).filter(|name| !known.contains(name)).collect()
}
