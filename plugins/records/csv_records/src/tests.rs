//! Tests with files of all kinds: good, bad, changing, gone.

use std::path::Path;
use std::time::{Duration, Instant, SystemTime};

use busbar_plugin_sdk::testing::host;
use busbar_plugin_sdk::{DefectSeverity, Plugin, RecordList, Records};
use serde_json::json;

use crate::{CsvRecords, Settings};

/// Longest wait for a change to be read.
const MAX_WAIT: Duration = Duration::from_secs(20);
const GOOD: &str = "WO,EQUIPMENT,TEXT,REPORTED,STATE,PRIO\n\
    1,=Q1-QA1,\"SF6 leak, pole 2\",2026-11-20,open,1\n\
    2,2211,Painted,2025-06-01,Closed,\n";

fn settings(file: &Path, source: serde_json::Value) -> Settings {
    let mut source = source;
    source["file"] = json!(file);
    let list = json!({
        "title": "Work orders", "kind": "business", "source": source, "equipment": "EQUIPMENT",
        "columns": [
            { "column": "WO", "name": "Order", "type": "number" },
            { "column": "TEXT" },
        ],
        "time": "REPORTED",
        "open": { "column": "STATE", "closed": ["closed"] },
        "severity": { "column": "PRIO", "critical": ["1"], "general": ["3"] },
    });
    serde_json::from_value(json!({ "lists": [list] })).expect("they are settings")
}

fn plugin(file: &Path) -> CsvRecords {
    CsvRecords::create(settings(file, json!({})), host()).expect("it is made")
}

/// Waits for a list that satisfies a condition, and returns it.
fn until(plugin: &mut CsvRecords, what: &str, holds: impl Fn(&RecordList) -> bool) -> RecordList {
    let end = Instant::now() + MAX_WAIT;
    loop {
        let list = plugin.records().expect("it answers").lists[0].clone();
        if holds(&list) {
            return list;
        }
        assert!(Instant::now() < end, "{what}: {list:?}");
        std::thread::sleep(Duration::from_millis(20));
    }
}

fn write(file: &Path, text: impl AsRef<[u8]>, second: u64) {
    std::fs::write(file, text).expect("it can be written");
    let time = SystemTime::UNIX_EPOCH + Duration::from_secs(1_700_000_000 + second);
    let file = std::fs::File::options().write(true).open(file).expect("it is there");
    file.set_modified(time).expect("its time can be set");
}

fn faults(list: &RecordList) -> Vec<(u64, &str)> {
    list.faults.iter().map(|fault| (fault.row, fault.reason.as_str())).collect()
}

#[test]
fn rows_are_read_with_time_state_and_severity_and_read_again_when_the_file_changed() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("orders.csv");
    write(&file, GOOD, 0);
    let mut plugin = plugin(&file);
    let list = until(&mut plugin, "rows", |list| list.rows.len() == 2);
    assert_eq!((list.title.as_str(), list.source.as_str()), ("Work orders", "orders.csv"));
    let [leak, paint] = &list.rows[..] else { panic!("two rows") };
    assert_eq!(
        (leak.equipment.as_str(), &leak.cells[..]),
        ("=Q1-QA1", &["1".to_owned(), "SF6 leak, pole 2".into()][..])
    );
    assert_eq!((leak.is_open, leak.severity), (true, Some(DefectSeverity::Critical)));
    assert_eq!((paint.is_open, paint.severity), (false, None));
    assert!(leak.unix_nanos > paint.unix_nanos);
    assert_eq!(list.as_of_unix_nanos, Some(1_700_000_000_000_000_000));
    let revision = plugin.records().expect("it answers").revision;
    std::thread::sleep(Duration::from_millis(1500));
    assert_eq!(plugin.records().expect("it answers").revision, revision, "nothing changed");

    write(&file, GOOD.replace("Painted", "Washed"), 60);
    let list = until(&mut plugin, "the change", |list| list.rows[1].cells[1] == "Washed");
    assert_eq!(list.as_of_unix_nanos, Some(1_700_000_060_000_000_000));
    assert!(plugin.records().expect("it answers").revision > revision);

    std::fs::remove_file(&file).expect("it is there");
    let list = until(&mut plugin, "that it is gone", |list| list.fault.is_some());
    assert_eq!(list.rows.len(), 2, "rows stay as they were");
    assert!(list.fault.is_some_and(|fault| fault.contains("No such file")));
    write(&file, GOOD, 120);
    until(&mut plugin, "that it is back", |list| list.fault.is_none());
}

