//! SQLite files that other programs write.

use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};

use rusqlite::Connection;
use tempfile::TempDir;

use super::*;

/// A file in a folder of its own.
pub(super) struct Database {
    pub(super) folder: TempDir,
    pub(super) path: PathBuf,
}

impl Database {
    pub(super) fn with(commands: &str) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let database = Self { path: folder.path().join("values.db"), folder };
        database.sql(commands);
        database
    }

    /// Runs commands on a connection of their own.
    pub(super) fn sql(&self, commands: &str) {
        Connection::open(&self.path).unwrap().execute_batch(commands).unwrap();
    }

    pub(super) fn settings(&self, queries: &[serde_json::Value]) -> serde_json::Value {
        json!({"sqlite": {"path": self.path}, "queries": queries, "timeout_seconds": 2})
    }
}

/// A table of latest values with one row.
pub(super) const LATEST: &str = "CREATE TABLE latest (tag TEXT, reading REAL, at);
    INSERT INTO latest VALUES ('T1.Oil', 61.5, '2026-11-22 03:50:29')";
pub(super) const ASK: &str = "SELECT tag AS key, reading AS value FROM latest";

pub(super) fn oil(database: &Database) -> Running {
    let settings = database.settings(&[query("latest", ASK)]);
    start(settings, vec![key(1, "latest", "T1.Oil", ValueKind::F64)])
}

#[test]
fn every_type_comes_as_the_tag_has_it() {
    let database = Database::with("CREATE TABLE t (v)");
    let cases: [(&str, ValueKind, Result<Value, Reason>); 19] = [
        ("-9223372036854775808", ValueKind::I64, Ok(Value::I64(i64::MIN))),
        ("61.5", ValueKind::F64, Ok(Value::F64(61.5))),
        ("7.0", ValueKind::I64, Ok(Value::I64(7))),
        ("1", ValueKind::Bool, Ok(Value::Bool(true))),
        ("'62.5'", ValueKind::F64, Ok(Value::F64(62.5))),
        ("2", ValueKind::DoublePoint, Ok(Value::DoublePoint(DoublePoint::On))),
        ("NULL", ValueKind::F64, Err(Reason::Sensor)),
        ("9e999", ValueKind::F64, Err(Reason::NotFinite)),
        ("'open'", ValueKind::F64, Err(Reason::Configuration)),
        ("x'00ff'", ValueKind::F64, Err(Reason::Configuration)),
        ("CAST(x'ff' AS TEXT)", ValueKind::F64, Err(Reason::Configuration)),
        ("hex(zeroblob(400000))", ValueKind::F64, Err(Reason::Configuration)),
        ("'Hand ⚡'", ValueKind::Text, Ok(text("Hand ⚡"))),
        ("''", ValueKind::Text, Ok(text(""))),
        ("-9223372036854775808", ValueKind::Text, Ok(text("-9223372036854775808"))),
        ("7.0", ValueKind::Text, Err(Reason::Configuration)),
        ("x'00ff'", ValueKind::Text, Err(Reason::Configuration)),
        ("NULL", ValueKind::Text, Err(Reason::Sensor)),
        ("printf('%255s', 'x')", ValueKind::Text, Ok(text(&format!("{:>255}", "x")))),
    ];
    let columns: Vec<_> =
        cases.iter().enumerate().map(|(index, (sql, ..))| format!("{sql} AS c{index}")).collect();
    let settings = database.settings(&[query("all", &format!("SELECT {}", columns.join(", ")))]);
    let tags = cases.iter().enumerate();
    let tags =
        tags.map(|(index, (_, kind, _))| column(index as u32, "all", &format!("c{index}"), *kind));
    let running = start(settings, tags.collect());
    for (tag, (sql, _, expected)) in cases.iter().enumerate() {
        match expected {
            Ok(value) => running.wait_for(tag as u32, value.clone()),
            Err(reason) => running.wait_for_bad(tag as u32, *reason),
        }
        let found = running.recorder.latest(tag as u32).unwrap();
        assert_eq!(found.value.is_some(), expected.is_ok(), "{sql}: {found:?}");
    }
}

#[test]
fn texts_that_are_cut_or_no_utf8_are_uncertain() {
    let database = Database::with("CREATE TABLE t (v)");
    let sql = "SELECT CAST(x'415554ff' AS TEXT) AS a, printf('%256s', 'x') AS b";
    let settings = database.settings(&[query("q", sql)]);
    let tags = ["a", "b"].into_iter().zip(0..);
    let running =
        start(settings, tags.map(|(name, tag)| column(tag, "q", name, ValueKind::Text)).collect());
    let blanks = " ".repeat(252);
    for (tag, expected) in [(0, "AUT\u{fffd}".to_owned()), (1, format!("{blanks}…"))] {
        running.wait("text", tag, |sample| {
            sample.value == Some(text(&expected))
                && sample.quality == Quality::Uncertain(Reason::Configuration)
        });
    }
}

