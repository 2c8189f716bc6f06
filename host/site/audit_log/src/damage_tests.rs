//! Seeded damage: lines and files that are flipped, cut, removed, doubled, reordered, forged
//! and rolled back, and full disks. No byte is destroyed, and verification finds each change.

use std::collections::BTreeMap;

use busbar_types::AlarmState;
use fastrand::Rng;

use crate::anchor::{Anchor, AnchorState};
use crate::chain::{ChainKey, Digest256, KeyRing};
use crate::file_header::FileHeader;
use crate::file_names::{CURRENT, FileRole, role_of};
use crate::line;
use crate::log_writer::tests::{old_line, record};
use crate::log_writer::{FileRules, LogWriter};
use crate::memory_storage::MemoryStorage;
use crate::probe;
use crate::verification::verify_storage;

/// Logs that are damaged in a test run; `BUSBAR_LOG_DAMAGES` says otherwise.
const LOGS: u64 = 300;
const LOGS_VARIABLE: &str = "BUSBAR_LOG_DAMAGES";
const MAX_DAMAGES: u32 = 3;

type Files = BTreeMap<String, Vec<u8>>;

/// A log as it was written, and what is known of it elsewhere.
struct WrittenLog {
    files: Files,
    keys: KeyRing,
    rules: FileRules,
    anchor: Anchor,
    newest: u64,
    /// The folder as it was at earlier times.
    past: Vec<Files>,
}

fn write_log(random: &mut Rng) -> WrittenLog {
    let is_keyed = random.u32(..4) > 0;
    let keys = KeyRing::new(is_keyed.then(|| ChainKey::new(b"a key of some length")));
    let rules = FileRules {
        max_file_bytes: random.u64(1_200..6_000),
        max_files: if random.u32(..4) == 0 { random.u32(1..4) } else { 1_000 },
    };
    let storage = MemoryStorage::default();
    let (mut number, mut past, mut anchor) = (0, Vec::new(), None::<Anchor>);
    if random.u32(..3) == 0 {
        let mut lines = |count: u64| -> Vec<u8> {
            let first = number + 1;
            number += count;
            (first..=number)
                .flat_map(|n| old_line(&record(n, "old", AlarmState::Unacknowledged)))
                .collect()
        };
        storage.put("alarms.1.jsonl", &lines(random.u64(1..5)));
        storage.put(CURRENT, &lines(random.u64(1..5)));
    }
    for _ in 0..random.u32(1..4) {
        let state = anchor.clone().map_or(AnchorState::Absent, AnchorState::Found);
        let boxed = Box::new(storage.clone());
        let (mut writer, found) =
            LogWriter::with_storage(boxed, rules, keys.clone(), &state).unwrap();
        assert_eq!((found.last_number, found.remarks), (number, Vec::new()));
        for _ in 0..random.u32(1..10) {
            let count = random.u64(1..4);
            let alarm = random.u32(..4).to_string();
            let to = if random.bool() { AlarmState::Unacknowledged } else { AlarmState::Normal };
            writer.stage((number + 1..=number + count).map(|n| record(n, &alarm, to)).collect());
            number += count;
            if random.u32(..8) == 0 {
                storage.set_free(Some(random.u64(..700)));
                let _ = writer.write_staged();
                storage.set_free(None);
            }
            writer.write_staged().unwrap();
            (anchor, _) = (writer.anchor(), writer.confirm_anchor());
            past.push(storage.files());
        }
    }
    past.pop();
    let anchor = anchor.expect("records were written");
    WrittenLog { files: storage.files(), keys, rules, anchor, newest: number, past }
}

fn lines_of(bytes: &[u8]) -> Vec<Vec<u8>> {
    bytes.split_inclusive(|byte| *byte == b'\n').map(<[u8]>::to_vec).collect()
}

