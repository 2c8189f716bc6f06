//! Servers that end, hang or start anew.

use std::time::Instant;

use super::*;

fn tags() -> Vec<TagSpec> {
    vec![tag(1, ValueKind::F64, "MMXU1.TotW", "MX"), tag(2, ValueKind::Bool, "GGIO1.Ind1", "ST")]
}

/// By polling, and by reports with nothing to ask for meanwhile.
fn ways() -> [serde_json::Value; 2] {
    let quick = json!({"timeout_seconds": 0.6, "test_seconds": 0.3, "connect_seconds": 1});
    let mut reported = quick.clone();
    reported["poll_seconds"] = json!(3600);
    reported["reports"] = json!([{"rcb": "IED1LD0/LLN0.BR.brcbA01"}]);
    [quick, reported]
}

#[test]
fn a_killed_server_makes_tags_bad_and_a_restarted_one_good() {
    for settings in ways() {
        let Some(mut peer) = peer::start(&json!({})) else { return };
        let running = start(peer.port, settings, tags());
        running.wait_for(1, Value::F64(0.0));
        peer.signal("KILL");
        running.wait_for_bad(1, Reason::Communication);
        running.wait_for_bad(2, Reason::Communication);
        // Closed, or reset where it had not read all.
        running.wait_for_link(LinkState::Down, "connection");
        running.recorder.clear();
        peer = peer.restart(&json!({}));
        running.wait_for_link(LinkState::Up, "connected");
        running.wait_for(2, Value::Bool(false));
        peer.command(&json!({"object": "LD0/MMXU1.TotW", "values": {"mag.f": 4.5}}));
        running.wait_for(1, Value::F64(4.5));
    }
}

#[test]
fn a_frozen_server_is_noticed_within_the_limit() {
    for settings in ways() {
        let Some(peer) = peer::start(&json!({})) else { return };
        let running = start(peer.port, settings, tags());
        running.wait_for(1, Value::F64(0.0));
        peer.signal("STOP");
        let stopped = Instant::now();
        running.wait_for_bad(1, Reason::Communication);
        running.wait_for_bad(2, Reason::Communication);
        // test_seconds, or a poll, and timeout_seconds; the rest is the machine's.
        assert!(stopped.elapsed() < Duration::from_millis(1900), "{:?}", stopped.elapsed());
        running.wait_for_link(LinkState::Down, "within 600 ms");
        peer.signal("CONT");
        running.wait_for(2, Value::Bool(false));
    }
}

#[test]
fn another_way_is_taken_where_one_is_down() {
    let Some(peer) = peer::start(&json!({})) else { return };
    let nobody = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
    let closed = nobody.local_addr().unwrap().port();
    drop(nobody);
    let settings = json!({"redundancy": [{"host": "127.0.0.1", "port": peer.port}]});
    let running = start(closed, settings, tags());
    running.wait_for(1, Value::F64(0.0));
    running.wait_for_link(LinkState::Down, "connection refused");
    running.wait_for_link(LinkState::Up, &peer.port.to_string());
}
