//! Against hat-drivers, another independent implementation: types, causes and
//! times as the tests want them.

use std::time::Instant;

use super::peer;
use super::*;

fn point(ioa: u32, kind: &str, value: serde_json::Value) -> serde_json::Value {
    json!({"common_address": 1, "ioa": ioa, "type": kind, "value": value})
}

/// A point with more fields.
fn with(mut point: serde_json::Value, more: serde_json::Value) -> serde_json::Value {
    point.as_object_mut().unwrap().extend(more.as_object().unwrap().clone());
    point
}

fn spec(points: &[serde_json::Value]) -> serde_json::Value {
    json!({ "points": points })
}

#[test]
fn every_type_is_read_as_the_station_has_it() {
    let on = || Value::DoublePoint(DoublePoint::On);
    let cases = [
        ("M_SP_NA_1", ValueKind::Bool, json!(true), Value::Bool(true)),
        ("M_SP_TB_1", ValueKind::Bool, json!(true), Value::Bool(true)),
        ("M_DP_NA_1", ValueKind::DoublePoint, json!(2), on()),
        ("M_DP_TB_1", ValueKind::DoublePoint, json!(2), on()),
        ("M_ST_NA_1", ValueKind::F64, json!(-64), Value::F64(-64.0)),
        ("M_ST_TB_1", ValueKind::I64, json!(63), Value::I64(63)),
        ("M_BO_NA_1", ValueKind::I64, json!(0x8765_4321_u32), Value::I64(0x8765_4321)),
        ("M_BO_TB_1", ValueKind::I64, json!(1), Value::I64(1)),
        ("M_ME_NA_1", ValueKind::F64, json!(-0.5), Value::F64(-0.5)),
        ("M_ME_ND_1", ValueKind::F64, json!(0.25), Value::F64(0.25)),
        ("M_ME_TD_1", ValueKind::F64, json!(0.5), Value::F64(0.5)),
        ("M_ME_NB_1", ValueKind::I64, json!(-32768), Value::I64(-32768)),
        ("M_ME_TE_1", ValueKind::F64, json!(32767), Value::F64(32767.0)),
        ("M_ME_NC_1", ValueKind::F64, json!(230.5), Value::F64(230.5)),
        ("M_ME_TF_1", ValueKind::F64, json!(-0.125), Value::F64(-0.125)),
        ("M_IT_NA_1", ValueKind::I64, json!(-2_147_483_648_i64), Value::I64(-2_147_483_648)),
        ("M_IT_TB_1", ValueKind::F64, json!(9), Value::F64(9.0)),
        ("M_PS_NA_1", ValueKind::I64, json!(0x8005), Value::I64(0x8005)),
        ("M_EP_TD_1", ValueKind::DoublePoint, json!(2), on()),
        ("M_EP_TE_1", ValueKind::I64, json!(0b10_0101), Value::I64(0b10_0101)),
        ("M_EP_TF_1", ValueKind::I64, json!(0b1010), Value::I64(0b1010)),
    ];
    // 2026-01-02 03:04:05.678 UTC.
    let time = json!({"time": [2026, 1, 2, 3, 4, 5678]});
    let has_time = |name: &str| name.contains("_T");
    let points: Vec<_> = (1..)
        .zip(&cases)
        .map(|(ioa, (name, _, value, _))| {
            let point = point(ioa, name, value.clone());
            if has_time(name) { with(point, time.clone()) } else { point }
        })
        .collect();
    let Some(peer) = peer::start(peer::HAT, &spec(&points)) else { return };
    let mut tags: Vec<_> = (1..).zip(&cases).map(|(ioa, (_, kind, ..))| tag(ioa, *kind)).collect();
    // Single bits of the packed points at 18.
    for bit in 0..16 {
        let address = json!({"ioa": 18, "bit": bit});
        tags.push(tag_spec(100 + bit, &format!("bit{bit}"), ValueKind::Bool, address));
    }
    let running = start(peer.port, json!({"counter_period_seconds": 60}), tags);
    let time = UNIX_EPOCH + Duration::from_millis(1_767_323_045_678);
    for (ioa, (name, _, _, expected)) in (1..).zip(cases) {
        running.wait_for(ioa, expected);
        let source_time = running.recorder.latest(ioa).unwrap().source_time;
        assert_eq!(source_time, has_time(name).then_some(time), "{name}");
    }
    for bit in 0..16 {
        running.wait_for(100 + bit, Value::Bool(0x8005 >> bit & 1 == 1));
    }
}

