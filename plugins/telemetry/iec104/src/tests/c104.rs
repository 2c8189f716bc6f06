//! Against lib60870-C behind c104, an independent implementation.

use std::time::Instant;

use peer_process::Peer;

use super::peer;
use super::*;

fn point(ioa: u32, kind: &str, value: serde_json::Value) -> serde_json::Value {
    json!({"common_address": 1, "ioa": ioa, "type": kind, "value": value})
}

fn spec(points: &[serde_json::Value]) -> serde_json::Value {
    json!({ "points": points })
}

fn peer(points: &[serde_json::Value]) -> Option<Peer> {
    peer::start(peer::C104, &spec(points))
}

/// A type, what the station has, and what it sends later, as values there and
/// of the tag.
type Case = (&'static str, ValueKind, [(serde_json::Value, Value); 2]);

fn cases() -> Vec<Case> {
    let double = |state| Value::DoublePoint(state);
    let mut cases: Vec<Case> = Vec::new();
    for name in ["M_SP_NA_1", "M_SP_TB_1"] {
        let values = [(json!(true), Value::Bool(true)), (json!(false), Value::Bool(false))];
        cases.push((name, ValueKind::Bool, values));
    }
    for name in ["M_DP_NA_1", "M_DP_TB_1"] {
        let values =
            [(json!(2), double(DoublePoint::On)), (json!(3), double(DoublePoint::BadState))];
        cases.push((name, ValueKind::DoublePoint, values));
    }
    for name in ["M_ST_NA_1", "M_ST_TB_1"] {
        let values = [(json!(-64), Value::I64(-64)), (json!(63), Value::I64(63))];
        cases.push((name, ValueKind::I64, values));
    }
    for name in ["M_BO_NA_1", "M_BO_TB_1"] {
        let values = [
            (json!(0x8000_0001_u32), Value::I64(0x8000_0001)),
            (json!(0x1234_5678), Value::I64(0x1234_5678)),
        ];
        cases.push((name, ValueKind::I64, values));
    }
    for name in ["M_ME_NA_1", "M_ME_TD_1", "M_ME_ND_1"] {
        let values = [(json!(-1.0), Value::F64(-1.0)), (json!(0.25), Value::F64(0.25))];
        cases.push((name, ValueKind::F64, values));
    }
    for name in ["M_ME_NB_1", "M_ME_TE_1"] {
        let values = [(json!(-32768), Value::F64(-32768.0)), (json!(7), Value::F64(7.0))];
        cases.push((name, ValueKind::F64, values));
    }
    for name in ["M_ME_NC_1", "M_ME_TF_1"] {
        let values = [(json!(-230.5), Value::F64(-230.5)), (json!(1e30_f32), f32_value(1e30))];
        cases.push((name, ValueKind::F64, values));
    }
    for name in ["M_IT_NA_1", "M_IT_TB_1"] {
        let values =
            [(json!(-7), Value::I64(-7)), (json!(2_147_483_647), Value::I64(2_147_483_647))];
        cases.push((name, ValueKind::I64, values));
    }
    cases
}

fn f32_value(value: f32) -> Value {
    Value::F64(f64::from(value))
}

#[test]
fn every_type_is_read_as_the_station_has_it() {
    let cases = cases();
    let addressed = || (1..).zip(&cases);
    let points: Vec<_> = addressed()
        .map(|(ioa, (name, _, [(first, _), _]))| point(ioa, name, first.clone()))
        .collect();
    let Some(mut peer) = peer(&points) else { return };
    let tags = addressed().map(|(ioa, (_, kind, _))| tag(ioa, *kind)).collect();
    let settings = json!({"counter_period_seconds": 60, "clock_sync_period_seconds": 60});
    let running = start(peer.port, settings, tags);
    for (ioa, (name, _, [(_, expected), _])) in addressed() {
        // c104 leaves this one out of interrogations.
        if *name != "M_ME_ND_1" {
            running.wait_for(ioa, expected.clone());
        }
    }
    let links = running.recorder.recording().links;
    let states: Vec<_> = links.iter().map(|(state, _)| *state).collect();
    assert_eq!(states, [LinkState::Connecting, LinkState::Up], "{links:?}");
    peer.command(&json!({"clock": true}));

    // 2026-01-02 03:04:05.678 UTC.
    let time_millis = 1_767_323_045_678_u64;
    for (ioa, (name, _, [_, (second, expected)])) in addressed() {
        let mut changed = point(ioa, name, second.clone());
        let has_time = ["_TB_", "_TD_", "_TE_", "_TF_"].iter().any(|form| name.contains(form));
        if has_time {
            changed["time_millis"] = json!(time_millis);
        }
        peer.command(&json!({"set": changed}));
        running.wait_for(ioa, expected.clone());
        let source_time = running.recorder.latest(ioa).unwrap().source_time;
        let wanted = UNIX_EPOCH + Duration::from_millis(time_millis);
        assert_eq!(source_time, has_time.then_some(wanted), "{name}");
    }
    // The station has started anew: all is asked for again.
    running.recorder.clear();
    peer.command(&json!({"initialised": 1}));
    let (.., [_, (_, expected)]) = &cases[0];
    running.wait_for(1, expected.clone());
}

#[test]
fn quality_is_carried_over() {
    let Some(mut peer) = peer(&[point(1, "M_ME_NC_1", json!(1.0))]) else { return };
    let running = start(peer.port, json!({}), vec![tag(1, ValueKind::F64)]);
    running.wait_for(1, Value::F64(1.0));
    let cases = [
        (0x80, Quality::Bad(Reason::Sensor)),
        (0x40, Quality::Bad(Reason::Communication)),
        (0x20, Quality::Uncertain(Reason::Unknown)),
        (0x10, Quality::Uncertain(Reason::Unknown)),
        (0x01, Quality::Uncertain(Reason::OutOfRange)),
    ];
    for (value, (bits, quality)) in (2..).zip(cases) {
        let mut changed = point(1, "M_ME_NC_1", json!(f64::from(value)));
        changed["quality"] = json!(bits);
        peer.command(&json!({"set": changed}));
        running.wait("quality", 1, |sample| {
            sample.value == Some(Value::F64(f64::from(value))) && sample.quality == quality
        });
    }
}

#[test]
fn a_killed_station_makes_tags_bad_and_a_restarted_one_good() {
    let points =
        |value: f64| [point(1, "M_ME_NC_1", json!(value)), point(2, "M_SP_NA_1", json!(true))];
    let Some(peer) = peer(&points(5.0)) else { return };
    let port = peer.port;
    let running = start(port, json!({}), vec![tag(1, ValueKind::F64), tag(2, ValueKind::Bool)]);
    running.wait_for(1, Value::F64(5.0));
    running.wait_for(2, Value::Bool(true));
    running.recorder.clear();
    let _peer = peer.restart(&spec(&points(50.0)));
    running.wait_for(1, Value::F64(50.0));
    running.wait_for(2, Value::Bool(true));
    let recording = running.recorder.recording();
    for tag in [1, 2] {
        let first = recording.samples.iter().find(|sample| sample.tag == tag).unwrap();
        assert_eq!(first.quality, Quality::Bad(Reason::Communication), "at once, tag {tag}");
    }
    let down = recording.links.iter().find(|(state, _)| *state == LinkState::Down).unwrap();
    assert!(down.1.starts_with(&format!("127.0.0.1:{port}: ")), "{down:?}");
    assert!(down.1.contains("; next try in 0."), "{down:?}");
    let last = recording.links.back().cloned();
    assert_eq!(last, Some((LinkState::Up, format!("127.0.0.1:{port}: connected"))));
}

#[test]
#[cfg(target_os = "linux")]
fn a_frozen_station_makes_tags_bad_within_t3_and_t1() {
    let Some(peer) = peer(&[point(1, "M_ME_NC_1", json!(5.0))]) else { return };
    let settings = json!({"t1_seconds": 0.7, "t2_seconds": 0.3, "t3_seconds": 0.5});
    let mut running = start(peer.port, settings, vec![tag(1, ValueKind::F64)]);
    running.wait_for(1, Value::F64(5.0));
    // Idle for longer than t3: the station answers the tests, and the tag stays.
    std::thread::sleep(Duration::from_millis(1300));
    assert!(running.recorder.latest(1).unwrap().quality.is_good());
    peer.signal("STOP");
    let frozen = Instant::now();
    running.wait_for_bad(1, Reason::Communication);
    assert!(frozen.elapsed() < Duration::from_millis(2500), "{:?}", frozen.elapsed());
    running.wait_for_link(LinkState::Down, "no answer to a test of the connection within 700 ms");

    // It connects again, for the system accepts; but nothing is started.
    let stopping = Instant::now();
    running.plugin.stop();
    assert!(stopping.elapsed() < Duration::from_secs(2));
    assert!(!has_thread(peer.port));
    peer.signal("CONT");
    running.plugin.start(vec![tag(1, ValueKind::F64)], running.recorder.sink()).unwrap();
    running.wait_for(1, Value::F64(5.0));
    assert!(has_thread(peer.port));
}

#[test]
fn a_wrong_common_address_is_named_and_the_right_ones_are_served() {
    let Some(peer) = peer(&[point(1, "M_ME_NC_1", json!(5.0))]) else { return };
    let wrong = tag_spec(9, "wrong", ValueKind::F64, json!({"ioa": 1, "common_address": 9}));
    let running = start(peer.port, json!({}), vec![tag(1, ValueKind::F64), wrong]);
    running.wait_for(1, Value::F64(5.0));
    running.wait_for_bad(9, Reason::Configuration);
    running.wait_for_link(LinkState::Up, "does not know common address 9");
}

#[test]
fn a_thousand_changes_arrive_in_order() {
    let Some(mut peer) = peer(&[point(1, "M_ME_NB_1", json!(0))]) else { return };
    let running = start(peer.port, json!({}), vec![tag(1, ValueKind::I64)]);
    running.wait_for(1, Value::I64(0));
    running.recorder.clear();
    peer.command(&json!({"count": point(1, "M_ME_NB_1", json!(0)), "to": 1000}));
    running.wait_for(1, Value::I64(1000));
    let samples = running.recorder.recording().samples;
    let values: Vec<_> = samples.into_iter().map(|sample| sample.value).collect();
    let expected: Vec<_> = (1..=1000).map(|value| Some(Value::I64(value))).collect();
    assert_eq!(values, expected);
}
