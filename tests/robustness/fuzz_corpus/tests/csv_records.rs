//! Fuzzing of CSV records: any bytes are a table of records or faults. Rows match their columns,
//! faults have lines in order, and what is written reads the same again.

use std::sync::OnceLock;

use csv_records::ListSettings;
use csv_records::probe::{Read, read};
use serde_json::json;

const COLUMNS: [&str; 5] = ["ID", "COUNT", "TEXT", "DAY", "STATE"];
const LABELS: [&str; 4] = ["utf-8", "gb18030", "windows-1252", "shift_jis"];
const DELIMITERS: [&str; 3] = ["comma", "semicolon", "tab"];
/// Greatest length of a cell, bytes.
const MAX_CELL: usize = 1024;

/// Runs one input. Its first byte selects the encoding and the delimiter.
pub fn fuzz_one(bytes: &[u8]) -> bool {
    let Some((&kind, bytes)) = bytes.split_first() else { return false };
    let (label, delimiter) = (LABELS[usize::from(kind & 3)], usize::from(kind >> 2) % 3);
    let Ok(found) = read(list(delimiter), label, bytes) else { return false };
    let lines = bytes.iter().filter(|byte| **byte == b'\n').count() as u64 + 1;
    check(&found, lines);
    assert_eq!(written_and_read(&found).rows, found.rows);
    !found.rows.is_empty()
}

fn list(delimiter: usize) -> ListSettings<csv_records::CsvFile> {
    static LISTS: OnceLock<[ListSettings<csv_records::CsvFile>; 3]> = OnceLock::new();
    let made = |delimiter| {
        let list = json!({
            "title": "Work", "kind": "business",
            "source": { "file": "/nowhere.csv", "delimiter": delimiter },
            "equipment": "ID",
            "columns": [
                { "column": "COUNT", "type": "number" },
                { "column": "TEXT" },
                { "column": "DAY", "type": "date" },
                { "column": "STATE" },
            ],
            "time": "DAY",
            "open": { "column": "STATE", "closed": ["closed"] },
            "severity": { "column": "STATE", "critical": ["1"] },
        });
        serde_json::from_value(list).expect("it is a list")
    };
    LISTS.get_or_init(|| DELIMITERS.map(made))[delimiter].clone()
}

fn check(found: &Read, lines: u64) {
    assert!((found.rows.len() + found.faults.len()) as u64 <= lines, "{found:?}");
    for row in &found.rows {
        let [count, _, day, state] = &row.cells[..] else { panic!("{row:?}") };
        assert!(!row.equipment.is_empty() && !row.equipment.contains(char::is_control));
        assert!(count.is_empty() || count.parse().is_ok_and(f64::is_finite), "{count}");
        assert_eq!(day.is_empty(), row.unix_nanos.is_none(), "{day}");
        assert_eq!(row.is_open, state.to_lowercase() != "closed");
        assert_eq!(row.severity.is_some(), state == "1");
        assert!(row.cells.iter().all(|cell| cell.len() <= MAX_CELL && cell.trim() == cell));
    }
    let mut last = 1;
    for fault in &found.faults {
        assert!(last < fault.row && fault.row <= lines, "{fault:?} after {last}, of {lines}");
        assert!(!fault.reason.is_empty() && !fault.reason.contains(char::is_control));
        last = fault.row;
    }
}

fn written_and_read(found: &Read) -> Read {
    let mut writer = csv::Writer::from_writer(Vec::new());
    writer.write_record(COLUMNS).expect("it is written");
    for row in &found.rows {
        let cells = std::iter::once(&row.equipment).chain(&row.cells);
        writer.write_record(cells).expect("it is written");
    }
    let bytes = writer.into_inner().expect("it is written");
    let again = read(list(0), "utf-8", &bytes).expect("it is a table");
    assert_eq!(again.faults, []);
    again
}

#[test]
fn kept_inputs_and_mutations_of_them() {
    fuzz_corpus::check("csv_records", fuzz_one);
}
