use std::borrow::Cow;
use std::collections::BTreeMap;

use super::*;

fn point(kind: ValueKind, states: &[(&str, Value)]) -> Point {
    let states = states.iter().map(|(name, state)| ((*name).to_owned(), *state)).collect();
    Point { tag: 7, id: "tag".into(), kind, states }
}

fn text(text: &str) -> Cell<'_> {
    Cell::Text(Cow::from(text))
}

fn check_value(kind: ValueKind, cell: Cell<'_>, expected: Option<Value>) {
    let point = Point { tag: 7, id: "tag".into(), kind, states: BTreeMap::new() };
    let found = value_of(&point, &cell);
    assert_eq!(found.clone().ok(), expected, "{cell:?} as {kind:?}: {found:?}");
}

#[test]
fn numbers_are_taken_where_they_fit() {
    use ValueKind::{Bool, DoublePoint as Double, F64, I64};
    let double = |point| Some(Value::DoublePoint(point));
    check_value(F64, Cell::Int(-3), Some(Value::F64(-3.0)));
    check_value(F64, Cell::Float(1.5), Some(Value::F64(1.5)));
    check_value(F64, Cell::Bool(true), Some(Value::F64(1.0)));
    check_value(F64, text(" 6.25 "), Some(Value::F64(6.25)));
    check_value(F64, text("open"), None);
    check_value(F64, Cell::Time(UNIX_EPOCH), None);
    check_value(I64, Cell::Int(i64::MIN), Some(Value::I64(i64::MIN)));
    check_value(I64, Cell::Float(-12.0), Some(Value::I64(-12)));
    check_value(I64, Cell::Float(12.5), None);
    check_value(I64, Cell::Float(I64_END), None);
    check_value(I64, Cell::Float(-I64_END), Some(Value::I64(i64::MIN)));
    check_value(I64, Cell::Float(f64::NAN), None);
    check_value(I64, Cell::Bool(false), Some(Value::I64(0)));
    check_value(I64, text("9223372036854775807"), Some(Value::I64(i64::MAX)));
    check_value(I64, text("9223372036854775808"), None);
    check_value(Bool, Cell::Bool(true), Some(Value::Bool(true)));
    check_value(Bool, Cell::Int(0), Some(Value::Bool(false)));
    check_value(Bool, Cell::Int(2), None);
    check_value(Bool, Cell::Float(1.0), None);
    check_value(Bool, text("true"), Some(Value::Bool(true)));
    check_value(Bool, text("yes"), None);
    check_value(Double, Cell::Int(2), double(DoublePoint::On));
    check_value(Double, Cell::Int(4), None);
    check_value(Double, Cell::Int(-1), None);
    check_value(Double, Cell::Bool(true), None);
    check_value(Double, text("0"), double(DoublePoint::Intermediate));
    check_value(F64, Cell::Unusable("a blob".into()), None);
}

#[test]
fn a_text_that_is_too_long_is_not_repeated() {
    let long = "x".repeat(MAX_TEXT_BYTES + 1);
    let fault = value_of(&point(ValueKind::F64, &[]), &text(&long)).unwrap_err();
    assert!(fault.contains("257 bytes") && !fault.contains("xx"), "{fault}");
}

#[test]
fn states_are_those_of_the_address() {
    let breaker = point(
        ValueKind::DoublePoint,
        &[
            ("OPEN", Value::DoublePoint(DoublePoint::Off)),
            ("1", Value::DoublePoint(DoublePoint::On)),
            ("true", Value::DoublePoint(DoublePoint::BadState)),
        ],
    );
    let double = |point| Ok(Value::DoublePoint(point));
    assert_eq!(value_of(&breaker, &text(" OPEN ")), double(DoublePoint::Off));
    assert_eq!(value_of(&breaker, &Cell::Int(1)), double(DoublePoint::On));
    assert_eq!(value_of(&breaker, &Cell::Bool(true)), double(DoublePoint::BadState));
    for other in [text("open"), Cell::Int(2), Cell::Float(1.0), Cell::Bool(false)] {
        assert!(value_of(&breaker, &other).unwrap_err().contains("`states`"), "{other:?}");
    }
}

#[test]
fn qualities_are_words_booleans_and_codes() {
    let (bad, uncertain) = (Quality::Bad(Reason::Sensor), Quality::Uncertain(Reason::Unknown));
    let cases = [
        (text("Good"), Quality::Good),
        (text("uncertain"), uncertain),
        (text(" bad "), bad),
        (Cell::Bool(true), Quality::Good),
        (Cell::Bool(false), bad),
        (Cell::Int(192), Quality::Good),
        (Cell::Int(216), Quality::Good),
        (Cell::Int(64), uncertain),
        (Cell::Int(0), bad),
        (Cell::Int(24), bad),
        // Reserved by OPC: nobody may call it good.
        (Cell::Int(128), bad),
        (Cell::Null, uncertain),
    ];
    for (cell, expected) in cases {
        assert_eq!(quality_of(&cell), Ok(expected), "{cell:?}");
    }
    for cell in [text("fine"), Cell::Int(256), Cell::Int(-1), Cell::Float(192.0)] {
        assert!(quality_of(&cell).is_err(), "{cell:?}");
    }
}

