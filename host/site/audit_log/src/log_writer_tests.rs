use std::collections::BTreeMap;
use std::fs;
use std::path::PathBuf;

use busbar_alarms::{AlarmEvent, AlarmFlags};
use busbar_tags::SourceTime;
use tempfile::TempDir;

use super::*;
use crate::memory_storage::MemoryStorage;
use crate::{Verification, probe, verify};

pub(crate) fn record(number: u64, alarm: &str, to: AlarmState) -> AlarmRecord {
    AlarmRecord {
        number,
        time: SourceTime(number as i64),
        alarm: alarm.into(),
        happened: AlarmEvent::Occurred,
        from: AlarmState::Normal,
        to,
        standing: AlarmFlags::from_state(to, None),
        operator: Some("Ö. Operator".into()),
        value: None,
        source_time: None,
        origin: busbar_types::Origin::LIVE,
        is_assumed: false,
        reason: None,
        is_first_out: false,
    }
}

fn rules(folder: &TempDir) -> AuditLogOptions {
    AuditLogOptions {
        directory: folder.path().join("log"),
        max_file_bytes: 3_000,
        max_files: 3,
        key_file: None,
        anchor_file: None,
    }
}

fn open(folder: &TempDir) -> (LogWriter, RecoveredLog) {
    LogWriter::open(&rules(folder)).unwrap()
}

fn newest(folder: &TempDir) -> PathBuf {
    folder.path().join("log").join(CURRENT)
}

fn append(writer: &mut LogWriter, records: &[AlarmRecord]) {
    writer.stage(records.to_vec());
    writer.write_staged().unwrap();
}

fn verified(folder: &TempDir) -> Verification {
    verify(&folder.path().join("log"), None, None).unwrap()
}

/// A line as releases before the chain wrote it.
pub(crate) fn old_line(record: &AlarmRecord) -> Vec<u8> {
    probe::signed(&serde_json::to_vec(record).unwrap(), false)
}

fn files(folder: &TempDir) -> BTreeMap<String, Vec<u8>> {
    let entries = fs::read_dir(folder.path().join("log")).unwrap().flatten();
    let file = |entry: fs::DirEntry| {
        let bytes = fs::read(entry.path()).unwrap();
        (entry.file_name().into_string().unwrap(), bytes)
    };
    entries.map(file).collect()
}

#[track_caller]
fn check_holds(folder: &TempDir, bytes: &[u8]) {
    let files = files(folder);
    assert!(files.values().any(|file| file.starts_with(bytes)), "{:?}", files.keys());
}

#[test]
fn records_are_there_again() {
    let folder = tempfile::tempdir().unwrap();
    let records = [
        record(1, "a", AlarmState::Unacknowledged),
        record(2, "b", AlarmState::Unacknowledged),
        record(3, "a", AlarmState::Normal),
    ];
    let (mut writer, found) = open(&folder);
    assert_eq!((found.last_number, found.remarks.len()), (0, 0));
    append(&mut writer, &records[..2]);
    append(&mut writer, &records[2..]);
    drop(writer);
    let (_, found) = open(&folder);
    assert!(found.tail.iter().eq(&records));
    assert_eq!(found.open.into_values().collect::<Vec<_>>(), records[1..2]);
    assert_eq!((found.last_number, found.remarks), (3, Vec::new()));
    let verified = verified(&folder);
    assert_eq!((verified.faults, verified.records), (Vec::new(), 3));
}

#[test]
fn a_line_that_was_cut_short_anywhere_is_kept_aside_and_the_next_one_is_whole() {
    let folder = tempfile::tempdir().unwrap();
    let (mut writer, _) = open(&folder);
    append(&mut writer, &[record(1, "a", AlarmState::Unacknowledged)]);
    let first = fs::read(newest(&folder)).unwrap().len();
    append(&mut writer, &[record(2, "b", AlarmState::Unacknowledged)]);
    drop(writer);
    let whole = fs::read(newest(&folder)).unwrap();
    for length in first..whole.len() {
        fs::remove_dir_all(folder.path().join("log")).unwrap();
        drop(open(&folder));
        fs::write(newest(&folder), &whole[..length]).unwrap();
        let (mut writer, found) = open(&folder);
        assert_eq!(found.last_number, 1, "{length} bytes");
        assert_eq!(found.remarks.len(), usize::from(length > first));
        append(&mut writer, &[record(2, "c", AlarmState::Unacknowledged)]);
        drop(writer);
        check_holds(&folder, &whole[..length]);
        let found = open(&folder).1;
        assert!(found.open.keys().eq(["a", "c"]), "{length} bytes");
        assert_eq!(found.remarks, Vec::<String>::new());
        assert_eq!(verified(&folder).faults, Vec::<String>::new(), "{length} bytes");
    }
}

