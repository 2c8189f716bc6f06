use busbar_plugin_sdk::testing::tag_spec;
use busbar_plugin_sdk::{DoublePoint, Quality, Sample, TagSpec, Text, Value, ValueKind};
use serde_json::json;

use crate::probe::{Bytes, play};

use super::*;

/// Samples of a table: tag, milliseconds from the first row, value, quality.
type Found = Vec<(u32, u64, Option<Value>, Quality)>;

fn read(csv: serde_json::Value, tags: &[TagSpec], text: &str) -> Result<Found, String> {
    let settings = json!({"file": "/a.csv", "max_updates_per_second": 0, "csv": csv});
    let settings = serde_json::from_value(settings).unwrap();
    let mut found = Vec::new();
    let keep = |batch: &[Sample]| {
        found.extend(batch.iter().map(|sample| {
            let since = sample.source_time.unwrap().duration_since(std::time::UNIX_EPOCH).unwrap();
            (sample.tag, since.as_millis() as u64, sample.value.clone(), sample.quality)
        }));
    };
    let played = play(settings, tags, Bytes::Csv(text.into()), keep);
    played.map(|()| found).map_err(|error| error.message().to_owned())
}

fn f64_of(column: &str, tag: u32) -> TagSpec {
    tag_spec(tag, column, ValueKind::F64, json!({"column": column}))
}

fn good(tag: u32, millis: u64, value: f64) -> (u32, u64, Option<Value>, Quality) {
    (tag, millis, Some(Value::F64(value)), Quality::Good)
}

fn missing(tag: u32, millis: u64) -> (u32, u64, Option<Value>, Quality) {
    (tag, millis, None, Quality::Bad(Reason::Sensor))
}

#[test]
fn a_column_is_a_signal() {
    let text = "\u{feff}time,Oil,\"Load, A\"\r\n2024-02-29T13:14:15Z,55.5,1\r\n2024-02-29T14:14:15.25+01:00,\"56\",-2e3\r\n";
    let tags = [f64_of("Oil", 1), f64_of("Load, A", 2)];
    let found = read(json!({}), &tags, text).unwrap();
    assert_eq!(
        found,
        [good(1, 0, 55.5), good(2, 0, 1.0), good(1, 250, 56.0), good(2, 250, -2000.0)]
    );
}

#[test]
fn a_row_is_a_value() {
    let text = "t;n;v;q\n1,5;A;1,25;good\n1,5;B;1;192\n2;C;9;good\n2,5;A;2;uncertain\n3;A;3;bad\n3;B;0;64\n4;A;;good\n";
    let csv = json!({"form": "long", "time": "t", "name": "n", "value": "v", "quality": "q",
        "time_format": "seconds", "delimiter": ";", "decimal": ","});
    let tag = |id: &str, tag, kind| tag_spec(tag, id, kind, json!({"name": id}));
    let tags = [tag("A", 1, ValueKind::F64), tag("B", 2, ValueKind::Bool)];
    let uncertain = Quality::Uncertain(Reason::Unknown);
    assert_eq!(
        read(csv, &tags, text).unwrap(),
        [
            good(1, 0, 1.25),
            (2, 0, Some(Value::Bool(true)), Quality::Good),
            (1, 1000, Some(Value::F64(2.0)), uncertain),
            (1, 1500, Some(Value::F64(3.0)), Quality::Bad(Reason::Unknown)),
            (2, 1500, Some(Value::Bool(false)), uncertain),
            missing(1, 2500),
        ]
    );
}

#[test]
fn every_time_format_is_read() {
    for (format, first, second) in [
        ("rfc3339", "1999-12-31T23:59:59.9Z", "2000-01-01T00:00:00.4Z"),
        ("unix_seconds", "1700000000.9", "1700000001.4"),
        ("unix_millis", "1700000000900", "1700000001400"),
        ("seconds", "-0.25", "0.25"),
    ] {
        let text = format!("a,time\n1,{first}\n2,{second}\n");
        let found = read(json!({"time_format": format}), &[f64_of("a", 1)], &text).unwrap();
        assert_eq!(found, [good(1, 0, 1.0), good(1, 500, 2.0)], "{format}");
    }
}

#[test]
fn every_kind_is_read() {
    let text = "time,i,b,d,off,on\n0,-7,true,closed,1,0\n1,1.5,OFF,0,0,0\n2,8,maybe,5,,1\n";
    let tag = |tag, kind, address| tag_spec(tag, "t", kind, address);
    let tags = [
        tag(1, ValueKind::I64, json!({"column": "i"})),
        tag(2, ValueKind::Bool, json!({"column": 3})),
        tag(3, ValueKind::DoublePoint, json!({"column": "d"})),
        tag(4, ValueKind::DoublePoint, json!({"off": "off", "on": "on"})),
    ];
    let found = read(json!({"time_format": "seconds"}), &tags, text).unwrap();
    let values: Vec<_> = found.iter().map(|(_, _, value, _)| value.clone()).collect();
    let position = |position| Some(Value::DoublePoint(position));
    assert_eq!(
        values,
        [
            Some(Value::I64(-7)),
            Some(Value::Bool(true)),
            position(DoublePoint::On),
            position(DoublePoint::Off),
            None,
            Some(Value::Bool(false)),
            position(DoublePoint::Intermediate),
            position(DoublePoint::Intermediate),
            Some(Value::I64(8)),
            None,
            None,
            None,
        ]
    );
    assert!(found.iter().all(|(.., value, quality)| value.is_some() == quality.is_good()));
}

