use busbar_plugin_sdk::testing::tag_spec;
use busbar_plugin_sdk::{Value, ValueKind};
use proptest::prelude::*;
use serde_json::json;

use super::*;
use crate::convert::rules_of_tests;
use crate::points::parse;
use crate::settings::Settings;

struct Cells(Vec<Cell<'static>>);

impl Row for Cells {
    fn cell(&self, column: usize) -> Cell<'_> {
        self.0[column].clone()
    }
}

/// The tags of one query; each tag is an f64.
fn points(addresses: &[serde_json::Value]) -> Points {
    let config = serde_json::from_value::<Settings>(json!({
        "sqlite": {"path": "/a.db"},
        "queries": [{"name": "q", "sql": "SELECT 1", "poll_seconds": 1}]
    }));
    let tag = |(index, address): (usize, &serde_json::Value)| {
        let mut address = address.clone();
        address["query"] = json!("q");
        tag_spec(index as u32, &format!("T{index}"), ValueKind::F64, address)
    };
    let tags: Vec<_> = addresses.iter().enumerate().map(tag).collect();
    parse(&tags, &config.unwrap().parse().unwrap()).unwrap().remove(0)
}

fn text(text: &str) -> Cell<'static> {
    Cell::Text(Cow::from(text.to_owned()))
}

fn read(
    points: &Points,
    names: &[&str],
    rows: &[Vec<Cell<'static>>],
) -> Result<Samples, QueryFault> {
    let mut answer = Answer::begin(points, names, &rules_of_tests(None))?;
    for row in rows {
        answer.take(&Cells(row.clone()))?;
    }
    answer.finish()
}

fn good(tag: u32, value: f64) -> Sample {
    Sample::good(tag, Value::F64(value))
}

#[test]
fn a_row_has_a_column_a_tag() {
    let points = points(&[
        json!({"column": "oil"}),
        json!({"column": "winding"}),
        json!({"column": "oil", "quality": "ok"}),
        json!({"column": "missing"}),
        json!({"column": "twice"}),
    ]);
    let names = ["winding", "oil", "ok", "twice", "twice"];
    let row = vec![Cell::Float(70.5), Cell::Int(60), Cell::Bool(false), Cell::Int(1), Cell::Int(2)];
    let samples = read(&points, &names, &[row]).unwrap();
    assert_eq!(samples[0], (good(0, 60.0), None));
    assert_eq!(samples[1], (good(1, 70.5), None));
    assert_eq!(samples[2].0.quality, busbar_plugin_sdk::Quality::Bad(Reason::Sensor));
    for (index, words) in [(3, "there is no column 'missing'"), (4, "several columns 'twice'")] {
        let (sample, remark) = &samples[index];
        assert_eq!(*sample, Sample::bad(index as u32, Reason::Configuration));
        let remark = remark.as_ref().unwrap();
        assert!(remark.contains(words) && remark.contains("'winding', 'oil'"), "{remark}");
    }
}

#[test]
fn one_row_is_one_row() {
    let points = points(&[json!({"column": "oil"})]);
    let row = vec![Cell::Int(1)];
    assert_eq!(read(&points, &["oil"], &[]), Err(QueryFault::NoRow));
    assert_eq!(read(&points, &["oil"], &[row.clone(), row]), Err(QueryFault::SeveralRows));
    assert_eq!(QueryFault::NoRow.reason(), Reason::Sensor);
    assert_eq!(QueryFault::SeveralRows.reason(), Reason::Configuration);
}

#[test]
fn rows_have_keys() {
    let points = points(&[json!({"key": "a"}), json!({"key": "7"}), json!({"key": "absent"})]);
    let rows = [
        vec![Cell::Int(1), text("a")],
        vec![Cell::Int(2), Cell::Int(7)],
        vec![Cell::Int(3), text("nobody's")],
        vec![Cell::Int(4), Cell::Null],
        vec![Cell::Int(5), text("A")],
    ];
    let samples = read(&points, &["value", "key"], &rows).unwrap();
    assert_eq!(samples[0], (good(0, 1.0), None));
    assert_eq!(samples[1], (good(1, 2.0), None));
    assert_eq!(samples[2].0, Sample::bad(2, Reason::Sensor), "it was not brought");
    // No row at all is none for any.
    let samples = read(&points, &["value", "key"], &[]).unwrap();
    assert!(samples.iter().all(|(sample, _)| sample.value.is_none()));
}

#[test]
fn of_rows_with_one_key_the_newest_counts() {
    let points = points(&[json!({"key": "a"})]);
    let names = ["key", "value", "time"];
    let row = |value, time: Option<i64>| {
        vec![text("a"), Cell::Int(value), time.map_or(Cell::Null, Cell::Int)]
    };
    let value = |rows: &[Vec<Cell<'static>>]| {
        read(&points, &names, rows).unwrap()[0].0.value.as_ref().map(|value| match value {
            Value::F64(value) => *value,
            other => panic!("{other:?}"),
        })
    };
    assert_eq!(value(&[row(1, Some(10)), row(2, Some(20)), row(3, Some(15))]), Some(2.0));
    assert_eq!(value(&[row(1, Some(20)), row(2, Some(20))]), None);
    assert_eq!(value(&[row(1, Some(20)), row(2, Some(20)), row(3, Some(30))]), Some(3.0));
    assert_eq!(value(&[row(1, None), row(2, Some(20))]), None);
}

#[test]
fn columns_of_keys_must_be_there() {
    let points = points(&[json!({"key": "a"})]);
    for (names, name) in [(["key", "val"], "value"), (["id", "value"], "key")] {
        let fault = read(&points, &names, &[]).unwrap_err();
        assert!(matches!(&fault, QueryFault::NoColumn { name: n, .. } if *n == name), "{fault}");
        assert!(fault.to_string().contains(names[0]), "{fault}");
    }
    assert!(read(&points, &["key", "value", "time", "time"], &[]).is_err());
}

#[test]
fn rows_are_counted() {
    let points = points(&[json!({"key": "a"})]);
    let mut answer = Answer::begin(&points, &["key", "value"], &rules_of_tests(None)).unwrap();
    let row = Cells(vec![text("b"), Cell::Int(1)]);
    for _ in 0..MAX_ROWS {
        answer.take(&row).unwrap();
    }
    assert_eq!(answer.take(&row), Err(QueryFault::TooManyRows));
}

proptest! {
    /// A value never lands on another tag, whatever else there is and in which order.
    #[test]
    fn values_stay_with_their_keys(keys in proptest::collection::vec(0..40_i64, 0..60)) {
        let addresses: Vec<_> = (0..20).map(|key| json!({"key": key.to_string()})).collect();
        let points = points(&addresses);
        let rows: Vec<_> = keys
            .iter()
            .map(|key| vec![Cell::Int(*key), Cell::Int(key * 100)])
            .collect();
        let samples = read(&points, &["key", "value"], &rows).unwrap();
        for (tag, (sample, _)) in samples.into_iter().enumerate() {
            let count = keys.iter().filter(|key| **key == tag as i64).count();
            let expected = (count == 1).then_some(Value::F64(tag as f64 * 100.0));
            prop_assert_eq!(sample.value, expected);
            prop_assert_eq!(sample.tag, tag as u32);
        }
    }
}
