//! Values that the server tells of by itself.

use super::cluster::Cluster;
use super::*;

/// Notifications in one storm.
const STORM: i64 = 10_000;

const TABLE: &str = "CREATE TABLE latest (key text PRIMARY KEY, value float8);
    INSERT INTO latest VALUES ('a', 1), ('b', 2);
    CREATE FUNCTION tell() RETURNS trigger LANGUAGE plpgsql AS $$
    BEGIN PERFORM pg_notify('New \"values\"', row_to_json(NEW)::text); RETURN NULL; END $$;
    CREATE TRIGGER tell AFTER INSERT OR UPDATE ON latest FOR EACH ROW EXECUTE FUNCTION tell()";

/// Asks once a connection; the rest is told.
fn listening(cluster: &Cluster) -> Running {
    let mut settings = cluster.settings(&[json!({"name": "latest", "sql": "TABLE latest"})]);
    settings["listen"] = json!([{"channel": "New \"values\"", "query": "latest"}]);
    start(
        settings,
        vec![key(1, "latest", "a", ValueKind::F64), key(2, "latest", "b", ValueKind::F64)],
    )
}

#[test]
fn a_notification_lands_at_once_and_nothing_is_missed_meanwhile() {
    let Some(mut cluster) = Cluster::start() else { return };
    cluster.sql(TABLE);
    let running = listening(&cluster);
    running.wait_for(1, Value::F64(1.0));
    running.wait_for(2, Value::F64(2.0));
    cluster.sql("UPDATE latest SET value = 10 WHERE key = 'a'");
    running.wait_for(1, Value::F64(10.0));
    running.wait_for(2, Value::F64(2.0));
    // What changes while nobody listens is asked for.
    cluster.kill();
    running.wait_for_bad(1, Reason::Communication);
    cluster.restart();
    cluster.sql("UPDATE latest SET value = 20 WHERE key = 'b'");
    running.wait_for(1, Value::F64(10.0));
    running.wait_for(2, Value::F64(20.0));
    cluster.sql("UPDATE latest SET value = 30 WHERE key = 'b'");
    running.wait_for(2, Value::F64(30.0));
}

#[test]
fn a_storm_comes_whole_and_in_order() {
    let Some(cluster) = Cluster::start() else { return };
    cluster.sql(TABLE);
    let running = listening(&cluster);
    running.wait_for(2, Value::F64(2.0));
    let storms = 5;
    for _ in 0..storms {
        running.recorder.clear();
        cluster.sql(&format!(
            "DO $$ BEGIN FOR n IN 1..{STORM} LOOP UPDATE latest SET value = n + 1000 WHERE key = 'a';
             END LOOP; END $$"
        ));
        running.wait_for(1, Value::F64((STORM + 1000) as f64));
        let samples = running.recorder.recording().samples;
        let values: Vec<_> =
            samples.iter().filter(|s| s.tag == 1).map(|s| s.value.clone()).collect();
        let expected: Vec<_> = (1..=STORM).map(|n| Some(Value::F64((n + 1000) as f64))).collect();
        assert!(values == expected, "{} of {STORM} came, in another order", values.len());
    }
}

/// Checks that a polled value never replaces a newer notification.
#[test]
fn polls_and_notifications_do_not_overtake_each_other() {
    let Some(cluster) = Cluster::start() else { return };
    cluster.sql(TABLE);
    let mut settings = cluster.settings(&[query("latest", "TABLE latest")]);
    settings["listen"] = json!([{"channel": "New \"values\"", "query": "latest"}]);
    let running = start(settings, vec![key(1, "latest", "a", ValueKind::F64)]);
    running.wait_for(1, Value::F64(1.0));
    // Each step commits, so that polls see some of them.
    let steps: Vec<_> = (1..=400)
        .map(|n| format!("UPDATE latest SET value = {} WHERE key = 'a'; COMMIT; BEGIN;", n + 1))
        .collect();
    cluster.sql(&format!("BEGIN; {} COMMIT", steps.concat()));
    running.wait_for(1, Value::F64(401.0));
    let samples = running.recorder.recording().samples;
    let values: Vec<f64> = samples
        .iter()
        .filter_map(|sample| match sample.value {
            Some(Value::F64(value)) => Some(value),
            _ => None,
        })
        .collect();
    // A notification follows the one before it; what else comes is a poll's. It may be
    // ahead of notifications that were held back for it, but never behind.
    let mut told = 1.0;
    for value in &values {
        if *value == told + 1.0 {
            told = *value;
        }
        assert!(*value >= told, "{value} after {told}: {values:?}");
    }
    assert_eq!(told, 401.0, "every notification came: {values:?}");
}

