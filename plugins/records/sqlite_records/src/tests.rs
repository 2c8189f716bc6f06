//! Tests with databases of all kinds: good, locked, cut short, changing, gone.

use std::path::Path;
use std::time::{Duration, Instant};

use busbar_plugin_sdk::testing::host;
use busbar_plugin_sdk::{Plugin, RecordKind, RecordList, Records};
use rusqlite::Connection;
use serde_json::json;

use crate::{Settings, SqliteRecords};

/// Longest wait for a change to be read.
const MAX_WAIT: Duration = Duration::from_secs(20);
const QUERY: &str = "SELECT id, maker, built, volts FROM assets ORDER BY id";

fn plugin(file: &Path, query: &str) -> SqliteRecords {
    let list = json!({
        "title": "Asset register", "kind": "asset",
        "source": { "file": file, "query": query }, "equipment": "id",
        "columns": [
            { "column": "maker", "name": "Maker" },
            { "column": "built", "name": "Year", "type": "number" },
            { "column": "volts", "name": "Rated voltage", "type": "number", "unit": "kV" },
        ],
    });
    let settings: Settings =
        serde_json::from_value(json!({ "lists": [list] })).expect("they are settings");
    SqliteRecords::create(settings, host()).expect("it is made")
}

fn until(
    plugin: &mut SqliteRecords,
    what: &str,
    holds: impl Fn(&RecordList) -> bool,
) -> RecordList {
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

fn database(file: &Path) -> Connection {
    let database = Connection::open(file).expect("it can be made");
    let sql = "CREATE TABLE assets (id TEXT, maker TEXT, built INTEGER, volts REAL);
        INSERT INTO assets VALUES ('=Q1-QA1', 'Alpha', 1998, 245.0), ('=Q2-QA1', NULL, 2004, 252.5);";
    database.execute_batch(sql).expect("it takes rows");
    database
}

#[test]
fn rows_are_read_and_read_again_whether_written_in_place_or_ahead() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("assets.db");
    let database = database(&file);
    let mut plugin = plugin(&file, QUERY);
    let list = until(&mut plugin, "rows", |list| list.rows.len() == 2);
    assert_eq!((list.kind, list.source.as_str()), (RecordKind::Asset, "assets.db"));
    assert_eq!(list.columns[2].unit, "kV");
    assert_eq!(list.rows[0].cells, ["Alpha", "1998", "245"]);
    assert_eq!(list.rows[1].cells, ["", "2004", "252.5"], "what is NULL is empty");
    database.execute("UPDATE assets SET maker = 'Beta'", []).expect("it is written");
    until(&mut plugin, "the change", |list| list.rows[0].cells[0] == "Beta");
    database.pragma_update(None, "journal_mode", "wal").expect("it is set");
    database.execute("UPDATE assets SET maker = 'Gamma'", []).expect("it is written");
    until(&mut plugin, "a change ahead", |list| list.rows[0].cells[0] == "Gamma");
}

