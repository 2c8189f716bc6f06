use busbar_alarms::{Happening, Standing};
use busbar_tags::SourceTime;
use tempfile::TempDir;

use super::*;

fn record(number: u64, alarm: &str, to: State) -> Record {
    Record {
        number,
        time: SourceTime(number as i64),
        alarm: alarm.into(),
        happened: Happening::Occurred,
        from: State::A,
        to,
        standing: Standing::of(to, None),
        operator: Some("Ö. Operator".into()),
        value: None,
        source_time: None,
        is_first_out: false,
    }
}

fn rules(folder: &TempDir) -> LogRules {
    LogRules { directory: folder.path().join("log"), max_file_bytes: 2_000, max_files: 3 }
}

fn open(folder: &TempDir) -> (Journal, Recovered) {
    Journal::open(rules(folder)).unwrap()
}

fn newest(folder: &TempDir) -> PathBuf {
    folder.path().join("log").join(NAME)
}

#[test]
fn what_was_appended_is_there_again() {
    let folder = tempfile::tempdir().unwrap();
    let records = [record(1, "a", State::B), record(2, "b", State::B), record(3, "a", State::A)];
    let (mut journal, found) = open(&folder);
    assert_eq!((found.last_number, found.remarks.len()), (0, 0));
    journal.append(&records[..2]).unwrap();
    journal.append(&records[2..]).unwrap();
    drop(journal);
    let (_, found) = open(&folder);
    assert!(found.tail.iter().eq(&records));
    assert_eq!(found.open.into_values().collect::<Vec<_>>(), records[1..2]);
    assert_eq!((found.last_number, found.remarks), (3, Vec::new()));
}

#[test]
fn a_line_that_was_cut_short_anywhere_is_left_out_and_the_next_one_is_whole() {
    let folder = tempfile::tempdir().unwrap();
    let (mut journal, _) = open(&folder);
    journal.append(&[record(1, "a", State::B)]).unwrap();
    let first = journal.bytes as usize;
    journal.append(&[record(2, "b", State::B)]).unwrap();
    drop(journal);
    let whole = fs::read(newest(&folder)).unwrap();
    for length in first..whole.len() {
        fs::write(newest(&folder), &whole[..length]).unwrap();
        let (mut journal, found) = open(&folder);
        assert_eq!(found.last_number, 1, "{length} bytes");
        assert_eq!(found.remarks.len(), usize::from(length > first));
        journal.append(&[record(2, "c", State::B)]).unwrap();
        drop(journal);
        let found = open(&folder).1;
        assert!(found.open.keys().eq(["a", "c"]), "{length} bytes");
        assert_eq!(found.remarks, Vec::<String>::new());
    }
}

#[test]
fn damage_in_the_middle_is_told_and_the_rest_is_read() {
    let folder = tempfile::tempdir().unwrap();
    let (mut journal, _) = open(&folder);
    let records: Vec<_> = (1..=3).map(|n| record(n, &n.to_string(), State::B)).collect();
    journal.append(&records).unwrap();
    drop(journal);
    let mut bytes = fs::read(newest(&folder)).unwrap();
    let middle = bytes.len() / 2;
    bytes[middle] ^= 1;
    fs::write(newest(&folder), &bytes).unwrap();
    let found = open(&folder).1;
    assert!(found.open.keys().eq(["1", "3"]));
    let remarks = found.remarks.join("; ");
    assert!(remarks.contains("1 damaged lines") && remarks.contains("1 records in it are missing"));
}

#[test]
fn files_are_bounded_and_the_newest_tells_how_all_alarms_stand() {
    let folder = tempfile::tempdir().unwrap();
    let (mut journal, _) = open(&folder);
    journal.append(&[record(1, "long ago", State::I)]).unwrap();
    for number in 2..=500_u64 {
        let state = if number.is_multiple_of(2) { State::B } else { State::A };
        journal.append(&[record(number, "bell", state)]).unwrap();
    }
    drop(journal);
    let files: Vec<_> = fs::read_dir(folder.path().join("log")).unwrap().flatten().collect();
    assert_eq!(files.len(), 4, "three files and the lock: {files:?}");
    assert!(files.iter().all(|file| file.metadata().unwrap().len() < 3_000), "{files:?}");
    let found = open(&folder).1;
    assert!(found.open.keys().eq(["bell", "long ago"]), "{:?}", found.open);
    assert_eq!((found.last_number, found.remarks), (500, Vec::new()));
}

#[test]
fn a_crash_between_two_renames_loses_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let (mut journal, _) = open(&folder);
    journal.append(&[record(1, "a", State::G), record(2, "b", State::A)]).unwrap();
    journal.rotate().unwrap();
    drop(journal);
    // As if the last rename had not been made.
    fs::rename(newest(&folder), folder.path().join("log").join(NEXT)).unwrap();
    let (mut journal, found) = open(&folder);
    assert!(found.open.keys().eq(["a"]));
    assert_eq!(found.last_number, 2, "the number of a record that is normal again, too");
    journal.append(&[record(3, "c", State::B)]).unwrap();
    drop(journal);
    assert_eq!(open(&folder).1.remarks, Vec::<String>::new());
}

#[test]
fn one_viewer_writes_at_a_time() {
    let folder = tempfile::tempdir().unwrap();
    let (journal, _) = open(&folder);
    let refused = Journal::open(rules(&folder)).unwrap_err();
    assert!(matches!(refused, LogError::InUse { .. }), "{refused}");
    drop(journal);
    open(&folder);
}