#[test]
fn a_notification_that_cannot_be_used_leaves_no_value_as_it_was() {
    let Some(cluster) = Cluster::start() else { return };
    cluster.sql(TABLE);
    let running = listening(&cluster);
    running.wait_for(1, Value::F64(1.0));
    running.wait_for(2, Value::F64(2.0));
    // Nobody can tell whose it is: all are uncertain, until the query was asked anew.
    cluster.sql("ALTER TABLE latest DISABLE TRIGGER tell; UPDATE latest SET value = value + 10");
    cluster.sql(r#"SELECT pg_notify('New "values"', '{"key": "a", "value": 1')"#);
    for tag in [1, 2] {
        running.wait_for_quality(tag, Quality::Uncertain(Reason::Communication));
    }
    running.wait_for(1, Value::F64(11.0));
    running.wait_for(2, Value::F64(12.0));
    running.wait_for_link(LinkState::Up, "notifications that cannot be used so far: 1");
    // That of one tag is its own alone, without a value as with one that does not fit.
    let payloads = [r#"{"key": "a"}"#, r#"{"key": "a", "value": "much"}"#];
    for (payload, asked) in payloads.into_iter().zip([21.0, 31.0]) {
        cluster.sql("UPDATE latest SET value = value + 10");
        let before = running.recorder.recording().samples.len();
        cluster.sql(&format!("SELECT pg_notify('New \"values\"', '{payload}')"));
        running.wait_for_bad(1, Reason::Configuration);
        let samples = running.recorder.recording().samples;
        assert!(samples.iter().skip(before).all(|sample| sample.tag == 1), "{samples:?}");
        running.wait_for(1, Value::F64(asked));
    }
}

#[test]
fn hostile_payloads_change_no_other_tag() {
    let Some(cluster) = Cluster::start() else { return };
    cluster.sql(TABLE);
    let running = listening(&cluster);
    running.wait_for(2, Value::F64(2.0));
    let payloads = [
        "",
        "no JSON",
        "[1]",
        r#"{"key": "nobody", "value": 5}"#,
        r#"{"key": "A", "value": 5}"#,
        r#"{"key": "a"}"#,
        r#"{"value": 5}"#,
        r#"{"key": "a", "key": "b", "value": 5}"#,
        r#"{"key": ["a"], "value": 5}"#,
    ];
    for payload in payloads {
        cluster.sql(&format!("SELECT pg_notify('New \"values\"', '{payload}')"));
    }
    // A long one, and one with a value that does not fit, which is the tag's fault alone.
    cluster.sql("SELECT pg_notify('New \"values\"', repeat('[', 7999))");
    cluster.sql(r#"SELECT pg_notify('New "values"', '{"key": "a", "value": {"x": 1}}')"#);
    running.wait_for_bad(1, Reason::Configuration);
    running.wait_for(2, Value::F64(2.0));
    let told = r#"{"tag": "a", "value": "7.5", "quality": "uncertain", "time": 1700000000}"#;
    cluster.sql(&format!("SELECT pg_notify('New \"values\"', '{told}')"));
    running.wait("sample", 1, |sample| {
        sample.value == Some(Value::F64(7.5))
            && sample.quality == Quality::Uncertain(Reason::Unknown)
            && sample.source_time.is_some()
    });
    let seen = running.recorder.recording().samples;
    let fives = seen.iter().filter(|sample| sample.value == Some(Value::F64(5.0))).count();
    assert_eq!(fives, 0);
}
