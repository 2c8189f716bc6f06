//! Verification of a log: its chain, its manifest, its numbers, its anchor.

use std::collections::BTreeMap;
use std::path::Path;
use std::{io, thread, time::Duration};

use crate::anchor::{self, Anchor, AnchorState};
use crate::chain::KeyRing;
use crate::chain_check::CheckedFile;
use crate::file_header::{FileHeader, ListedFile};
use crate::file_names::{CURRENT, FileRole, SCRATCH, age_order, role_of};
use crate::options::open_keys;
use crate::recovery::is_whole_beginning;
use crate::storage::{DiskStorage, Storage};
use crate::{LogError, MAX_FILE_BYTES, RecoveredLog};

/// Limit of faults, and of notes, of one verification.
pub const MAX_FINDINGS: usize = 1_000;
/// Readings of a log in which faults are found: a viewer may be writing it meanwhile.
const LOOKS: u32 = 3;
const LOOK_INTERVAL: Duration = Duration::from_millis(100);

/// Outcome of a verification.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Verification {
    /// Signs of removed, reordered, changed or damaged lines and files.
    pub faults: Vec<String>,
    /// Statements on what was verified and what was not.
    pub notes: Vec<String>,
    /// Files of the log.
    pub files: u64,
    /// Number of records in the files.
    pub records: u64,
    /// Number of the newest record; 0 for none.
    pub newest: u64,
}

impl Verification {
    fn fault(&mut self, fault: String) {
        if self.faults.len() < MAX_FINDINGS {
            self.faults.push(fault);
        }
    }

    fn note(&mut self, note: String) {
        if self.notes.len() < MAX_FINDINGS {
            self.notes.push(note);
        }
    }
}

/// Verifies the log of a folder, with the key of its chain and its anchor where there are
/// such. Nothing is written, and a viewer may write it meanwhile.
///
/// # Errors
/// A folder or key that cannot be read, or a folder without log.
pub fn verify(
    directory: &Path,
    key_file: Option<&Path>,
    anchor_file: Option<&Path>,
) -> Result<Verification, LogError> {
    let unusable = |source| LogError::Unusable { path: directory.to_owned(), source };
    let keys = open_keys(key_file)?;
    let storage = DiskStorage::open(directory).map_err(unusable)?;
    let mut look = 1;
    loop {
        // First the anchor: the log is never behind it.
        let state = match anchor_file {
            Some(path) => anchor::read(path, &keys),
            None => AnchorState::Unused,
        };
        let verified = verify_storage(&storage, &keys, &state);
        let is_sure = match &verified {
            Ok(Some(verification)) => verification.faults.is_empty(),
            _ => false,
        };
        if is_sure || look == LOOKS {
            let absent = || LogError::Absent { directory: directory.to_owned() };
            return verified.map_err(unusable)?.ok_or_else(absent);
        }
        look += 1;
        thread::sleep(LOOK_INTERVAL);
    }
}

/// A file of the log.
struct NamedCheckedFile {
    name: String,
    reading: CheckedFile,
    /// True where it was larger than the limit of reading.
    is_cut: bool,
}

/// Verifies a log in any storage; none where there is no file of a log and no anchor.
pub(crate) fn verify_storage(
    storage: &dyn Storage,
    keys: &KeyRing,
    anchor: &AnchorState,
) -> io::Result<Option<Verification>> {
    let mut outcome = Verification::default();
    let mut names = storage.names()?;
    names.sort_by_key(|name| age_order(role_of(name)));
    let scratch = names.iter().any(|name| name == SCRATCH);
    let mut listed_names: Vec<String> = names.iter().filter(|name| is_log(name)).cloned().collect();
    if !names.iter().any(|name| name == CURRENT) {
        if scratch && is_whole_beginning(&storage.read(SCRATCH, MAX_FILE_BYTES)?, keys) {
            outcome.note("the newest file has yet to get its name: a crash came between".into());
            listed_names.push(SCRATCH.to_owned());
        } else if !listed_names.is_empty() {
            outcome.fault(format!("the newest file, {CURRENT}, is missing"));
        }
    }
    if listed_names.is_empty() {
        let AnchorState::Found(Anchor { number, .. }) = anchor else { return Ok(None) };
        outcome.fault(format!("there is no log, though its anchor has record {number}"));
        return Ok(Some(outcome));
    }
    let wanted = match anchor {
        AnchorState::Found(anchor) => anchor.value(),
        _ => None,
    };
    // Which part of a file counts, the newest header tells.
    let header = newest_header(storage, keys, &listed_names)?;
    let listed = header.as_ref().map_or(&[][..], |(_, header)| &header.files);
    let lengths: BTreeMap<&str, u64> = listed
        .iter()
        .filter(|file| file.is_unsynced)
        .map(|file| (file.name.as_str(), file.bytes))
        .collect();
    let mut files = Vec::new();
    for name in &listed_names {
        let most = lengths.get(name.as_str()).copied().unwrap_or(MAX_FILE_BYTES + 1);
        let bytes = match storage.read(name, most) {
            Ok(bytes) => bytes,
            Err(error) => {
                outcome.fault(format!("{name} cannot be read: {error}"));
                continue;
            }
        };
        let is_cut = bytes.len() as u64 > MAX_FILE_BYTES;
        let bytes = &bytes[..bytes.len().min(MAX_FILE_BYTES as usize)];
        let mut found = RecoveredLog::default();
        let reading = CheckedFile::read(bytes, keys, wanted.as_ref(), &mut found);
        files.push(NamedCheckedFile { name: name.clone(), reading, is_cut });
    }
    check_manifest(storage, header.as_ref(), &files, &mut outcome)?;
    check_keys(keys, &files, &mut outcome);
    check_files(&files, &mut outcome);
    check_anchor(anchor, &files, &mut outcome);
    for name in names.iter().filter(|name| matches!(role_of(name), FileRole::Unfinished(_))) {
        outcome.note(format!("{name} was begun before a crash, and is no part of the log"));
    }
    Ok(Some(outcome))
}