#[test]
fn damage_in_the_middle_is_told_and_kept_and_the_rest_is_read() {
    let folder = tempfile::tempdir().unwrap();
    let (mut writer, _) = open(&folder);
    let records: Vec<_> =
        (1..=3).map(|n| record(n, &n.to_string(), AlarmState::Unacknowledged)).collect();
    append(&mut writer, &records);
    drop(writer);
    let mut bytes = fs::read(newest(&folder)).unwrap();
    let line = bytes.windows(11).position(|text| text == b"\"number\":2,").unwrap();
    bytes[line + 20] ^= 1;
    fs::write(newest(&folder), &bytes).unwrap();
    let (mut writer, found) = open(&folder);
    assert!(found.open.keys().eq(["1", "3"]));
    let remarks = found.remarks.join("; ");
    assert!(remarks.contains("1 damaged lines") && remarks.contains("1 records in it are missing"));
    append(&mut writer, &[record(4, "4", AlarmState::Unacknowledged)]);
    drop(writer);
    check_holds(&folder, &bytes);
    assert!(files(&folder).contains_key("alarms.00000001.quarantine.jsonl"));
    assert!(open(&folder).1.open.keys().eq(["1", "3", "4"]));
    let faults = verified(&folder).faults.join("; ");
    assert!(faults.contains("alarms.00000001.quarantine.jsonl: 1 lines are damaged"), "{faults}");
}

#[test]
fn lines_of_a_newer_release_are_kept_and_told_and_their_numbers_count() {
    let newer = |number: u64, version: &str| {
        let json = format!("{{{version}\"number\":{number},\"happened\":\"escalated\"}}");
        probe::signed(json.as_bytes(), false)
    };
    for version in ["", "\"version\":2,", "\"version\":3,"] {
        let folder = tempfile::tempdir().unwrap();
        fs::create_dir(folder.path().join("log")).unwrap();
        let old: Vec<u8> =
            (1..=2).flat_map(|n| old_line(&record(n, "a", AlarmState::Unacknowledged))).collect();
        let lines: Vec<u8> = (3..=2849).flat_map(|number| newer(number, version)).collect();
        let bytes = [old, lines].concat();
        fs::write(newest(&folder), &bytes).unwrap();
        let (mut writer, found) = open(&folder);
        check_holds(&folder, &bytes);
        assert_eq!(found.last_number, 2849);
        let told = "2847 lines in it are of a newer release";
        assert!(found.remarks[0].contains(told), "{:?}", found.remarks);
        assert!(found.open.keys().eq(["a"]));
        let next = found.last_number + 1;
        append(&mut writer, &[record(next, "b", AlarmState::Unacknowledged)]);
        drop(writer);
        check_holds(&folder, &bytes);
        let found = open(&folder).1;
        assert_eq!((found.last_number, found.remarks), (next, Vec::new()));
    }
}

#[test]
fn a_log_without_chain_is_read_and_the_chain_begins_behind_it() {
    let folder = tempfile::tempdir().unwrap();
    fs::create_dir(folder.path().join("log")).unwrap();
    let lines = |numbers: std::ops::RangeInclusive<u64>| -> Vec<u8> {
        numbers
            .flat_map(|n| old_line(&record(n, &n.to_string(), AlarmState::Unacknowledged)))
            .collect()
    };
    let (older, newer) = (lines(1..=4), lines(5..=7));
    fs::write(newest(&folder).with_file_name("alarms.1.jsonl"), &older).unwrap();
    fs::write(newest(&folder), &newer).unwrap();
    assert!(verified(&folder).notes[0].contains("there is no chain"));
    let (mut writer, found) = open(&folder);
    assert_eq!((found.last_number, found.remarks, found.tail.len()), (7, Vec::new(), 3));
    append(&mut writer, &[record(8, "8", AlarmState::Unacknowledged)]);
    drop(writer);
    let of = files(&folder);
    assert_eq!((&of["alarms.1.jsonl"], &of["alarms.00000001.jsonl"]), (&older, &newer));
    assert_eq!(open(&folder).1.open.len(), 4);
    let verified = verified(&folder);
    assert_eq!((verified.faults, verified.newest), (Vec::new(), 8));
    let notes = verified.notes.join("; ");
    assert!(notes.contains("begins in alarms.jsonl after record 7"), "{notes}");
}