#[test]
fn bad_rows_are_told_with_their_lines_and_the_rest_goes_on() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("orders.csv");
    let mut text = GOOD.as_bytes().to_vec();
    text.extend_from_slice(
        b"3,,No equipment,2026-01-01,open,\n\
          x,=Q1,No number,2026-01-01,open,\n\
          5,=Q1,Bad date,1.1.2026,open,\n\
          6,=Q1,too few\n\
          7,=Q1,\"two\nlines\",2026-01-01,open,3\n\
          8,=Q1,\"never closed,2026-01-01,open,3\n\
          9,=Q1,good,2026-01-01,open,3\n\
          \n\
          10,=Q1,\xff\xfe,2026-01-01,open,3\n\
          11,=Q1,last,2026-01-01,open,3",
    );
    write(&file, &text, 0);
    let mut plugin = plugin(&file);
    let list = until(&mut plugin, "rows", |list| !list.rows.is_empty());
    let texts: Vec<_> = list.rows.iter().map(|row| row.cells[1].as_str()).collect();
    assert_eq!(texts, ["SF6 leak, pole 2", "Painted", "two\nlines", "good", "last"]);
    let found = faults(&list);
    let lines: Vec<_> = found.iter().map(|(line, _)| *line).collect();
    assert_eq!(lines, [4, 5, 6, 7, 10, 13]);
    for ((_, reason), words) in found.iter().zip([
        "names no equipment",
        "column 'WO': 'x' is no number",
        "'1.1.2026' is not a time such as 2024-02-29T13:14:15Z",
        "it has 3 cells, where the first row has 6",
        "is a quote not closed?",
        "is not UTF-8",
    ]) {
        assert!(reason.contains(words), "{words}: {reason}");
    }
    assert_eq!(list.left_out, 6);
}

#[test]
fn encodings_and_delimiters_are_read() {
    let folder = tempfile::tempdir().expect("a folder");
    let text = GOOD.replace("Painted", "\u{6cb9}\u{6f06}");
    let utf_16: Vec<u8> =
        std::iter::once(0xfeff).chain(text.encode_utf16()).flat_map(u16::to_le_bytes).collect();
    // Both characters, and those of ASCII, are all that there is.
    let (oil, paint) = (b"\xd3\xcd", b"\xc6\xe1");
    let in_gb = |text: &str| -> Vec<u8> {
        let bytes = text.chars().flat_map(|c| match c {
            '\u{6cb9}' => oil.to_vec(),
            '\u{6f06}' => paint.to_vec(),
            other => vec![other as u8],
        });
        bytes.collect()
    };
    let gb = in_gb(&text);
    let semicolons = text.replace("\"SF6 leak, pole 2\"", "SF6 leak").replace(',', ";");
    for (name, bytes, source) in [
        ("bom", [b"\xef\xbb\xbf", text.as_bytes()].concat(), json!({})),
        ("utf16", utf_16, json!({})),
        ("gb18030", gb, json!({ "encoding": "gb18030" })),
        ("semicolons", semicolons.into_bytes(), json!({ "delimiter": "semicolon" })),
    ] {
        let file = folder.path().join(name);
        write(&file, bytes, 0);
        let made = CsvRecords::create(settings(&file, source), host());
        let mut plugin = made.expect("it is made");
        let list = until(&mut plugin, name, |list| !list.rows.is_empty());
        assert_eq!(list.rows[1].cells[1], "\u{6cb9}\u{6f06}", "{name}");
        assert_eq!(list.left_out, 0, "{name}");
    }
    // Of two encodings in one file the rows of one are told.
    let file = folder.path().join("mixed");
    let row = in_gb("3,=Q1,\u{6cb9}\u{6f06},2026-01-01,open,\n");
    write(&file, [text.as_bytes(), &row].concat(), 0);
    let list = until(&mut plugin(&file), "mixed", |list| list.left_out == 1);
    assert_eq!(list.rows.len(), 2);
}

