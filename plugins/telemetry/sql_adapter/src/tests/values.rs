//! Tests of queries and the values that they return.

use std::time::{SystemTime, UNIX_EPOCH};

use super::cluster::Cluster;
use super::*;

/// SQL of a value, the tag's kind, and what comes of it.
type Case = (&'static str, ValueKind, Result<Value, Reason>);

const CASES: &[Case] = {
    use Reason::{Configuration, NotFinite, Sensor};
    use ValueKind::{Bool, DoublePoint as Double, F64, I64};
    &[
        ("(-7)::int2", F64, Ok(Value::F64(-7.0))),
        ("2147483647::int4", I64, Ok(Value::I64(2_147_483_647))),
        ("(-9223372036854775808)::int8", I64, Ok(Value::I64(i64::MIN))),
        ("1.5::float4", F64, Ok(Value::F64(1.5))),
        ("1e300::float8", F64, Ok(Value::F64(1e300))),
        ("3.0::float8", I64, Ok(Value::I64(3))),
        ("3.5::float8", I64, Err(Configuration)),
        ("'NaN'::float8", F64, Err(NotFinite)),
        ("'-Infinity'::float4", F64, Err(NotFinite)),
        ("12345.6789::numeric", F64, Ok(Value::F64(12_345.678_9))),
        ("(-0.00012)::numeric(10,5)", F64, Ok(Value::F64(-0.000_12))),
        ("9223372036854775807::numeric(30,4)", I64, Ok(Value::I64(i64::MAX))),
        ("9223372036854775808::numeric", I64, Err(Configuration)),
        ("(10::numeric ^ 400)", F64, Err(Configuration)),
        ("'NaN'::numeric", F64, Err(NotFinite)),
        ("true", Bool, Ok(Value::Bool(true))),
        ("false", I64, Ok(Value::I64(0))),
        ("0", Bool, Ok(Value::Bool(false))),
        ("2", Bool, Err(Configuration)),
        ("'62.5'::text", F64, Ok(Value::F64(62.5))),
        ("' 1 '::char(8)", Bool, Ok(Value::Bool(true))),
        ("'on'::varchar", Bool, Err(Configuration)),
        ("2::int2", Double, Ok(Value::DoublePoint(DoublePoint::On))),
        ("7::int2", Double, Err(Configuration)),
        ("repeat('x', 500000)", F64, Err(Configuration)),
        ("NULL::float8", F64, Err(Sensor)),
        ("'{\"a\": 1}'::json", F64, Err(Configuration)),
        ("now()", F64, Err(Configuration)),
        ("4::positive", I64, Ok(Value::I64(4))),
    ]
};

/// SQL of a value of a text tag, and the text; `None` where it does not fit.
const TEXTS: [(&str, Option<&str>); 9] = [
    ("'Hand ⚡'::text", Some("Hand ⚡")),
    ("''::text", Some("")),
    ("'AUTO'::char(8)", Some("AUTO")),
    ("'SHUT'::switch_state", Some("SHUT")),
    ("(-9223372036854775808)::int8", Some("-9223372036854775808")),
    ("42::numeric(20, 2)", Some("42")),
    ("42.5::numeric", None),
    ("42::float8", None),
    ("true", None),
];

#[test]
fn every_type_comes_as_the_tag_has_it() {
    let Some(cluster) = Cluster::start() else { return };
    cluster.sql(
        "CREATE DOMAIN positive AS int CHECK (VALUE > 0);
         CREATE TYPE switch_state AS ENUM ('OPEN', 'SHUT', 'BROKEN');
         CREATE TABLE breaker (name text, state switch_state);
         INSERT INTO breaker VALUES ('Q1', 'SHUT'), ('Q2', 'OPEN'), ('Q3', 'BROKEN')",
    );
    let columns: Vec<_> =
        CASES.iter().enumerate().map(|(index, (sql, ..))| format!("{sql} AS c{index}")).collect();
    let texts: Vec<_> =
        TEXTS.iter().enumerate().map(|(index, (sql, _))| format!("{sql} AS t{index}")).collect();
    let settings = cluster.settings(&[
        query("all", &format!("SELECT {}", columns.join(", "))),
        query("breakers", "SELECT name AS key, state AS value FROM breaker"),
        query("texts", &format!("SELECT {}", texts.join(", "))),
    ]);
    let mut tags: Vec<_> = CASES
        .iter()
        .enumerate()
        .map(|(index, (_, kind, _))| column(index as u32, "all", &format!("c{index}"), *kind))
        .collect();
    for (tag, name) in [(101, "Q1"), (102, "Q2"), (103, "Q3")] {
        let address = json!({"query": "breakers", "key": name, "states": {
            "OPEN": "off", "SHUT": "on", "MOVING": "intermediate"
        }});
        tags.push(tag_spec(tag, name, ValueKind::DoublePoint, address));
    }
    let texts = (201..).zip(0..TEXTS.len());
    tags.extend(
        texts.map(|(tag, index)| column(tag, "texts", &format!("t{index}"), ValueKind::Text)),
    );
    let running = start(settings, tags);
    for (index, (sql, kind, expected)) in CASES.iter().enumerate() {
        let tag = index as u32;
        match expected {
            Ok(value) => running.wait_for(tag, value.clone()),
            Err(reason) => running.wait_for_bad(tag, *reason),
        }
        let found = running.recorder.latest(tag).unwrap();
        assert_eq!(found.value.is_some(), expected.is_ok(), "{sql} as {kind:?}: {found:?}");
    }
    for (tag, expected) in (201..).zip(TEXTS.map(|(_, expected)| expected)) {
        match expected {
            Some(expected) => running.wait_for(tag, text(expected)),
            None => running.wait_for_bad(tag, Reason::Configuration),
        }
    }
    running.wait_for(101, Value::DoublePoint(DoublePoint::On));
    running.wait_for(102, Value::DoublePoint(DoublePoint::Off));
    running.wait_for_bad(103, Reason::Configuration);
}

#[test]
fn rows_come_with_quality_and_time_and_go() {
    let Some(cluster) = Cluster::start() else { return };
    cluster.sql(
        "CREATE TABLE latest (tag text, reading float8, ok int, at timestamptz);
         INSERT INTO latest VALUES
           ('T1.Oil', 61.5, 192, '2026-11-22 03:50:29.25+00'), ('T2.Oil', 62.5, 64, NULL),
           ('T3.Oil', 63.5, 0, '2026-11-22 03:50:29+00'), ('T4.Oil', 64.5, 192, 'infinity')",
    );
    let settings = cluster.settings(&[
        query(
            "latest",
            "SELECT tag AS key, reading AS value, ok AS quality, at AS time FROM latest",
        ),
        query("row", "SELECT 1.5 AS a, 64 AS q, 1700000000 AS t"),
        query("zoneless", "SELECT 1.5 AS a, now()::timestamp AS t"),
    ]);
    let mut tags: Vec<_> =
        (1..=5).map(|n| key(n, "latest", &format!("T{n}.Oil"), ValueKind::F64)).collect();
    let wide = |query| json!({"query": query, "column": "a", "time": "t"});
    let mut with_quality = wide("row");
    with_quality["quality"] = json!("q");
    tags.push(tag_spec(6, "tag6", ValueKind::F64, with_quality));
    tags.push(tag_spec(7, "tag7", ValueKind::F64, wide("zoneless")));
    let running = start(settings, tags);

    running.wait_for(1, Value::F64(61.5));
    let at = |sample: Option<Sample>| -> Option<SystemTime> { sample?.source_time };
    let millis = Some(UNIX_EPOCH + Duration::from_millis(1_795_319_429_250));
    assert_eq!(at(running.recorder.latest(1)), millis);
    running.wait("sample", 2, |sample| sample.quality == Quality::Uncertain(Reason::Unknown));
    running.wait("sample", 3, |sample| {
        sample.quality == Quality::Bad(Reason::Sensor) && sample.value == Some(Value::F64(63.5))
    });
    running.wait_for_quality(4, Quality::Uncertain(Reason::SourceTime));
    running.wait_for_bad(5, Reason::Sensor);
    running.wait("sample", 6, |sample| {
        sample.source_time == Some(UNIX_EPOCH + Duration::from_secs(1_700_000_000))
            && sample.quality == Quality::Uncertain(Reason::Unknown)
    });
    running.wait("unusable time", 7, |sample| {
        sample.quality == Quality::Uncertain(Reason::SourceTime)
            && sample.flags.contains(SampleFlags::TIME_UNUSABLE)
            && sample.value == Some(Value::F64(1.5))
    });

    // A row that goes leaves nothing good, and one that comes is taken.
    cluster.sql("DELETE FROM latest WHERE tag = 'T1.Oil'; INSERT INTO latest VALUES ('T5.Oil', 5, 192, now())");
    running.wait_for_bad(1, Reason::Sensor);
    running.wait_for(5, Value::F64(5.0));
    cluster.sql("UPDATE latest SET reading = 66 WHERE tag = 'T5.Oil'");
    running.wait_for(5, Value::F64(66.0));
}

#[test]
fn a_query_that_fails_marks_only_its_tags() {
    let Some(cluster) = Cluster::start() else { return };
    cluster.sql(
        "CREATE SEQUENCE numbers; GRANT USAGE ON SEQUENCE numbers TO viewer;
                 CREATE TABLE t (v float8); INSERT INTO t VALUES (1)",
    );
    let failing = [
        ("missing", "SELECT v FROM no_such_table", Reason::Configuration),
        ("syntax", "SELEC v", Reason::Configuration),
        ("division", "SELECT 1 / (v - v)::int AS v FROM t", Reason::Configuration),
        ("two", "SELECT 1 AS v; SELECT 2", Reason::Configuration),
        ("parameter", "SELECT $1::float8 AS v", Reason::Configuration),
        ("no_columns", "SET statement_timeout = 0", Reason::Configuration),
        ("slow", "SELECT 1 AS v FROM pg_sleep(60)", Reason::Communication),
        ("several", "SELECT v FROM t UNION ALL SELECT 2", Reason::Configuration),
        ("none", "SELECT v FROM t WHERE false", Reason::Sensor),
        ("many", "SELECT g AS v FROM generate_series(1, 1000000) g", Reason::Configuration),
    ];
    let writing = [
        "INSERT INTO t VALUES (2) RETURNING v",
        "WITH d AS (DELETE FROM t RETURNING v) SELECT v FROM d",
        "SELECT set_config('transaction_read_only', 'off', true)::text AS v",
        "SELECT nextval('numbers') AS v",
    ];
    let mut queries: Vec<_> = failing.iter().map(|(name, sql, _)| query(name, sql)).collect();
    let names: Vec<_> = (0..writing.len()).map(|n| format!("writing{n}")).collect();
    queries.extend(names.iter().zip(writing).map(|(name, sql)| query(name, sql)));
    queries.push(query("good", "SELECT v FROM t"));
    let mut settings = cluster.settings(&queries);
    settings["timeout_seconds"] = json!(0.3);
    let names = failing.iter().map(|(name, ..)| *name).chain(names.iter().map(String::as_str));
    let mut tags: Vec<_> = names
        .enumerate()
        .map(|(index, name)| column(index as u32, name, "v", ValueKind::F64))
        .collect();
    tags.push(column(100, "good", "v", ValueKind::F64));
    let running = start(settings, tags);
    running.wait_for(100, Value::F64(1.0));
    for (tag, (_, _, reason)) in failing.iter().enumerate() {
        running.wait_for_bad(tag as u32, *reason);
    }
    for tag in failing.len()..failing.len() + writing.len() {
        running.wait_for_bad(tag as u32, Reason::Configuration);
    }
    running.wait_for_link(LinkState::Up, "query 'missing': relation \"no_such_table\"");
    running.wait_for_link(LinkState::Up, "timeout_seconds");
    // All of it was told on one connection, and nothing was written.
    let links = running.recorder.recording().links;
    assert!(links.iter().all(|(state, _)| *state != LinkState::Down), "{links:?}");
    assert_eq!(cluster.sql("SELECT count(*), sum(v) FROM t").trim(), "1|1");
    // The same query works again when its table is there.
    cluster.sql("CREATE TABLE no_such_table (v float8); INSERT INTO no_such_table VALUES (9)");
    running.wait_for(0, Value::F64(9.0));
    cluster.sql("ALTER TABLE no_such_table ALTER v TYPE text");
    running.wait_for(0, Value::F64(9.0));
    cluster.sql("UPDATE no_such_table SET v = '10'");
    running.wait_for(0, Value::F64(10.0));
}

#[test]
fn a_socket_leads_there_too() {
    let Some(cluster) = Cluster::start() else { return };
    let mut settings = cluster.settings(&[query("q", "SELECT 3 AS v")]);
    let server = settings["postgres"].as_object_mut().unwrap();
    server.insert("host".into(), json!(cluster.folder()));
    server.remove("sslmode");
    server.remove("password");
    start(settings, vec![column(1, "q", "v", ValueKind::I64)]).wait_for(1, Value::I64(3));
}