#[test]
fn its_own_times_are_utc() {
    let database = Database::with(LATEST);
    let sql = "SELECT tag AS key, reading AS value, at AS time FROM latest";
    let settings = database.settings(&[query("latest", sql)]);
    let running = start(settings, vec![key(1, "latest", "T1.Oil", ValueKind::F64)]);
    let expected = std::time::UNIX_EPOCH + Duration::from_secs(1_795_319_429);
    running.wait("sample", 1, |sample| sample.source_time == Some(expected));
    database.sql("UPDATE latest SET at = 'last week'");
    running.wait_for_quality(1, Quality::Uncertain(Reason::SourceTime));
    // Rows are rewritten with older times, as by a clock that was set back: they count.
    database.sql("UPDATE latest SET reading = 7, at = '2026-11-22 03:50:09'");
    let older = expected - Duration::from_secs(20);
    running.wait("older time", 1, |sample| {
        sample.value == Some(Value::F64(7.0))
            && sample.quality.is_good()
            && sample.source_time == Some(older)
            && sample.flags == SampleFlags::LIVE
    });
    database.sql("UPDATE latest SET at = unixepoch('2026-11-22 03:50:29')");
    running.wait("sample", 1, |sample| {
        sample.source_time == Some(expected) && sample.quality.is_good()
    });
}

#[test]
fn a_query_that_fails_marks_only_its_tags() {
    let database = Database::with(LATEST);
    let endless = "WITH RECURSIVE n(v) AS (SELECT 1 UNION ALL SELECT v + 1 FROM n) ";
    let queries = [
        ("missing", "SELECT v FROM no_such_table".to_owned(), Reason::Configuration),
        ("slow", format!("{endless} SELECT max(v) AS v FROM n"), Reason::Communication),
        ("many", format!("{endless} SELECT 'k' AS key, v AS value FROM n"), Reason::Configuration),
        ("long", "SELECT hex(zeroblob(1000000)) AS v".to_owned(), Reason::Configuration),
        ("two", "SELECT 1 AS v; SELECT 2 AS v".to_owned(), Reason::Configuration),
        ("parameter", "SELECT ? AS v".to_owned(), Reason::Configuration),
        (
            "insert",
            "INSERT INTO latest VALUES (1, 2, 3) RETURNING 1 AS v".to_owned(),
            Reason::Configuration,
        ),
        ("pragma", "PRAGMA query_only = OFF".to_owned(), Reason::Configuration),
        ("attach", "ATTACH 'other.db' AS other".to_owned(), Reason::Configuration),
        ("none", "SELECT 1 AS v WHERE 0".to_owned(), Reason::Sensor),
    ];
    let mut settings: Vec<_> = queries.iter().map(|(name, sql, _)| query(name, sql)).collect();
    settings.push(query("latest", ASK));
    let mut settings = database.settings(&settings);
    settings["timeout_seconds"] = json!(0.3);
    let mut tags: Vec<_> = queries
        .iter()
        .enumerate()
        .map(|(index, (name, ..))| match *name {
            "many" => key(index as u32, name, "a", ValueKind::F64),
            _ => column(index as u32, name, "v", ValueKind::F64),
        })
        .collect();
    tags.push(key(100, "latest", "T1.Oil", ValueKind::F64));
    let running = start(settings, tags);
    for (tag, (_, _, reason)) in queries.iter().enumerate() {
        running.wait_for_bad(tag as u32, *reason);
    }
    running.wait_for_link(LinkState::Up, "query 'slow': it took longer than 300 ms");
    running.wait_for_link(LinkState::Up, "query 'many': it gave more than 100000 rows");
    running.wait_for_link(LinkState::Up, "query 'long': a value has more than 1048576 bytes");
    running.wait_for(100, Value::F64(61.5));
    let links = running.recorder.recording().links;
    assert!(links.iter().all(|(state, _)| *state != LinkState::Down), "{links:?}");
    let rows = "SELECT count(*) FROM latest";
    let connection = Connection::open(&database.path).unwrap();
    let count: i64 = connection.query_row(rows, [], |row| row.get(0)).unwrap();
    assert_eq!(count, 1, "nothing was written");
    assert!(!database.folder.path().join("other.db").exists());
}

