//! Alarm conditions of asyncua as tags.

use super::peer;
use super::*;

/// Test time 2026-01-02 03:04:05.678 UTC, milliseconds since 1970.
const TIME_MILLIS: u64 = 1_767_323_045_678;
/// Ids of the states of a shelf (OPC 10000-6, Annex A).
const UNSHELVED: u32 = 2930;
const TIMED_SHELVED: u32 = 2929;

const FIELDS: [&str; 6] =
    ["ActiveState", "AckedState", "ShelvingState", "SuppressedState", "Retain", "Severity"];

fn tags(condition: &str) -> Vec<TagSpec> {
    let kind = |field| if field == "Severity" { ValueKind::I64 } else { ValueKind::Bool };
    (0..)
        .zip(FIELDS)
        .map(|(tag, field)| {
            let address = json!({"condition": format!("ns=2;s={condition}"), "field": field});
            tag_spec(tag, field, kind(field), address)
        })
        .collect()
}

fn state(active: bool, acked: bool, shelf: u32, severity: u16) -> Json {
    json!({
        "ActiveState/Id": active, "AckedState/Id": acked, "SuppressedState/Id": false,
        "ShelvingState/CurrentState/Id": shelf, "Retain": active || !acked,
        "Severity": severity, "time_millis": TIME_MILLIS,
    })
}

#[track_caller]
fn check(running: &Running, expected: [bool; 5], severity: i64) {
    for (tag, value) in (0..).zip(expected) {
        running.wait_for(tag, Value::Bool(value));
    }
    running.wait_for(5, Value::I64(severity));
}

#[test]
fn a_condition_is_followed_from_its_state_at_connecting_on() {
    let spec = json!({
        "conditions": ["ns=2;s=Hot"],
        "alarms": {"ns=2;s=Hot": state(true, false, UNSHELVED, 700)}
    });
    let Some(mut peer) = peer::start(&spec) else { return };
    let running = start(peer.port, &json!({}), tags("Hot"));
    check(&running, [true, false, false, false, true], 700);
    let time = UNIX_EPOCH + Duration::from_millis(TIME_MILLIS);
    running.wait_for_any(0, |sample| sample.source_time == Some(time));
    let mut change =
        |fields: &Json| peer.command(&json!({"alarm": "ns=2;s=Hot", "fields": fields}));
    change(&state(true, true, TIMED_SHELVED, 300));
    check(&running, [true, true, true, false, true], 300);
    change(&state(false, true, UNSHELVED, 300));
    check(&running, [false, true, false, false, false], 300);
    // What the server does not vouch for is not good.
    change(&json!({"Quality": 0x8031_0000_u32}));
    running.wait_for_bad(0, Reason::Communication);
}

#[test]
fn a_condition_of_no_interest_is_normal_and_one_that_is_not_there_is_bad() {
    let Some(peer) = peer::start(&json!({"conditions": ["ns=2;s=Calm"]})) else { return };
    let running = start(peer.port, &json!({}), tags("Calm"));
    running.wait_for(0, Value::Bool(false));
    running.wait_for(1, Value::Bool(true));
    running.wait_for(4, Value::Bool(false));
    // Nobody knows whether it is shelved.
    running.wait_for_bad(2, Reason::NotConnected);
    let missing = start(peer.port, &json!({}), tags("Missing"));
    missing.wait_for_bad(0, Reason::Configuration);
    assert!(!missing.has_good_samples());
}

#[test]
fn conditions_of_a_server_that_is_lost_are_bad_and_those_of_the_next_one_good() {
    let spec = |active| {
        json!({
            "conditions": ["ns=2;s=Hot"],
            "alarms": {"ns=2;s=Hot": state(active, false, UNSHELVED, 500)}
        })
    };
    let Some(peer) = peer::start(&spec(true)) else { return };
    let running = start(peer.port, &json!({}), tags("Hot"));
    running.wait_for(0, Value::Bool(true));
    running.recorder.clear();
    let _peer = peer.restart(&spec(false));
    running.wait_for(0, Value::Bool(false));
    let samples = running.recorder.recording().samples;
    let first = samples.iter().find(|sample| !sample.quality.is_good()).unwrap();
    assert_eq!(first.quality, Quality::Bad(Reason::Communication));
}

#[test]
fn a_server_without_refresh_serves_its_values_all_the_same() {
    let spec = json!({
        "conditions": ["ns=2;s=Hot"], "condition_refresh": false,
        "nodes": [node("A", "Double", &json!(5.0))]
    });
    let Some(peer) = peer::start(&spec) else { return };
    let mut tags = tags("Hot");
    tags.push(tag(9, ValueKind::F64, "A"));
    let running = start(peer.port, &json!({}), tags);
    running.wait_for(9, Value::F64(5.0));
    running.wait_for_bad(0, Reason::Configuration);
}