#[test]
fn what_is_no_table_is_told_and_holds_nobody_up() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = |name: &str| folder.path().join(name);
    std::fs::create_dir(path("folder")).expect("it can be made");
    write(&path("empty"), "", 0);
    write(&path("header"), "WO,TEXT\n", 0);
    write(&path("twice"), GOOD.replacen("PRIO", "TEXT", 1), 0);
    write(&path("quote"), format!("\"{}", "x,\n".repeat(100_000)), 0);
    let huge = std::fs::File::create(path("huge")).expect("it can be made");
    huge.set_len(65 << 20).expect("a hole");
    let made = std::process::Command::new("mkfifo").arg(path("fifo")).status();
    assert!(made.is_ok_and(|status| status.success()));
    for (name, words) in [
        ("absent", "No such file"),
        ("folder", "no regular file"),
        ("fifo", "no regular file"),
        ("empty", "it is empty"),
        ("header", "there is no column 'EQUIPMENT'; it has 'WO', 'TEXT'"),
        ("twice", "column 'TEXT' is there twice"),
        ("quote", "is a quote not closed?"),
        ("huge", "more than 64 MiB"),
    ] {
        let begun = Instant::now();
        let mut plugin = plugin(&path(name));
        let list = until(&mut plugin, name, |list| list.fault.is_some());
        assert!(list.rows.is_empty() && list.as_of_unix_nanos.is_none());
        let fault = list.fault.expect("it has one");
        assert!(fault.contains(words), "{name}: {fault}");
        drop(plugin);
        assert!(begun.elapsed() < Duration::from_secs(5), "{name}: {:?}", begun.elapsed());
    }
}

#[test]
fn settings_that_cannot_work_are_refused() {
    let relative = CsvRecords::create(settings(Path::new("a.csv"), json!({})), host());
    let fault = relative.err().expect("it is refused").to_string();
    assert_eq!(fault, "lists[0].source.file: 'a.csv' is no absolute path");
    let source = json!({ "encoding": "klingon" });
    let unknown = CsvRecords::create(settings(Path::new("/a.csv"), source), host());
    let fault = unknown.err().expect("it is refused").to_string();
    assert!(fault.contains("lists[0].source.encoding: 'klingon' is no known encoding"), "{fault}");
}

#[test]
fn exports_of_other_countries_are_read() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("orders.csv");
    let text = "sep=;\nReport of today\nWO;EQUIPMENT;TEXT;REPORTED;STATE;PRIO\n\
        # a comment\n\
        1.234,0;=Q1;Paint;02.01.2026 03:04;open;1\n1.2;=Q1;Wrong;02.01.2026 03:04;open;1\n";
    write(&file, text, 0);
    let source = json!({ "decimal": ",", "thousands": ".", "skip_lines": 2, "comment": "#" });
    let mut settings = settings(&file, source);
    settings.lists[0].time_format = Some("%d.%m.%Y %H:%M".into());
    settings.lists[0].zone = Some("Europe/Berlin".into());
    let mut plugin = CsvRecords::create(settings, host()).expect("it is made");
    let list = until(&mut plugin, "rows", |list| !list.rows.is_empty());
    assert_eq!(list.rows[0].cells, ["1234.0", "Paint"]);
    assert_eq!(list.rows[0].unix_nanos, Some(1_767_319_440_000_000_000));
    let found = faults(&list);
    assert_eq!((found.len(), found[0].0), (1, 6));
    assert!(found[0].1.contains("'1.2' is no number where ','"), "{found:?}");
}

#[test]
fn settings_of_a_dialect_are_checked() {
    for (source, part) in [
        (json!({ "delimiter": "x" }), "lists[0].source.delimiter: 'x' is none of"),
        (json!({ "decimal": ";" }), "lists[0].source.decimal: ';' is neither"),
        (json!({ "thousands": "." }), "lists[0].source.thousands: the same as decimal"),
    ] {
        let made = CsvRecords::create(settings(Path::new("/a.csv"), source), host());
        let fault = made.err().expect("it is refused").to_string();
        assert!(fault.contains(part), "{fault}");
    }
    let mut zoned = settings(Path::new("/a.csv"), json!({}));
    zoned.lists[0].zone = Some("MEZ".into());
    let fault = CsvRecords::create(zoned, host()).err().expect("it is refused").to_string();
    assert!(fault.contains("lists[0].zone: 'MEZ' is no zone"), "{fault}");
}

/// Reads the greatest number of rows while the clock is polled.
#[test]
fn as_many_rows_as_there_may_be_are_read_and_more_are_refused() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("orders.csv");
    let mut text = GOOD.lines().next().expect("a header").to_owned() + "\n";
    for number in 0..busbar_plugin_sdk::MAX_RECORD_ROWS {
        text += &format!("{number},=Q{},Text of an order,2026-01-01,open,3\n", number % 900);
    }
    write(&file, &text, 0);
    let mut plugin = plugin(&file);
    let list = until(&mut plugin, "rows", |list| !list.rows.is_empty() || list.fault.is_some());
    assert_eq!((list.rows.len(), list.fault), (busbar_plugin_sdk::MAX_RECORD_ROWS, None));
    write(&file, text + "1,=Q1,One too many,2026-01-01,open,3\n", 60);
    let list = until(&mut plugin, "the fault", |list| list.fault.is_some());
    assert!(list.fault.is_some_and(|fault| fault.contains("more than 200000 rows")));
}