#[test]
fn files_are_bounded_and_the_newest_tells_how_all_alarms_stand() {
    let folder = tempfile::tempdir().unwrap();
    let (mut writer, _) = open(&folder);
    append(&mut writer, &[record(1, "long ago", AlarmState::OutOfService)]);
    for number in 2..=500_u64 {
        let state =
            if number.is_multiple_of(2) { AlarmState::Unacknowledged } else { AlarmState::Normal };
        append(&mut writer, &[record(number, "bell", state)]);
    }
    drop(writer);
    let files = files(&folder);
    assert_eq!(files.len(), 4, "three files and the lock: {:?}", files.keys());
    assert!(files.values().all(|bytes| bytes.len() < 4_000));
    let found = open(&folder).1;
    assert!(found.open.keys().eq(["bell", "long ago"]), "{:?}", found.open);
    assert_eq!((found.last_number, found.remarks), (500, Vec::new()));
    assert_eq!(verified(&folder).faults, Vec::<String>::new());
}

#[test]
fn faults_push_no_full_file_out() {
    let folder = tempfile::tempdir().unwrap();
    let mut number = 0;
    let mut fill = |count: u64| {
        let (mut writer, found) = open(&folder);
        assert_eq!(found.last_number, number);
        for _ in 0..count {
            number += 1;
            append(&mut writer, &[record(number, "a", AlarmState::Unacknowledged)]);
        }
    };
    fill(20);
    let full: Vec<String> = files(&folder).into_keys().collect();
    for _ in 0..10 {
        let bytes = fs::read(newest(&folder)).unwrap();
        fs::write(newest(&folder), [bytes, b"cut".to_vec()].concat()).unwrap();
        fill(1);
    }
    let kept = files(&folder);
    assert!(full.iter().all(|name| kept.contains_key(name)), "{full:?} {:?}", kept.keys());
    assert_eq!(verified(&folder).faults, Vec::<String>::new());
}

#[test]
fn a_crash_between_two_renames_loses_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let (mut writer, _) = open(&folder);
    append(&mut writer, &[record(1, "a", AlarmState::Shelved), record(2, "b", AlarmState::Normal)]);
    drop(writer);
    // As if the last rename of a beginning had not been made; or that of an older release.
    for _ in 0..2 {
        fs::rename(newest(&folder), newest(&folder).with_file_name(SCRATCH)).unwrap();
        assert_eq!(verified(&folder).faults, Vec::<String>::new());
        let found = open(&folder).1;
        assert!(found.open.keys().eq(["a"]));
        assert_eq!((found.last_number, found.remarks), (2, Vec::new()));
    }
    let (mut writer, _) = open(&folder);
    append(&mut writer, &[record(3, "c", AlarmState::Unacknowledged)]);
    drop(writer);
    assert_eq!(open(&folder).1.remarks, Vec::<String>::new());
}

#[test]
fn a_newest_file_that_is_missing_is_told_and_numbers_go_on() {
    let folder = tempfile::tempdir().unwrap();
    let (mut writer, _) = open(&folder);
    for number in 1..=30 {
        append(&mut writer, &[record(number, &number.to_string(), AlarmState::Unacknowledged)]);
    }
    let begun = writer.current.as_ref().unwrap().number;
    drop(writer);
    fs::remove_file(newest(&folder)).unwrap();
    let faults = verified(&folder).faults.join("; ");
    assert!(faults.contains("is missing"), "{faults}");
    let (writer, found) = open(&folder);
    assert!(found.remarks.join("; ").contains("newest file is missing"), "{:?}", found.remarks);
    assert!((1..30).contains(&found.last_number), "{}", found.last_number);
    assert_eq!(found.open.len() as u64, found.last_number, "older files tell");
    assert!(writer.current.as_ref().unwrap().number >= begun);
    drop(writer);
    let faults = verified(&folder).faults.join("; ");
    assert!(faults.contains("newest file is missing"), "the next header keeps it: {faults}");
}

#[test]
fn a_file_that_is_taken_away_while_it_is_written_is_told() {
    let folder = tempfile::tempdir().unwrap();
    let (mut writer, _) = open(&folder);
    append(&mut writer, &[record(1, "a", AlarmState::Unacknowledged)]);
    fs::remove_file(newest(&folder)).unwrap();
    append(&mut writer, &[record(2, "b", AlarmState::Unacknowledged)]);
    drop(writer);
    assert!(open(&folder).1.open.keys().eq(["a", "b"]));
    let faults = verified(&folder).faults.join("; ");
    assert!(faults.contains("alarms.00000001.jsonl is missing"), "{faults}");
    assert!(faults.contains("removed or renamed while"), "{faults}");
}