#[test]
fn texts_are_cells_as_they_stand() {
    let long = "x".repeat(256);
    let cut = format!("{}…", "x".repeat(252));
    let table = format!(
        "time,m,q\n0,AUTO,good\n1,\"Hand; local\",bad\n2,1.50 kV,good\n3,shutdown,good\n\
         4,,good\n5,AUTO,good\n6,AUTO,good\n7,{long},good\n8,{long},bad\n"
    );
    let text = |text: &str| Some(Value::Text(Text::cut(text)));
    let tags = [tag_spec(1, "m", ValueKind::Text, json!({"column": "m", "quality": "q"}))];
    let csv = |no_value: serde_json::Value| -> serde_json::Value {
        json!({"time_format": "seconds", "no_value": no_value, "units_row": false})
    };
    let bad = Quality::Bad(Reason::Unknown);
    let mut expected = vec![
        (1, 0, text("AUTO"), Quality::Good),
        (1, 1000, text("Hand; local"), bad),
        (1, 2000, text("1.50 kV"), Quality::Good),
        (1, 3000, text("shutdown"), Quality::Good),
        missing(1, 4000),
        (1, 5000, text("AUTO"), Quality::Good),
        (1, 6000, text("AUTO"), Quality::Good),
        (1, 7000, text(&cut), Quality::Uncertain(Reason::Configuration)),
        (1, 8000, text(&cut), bad),
    ];
    assert_eq!(read(csv(json!(null)), &tags, &table).unwrap(), expected);
    expected[3] = missing(1, 3000);
    assert_eq!(read(csv(json!(["Shutdown"])), &tags, &table).unwrap(), expected);

    // Bytes that are no text in the file's encoding.
    let settings = json!({"file": "/a.csv", "csv": {"time_format": "seconds"}});
    let mut found = Vec::new();
    let keep = |batch: &[Sample]| found.extend_from_slice(batch);
    let bytes = Bytes::Csv(b"time,m,q\n0,AUT\xD6,good\n".into());
    play(serde_json::from_value(settings).unwrap(), &tags, bytes, keep).unwrap();
    assert_eq!(found[0].value, text("AUT\u{fffd}"));
    assert_eq!(found[0].quality, Quality::Uncertain(Reason::Configuration));
}

#[test]
fn an_empty_cell_is_missing_or_nothing() {
    let text = "time,a,b\n0,1,NaN\n1,,2\n";
    let tags = [f64_of("a", 1), f64_of("b", 2)];
    let found = read(json!({"time_format": "seconds"}), &tags, text).unwrap();
    let not_finite = || (2, 0, None, Quality::Bad(Reason::NotFinite));
    assert_eq!(found, [good(1, 0, 1.0), not_finite(), missing(1, 1000), good(2, 1000, 2.0)]);
    let csv = json!({"time_format": "seconds", "empty_cells": "unchanged"});
    let found = read(csv, &tags, text).unwrap();
    assert_eq!(found, [good(1, 0, 1.0), not_finite(), good(2, 1000, 2.0)]);
}

#[test]
fn bad_rows_are_told_and_do_not_stop_the_rest() {
    let long = "x".repeat(MAX_LINE_BYTES + 1);
    let text = format!("time,a\nsoon,1\n1,2\n0,3\n1\n1,2,3\n{long}\n\n1,oil\n2,\"4\n3,5,\n");
    let config = json!({"file": "/a.csv", "csv": {"time_format": "seconds"}});
    let config = serde_json::from_value::<crate::Settings>(config).unwrap().parse().unwrap();
    let points = Points::parse(&[f64_of("a", 1)], &config).unwrap();
    let mut remarks = Remarks::new(busbar_plugin_sdk::testing::host(), "a".into());
    let mut table = Table::new(&config, std::io::Cursor::new(text), &points, &mut remarks).unwrap();
    let mut updates = Vec::new();
    while table.read(&mut updates, &mut remarks).unwrap().is_some() {}
    let values: Vec<_> = updates.iter().map(|update| update.value.clone()).collect();
    // Each of the others makes the tag bad, until a row can be read.
    let expected =
        [[None, Some(2.0)].as_slice(), &[None; 4], &[None, Some(4.0), Some(5.0)]].concat();
    let expected: Vec<_> = expected.into_iter().map(|value| value.map(Value::F64)).collect();
    assert_eq!(values, expected);
    assert!(updates.iter().all(|update| update.value.is_some() == update.quality.is_good()));
    let expected = [
        "line 2: 'soon' is not a number of seconds: is csv.time_format right?; the row is left out",
        "line 4: it is 1.000 s earlier than the one before",
        "line 5: 1 cells instead of 2",
        "line 6: 3 cells instead of 2",
        "line 7: more than 1048576 bytes",
        "line 9: 'oil' is no number; taken as missing",
    ];
    let (told, left_out) = remarks.told();
    assert_eq!((told.len(), left_out), (expected.len(), 0), "{told:#?}");
    for (told, expected) in told.iter().zip(expected) {
        assert!(told.starts_with(expected), "{told}");
    }
}

