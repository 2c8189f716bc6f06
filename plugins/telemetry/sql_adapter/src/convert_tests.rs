use source_units::TagUnit;
use std::borrow::Cow;
use text_table::StateWords;

use super::*;

fn point(kind: ValueKind, states: &[(&str, Value)]) -> Point {
    let states = states.iter().map(|(name, state)| ((*name).to_owned(), state.clone())).collect();
    let (states, unit) = (StateWords::new(states).unwrap(), TagUnit::default());
    Point { tag: 7, id: "tag".into(), kind, states, unit }
}

fn text(text: &str) -> Cell<'_> {
    Cell::Text(Cow::from(text))
}

fn check_value(kind: ValueKind, cell: Cell<'_>, expected: Option<Value>) {
    let point = Point {
        tag: 7,
        id: "tag".into(),
        kind,
        states: StateWords::default(),
        unit: TagUnit::default(),
    };
    let found = value_of(&point, &cell);
    let expected = expected.map(|value| (value, Quality::Good));
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
    // 1, 1.0, true and "1" are one state.
    for one in [Cell::Int(1), Cell::Float(1.0), Cell::Bool(true), text("1"), text("1.0")] {
        check_value(Bool, one, Some(Value::Bool(true)));
    }
    for zero in [Cell::Float(0.0), Cell::Float(-0.0), text("0.0"), text("FALSE")] {
        check_value(Bool, zero, Some(Value::Bool(false)));
    }
    check_value(Bool, Cell::Float(0.5), None);
    check_value(Bool, text("true"), Some(Value::Bool(true)));
    check_value(I64, text("7.0"), Some(Value::I64(7)));
    check_value(I64, text("7.5"), None);
    check_value(Double, text("2.0"), double(DoublePoint::On));
    check_value(Bool, text("yes"), None);
    check_value(Double, Cell::Int(2), double(DoublePoint::On));
    check_value(Double, Cell::Int(4), None);
    check_value(Double, Cell::Int(-1), None);
    check_value(Double, Cell::Bool(true), None);
    check_value(Double, text("0"), double(DoublePoint::Intermediate));
    check_value(F64, Cell::Unusable("a blob".into()), None);
}

#[test]
fn text_tags_take_texts_and_whole_numbers() {
    let uncertain = Quality::Uncertain(Reason::Configuration);
    let (whole, long) = ("x".repeat(255), "x".repeat(256));
    let cut = format!("{}…", "x".repeat(252));
    let cases = [
        (text("AUTO"), Some(("AUTO", Quality::Good))),
        // As a char(8) comes.
        (text(" AUTO   "), Some((" AUTO", Quality::Good))),
        (text("62.50"), Some(("62.50", Quality::Good))),
        (text(""), Some(("", Quality::Good))),
        (text(&whole), Some((&whole, Quality::Good))),
        (text(&long), Some((&cut, uncertain))),
        (Cell::NotUtf8(b"AUT\xD6"), Some(("AUT\u{fffd}", uncertain))),
        (Cell::Int(i64::MIN), Some(("-9223372036854775808", Quality::Good))),
        (Cell::Float(7.0), None),
        (Cell::Bool(true), None),
        (Cell::Time(UNIX_EPOCH), None),
        (Cell::Unusable("a blob".into()), None),
    ];
    let point = point(ValueKind::Text, &[]);
    for (cell, expected) in cases {
        let expected = expected.map(|(text, quality)| (Value::Text(Text::cut(text)), quality));
        let found = value_of(&point, &cell);
        assert_eq!(found.clone().ok(), expected, "{cell:?}: {found:?}");
        let reading = Reading { value: cell, quality: None, time: None, unit: Some(text("kW")) };
        let (sample, remark) = reading.sample(&point, &rules_of_tests(None));
        let quality = expected.as_ref().map_or(Quality::Bad(Reason::Configuration), |read| read.1);
        assert_eq!((sample.value, sample.quality), (expected.map(|read| read.0), quality));
        assert_eq!(remark.is_some(), !quality.is_good());
    }
    assert_eq!(
        value_of(&point, &Cell::Float(7.0)).unwrap_err(),
        "the number 7 is no text: cast it in the query, or correct the tag's type"
    );
    let bad = Reading {
        value: text(&long),
        quality: Some(Cell::Bool(false)),
        time: Some(Cell::Null),
        unit: None,
    };
    let (sample, _) = bad.sample(&point, &rules_of_tests(None));
    assert_eq!(sample.quality, Quality::Bad(Reason::Sensor), "the worse of both");
    // Of other tags, and in other places, such bytes are nothing.
    assert!(value_of(&self::point(ValueKind::I64, &[]), &Cell::NotUtf8(b"\xff")).is_err());
    assert!(quality_of(&Cell::NotUtf8(b"\xff")).is_err());
    assert!(time_of(&Cell::NotUtf8(b"\xff"), &rules_of_tests(None)).is_err());
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
            ("0", Value::DoublePoint(DoublePoint::BadState)),
        ],
    );
    let double = |point| Ok((Value::DoublePoint(point), Quality::Good));
    assert_eq!(value_of(&breaker, &text(" OPEN ")), double(DoublePoint::Off));
    assert_eq!(value_of(&breaker, &Cell::Int(1)), double(DoublePoint::On));
    for one in [Cell::Bool(true), Cell::Float(1.0), text("1"), text("1.0"), text("TRUE")] {
        assert_eq!(value_of(&breaker, &one), double(DoublePoint::On), "{one:?}");
    }
    assert_eq!(value_of(&breaker, &Cell::Bool(false)), double(DoublePoint::BadState));
    for (other, seen) in [
        (text("open"), "the text 'open'"),
        (Cell::Int(2), "the integer 2"),
        (Cell::Float(1.5), "the number 1.5"),
    ] {
        let fault = value_of(&breaker, &other).unwrap_err();
        assert!(fault.contains(seen) && fault.contains("`states` '0', '1', 'OPEN'"), "{fault}");
    }
    let fault = value_of(&point(ValueKind::F64, &[]), &text("shut\n")).unwrap_err();
    assert!(fault.contains("the text 'shut' is no number"), "{fault}");
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
    assert_eq!(quality_of(&Cell::Float(192.0)), Ok(Quality::Good));
    for cell in [text("fine"), Cell::Int(256), Cell::Int(-1), Cell::Float(192.5)] {
        let fault = quality_of(&cell).unwrap_err();
        assert!(fault.contains(&*cell.name()), "{fault}");
    }
}

