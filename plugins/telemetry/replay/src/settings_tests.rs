use serde_json::json;

use super::*;
use crate::table::Column;

fn parse(json: serde_json::Value) -> Result<Config, Error> {
    serde_json::from_value::<Settings>(json).expect("well-formed").parse()
}

#[test]
fn defaults_play_at_the_recorded_pace() {
    let config = parse(json!({"file": "/a/b.CFG"})).unwrap();
    assert_eq!((config.format, config.speed, config.is_loop), (Format::Comtrade, Some(1.0), false));
    assert_eq!((config.times, config.max_updates_per_second), (Times::Now, Some(20.0)));
    assert_eq!((config.start, config.end), (None, None));
    assert_eq!(config.csv.time, Column::Name("time".into()));
}

#[test]
fn what_is_typed_is_meant() {
    let config = parse(json!({
        "file": "/a/b.txt", "format": "csv", "speed": "as_fast_as_possible",
        "start": "2024-02-29T13:14:15Z", "end": 7.5, "times": "original",
        "max_updates_per_second": 0,
        "csv": {"time": 3, "time_format": "unix_millis", "delimiter": ";", "decimal": ","}
    }))
    .unwrap();
    assert_eq!((config.format, config.speed), (Format::Csv, None));
    assert_eq!(config.start, Some(Moment::Unix(1_709_212_455_000_000_000)));
    assert_eq!(config.end, Some(Moment::Offset(7_500_000_000)));
    assert_eq!((config.times, config.max_updates_per_second), (Times::Original, None));
    assert_eq!(config.csv.time, Column::Number(3));
    assert_eq!(config.csv.numbers.parse_f64("1,5"), Ok(1.5));
    assert_eq!(config.csv.dialect.delimiter.unwrap().byte(), b';');
}

#[test]
fn every_fault_is_named() {
    let error = parse(json!({
        "file": "recording", "speed": 0.01, "loop": true, "times": "original",
        "start": -1, "end": "yesterday", "max_updates_per_second": -1, "utc_offset_minutes": 900,
        "csv": {"time": 0, "name": "", "delimiter": "ab", "decimal": "x"}
    }))
    .unwrap_err();
    for part in [
        "file: 'recording' is no absolute path",
        "format: the file's name ends in none of .cfg, .cff, .csv",
        "speed: 0.01 is not within 0.1 to 1000",
        "loop: not with times original",
        "start: -1 is not within 0 to",
        "end: 'yesterday' is no time such as",
        "max_updates_per_second: -1 is not within 0 to 100000",
        "utc_offset_minutes: 900 is not within -840 to 840",
        "csv.time: columns are counted from 1",
        "csv.name: a name has 1 to",
        "csv.delimiter: 'ab' is none of",
        "csv.decimal: 'x' is neither . nor ,",
    ] {
        assert!(error.message().contains(part), "{part}: {}", error.message());
    }
    let together = |json| parse(json).unwrap_err().message().to_owned();
    let file = "/a.csv";
    assert!(
        together(json!({"file": file, "loop": true, "speed": "as_fast_as_possible"}))
            .contains("not with as_fast_as_possible")
    );
    assert!(
        together(json!({"file": file, "start": 2, "end": 2})).contains("end: must be after start")
    );
}

#[test]
fn faults_of_a_tables_settings_are_named() {
    let error = parse(json!({
        "file": "/a.csv", "zone": "Nowhere", "encoding": "morse",
        "csv": {
            "time_format": "dd.mm.yyyy", "zone": "MEZ", "encoding": "x", "thousands": ".",
            "header": false, "skip_lines": 99_999, "comment": ""
        }
    }))
    .unwrap_err();
    for part in [
        "zone: 'Nowhere' is no zone",
        "encoding: 'morse' is no known encoding",
        "csv.time_format: 'dd.mm.yyyy' is none of rfc3339",
        "csv.zone: 'MEZ' is no zone: write a name of the IANA data base such as Europe/Berlin",
        "csv.encoding: 'x' is no known encoding",
        "csv.thousands: the same as decimal",
        "csv.time: without a header (csv.header is false) columns have numbers alone",
        "csv.skip_lines: 99999 is not within",
        "csv.comment: give 1 to",
    ] {
        assert!(error.message().contains(part), "{part}: {}", error.message());
    }
    // Of a decimal comma the delimiter is a semicolon, unless something says another.
    let german = parse(json!({"file": "/a.csv", "csv": {"decimal": ","}})).unwrap();
    assert_eq!(german.csv.dialect.fallback.byte(), b';');
}

#[test]
fn nothing_unknown_is_ignored() {
    for json in [
        json!({"file": "/a.csv", "sped": 1}),
        json!({"file": "/a.csv", "speed": "slow"}),
        json!({"file": "/a.csv", "csv": {"tim": 1}}),
    ] {
        assert!(serde_json::from_value::<Settings>(json.clone()).is_err(), "{json}");
    }
}