#[test]
fn rows_of_a_tag_keep_their_own_order() {
    // Two loggers in one file: what is earlier than another tag's row is no fault.
    let text = "time,name,value\n0,a,1\n0,b,1\n2,a,2\n1,b,2\n1,a,3\n3,a,4\n";
    let csv = json!({"form": "long", "time_format": "seconds"});
    let tag = |tag, id: &str| tag_spec(tag, id, ValueKind::F64, json!({"name": id}));
    assert_eq!(
        read(csv, &[tag(1, "a"), tag(2, "b")], text).unwrap(),
        [
            good(1, 0, 1.0),
            good(2, 0, 1.0),
            good(1, 2000, 2.0),
            good(2, 1000, 2.0),
            // Nobody can tell whether it is older, or the clock was set back.
            missing(1, 2000),
            good(1, 3000, 4.0),
        ]
    );
}

#[test]
fn a_row_that_cannot_be_read_is_of_its_tag_or_of_all() {
    let csv = || json!({"form": "long", "time_format": "seconds"});
    let tag = |tag, id: &str| tag_spec(tag, id, ValueKind::F64, json!({"name": id}));
    let tags = [tag(1, "a"), tag(2, "b")];
    let of_all = [missing(1, 1000), missing(2, 1000)];
    for (row, expected) in [
        ("soon,a,5", &[missing(1, 1000)][..]),
        ("2,a,much", &[missing(1, 2000)]),
        ("2,a", &of_all),
        ("2", &of_all),
        ("2,a,5,6", &of_all),
        ("soon,nobody,5", &[]),
        ("2,nobody,much", &[]),
    ] {
        let text = format!("time,name,value\n0,a,1\n1,b,1\n{row}\n3,a,2\n3,b,2\n");
        let found = read(csv(), &tags, &text).unwrap();
        let all = [
            &[good(1, 0, 1.0), good(2, 1000, 1.0)],
            expected,
            &[good(1, 3000, 2.0), good(2, 3000, 2.0)],
        ];
        assert_eq!(found, all.concat(), "{row}");
    }
    // A name that is not UTF-8 may be that of any tag.
    let text = b"time,name,value\n0,a,1\n1,\xff,5\n2,a,2\n".to_vec();
    let settings = json!({"file": "/a.csv", "max_updates_per_second": 0, "csv": csv()});
    let mut values = Vec::new();
    let keep = |batch: &[Sample]| values.extend(batch.iter().map(|s| (s.tag, s.value.clone())));
    play(serde_json::from_value(settings).unwrap(), &tags, Bytes::Csv(text), keep).unwrap();
    let value = |value| Some(Value::F64(value));
    assert_eq!(values, [(1, value(1.0)), (1, None), (2, None), (1, value(2.0))]);
}

#[test]
fn remarks_are_bounded() {
    let mut remarks = Remarks::new(busbar_plugin_sdk::testing::host(), "a".into());
    (0..1000).for_each(|number| remarks.add(format!("line {number}")));
    (0..1000).for_each(|_| remarks.add("line 0"));
    assert_eq!((remarks.told().0.len(), remarks.told().1), (crate::remarks::MAX_REMARKS, 980));
}

#[test]
fn what_is_wrong_with_the_header_is_named() {
    let tags = [f64_of("a", 1)];
    for (text, part) in [
        ("", "the file is empty"),
        ("t,a\n1,1\n", "csv.time: there is no column 'time'; there are 't', 'a'"),
        ("time,b\n1,1\n", "tag 'a': there is no column 'a'; there are 'time', 'b'"),
        ("time,a,a\n1,1,1\n", "2, 3 are columns 'a': give the number"),
        ("time,a\n", "there is no row of data"),
        ("time,a\nx,1\n", "line 2: 'x' is not a time such as"),
    ] {
        let fault = read(json!({}), &tags, text).unwrap_err();
        assert!(fault.contains(part), "{fault}");
    }
    let wide = vec![","; MAX_COLUMNS].concat();
    assert!(read(json!({}), &tags, &wide).unwrap_err().contains("more than 65536 cells"));
}