fn is_log(name: &str) -> bool {
    matches!(
        role_of(name),
        FileRole::Current | FileRole::Ended(_) | FileRole::Quarantined(_) | FileRole::Aged(_)
    )
}

/// The header of the newest file that has one, and the file's name.
fn newest_header(
    storage: &dyn Storage,
    keys: &KeyRing,
    names: &[String],
) -> io::Result<Option<(String, FileHeader)>> {
    for name in names.iter().rev() {
        let bytes = storage.read(name, MAX_FILE_BYTES).unwrap_or_default();
        let line = bytes.split_inclusive(|&byte| byte == b'\n').next().unwrap_or_default();
        let reading = CheckedFile::read(line, keys, None, &mut RecoveredLog::default());
        if let Some(header) = reading.header {
            return Ok(Some((name.clone(), header)));
        }
    }
    Ok(None)
}

/// Compares the files with the manifest of the newest header.
fn check_manifest(
    storage: &dyn Storage,
    header: Option<&(String, FileHeader)>,
    files: &[NamedCheckedFile],
    outcome: &mut Verification,
) -> io::Result<()> {
    let Some((newest, header)) = header else { return Ok(()) };
    for listed in &header.files {
        let ListedFile { name, bytes, sha256, is_unsynced } = listed;
        match storage.digest(name, *bytes) {
            Err(error) if error.kind() == io::ErrorKind::NotFound => {
                outcome.fault(format!("{name} is missing, which {newest} lists"));
            }
            Err(error) => outcome.fault(format!("{name} cannot be read: {error}")),
            Ok((size, _)) if size < *bytes => {
                let lost = bytes - size;
                outcome.fault(format!("{name} was cut: {lost} of its {bytes} bytes are missing"));
            }
            Ok((_, digest)) if digest.to_string() != *sha256 => {
                outcome.fault(format!("{name} was changed after it ended"));
            }
            Ok((size, _)) if size > *bytes && *is_unsynced => {
                let more = size - bytes;
                outcome.note(format!(
                    "{name} ends with {more} bytes that the disk did not confirm; the next file \
                     has their records"
                ));
            }
            Ok((size, _)) if size > *bytes => {
                let more = size - bytes;
                outcome.fault(format!("{name} was changed: {more} bytes follow after its end"));
            }
            Ok(_) => {}
        }
    }
    for file in files.iter().filter(|file| file.name != *newest) {
        let name = &file.name;
        if header.removed.contains(name) {
            outcome.note(format!("{name} is older than what is kept, and has yet to go"));
        } else if !header.files.iter().any(|listed| listed.name == *name) {
            outcome.fault(format!("{name} is no file of this log, as {newest} knows it"));
        }
    }
    Ok(())
}