#[test]
fn times_have_a_zone_or_are_unix_seconds() {
    let at = |millis| Ok(Some(UNIX_EPOCH + Duration::from_millis(millis)));
    let time = |cell| time_of(&cell, ZonelessTime::Refused);
    assert_eq!(time(Cell::Int(1_700_000_000)), at(1_700_000_000_000));
    assert_eq!(time(Cell::Float(1_700_000_000.5)), at(1_700_000_000_500));
    assert_eq!(time(text("2023-11-14T22:13:20.5Z")), at(1_700_000_000_500));
    assert_eq!(time(text("2023-11-15 00:13:20+02:00")), at(1_700_000_000_000));
    assert_eq!(time(Cell::Null), Ok(None));
    let now = SystemTime::now();
    assert_eq!(time(Cell::Time(now)), Ok(Some(now)));
    let wrong = [
        text("2023-11-14 22:13:20"),
        text("yesterday"),
        text("1969-12-31T23:59:59Z"),
        Cell::Int(1_700_000_000_000),
        Cell::Int(-1),
        Cell::Float(f64::NAN),
        Cell::Float(f64::INFINITY),
        Cell::Bool(true),
        Cell::Unusable("a timestamp without time zone".into()),
    ];
    for cell in wrong {
        assert!(time(cell.clone()).is_err(), "{cell:?}");
    }
    let utc = time_of(&text("2023-11-14 22:13:20"), ZonelessTime::Utc);
    assert_eq!(utc, at(1_700_000_000_000), "as SQLite writes it");
}

#[test]
fn what_a_row_says_of_its_value_counts() {
    let read =
        |value: Cell<'static>, quality: Option<Cell<'static>>, time: Option<Cell<'static>>| {
            let reading = Reading { value, quality, time };
            reading.sample(&point(ValueKind::F64, &[]), ZonelessTime::Refused)
        };
    let good = Sample::good(7, Value::F64(1.0));
    let one = Cell::Int(1);
    assert_eq!(read(one.clone(), None, None), (good, None));
    let time = UNIX_EPOCH + Duration::from_secs(5);
    let timed = Sample { source_time: Some(time), ..good };
    assert_eq!(read(one.clone(), None, Some(Cell::Int(5))), (timed, None));
    // A value of unknown age is not shown as certain, and that is said.
    let uncertain = Sample { quality: Quality::Uncertain(Reason::SourceTime), ..good }
        .with_flags(SampleFlags::TIME_UNUSABLE);
    let dateless = Sample { quality: Quality::Uncertain(Reason::Unknown), ..uncertain };
    assert_eq!(
        read(one.clone(), None, Some(Cell::Null)),
        (dateless, Some("time: it is NULL".into()))
    );
    let mut times = vec![Cell::Bool(true), Cell::Int(-1), text("yesterday")];
    times.extend([Cell::Float(1e300), Cell::Int(1_700_000_000_000), text("2023-11-14 22:13:20")]);
    times.push(Cell::Unusable("a timestamp without time zone".into()));
    for time in times {
        let (sample, remark) = read(one.clone(), None, Some(time.clone()));
        assert_eq!(sample, uncertain, "{time:?}");
        assert!(remark.unwrap().starts_with("time: "), "{time:?}");
    }
    // The host judges what is of the future; it is handed on as it was read.
    let future = SystemTime::now() + Duration::from_secs(86_400);
    let ahead = Sample { source_time: Some(future), ..good };
    assert_eq!(read(one.clone(), None, Some(Cell::Time(future))), (ahead, None));
    let bad = Sample { quality: Quality::Bad(Reason::Sensor), ..good };
    assert_eq!(read(one, Some(Cell::Bool(false)), None), (bad, None));
    assert_eq!(read(Cell::Null, Some(Cell::Bool(true)), None).0, Sample::bad(7, Reason::Sensor));
    for value in [f64::NAN, f64::INFINITY] {
        assert_eq!(read(Cell::Float(value), None, None).0, Sample::bad(7, Reason::NotFinite));
    }
    let (sample, remark) = read(Cell::Time(time), None, None);
    assert_eq!(sample, Sample::bad(7, Reason::Configuration));
    assert!(remark.unwrap().contains("a time is no number"));
}