#[test]
fn a_full_disk_loses_nothing_and_cuts_nothing_off() {
    let rules = FileRules { max_file_bytes: 1_500, max_files: 1_000 };
    for free in 0..1_500 {
        let storage = MemoryStorage::default();
        let open = || {
            let boxed = Box::new(storage.clone());
            LogWriter::with_storage(boxed, rules, KeyRing::default(), &AnchorState::Unused).unwrap()
        };
        let (mut writer, _) = open();
        storage.set_free(Some(free));
        let records: Vec<_> =
            (1..=3).map(|n| record(n, &n.to_string(), AlarmState::Unacknowledged)).collect();
        for record in &records {
            writer.stage(vec![record.clone()]);
            let before = storage.files();
            while writer.write_staged().is_err() {
                let after = storage.files();
                for (name, bytes) in before.iter().filter(|(name, _)| *name != SCRATCH) {
                    let kept = after.values().any(|kept| kept.starts_with(bytes));
                    assert!(kept, "{free} bytes free: {name}");
                }
                storage.set_free(Some(200));
            }
        }
        storage.set_free(None);
        drop(writer);
        let (_, found) = open();
        assert_eq!((found.last_number, found.remarks), (3, Vec::new()), "{free} bytes free");
        assert!(found.open.into_values().eq(records), "{free} bytes free");
    }
}

#[test]
fn links_in_the_folder_are_not_followed() {
    let folder = tempfile::tempdir().unwrap();
    let victim = folder.path().join("victim");
    fs::write(&victim, "untouched").unwrap();
    drop(open(&folder));
    for name in [CURRENT, LOCK] {
        let path = newest(&folder).with_file_name(name);
        let aside = folder.path().join("aside");
        fs::rename(&path, &aside).unwrap();
        std::os::unix::fs::symlink(&victim, &path).unwrap();
        let refused = LogWriter::open(&rules(&folder)).unwrap_err();
        assert!(matches!(refused, LogError::Unusable { .. }), "{refused}");
        assert!(crate::inspect(&rules(&folder)).is_err(), "{name}");
        assert_eq!(fs::read_to_string(&victim).unwrap(), "untouched");
        fs::remove_file(&path).unwrap();
        fs::rename(&aside, &path).unwrap();
    }
    drop(open(&folder));
}

#[test]
fn one_viewer_writes_at_a_time() {
    let folder = tempfile::tempdir().unwrap();
    let (writer, _) = open(&folder);
    let refused = LogWriter::open(&rules(&folder)).unwrap_err();
    assert!(matches!(refused, LogError::InUse { .. }), "{refused}");
    crate::inspect(&rules(&folder)).unwrap();
    drop(writer);
    open(&folder);
}

#[test]
fn a_trial_writes_nothing_and_finds_what_is_in_the_way() {
    let folder = tempfile::tempdir().unwrap();
    let mut rules = rules(&folder);
    assert_eq!(crate::inspect(&rules).unwrap(), Vec::<String>::new());
    assert!(!rules.directory.exists());
    let (mut writer, _) = open(&folder);
    append(&mut writer, &[record(1, "a", AlarmState::Unacknowledged)]);
    drop(writer);
    fs::write(newest(&folder), [fs::read(newest(&folder)).unwrap(), b"torn".to_vec()].concat())
        .unwrap();
    let before = files(&folder);
    assert!(crate::inspect(&rules).unwrap()[0].contains("cut short"));
    assert_eq!(files(&folder), before);
    rules.key_file = Some(folder.path().join("absent"));
    assert!(matches!(crate::inspect(&rules), Err(LogError::Key { .. })));
    for inside in [rules.directory.join("key"), rules.directory.join("deep/key")] {
        rules.key_file = Some(inside);
        assert!(matches!(crate::inspect(&rules), Err(LogError::Misplaced { .. })));
        assert!(matches!(LogWriter::open(&rules), Err(LogError::Misplaced { .. })));
    }
    rules.key_file = None;
    rules.anchor_file = Some(folder.path().join("absent/anchor"));
    assert!(matches!(crate::inspect(&rules), Err(LogError::Anchor { .. })));
    rules.anchor_file = None;
    rules.directory = folder.path().join("log").join(CURRENT).join("log");
    assert!(matches!(crate::inspect(&rules), Err(LogError::Unusable { .. })));
    assert_eq!(files(&folder), before);
}
