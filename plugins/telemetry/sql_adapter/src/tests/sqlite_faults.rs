//! Files that go, change, lock or break.

use std::fs;

use rusqlite::Connection;

use super::sqlite::{ASK, Database, LATEST, oil};
use super::*;

#[test]
fn a_file_that_goes_leaves_nothing_good_and_is_found_again() {
    let database = Database::with(LATEST);
    let running = oil(&database);
    running.wait_for(1, Value::F64(61.5));
    let aside = database.folder.path().join("aside.db");
    fs::rename(&database.path, &aside).unwrap();
    running.wait_for_bad(1, Reason::Communication);
    running.wait_for_link(LinkState::Down, "it cannot be opened: No such file");
    fs::rename(&aside, &database.path).unwrap();
    running.wait_for(1, Value::F64(61.5));
    // A folder is none.
    fs::rename(&database.path, &aside).unwrap();
    fs::create_dir(&database.path).unwrap();
    running.wait_for_link(LinkState::Down, "it is no file");
    running.wait_for_bad(1, Reason::Communication);
}

#[test]
fn a_file_in_its_place_is_the_one_that_is_read() {
    let database = Database::with(LATEST);
    let running = oil(&database);
    running.wait_for(1, Value::F64(61.5));
    let other = Database::with(LATEST);
    other.sql("UPDATE latest SET reading = 99");
    // On the same file system, so that it happens at once.
    let beside = database.folder.path().join("new.db");
    fs::copy(&other.path, &beside).unwrap();
    fs::rename(&beside, &database.path).unwrap();
    running.wait_for(1, Value::F64(99.0));
    let links = running.recorder.recording().links;
    assert!(links.iter().all(|(state, _)| *state != LinkState::Down), "{links:?}");
}

#[test]
fn a_file_that_is_locked_is_said_to_be() {
    let database = Database::with(LATEST);
    let running = oil(&database);
    running.wait_for(1, Value::F64(61.5));
    let writer = Connection::open(&database.path).unwrap();
    writer.execute_batch("BEGIN EXCLUSIVE; UPDATE latest SET reading = 70").unwrap();
    running.wait_for_bad(1, Reason::Communication);
    running.wait_for_link(LinkState::Up, "another program writes");
    writer.execute_batch("COMMIT").unwrap();
    running.wait_for(1, Value::F64(70.0));
}

#[test]
fn a_file_that_breaks_leaves_nothing_good() {
    let database = Database::with(LATEST);
    database.sql(
        "WITH RECURSIVE n(v) AS (SELECT 1 UNION ALL SELECT v + 1 FROM n LIMIT 2000)
                  INSERT INTO latest SELECT 'more' || v, v, NULL FROM n",
    );
    let whole = fs::read(&database.path).unwrap();
    let running = oil(&database);
    running.wait_for(1, Value::F64(61.5));
    for what in ["no database", "pages of noise", "cut short"] {
        let mut bytes = whole.clone();
        match what {
            "no database" => bytes[..16].copy_from_slice(b"no database here"),
            "cut short" => bytes.truncate(whole.len() / 2),
            _ => bytes[4096..].iter_mut().for_each(|byte| *byte ^= 0xA5),
        }
        running.recorder.clear();
        fs::write(&database.path, bytes).unwrap();
        running.wait_for_bad(1, Reason::Communication);
        running.wait_for_link(LinkState::Down, "it cannot be read");
        // Another file, so that it is not read out of the library's memory.
        let beside = database.folder.path().join("whole.db");
        fs::write(&beside, &whole).unwrap();
        fs::rename(&beside, &database.path).unwrap();
        running.wait_for(1, Value::F64(61.5));
        println!("{what}: found and got over");
    }
    // An empty file is a database without tables.
    fs::write(&database.path, "").unwrap();
    running.wait_for_bad(1, Reason::Configuration);
    running.wait_for_link(LinkState::Up, "no such table");
}

#[test]
fn a_file_that_is_not_there_at_first_is_waited_for() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("values.db");
    let settings = json!({"sqlite": {"path": path}, "queries": [query("latest", ASK)]});
    let running = start(settings, vec![key(1, "latest", "T1.Oil", ValueKind::F64)]);
    running.wait_for_link(LinkState::Down, "it cannot be opened");
    assert!(!path.exists(), "reading makes no file");
    Connection::open(&path).unwrap().execute_batch(LATEST).unwrap();
    running.wait_for(1, Value::F64(61.5));
}
