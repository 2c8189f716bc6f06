//! Brokers that go, hang, refuse, and follow each other.

use std::net::{Ipv4Addr, TcpListener};
use std::time::Instant;

use super::*;

fn one_tag() -> Vec<TagSpec> {
    vec![tag(1, ValueKind::I64, json!({"topic": "a"}))]
}

#[test]
fn a_broker_that_is_killed_and_started_again_brings_values_again() {
    let Some(mut broker) = Broker::start() else { return };
    let running = start(broker.port, &json!({}), one_tag());
    {
        let Some(mut peer) = Client::publisher(broker.port, &json!({})) else { return };
        peer.publish("a", "1");
        running.wait_for(1, Value::I64(1));
    }
    broker.kill();
    running.wait_for_link(LinkState::Down, "next try in");
    running.wait_for_bad(1, Reason::Communication);
    running.recorder.clear();
    broker.resume().unwrap();
    running.wait_for_link(LinkState::Up, "connected");
    let Some(mut peer) = Client::publisher(broker.port, &json!({})) else { return };
    peer.publish("a", "2");
    running.wait_for(1, Value::I64(2));
}

#[test]
fn a_broker_that_hangs_is_noticed_within_the_keep_alive() {
    let Some(broker) = Broker::start() else { return };
    let running = start(broker.port, &json!({"keep_alive_seconds": 2}), one_tag());
    let Some(mut peer) = Client::publisher(broker.port, &json!({})) else { return };
    peer.publish("a", "1");
    running.wait_for(1, Value::I64(1));
    // Silence alone is no fault: the broker is asked.
    std::thread::sleep(Duration::from_secs(5));
    running.wait_for(1, Value::I64(1));
    broker.signal("STOP");
    let stopped = Instant::now();
    running.wait_for_bad(1, Reason::Communication);
    let noticed = stopped.elapsed();
    assert!(noticed < Duration::from_millis(2500), "{noticed:?}");
    running.wait_for_link(LinkState::Down, "said nothing for 2000 ms");
    // Until topics are subscribed to anew, a broker passes nothing on.
    running.recorder.clear();
    broker.signal("CONT");
    running.wait_for_link(LinkState::Up, "connected");
    running.wait_for_quality(1, Quality::Bad(Reason::NotConnected));
    peer.publish("a", "2");
    running.wait_for(1, Value::I64(2));
}

#[test]
fn the_next_broker_of_a_cluster_takes_over() {
    let (Some(mut first), Some(second)) = (Broker::start(), Broker::start()) else { return };
    let settings = json!({"cluster": [{"host": "127.0.0.1", "port": second.port}]});
    let running = start(first.port, &settings, one_tag());
    let Some(mut peer) = Client::publisher(second.port, &json!({})) else { return };
    let lost = Instant::now();
    first.kill();
    running.wait_for_link(LinkState::Connecting, "the next broker is tried");
    running.wait_for_link(LinkState::Up, &format!("{}: connected", second.port));
    assert!(lost.elapsed() < Duration::from_secs(1), "{:?}", lost.elapsed());
    peer.publish("a", "3");
    running.wait_for(1, Value::I64(3));
}

#[test]
fn whoever_is_no_broker_is_told_so() {
    let listen = || TcpListener::bind((Ipv4Addr::LOCALHOST, 0)).unwrap();
    let listener = listen();
    let port = listener.local_addr().unwrap().port();
    let silent = start_only(port, &json!({"timeout_seconds": 0.2}), one_tag());
    silent.wait_for_link(LinkState::Down, "does it speak MQTT on this port?");
    drop(silent);
    // Another, where no connection waits any more.
    let listener = listen();
    let port = listener.local_addr().unwrap().port();
    let talker = std::thread::spawn(move || {
        use std::io::Write;
        let (mut stream, _) = listener.accept().unwrap();
        let _ = stream.write_all("HTTP/1.1 400 Bad Request\r\n".repeat(10).as_bytes());
        std::thread::sleep(Duration::from_millis(500));
    });
    let told = start_only(port, &json!({"timeout_seconds": 2}), one_tag());
    told.wait_for_link(LinkState::Down, "is the port right, and is it encrypted?");
    talker.join().unwrap();
    drop(told);
    let closed = listen().local_addr().unwrap().port();
    let refused = start_only(closed, &json!({}), one_tag());
    refused.wait_for_link(LinkState::Down, "connection refused");
}

#[test]
fn stopping_ends_the_thread_and_the_connection() {
    let Some(broker) = Broker::start() else { return };
    let mut running = start(broker.port, &json!({}), one_tag());
    let began = Instant::now();
    running.plugin.stop();
    assert!(began.elapsed() < Duration::from_secs(2));
    let Some(mut peer) = Client::publisher(broker.port, &json!({})) else { return };
    running.recorder.clear();
    peer.publish("a", "1");
    std::thread::sleep(Duration::from_millis(300));
    assert!(running.recorder.recording().samples.is_empty());
}
