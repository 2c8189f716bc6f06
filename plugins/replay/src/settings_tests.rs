use serde_json::json;

use super::*;

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
    assert!(config.csv.has_decimal_comma && config.csv.delimiter == b';');
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
        "csv.decimal: 'x' is none of",
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
    assert!(
        together(json!({"file": file, "csv": {"decimal": ","}}))
            .contains("the same as csv.delimiter")
    );
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