#[test]
fn quality_time_and_cause_are_heeded() {
    let Some(mut peer) = peer::start(peer::HAT, &spec(&[point(1, "M_ME_TE_1", json!(0))])) else {
        return;
    };
    let settings = json!({"utc_offset_minutes": 60});
    let running = start(peer.port, settings, vec![tag(1, ValueKind::I64)]);
    running.wait_for(1, Value::I64(0));
    let (bad, uncertain) = (Quality::Bad, Quality::Uncertain);
    let time = json!([2026, 1, 2, 4, 4, 5678]);
    let winter = Some(UNIX_EPOCH + Duration::from_millis(1_767_323_045_678));
    let summer = Some(UNIX_EPOCH + Duration::from_millis(1_767_319_445_678));
    let cases = [
        (json!({"quality": 0x80}), bad(Reason::Sensor), winter),
        (json!({"quality": 0x40}), bad(Reason::Communication), winter),
        (json!({"quality": 0x20}), uncertain(Reason::Unknown), winter),
        (json!({"quality": 0x10}), uncertain(Reason::Unknown), winter),
        (json!({"quality": 0x01}), uncertain(Reason::OutOfRange), winter),
        (json!({"quality": 0xF1}), bad(Reason::Sensor), winter),
        (json!({"is_summer_time": true}), Quality::Good, summer),
        (json!({"is_time_invalid": true}), Quality::Good, None),
        (json!({"cause": "PERIODIC"}), Quality::Good, winter),
        (json!({"cause": "BACKGROUND_SCAN"}), Quality::Good, winter),
        (json!({"cause": "REQUEST"}), Quality::Good, winter),
        (json!({"cause": "REMOTE_COMMAND"}), Quality::Good, winter),
        (json!({"cause": "LOCAL_COMMAND"}), Quality::Good, winter),
        (json!({"cause": "INTERROGATED_GROUP16"}), Quality::Good, winter),
    ];
    let base = |value: i64| with(point(1, "M_ME_TE_1", json!(value)), json!({"time": time}));
    for (value, (more, quality, source_time)) in (1..).zip(cases) {
        // A value under test is marked, and is none of the process.
        peer.command(&json!({"send": with(base(-value), json!({"is_test": true}))}));
        running.wait("test", 1, |sample| {
            sample.value == Some(Value::I64(-value))
                && sample.flags == SampleFlags::TEST
                && sample.quality == bad(Reason::Unknown)
        });
        let is_substituted = more["quality"].as_u64().unwrap_or_default() & 0x20 != 0;
        let is_time_invalid = more["is_time_invalid"] == true;
        let flags = match (is_substituted, is_time_invalid) {
            (true, _) => SampleFlags::SUBSTITUTED,
            (_, true) => SampleFlags::TIME_UNUSABLE,
            _ => SampleFlags::LIVE,
        };
        peer.command(&json!({"send": with(base(value), more)}));
        let value = Some(Value::I64(value));
        let expected = Sample { tag: 1, value, quality, source_time, flags };
        running.wait("sample", 1, |sample| *sample == expected);
    }
}

/// A clock that is set back by some seconds, and then by an hour: what came last counts.
#[test]
fn values_count_in_order_of_arrival_whatever_the_clock_says() {
    let Some(mut peer) = peer::start(peer::HAT, &spec(&[point(1, "M_DP_NA_1", json!(1))])) else {
        return;
    };
    let running = start(peer.port, json!({}), vec![tag(1, ValueKind::DoublePoint)]);
    running.wait_for(1, Value::DoublePoint(DoublePoint::Off));
    let cases = [
        (2, [4, 4, 5678], DoublePoint::On),
        (1, [4, 4, 3678], DoublePoint::Off),
        (2, [3, 4, 5678], DoublePoint::On),
    ];
    for (state, [hour, minute, millis], expected) in cases {
        let time = json!([2026, 1, 2, hour, minute, millis]);
        let event = with(point(1, "M_DP_TB_1", json!(state)), json!({"time": time}));
        peer.command(&json!({"send": event}));
        running.wait("state", 1, |sample| {
            sample.value == Some(Value::DoublePoint(expected))
                && sample.quality.is_good()
                && sample.source_time.is_some()
                && sample.flags == SampleFlags::LIVE
        });
    }
}