#[test]
fn times_have_a_zone_or_are_unix_seconds() {
    let at = |millis| Ok(Some(UNIX_EPOCH + Duration::from_millis(millis)));
    let only = |read: Result<Option<RowTime>, String>| read.map(|time| time.map(|time| time.time));
    let time = |cell| only(time_of(&cell, &rules_of_tests(None)));
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
    let utc = only(time_of(&text("2023-11-14 22:13:20"), &rules_of_tests(Some("UTC"))));
    assert_eq!(utc, at(1_700_000_000_000), "as SQLite writes it");
}

#[test]
fn what_a_row_says_of_its_value_counts() {
    let read =
        |value: Cell<'static>, quality: Option<Cell<'static>>, time: Option<Cell<'static>>| {
            let reading = Reading { value, quality, time, unit: None };
            reading.sample(&point(ValueKind::F64, &[]), &rules_of_tests(None))
        };
    let good = || Sample::good(7, Value::F64(1.0));
    let one = Cell::Int(1);
    assert_eq!(read(one.clone(), None, None), (good(), None));
    let time = UNIX_EPOCH + Duration::from_secs(5);
    let timed = Sample { source_time: Some(time), ..good() };
    assert_eq!(read(one.clone(), None, Some(Cell::Int(5))), (timed, None));
    // A value of unknown age is not shown as certain, and that is said.
    let uncertain = Sample { quality: Quality::Uncertain(Reason::SourceTime), ..good() }
        .with_flags(SampleFlags::TIME_UNUSABLE);
    let dateless = Sample { quality: Quality::Uncertain(Reason::Unknown), ..uncertain.clone() };
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
    let ahead = Sample { source_time: Some(future), ..good() };
    assert_eq!(read(one.clone(), None, Some(Cell::Time(future))), (ahead, None));
    let bad = Sample { quality: Quality::Bad(Reason::Sensor), ..good() };
    assert_eq!(read(one, Some(Cell::Bool(false)), None), (bad, None));
    assert_eq!(read(Cell::Null, Some(Cell::Bool(true)), None).0, Sample::bad(7, Reason::Sensor));
    for value in [f64::NAN, f64::INFINITY] {
        assert_eq!(read(Cell::Float(value), None, None).0, Sample::bad(7, Reason::NotFinite));
    }
    let (sample, remark) = read(Cell::Time(time), None, None);
    assert_eq!(sample, Sample::bad(7, Reason::Configuration));
    assert!(remark.unwrap().contains("a time is no number"));
}