/// Damages a folder in one way.
fn damage(log: &WrittenLog, files: &mut Files, random: &mut Rng) {
    let names: Vec<String> = files.keys().cloned().collect();
    if names.is_empty() {
        return;
    }
    let pick = |random: &mut Rng| {
        // The newest file is the one that matters most.
        if random.bool() && names.iter().any(|name| name == CURRENT) {
            CURRENT.to_owned()
        } else {
            names[random.usize(..names.len())].clone()
        }
    };
    let (name, other) = (pick(random), pick(random));
    let kind = random.u32(..20);
    let bytes = files.get_mut(&name).expect("it is one of them");
    let mut lines = lines_of(bytes);
    let any = |random: &mut Rng, lines: &[Vec<u8>]| random.usize(..lines.len().max(1));
    match kind {
        0 if !bytes.is_empty() => {
            let at = random.usize(..bytes.len());
            bytes[at] ^= 1 << random.u32(..8);
        }
        1 => bytes.truncate(random.usize(..=bytes.len())),
        2 => {
            let start = random.usize(..=bytes.len());
            let end = random.usize(start..=bytes.len());
            bytes[start..end].fill(0);
        }
        3 => bytes.extend((0..random.usize(1..300)).map(|_| random.u8(..))),
        4 => *bytes = Vec::new(),
        5 => drop(files.remove(&name)),
        6 | 7 if !lines.is_empty() => {
            let start = any(random, &lines);
            let end = (start + random.usize(1..4)).min(lines.len());
            lines.drain(start..end);
            files.insert(name, lines.concat());
        }
        8 if !lines.is_empty() => {
            let (from, to) = (any(random, &lines), any(random, &lines));
            lines.insert(to, lines[from].clone());
            files.insert(name, lines.concat());
        }
        9 if lines.len() > 1 => {
            let (a, b) = (any(random, &lines), any(random, &lines));
            lines.swap(a, b);
            files.insert(name, lines.concat());
        }
        10 if !lines.is_empty() => {
            // Another text behind a checksum that is right.
            let at = any(random, &lines);
            let mut text = lines[at].get(17..).unwrap_or_default().trim_ascii_end().to_vec();
            if let Some(digit) = text.iter_mut().rev().find(|byte| byte.is_ascii_digit()) {
                *digit = if *digit == b'7' { b'8' } else { b'7' };
            }
            lines[at] = probe::marked(lines[at].get(16).copied().unwrap_or(b' '), &text);
            files.insert(name, lines.concat());
        }
        11 => {
            let at = any(random, &lines);
            let json = format!("{{\"version\":9,\"number\":{},\"new\":true}}", random.u32(..200));
            lines.insert(at, probe::signed(json.as_bytes(), random.bool()));
            files.insert(name, lines.concat());
        }
        12 => {
            let forged =
                old_line(&record(log.newest + random.u64(..3), "forged", AlarmState::OutOfService));
            bytes.extend_from_slice(&forged);
        }
        13 => {
            // A record that goes on from the last chain value, under a key that was guessed.
            let last = lines.iter().rev().find_map(|l| line::read(l.strip_suffix(b"\n")?)?.link);
            let before = last.map_or(Digest256::default(), |link| link.value);
            let forged = record(log.newest + 1, "forged", AlarmState::Normal);
            let key = ChainKey::new(b"some other key here");
            line::write(bytes, line::NEWS, &forged, &before, &key).unwrap();
        }
        14 => {
            // A whole log by somebody without key.
            let header = FileHeader { file: 900, after: log.newest, ..FileHeader::default() };
            let (mut text, key) = (Vec::new(), ChainKey::default());
            let start = Digest256::default();
            let chain = line::write(&mut text, line::HEADER, &header, &start, &key).unwrap();
            let forged = record(log.newest + 1, "forged", AlarmState::Normal);
            line::write(&mut text, line::NEWS, &forged, &chain, &key).unwrap();
            if random.bool() {
                files.clear();
            }
            files.insert(CURRENT.to_owned(), text);
        }
        15 => {
            let (a, b) = (files[&name].clone(), files[&other].clone());
            files.insert(name, b);
            files.insert(other, a);
        }
        16 => {
            let moved = files.remove(&name).unwrap_or_default();
            files.insert(format!("alarms.{:08}.jsonl", random.u32(1..20)), moved);
        }
        17 | 18 if !log.past.is_empty() => {
            *files = log.past[random.usize(..log.past.len())].clone();
        }
        19 => {
            let copy = files[&name].clone();
            files.insert(format!("alarms.{:08}.quarantine.jsonl", random.u32(1..20)), copy);
        }
        _ => {}
    }
}

/// Reports whether bytes of the log are gone, moved or foreign: more than an end that lacks its
/// last byte.
fn is_changed(log: &WrittenLog, files: &Files) -> bool {
    let is_log = |name: &&String| {
        !matches!(role_of(name), FileRole::Other | FileRole::Unfinished(_) | FileRole::Scratch)
    };
    if !files.keys().filter(is_log).eq(log.files.keys().filter(is_log)) {
        return true;
    }
    files.iter().filter(|(name, _)| is_log(name)).any(|(name, bytes)| {
        let torn = bytes.strip_prefix(log.files[name].as_slice());
        let is_torn = name == CURRENT
            && torn.is_some_and(|torn| {
                // Nothing whole was added: as a power cut leaves it.
                lines_of(torn).iter().all(|l| l.strip_suffix(b"\n").and_then(line::read).is_none())
            });
        *bytes != log.files[name] && !is_torn
    })
}