#[test]
fn a_wrong_common_address_is_named_and_the_right_ones_are_served() {
    let Some(peer) = peer::start(peer::HAT, &spec(&[point(1, "M_ME_NB_1", json!(5))])) else {
        return;
    };
    let wrong = tag_spec(9, "wrong", ValueKind::I64, json!({"ioa": 1, "common_address": 9}));
    let running = start(peer.port, json!({}), vec![tag(1, ValueKind::I64), wrong]);
    running.wait_for(1, Value::I64(5));
    running.wait_for_bad(9, Reason::Configuration);
    running.wait_for_link(LinkState::Up, "does not know common address 9");
}

#[test]
fn a_thousand_changes_pass_the_windows_in_order() {
    let Some(mut peer) = peer::start(peer::HAT, &spec(&[point(1, "M_ME_NB_1", json!(0))])) else {
        return;
    };
    // As late as it may: every acknowledgement is one by w, the station's k is 12.
    let settings = json!({"w": 12, "t1_seconds": 200, "t2_seconds": 100});
    let running = start(peer.port, settings, vec![tag(1, ValueKind::I64)]);
    running.wait_for(1, Value::I64(0));
    running.recorder.clear();
    peer.command(&json!({"count": point(1, "M_ME_NB_1", json!(0)), "to": 1000}));
    running.wait_for(1, Value::I64(1000));
    let samples = running.recorder.recording().samples;
    let values: Vec<_> = samples.into_iter().map(|sample| sample.value).collect();
    let expected: Vec<_> = (1..=1000).map(|value| Some(Value::I64(value))).collect();
    assert_eq!(values, expected);
}

#[test]
fn a_redundancy_group_switches_over_and_keeps_the_others_ready() {
    let station = |value: i64| spec(&[point(1, "M_ME_NB_1", json!(value))]);
    let Some(mut first) = peer::start(peer::HAT, &station(1)) else { return };
    let mut second = peer::start(peer::HAT, &station(2)).unwrap();
    let settings = json!({
        "redundancy": [{"host": "127.0.0.1", "port": second.port}],
        "t1_seconds": 2, "t2_seconds": 1, "t3_seconds": 0.1
    });
    let mut running = start(first.port, settings, vec![tag(1, ValueKind::I64)]);
    // Whichever was quicker carries data.
    let has_value = |value| {
        move |seen: &Recording| {
            let good = |s: Sample| s.quality.is_good() && s.value == Some(Value::I64(value));
            seen.latest(1).is_some_and(good)
        }
    };
    let wait_for_any = |seen: &Recording| has_value(1)(seen) || has_value(2)(seen);
    assert!(running.recorder.wait_until(PATIENCE, wait_for_any));
    if has_value(2)(&running.recorder.recording()) {
        std::mem::swap(&mut first, &mut second);
    }
    first.command(&json!({"connections": [1, 1]}));
    second.command(&json!({"connections": [1, 0]}));
    // Several t3: the one that is kept ready is tested, and stays.
    std::thread::sleep(Duration::from_millis(500));
    second.command(&json!({"connections": [1, 0]}));

    let (lost, left) = (first.port, second.port);
    running.recorder.clear();
    let killed = Instant::now();
    drop(first);
    assert!(running.recorder.wait_until(PATIENCE, |seen| {
        seen.latest(1).is_some_and(|sample| sample.quality.is_good())
    }));
    assert!(killed.elapsed() < Duration::from_secs(1), "{:?}", killed.elapsed());
    let recording = running.recorder.recording();
    let bad = recording.samples.iter().next().unwrap().quality;
    assert_eq!(bad, Quality::Bad(Reason::Communication), "in between");
    running.wait_for_link(LinkState::Connecting, &format!("127.0.0.1:{lost}: "));
    running.wait_for_link(LinkState::Connecting, &format!("switching over to 127.0.0.1:{left}"));
    running.wait_for_link(LinkState::Up, &format!("127.0.0.1:{left}: connected"));
    second.command(&json!({"connections": [1, 1]}));
    running.plugin.stop();
    second.command(&json!({"connections": [0, 0]}));
}
