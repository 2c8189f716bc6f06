//! Against pymodbus, an independent implementation.

use std::time::Instant;

use super::peer::Peer;
use super::*;

#[test]
fn every_type_is_read_as_the_server_has_it() {
    let Some(peer) = Peer::start(&types::values()) else { return };
    types::check(json!({"host": "127.0.0.1", "port": peer.port}));
}

#[test]
fn a_change_is_seen_and_groups_keep_their_own_beat() {
    let values = json!({"holding": {"10": [1, 2]}});
    let Some(mut peer) = Peer::start(&values) else {
        return;
    };
    let slow = json!({
        "table": "holding", "register": 11, "type": "u16", "poll_group": "slow"
    });
    let running = start(
        peer.port,
        json!({"poll_groups": {"slow": {"poll_seconds": 60}}}),
        vec![holding(1, 10), tag_spec(2, "slow", ValueKind::F64, slow)],
    );
    running.wait_for(1, Value::F64(1.0));
    running.wait_for(2, Value::F64(2.0));
    peer.command("set holding 10 77 78");
    running.wait_for(1, Value::F64(77.0));
    assert_eq!(running.recorder.latest(2).and_then(|s| s.value), Some(Value::F64(2.0)));
}

#[test]
fn a_killed_server_makes_tags_bad_and_a_restarted_one_good() {
    let values = json!({"holding": {"0": [5, 6]}});
    let Some(peer) = Peer::start(&values) else {
        return;
    };
    let port = peer.port;
    let running = start(port, json!({}), vec![holding(1, 0), holding(2, 1)]);
    running.wait_for(1, Value::F64(5.0));
    running.wait_for(2, Value::F64(6.0));
    drop(peer);
    running.wait_for_bad(1, Reason::Communication);
    running.wait_for_bad(2, Reason::Communication);
    let refused = |seen: &busbar_plugin_sdk::testing::Recording| {
        seen.links.iter().any(|(state, message)| {
            *state == LinkState::Down
                && message
                    .starts_with(&format!("127.0.0.1:{port}: connection refused; next try in 0."))
        })
    };
    assert!(
        running.recorder.wait_until(PATIENCE, refused),
        "{:?}",
        running.recorder.recording().links
    );
    running.recorder.clear();
    let _peer = Peer::restart(port, &json!({"holding": {"0": [50, 60]}}));
    running.wait_for(1, Value::F64(50.0));
    running.wait_for(2, Value::F64(60.0));
    let last = running.recorder.recording().links.back().cloned();
    assert_eq!(last, Some((LinkState::Up, format!("127.0.0.1:{port}: connected"))));
}

#[test]
fn only_tags_at_refused_addresses_are_bad() {
    let values = json!({
        "holding": {"0": [10, 11, 12, 13, 14, 15], "8": [18, 19], "12": [22]},
        "input": {"0": [7]}
    });
    let Some(peer) = Peer::start(&values) else {
        return;
    };
    let in_a_refused_table = json!({"table": "discrete", "register": 200});
    let running = start(
        peer.port,
        json!({}),
        vec![
            holding(0, 0),
            holding(5, 5),
            holding(6, 6),
            holding(8, 8),
            holding(9, 9),
            holding(10, 10),
            holding(12, 12),
            holding(500, 500),
            tag_spec(200, "discrete", ValueKind::Bool, in_a_refused_table),
        ],
    );
    for tag in [0, 5, 8, 9, 12] {
        running.wait_for(tag, Value::F64(10.0 + f64::from(tag)));
    }
    for tag in [6, 10, 500, 200] {
        running.wait_for_bad(tag, Reason::Configuration);
    }
    // It stays like that, over one connection.
    running.recorder.clear();
    for tag in [0, 5, 8, 9, 12] {
        running.wait_for(tag, Value::F64(10.0 + f64::from(tag)));
    }
    running.wait_for_bad(6, Reason::Configuration);
    assert_eq!(running.recorder.recording().links, []);
}

#[test]
fn a_frozen_server_makes_tags_bad_within_the_deadline() {
    let Some(mut peer) = Peer::start(&json!({"holding": {"0": 1}})) else {
        return;
    };
    let running = start(peer.port, json!({"timeout_seconds": 0.2}), vec![holding(1, 0)]);
    running.wait_for(1, Value::F64(1.0));
    peer.command("freeze");
    let frozen = Instant::now();
    running.wait_for_bad(1, Reason::Communication);
    assert!(frozen.elapsed() < Duration::from_millis(1500));
    let said = |seen: &busbar_plugin_sdk::testing::Recording| {
        let wanted = "no answer within 200 ms to a read of holding register 0 of unit 1";
        seen.links.iter().any(|(_, said)| said.contains(wanted))
    };
    assert!(
        running.recorder.wait_until(PATIENCE, said),
        "{:?}",
        running.recorder.recording().links
    );
    peer.command("set holding 0 2");
    peer.command("thaw");
    running.wait_for(1, Value::F64(2.0));
}

#[test]
#[cfg(target_os = "linux")]
fn stop_is_quick_while_a_request_hangs_and_leaves_no_thread() {
    let Some(mut peer) = Peer::start(&json!({"holding": {"0": 1}})) else {
        return;
    };
    let port = peer.port;
    let mut running = start(port, json!({"timeout_seconds": 600}), vec![holding(1, 0)]);
    running.wait_for(1, Value::F64(1.0));
    peer.command("freeze");
    // Longer than a poll period: a request is under way now, and hangs.
    std::thread::sleep(Duration::from_millis(200));
    assert!(has_thread(port));
    let stopping = Instant::now();
    running.plugin.stop();
    assert!(stopping.elapsed() < Duration::from_secs(2));
    assert!(!has_thread(port));
    // And it can start again.
    peer.command("thaw");
    let recorder = Recorder::new();
    let start = running.plugin.start(vec![holding(1, 0)], recorder.sink());
    start.unwrap();
    assert!(
        recorder
            .wait_until(PATIENCE, |seen| { seen.latest(1).is_some_and(|s| s.quality.is_good()) })
    );
    drop(running);
    assert!(!has_thread(port), "dropping ends the thread too");
}