#[test]
fn stopping_ends_a_query() {
    let database = Database::with(LATEST);
    let sql =
        "WITH RECURSIVE n(v) AS (SELECT 1 UNION ALL SELECT v + 1 FROM n) SELECT max(v) AS v FROM n";
    let mut settings = database.settings(&[query("endless", sql)]);
    settings["timeout_seconds"] = json!(600);
    let mut running = start(settings, vec![column(1, "endless", "v", ValueKind::I64)]);
    running.wait_for_link(LinkState::Up, "connected");
    running.plugin.stop();
    let threads = std::fs::read_dir("/proc/self/task").unwrap().flatten();
    let names = threads.filter_map(|task| std::fs::read_to_string(task.path().join("comm")).ok());
    assert_eq!(names.filter(|name| name.trim() == "sqlite").count(), 0);
}

/// Writes in another process with another build of SQLite: counts up, ten thousand times
/// a transaction each, and then leaves a row that says so.
const WRITER: &str = "
import sqlite3, sys
connection = sqlite3.connect(sys.argv[1], isolation_level=None)
connection.execute('PRAGMA journal_mode = WAL')
connection.execute('PRAGMA synchronous = OFF')
connection.execute('PRAGMA wal_autocheckpoint = 50')
for n in range(1, 10001):
    connection.execute('UPDATE latest SET reading = ?', (n,))
";

fn writer(path: &Path) -> Option<Child> {
    let root = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../../.."));
    let ours = std::env::var_os("BUSBAR_PYTHON").map(PathBuf::from);
    let venv = root.join("target/venv/bin/python");
    let python = ours.or_else(|| venv.exists().then_some(venv)).unwrap_or("python3".into());
    let mut command = Command::new(&python);
    let works = command.args(["-c", "import sqlite3"]).stderr(Stdio::null()).status();
    let works = works.is_ok_and(|status| status.success());
    let remedy = "no Python with sqlite3: run `cargo xtask test`, or set BUSBAR_PYTHON";
    available(works, remedy)
        .then(|| Command::new(python).args(["-c", WRITER]).arg(path).spawn().unwrap())
}

#[test]
fn a_writer_at_work_is_followed() {
    let database = Database::with(LATEST);
    database.sql("PRAGMA journal_mode = WAL");
    let Some(mut writer) = writer(&database.path) else { return };
    let running = oil(&database);
    assert!(writer.wait().unwrap().success(), "reading never holds a writer up");
    running.wait_for(1, Value::F64(10_000.0));
    let samples = running.recorder.recording().samples;
    let values: Vec<_> = samples
        .iter()
        .filter_map(|sample| match sample.value {
            Some(Value::F64(value)) => Some(value),
            _ => None,
        })
        .collect();
    // Before the writer's first step there is the first value.
    let counted = values.iter().skip_while(|value| **value == 61.5).copied();
    assert!(counted.is_sorted(), "{values:?}");
}

#[test]
fn a_value_in_another_unit_than_its_tag_is_never_good() {
    let bad = Quality::Bad(Reason::Configuration);
    let cases = [
        ("MW", "'MW'", Quality::Good),
        ("MW", "'kW'", bad),
        ("°C", "'degF'", bad),
        ("A", "'apples'", Quality::Good),
        ("A", "NULL", Quality::Good),
        ("A", "7", Quality::Uncertain(Reason::Configuration)),
        ("", "'kW'", Quality::Good),
    ];
    let rows: Vec<_> = cases
        .iter()
        .enumerate()
        .map(|(index, (_, unit, _))| format!("('{index}', 61.5, {unit})"))
        .collect();
    let database = Database::with(&format!(
        "CREATE TABLE latest (tag TEXT, reading REAL, unit); INSERT INTO latest VALUES {}",
        rows.join(", ")
    ));
    let ask = "SELECT tag AS key, reading AS value, unit FROM latest";
    let one = "SELECT reading, unit AS u FROM latest WHERE tag = '1'";
    let settings = database.settings(&[query("latest", ask), query("one", one)]);
    let with_unit = |spec: TagSpec, unit: &str| TagSpec { unit: unit.into(), ..spec };
    let of = |(index, (unit, ..)): (u32, &(&str, _, _))| {
        with_unit(key(index, "latest", &index.to_string(), ValueKind::F64), unit)
    };
    let mut tags: Vec<_> = (0..).zip(&cases).map(of).collect();
    for (index, unit) in [(50, "MW"), (51, "kW")] {
        let mut spec = with_unit(column(index, "one", "reading", ValueKind::F64), unit);
        spec.address["unit"] = json!("u");
        tags.push(spec);
    }
    let running = start(settings, tags);
    running.wait_for_bad(50, Reason::Configuration);
    running.wait_for(51, Value::F64(61.5));
    for (index, (unit, stated, quality)) in (0..).zip(&cases) {
        running.wait_for_quality(index, *quality);
        let has_good = running.samples(index).iter().any(|sample| sample.quality.is_good());
        assert_eq!(has_good, quality.is_good(), "{unit} {stated}");
    }
}