#[test]
fn local_times_are_those_of_the_zone() {
    let berlin = rules_of_tests(Some("Europe/Berlin"));
    let nanos = |text: &str| {
        let utc = time_of(&Cell::Text(Cow::from(text.to_owned())), &rules_of_tests(Some("UTC")));
        utc.unwrap().unwrap().time.duration_since(UNIX_EPOCH).unwrap().as_nanos() as i64
    };
    let time = |cell: &Cell<'_>| time_of(cell, &berlin).map(|time| time.unwrap());
    for (written, utc, is_ambiguous) in [
        ("2026-01-02 03:04:05", "2026-01-02T02:04:05Z", false),
        ("2026-07-02 03:04:05", "2026-07-02T01:04:05Z", false),
        ("2026-10-25 02:30:00", "2026-10-25T00:30:00Z", true),
        ("2026-10-25T02:30:00+01:00", "2026-10-25T01:30:00Z", false),
    ] {
        let expected = UNIX_EPOCH + Duration::from_nanos(nanos(utc) as u64);
        let found = time(&text(written)).unwrap();
        assert_eq!(found, RowTime { time: expected, is_ambiguous }, "{written}");
        if !written.contains('+') {
            assert_eq!(time(&Cell::LocalTime(nanos(written))).unwrap(), found, "{written}");
        }
    }
    for cell in [text("2026-03-29 02:30:00"), Cell::LocalTime(nanos("2026-03-29 02:30:00"))] {
        assert!(time(&cell).unwrap_err().contains("never was in Europe/Berlin"));
    }
    let refused = time_of(&Cell::LocalTime(0), &rules_of_tests(None)).unwrap_err();
    assert!(refused.contains("set `zone`"), "{refused}");
    let reading = Reading {
        value: Cell::Int(1),
        quality: None,
        time: Some(text("2026-10-25 02:30:00")),
        unit: None,
    };
    let (sample, remark) = reading.sample(&point(ValueKind::F64, &[]), &berlin);
    assert_eq!(sample.quality, Quality::Uncertain(Reason::SourceTime));
    assert!(sample.source_time.is_some() && sample.flags == SampleFlags::LIVE);
    assert_eq!(remark.unwrap(), "time: the clock of Europe/Berlin showed it twice");
}

#[test]
fn times_are_of_the_format_of_the_settings() {
    let rules = |format: &str| TimeReader {
        format: TimeFormat::parse(format).unwrap(),
        zone: text_table::Zone::parse("UTC").ok(),
        numbers: NumberFormat::default(),
    };
    let expected = UNIX_EPOCH + Duration::from_secs(1_767_323_045);
    for (format, cell) in [
        ("unix_millis", Cell::Int(1_767_323_045_000)),
        ("unix_micros", Cell::Int(1_767_323_045_000_000)),
        ("unix_millis", Cell::Float(1_767_323_045_000.0)),
        ("%d.%m.%Y %H:%M:%S", text("02.01.2026 03:04:05")),
        ("%d.%m.%Y %H:%M:%S", Cell::Int(1_767_323_045)),
        ("unix_millis", text("1767323045000")),
    ] {
        let found = time_of(&cell, &rules(format)).unwrap().unwrap();
        assert_eq!(found, RowTime { time: expected, is_ambiguous: false }, "{format} {cell:?}");
    }
    let fault = time_of(&Cell::Int(1_767_323_045), &rules("unix_millis")).unwrap_err();
    assert!(fault.contains("of the year 1970; as a number of seconds it is of 2026"), "{fault}");
    let fault = time_of(&Cell::Int(1_767_323_045_000), &rules("rfc3339")).unwrap_err();
    assert!(fault.contains("1767323045000") && fault.contains("`time_format`"), "{fault}");
}

#[test]
fn a_unit_that_is_no_text_leaves_its_value_uncertain() {
    let tag = Point { unit: TagUnit::new("MW"), ..point(ValueKind::F64, &[]) };
    for unit in [Cell::Int(7), Cell::Float(1.5), Cell::Bool(true)] {
        let value = Cell::Float(1.5);
        let reading = Reading { value, quality: None, time: None, unit: Some(unit) };
        let (sample, remark) = reading.sample(&tag, &rules_of_tests(None));
        assert_eq!(sample.quality, Quality::Uncertain(Reason::Configuration));
        assert!(remark.is_some_and(|remark| remark.contains("cannot be read")));
    }
}

#[test]
fn every_pair_of_units_is_judged() {
    for pair in source_units::testing::unit_pairs() {
        let tag = Point { unit: TagUnit::new(pair.tag), ..point(ValueKind::F64, &[]) };
        let unit = Some(text(pair.source));
        let reading = Reading { value: Cell::Float(1.5), quality: None, time: None, unit };
        let (sample, remark) = reading.sample(&tag, &rules_of_tests(None));
        let expected = if pair.may_be_good {
            Sample::good(7, Value::F64(1.5))
        } else {
            Sample::bad(7, Reason::Configuration)
        };
        assert_eq!((sample, remark.is_some()), (expected, pair.must_be_told), "{pair:?}");
    }
}