/// Compares the keys of the files with the given one, and reports where the chain begins.
fn check_keys(keys: &KeyRing, files: &[NamedCheckedFile], outcome: &mut Verification) {
    let own = keys.current().id();
    let mut begun: Option<(&NamedCheckedFile, &FileHeader)> = None;
    let mut is_keyed_elsewhere = false;
    for file in files {
        let name = &file.name;
        match &file.reading.header {
            None if file.reading.first_chained.is_some() => {
                outcome.fault(format!("{name} has no header: its beginning was removed"));
            }
            None if begun.is_some() => {
                outcome.fault(format!("{name} has no chain, though files before it have one"));
            }
            None => {}
            Some(header) if header.key == own => {
                begun.get_or_insert((file, header));
            }
            Some(_) if begun.is_some() && keys.is_keyed() => {
                outcome.fault(format!("{name} is under another key, or none, than those before"));
            }
            Some(header) if header.key.is_empty() && !keys.is_keyed() => {
                begun.get_or_insert((file, header));
            }
            Some(header) if header.key.is_empty() => {}
            Some(_) => is_keyed_elsewhere = true,
        }
    }
    let newest = files.last();
    let is_own = newest
        .is_some_and(|file| file.reading.header.as_ref().is_some_and(|header| header.key == own));
    if keys.is_keyed() && !is_own {
        outcome.fault("the newest file is not under this key".to_owned());
    }
    if !keys.is_keyed() && is_keyed_elsewhere {
        outcome.note(
            "the chain has a key: without it, changes by somebody who knows the log are not found"
                .to_owned(),
        );
    }
    match begun {
        Some((file, header)) => {
            let key = if own.is_empty() { ", without key," } else { "" };
            outcome.note(match header.after {
                0 => format!("the chain{key} has the log from its first record on"),
                after => format!(
                    "the chain{key} begins in {} after record {after}; files before it are as \
                     they were then found",
                    file.name
                ),
            });
        }
        None if !is_keyed_elsewhere => {
            outcome.note("there is no chain: an older release wrote this log".to_owned());
        }
        None => {}
    }
}

/// Reports the faults of each file, and gaps of numbers between files.
fn check_files(files: &[NamedCheckedFile], outcome: &mut Verification) {
    let mut before: Option<u64> = None;
    for NamedCheckedFile { name, reading, is_cut } in files {
        outcome.files += 1;
        outcome.records += reading.news;
        if let Some(header) = &reading.header {
            for remark in &header.remarks {
                outcome.fault(format!("{name} notes of the log before it: {remark}"));
            }
            if reading.carried < header.carried {
                outcome.fault(format!("{name} lacks records that it began with"));
            }
        }
        if *is_cut {
            outcome.fault(format!("{name} has more than {MAX_FILE_BYTES} bytes"));
        }
        let kinds = [
            (&reading.damaged, "damaged"),
            (&reading.unlinked, "changed, reordered, or next to removed ones"),
            (&reading.unchained, "without chain value after chained ones"),
            (&reading.newer, "of a newer release, which alone can verify them"),
        ];
        for (places, kind) in kinds.into_iter().filter(|(places, _)| places.count > 0) {
            outcome.fault(format!(
                "{name}: {} lines are {kind} ({})",
                places.count,
                places.shown()
            ));
        }
        let torn = reading.torn_bytes();
        if torn > 0 {
            outcome.note(format!("{name}: {torn} bytes at its end were cut short"));
        }
        check_numbers(name, reading, before, outcome);
        before = Some(before.unwrap_or(0).max(reading.last_number));
    }
    outcome.newest = before.unwrap_or(0);
}

fn check_numbers(
    name: &str,
    reading: &CheckedFile,
    before: Option<u64>,
    outcome: &mut Verification,
) {
    let is_proven = reading.is_checked && !reading.is_faulty() && reading.newer.count == 0;
    for [first, last] in &reading.gaps {
        if is_proven {
            outcome.note(format!(
                "{name}: records {first} to {last} were never written: the disk did not keep up"
            ));
        } else {
            outcome.fault(format!("{name}: records {first} to {last} are missing"));
        }
    }
    let Some(before) = before else { return };
    let start = match &reading.header {
        Some(header) => header.after,
        None if reading.newest_carried > 0 => reading.newest_carried,
        None => reading.first_news.map_or(before, |first| first - first.min(1)),
    };
    if start > before {
        outcome.fault(format!("records {} to {start} are missing before {name}", before + 1));
    }
    if start < before && reading.header.is_some() {
        outcome.fault(format!(
            "{name} goes on after record {start}, though files before it have record {before}"
        ));
    }
}

fn check_anchor(anchor: &AnchorState, files: &[NamedCheckedFile], outcome: &mut Verification) {
    let Anchor { file, number, .. } = match anchor {
        AnchorState::Unused => {
            let header = files.last().and_then(|file| file.reading.header.as_ref());
            let remedy = if header.is_some_and(|header| header.has_anchor) {
                "name the anchor to find it"
            } else {
                "no anchor is named"
            };
            outcome.note(format!("the loss of the newest lines is not looked for: {remedy}"));
            return;
        }
        AnchorState::Absent => return outcome.fault("the anchor is missing".to_owned()),
        AnchorState::Unusable(cause) => {
            return outcome.fault(format!("the anchor cannot be used: {cause}"));
        }
        AnchorState::Found(anchor) => anchor,
    };
    if *number > outcome.newest {
        let first = outcome.newest + 1;
        return outcome.fault(format!(
            "records {first} to {number} are missing at the end: the anchor has the last"
        ));
    }
    if files.iter().any(|file| file.reading.has_wanted) {
        outcome.note(format!("the anchor has record {number}, and the log has it too"));
    } else {
        outcome.fault(format!("the anchor has another record {number} in file {file}"));
    }
}