#[test]
fn what_is_locked_cut_short_or_gone_keeps_its_rows_and_says_so() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("assets.db");
    let database = database(&file);
    let mut plugin = plugin(&file, QUERY);
    until(&mut plugin, "rows", |list| list.rows.len() == 2);
    database.execute("UPDATE assets SET maker = 'Beta'", []).expect("it is written");
    database.execute_batch("BEGIN EXCLUSIVE; UPDATE assets SET built = 1;").expect("a lock");
    // It may have read the rows before the lock; what is new it cannot read.
    let touched = std::fs::File::options().append(true).open(&file).expect("it is there");
    touched.set_modified(std::time::SystemTime::now() + Duration::from_secs(60)).expect("touched");
    let begun = Instant::now();
    let list = until(&mut plugin, "the lock", |list| list.fault.is_some());
    assert!(list.fault.is_some_and(|fault| fault.contains("another program")));
    assert_eq!(list.rows.len(), 2);
    assert!(begun.elapsed() < Duration::from_secs(5), "{:?}", begun.elapsed());
    database.execute_batch("ROLLBACK").expect("no lock");
    until(&mut plugin, "the rest", |list| list.fault.is_none());
    drop(database);

    let bytes = std::fs::read(&file).expect("it is there");
    std::fs::write(&file, &bytes[..bytes.len() / 2]).expect("it can be cut");
    let list = until(&mut plugin, "that it is cut", |list| list.fault.is_some());
    assert_eq!(list.rows.len(), 2);
    std::fs::write(&file, "no database at all, but some text").expect("it can be written");
    let is_other = |list: &RecordList| {
        list.fault.as_ref().is_some_and(|fault| fault.contains("not a database"))
    };
    until(&mut plugin, "that it is none", is_other);
    std::fs::remove_file(&file).expect("it is there");
    let is_gone =
        |list: &RecordList| list.fault.as_ref().is_some_and(|f| f.contains("No such file"));
    until(&mut plugin, "that it is gone", is_gone);
    std::fs::write(&file, &bytes).expect("it can be written");
    until(&mut plugin, "that it is back", |list| list.fault.is_none());
}

#[test]
fn bad_rows_are_told_with_their_numbers_and_the_rest_goes_on() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("assets.db");
    let database = database(&file);
    let sql = "INSERT INTO assets VALUES (NULL, 'x', 1, 1), ('=Q3', x'00ff', 1, 1),
        ('=Q4', CAST(x'ff41' AS TEXT), 1, 1), ('=Q5', 'x', 'old', 1), ('=Q6', 'x', 1, 9e999),
        ('=Q7', 'good', 1, 1);";
    database.execute_batch(sql).expect("it takes rows");
    let mut plugin = plugin(&file, "SELECT * FROM assets ORDER BY rowid");
    let list = until(&mut plugin, "rows", |list| !list.rows.is_empty());
    let last = list.rows.last().expect("a row");
    assert_eq!((list.rows.len(), last.cells[0].as_str()), (3, "good"));
    let found: Vec<_> = list.faults.iter().map(|f| (f.row, f.reason.as_str())).collect();
    for ((row, reason), (number, words)) in found.iter().zip([
        (3, "it names no equipment"),
        (4, "column 'maker': it is binary"),
        (5, "column 'maker': it is not UTF-8"),
        (6, "column 'built': 'old' is no number"),
        (7, "column 'volts': 'inf' is no number"),
    ]) {
        assert!(*row == number && reason.contains(words), "{row}: {reason}");
    }
    assert_eq!(found.len(), 5);
}

#[test]
fn queries_that_cannot_work_are_told() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("assets.db");
    drop(database(&file));
    for (query, words) in [
        ("SELECT 1 AS id", "there is no column 'maker'; it has 'id'"),
        ("SELECT id, maker, built, volts FROM assets WHERE id = ?", "has parameters"),
        ("DELETE FROM assets", "does not only read"),
        ("SELECT nonsense", "no such column"),
        ("SELEKT", "syntax error"),
    ] {
        let list = until(&mut plugin(&file, query), query, |list| list.fault.is_some());
        let fault = list.fault.expect("it has one");
        assert!(fault.contains(words), "{query}: {fault}");
    }
    assert_eq!(until(&mut plugin(&file, QUERY), "rows", |l| !l.rows.is_empty()).rows.len(), 2);
}

#[test]
fn a_query_without_end_is_ended_with_the_plugin() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("assets.db");
    drop(database(&file));
    let endless = "WITH RECURSIVE n(x) AS (SELECT 1 UNION ALL SELECT x + 1 FROM n)
        SELECT x AS id, x AS maker, x AS built, x AS volts FROM n WHERE x < 0";
    let begun = Instant::now();
    let mut plugin = plugin(&file, endless);
    assert!(plugin.records().expect("it answers").lists[0].rows.is_empty());
    drop(plugin);
    assert!(begun.elapsed() < Duration::from_secs(6), "{:?}", begun.elapsed());
}