#[track_caller]
fn check_kept(before: &Files, after: &Files, told: &str) {
    let mut left: Vec<&Vec<u8>> = after.values().collect();
    for (name, bytes) in before {
        // Each file is still there, under whatever name; one may have gone on.
        let place = left.iter().position(|kept| *kept == bytes);
        let place = place.or_else(|| left.iter().position(|kept| kept.starts_with(bytes)));
        let place = place.unwrap_or_else(|| panic!("{told}: bytes of {name} are destroyed"));
        left.swap_remove(place);
    }
}

#[test]
fn no_byte_is_destroyed_and_every_change_is_found() {
    let count = std::env::var(LOGS_VARIABLE).ok().and_then(|n| n.parse().ok()).unwrap_or(LOGS);
    let (mut changed, mut kept) = (0, 0);
    for seed in 0..count {
        let mut random = Rng::with_seed(seed);
        let log = write_log(&mut random);
        let anchor = AnchorState::Found(log.anchor.clone());
        let told = format!("seed {seed}");
        let untouched = MemoryStorage::with_files(&log.files);
        let verified = verify_storage(&untouched, &log.keys, &anchor).unwrap().unwrap();
        assert_eq!(verified.faults, Vec::<String>::new(), "{told}: a false alarm");
        assert_eq!(verified.newest, log.newest, "{told}");

        let mut files = log.files.clone();
        for _ in 0..random.u32(1..=MAX_DAMAGES) {
            damage(&log, &mut files, &mut random);
        }
        let faults_of = |storage: &MemoryStorage, anchor: &AnchorState| {
            let verified = verify_storage(storage, &log.keys, anchor).unwrap();
            verified.map_or(vec!["there is no log".to_owned()], |verified| verified.faults)
        };
        let storage = MemoryStorage::with_files(&files);
        let is_changed = is_changed(&log, &files);
        let faults = faults_of(&storage, &anchor);
        if is_changed {
            changed += 1;
            let sizes = |files: &Files| -> Vec<_> {
                files.iter().map(|(name, bytes)| (name.clone(), bytes.len())).collect()
            };
            let (was, is) = (sizes(&log.files), sizes(&files));
            assert!(!faults.is_empty(), "{told}: a change is not found: {was:?}, now {is:?}");
        }

        // Some disks are full when the log is opened again.
        if random.u32(..3) == 0 {
            storage.set_free(Some(random.u64(..1_500)));
        }
        let boxed = Box::new(storage.clone());
        let (mut writer, found) =
            LogWriter::with_storage(boxed, log.rules, log.keys.clone(), &anchor).unwrap();
        assert!(found.last_number >= log.newest, "{told}: numbers go back");
        let is_bounded = log.rules.max_files < 1_000;
        if !is_bounded {
            check_kept(&files, &storage.files(), &told);
            kept += 1;
        }
        writer.stage(vec![record(found.last_number + 1, "after", AlarmState::Unacknowledged)]);
        let _ = writer.write_staged();
        storage.set_free(None);
        writer.write_staged().unwrap();
        let anchor = AnchorState::Found(writer.anchor().unwrap());
        drop(writer);
        if !is_bounded {
            check_kept(&files, &storage.files(), &told);
        }
        if is_changed && !is_bounded {
            let is_found = !faults_of(&storage, &anchor).is_empty();
            assert!(is_found, "{told}: no longer found: {faults:?}, {:?}", storage.files().keys());
        }
        let boxed = Box::new(storage.clone());
        let again = LogWriter::with_storage(boxed, log.rules, log.keys.clone(), &anchor).unwrap().1;
        assert!(again.open.contains_key("after"), "{told}: the new record is lost");
        assert_eq!(again.last_number, found.last_number + 1, "{told}");
        // Strange files are told until the next file lists them.
        let odd = again.remarks.iter().find(|remark| !remark.starts_with("files that"));
        assert_eq!(odd, None, "{told}: the new file is whole");
    }
    assert!(changed > count / 2 && kept > count / 2, "{changed} changed, {kept} kept of {count}");
    println!("{count} logs, {changed} of them changed and found, {kept} without a byte lost");
}
