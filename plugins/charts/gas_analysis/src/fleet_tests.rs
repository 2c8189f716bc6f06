//! A fleet from files: what is read, what is left out and why.

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use busbar_plugin_sdk::testing::host;
use rusqlite::Connection;

use crate::settings::FleetSettings;
use crate::*;

const ROWS: &str = "(equipment TEXT, time TEXT, H2, CH4, C2H6, C2H4, C2H2, O2, N2, load)";
/// Longest time of reading on a busy machine.
const MAX_WAIT: Duration = Duration::from_secs(30);

fn settings(file: &Path, query: Option<&str>) -> Settings {
    let mut fleet = format!("{{ \"file\": {:?}", file.display().to_string());
    if let Some(query) = query {
        fleet += &format!(", \"query\": {query:?}");
    }
    let fleet: FleetSettings = serde_json::from_str(&(fleet + " }")).unwrap();
    Settings { fleet: Some(fleet), ..Settings::default() }
}

fn plugin(file: &Path) -> GasAnalysis {
    GasAnalysis::create(settings(file, None), host()).unwrap()
}

/// Returns the fault of reading once.
fn fault(file: &Path, query: Option<&str>) -> String {
    let settings = settings(file, query);
    let fleet = settings.fleet.unwrap();
    source::read(&fleet, &Default::default()).map(|_| ()).unwrap_err()
}

/// Records once there are `count`.
fn wait_for(plugin: &mut GasAnalysis, count: usize) -> u64 {
    let begun = Instant::now();
    loop {
        let read = plugin.chart_records().map(|records| (records.records.len(), records.revision));
        match read {
            Ok((there, revision)) if there == count => return revision,
            other => assert!(begun.elapsed() < MAX_WAIT, "{other:?}"),
        }
        std::thread::sleep(Duration::from_millis(20));
    }
}

fn database(folder: &Path) -> (PathBuf, Connection) {
    let file = folder.join("samples.db");
    let connection = Connection::open(&file).unwrap();
    connection.execute_batch(&format!("CREATE TABLE samples {ROWS}")).unwrap();
    (file, connection)
}

fn insert(connection: &Connection, values: &str) {
    connection.execute(&format!("INSERT INTO samples VALUES ({values})"), []).unwrap();
}

#[test]
fn a_database_is_read_and_its_bad_rows_are_told_with_their_reasons() {
    let folder = tempfile::tempdir().unwrap();
    let (file, connection) = database(folder.path());
    insert(&connection, "'=T1', '2025-01-31', 10, 5, 3, 2, 0, 800, 60000, 0.5");
    insert(&connection, "'=T1', '2026-01-31', 12.5, '<1', NULL, 2, 0, 800, 60000, NULL");
    insert(&connection, "'=T2', 'yesterday', 10, 5, 3, 2, 0, 800, 60000, 0.5");
    insert(&connection, "'=T2', '2026-01-31', -1, 5, 3, 2, 0, 800, 60000, 0.5");
    insert(&connection, "'=T2', '2026-02-28', 1, 5, x'00', 2, 0, 800, 60000, 0.5");
    insert(&connection, "NULL, '2026-02-28', 1, 5, 3, 2, 0, 800, 60000, 0.5");
    let fleet = settings(&file, None).fleet.unwrap();
    let readings = source::read(&fleet, &Default::default()).unwrap();
    assert_eq!((readings.all.len(), readings.left_out), (2, 4));
    let faults = readings.faults.join("\n");
    for words in ["-1 ppm is negative", "a value is binary", "'yesterday' is no time", "not named"]
    {
        assert!(faults.contains(words), "{words}: {faults}");
    }
    assert!(readings.faults.iter().all(|fault| fault.starts_with("row ")));

    let mut plugin = plugin(&file);
    let first = wait_for(&mut plugin, 2);
    let records = plugin.chart_records().unwrap();
    assert_eq!(records.values[..5], [10.0, 5.0, 3.0, 2.0, 0.0]);
    assert!(records.values[5].is_nan(), "CO was not measured");
    // More rows are taken as they come.
    insert(&connection, "'=T2', '2026-03-31', 1, 5, 3, 2, 0, 800, 60000, 0.5");
    assert!(wait_for(&mut plugin, 3) > first);
    assert_eq!(plugin.describe_chart().unwrap().equipment, ["=T1", "=T2"]);
}

#[test]
fn what_is_no_database_or_holds_no_samples_is_told() {
    let folder = tempfile::tempdir().unwrap();
    let (file, connection) = database(folder.path());
    let no_table = fault(&file, Some("SELECT * FROM gases"));
    assert!(no_table.contains("samples.db") && no_table.contains("no such table: gases"));
    let lacking = fault(&file, Some("SELECT equipment, time, H2 FROM samples"));
    assert!(lacking.contains("lacks CH4, C2H6, C2H4, C2H2"), "{lacking}");
    let nameless = fault(&file, Some("SELECT H2, CH4, C2H6, C2H4, C2H2 FROM samples"));
    assert!(nameless.contains("needs the columns equipment and time"), "{nameless}");
    let write = fault(&file, Some("DELETE FROM samples"));
    assert!(!write.is_empty(), "nothing is written");
    // Somebody writes.
    connection.execute_batch("BEGIN EXCLUSIVE").unwrap();
    let locked = fault(&file, None);
    assert!(locked.contains("locked"), "{locked}");
    connection.execute_batch("ROLLBACK").unwrap();
    let absent = fault(&folder.path().join("absent.db"), None);
    assert!(absent.contains("there is no such file"), "{absent}");
    let other = folder.path().join("other.db");
    std::fs::write(&other, b"this is no database, whatever its name says").unwrap();
    assert!(fault(&other, None).contains("not a database"));
}

#[test]
fn a_file_that_goes_bad_leaves_the_samples_as_they_were() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("samples.csv");
    let header = "equipment,time,H2,CH4,C2H6,C2H4,C2H2,O2,N2\n";
    let rows = "=T1,2026-01-31,900,20,3,2,0,800,60000\n=T1,2026-01-31,1,2,3,4,5,6,7\n";
    std::fs::write(&file, format!("{header}{rows}")).unwrap();
    let mut plugin = plugin(&file);
    // Of two samples of one instant the first counts.
    let first = wait_for(&mut plugin, 1);
    for (text, why) in [
        ("H2,CH4\n".to_owned(), "the header lacks"),
        (format!("{header}=T1,2026-01-31,much,2,3,4,5,6,7\n"), "none of 1 rows is a sample"),
    ] {
        std::fs::write(&file, text).unwrap();
        let begun = Instant::now();
        let fault = loop {
            match plugin.chart_records() {
                Err(fault) if fault.to_string().contains(why) => break fault.to_string(),
                _ => assert!(begun.elapsed() < MAX_WAIT, "{why}"),
            }
            std::thread::sleep(Duration::from_millis(20));
        };
        assert!(fault.contains("samples.csv"), "{fault}");
    }
    let told = plugin.explain("=T1", i64::MAX).unwrap();
    assert!(told.verdict.contains("Status 3"), "{}", told.verdict);
    assert!(plugin.explain("=T1", 0).is_err(), "nothing was known then");
    // And it is well again once the file is.
    std::fs::write(&file, format!("{header}{rows}=T1,2026-02-28,1,2,3,4,5,6,7\n")).unwrap();
    assert!(wait_for(&mut plugin, 2) > first);
}
