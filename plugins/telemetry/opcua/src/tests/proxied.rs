//! Over connections that break in every way: no wrong value, nothing left behind.

use fault_proxy::{
    ALL_FAULTS, ConnectionFault, ENDLESS_FAULTS, FaultProxy, FaultScript, ResourceUsage,
    check_stamps,
};

use peer_process::Peer;

use super::peer;
use super::*;

/// Delays that make reconnects quick.
const AT_ONCE: ReconnectBounds =
    ReconnectBounds { min: Duration::from_millis(1), max: Duration::from_millis(4) };
const NODES: [&str; 3] = ["A", "B", "C"];
/// Number of connections of a test of all faults.
const CONNECTIONS: u64 = 60;
/// Number of connections of a test of leaks.
const RECONNECTS: u64 = 150;

/// Starts a server whose values encode their node and the time of their making.
fn server() -> Option<Peer> {
    let nodes = NODES.map(|name| node(name, "Int64", &json!(0)));
    let mut peer = peer::start(&json!({"nodes": nodes}))?;
    let ids = NODES.map(|name| format!("ns=2;s={name}"));
    peer.command(&json!({"count": ids, "seconds": 0.02}));
    Some(peer)
}

fn tags() -> Vec<TagSpec> {
    (1..).zip(NODES).map(|(index, name)| tag(index, ValueKind::I64, name)).collect()
}

fn quick() -> Json {
    json!({"connect_timeout_seconds": 0.5, "silence_seconds": 0.5})
}

fn proxy(peer: &Peer, script: &FaultScript) -> FaultProxy {
    FaultProxy::start(([127, 0, 0, 1], peer.port).into(), script.clone()).unwrap()
}

/// Returns the number of values of each tag, and checks that none is wrong.
#[track_caller]
fn check_values(recording: &Recording) -> [usize; NODES.len()] {
    let mut values = recording.integers();
    // Before the server began to count.
    values.retain(|(_, value)| *value != 0);
    check_stamps(&values, [1, 2, 3])
}

#[test]
fn no_value_is_wrong_whatever_happens_to_connections() {
    let Some(peer) = server() else { return };
    let script = FaultScript { seed: 4, faults: ALL_FAULTS.to_vec(), max_bytes: 4000 };
    let proxy = proxy(&peer, &script);
    let running = start_with(proxy.port(), &quick(), AT_ONCE, tags());
    proxy.break_all(&script, CONNECTIONS, Duration::from_millis(300), &ENDLESS_FAULTS);
    let counts = check_values(&running.recorder.recording());
    assert!(counts.iter().all(|count| *count >= 10), "{counts:?}");
}

#[test]
fn hundreds_of_reconnects_leave_nothing_behind() {
    let Some(peer) = server() else { return };
    let before = ResourceUsage::now();
    let faults = vec![ConnectionFault::Reset, ConnectionFault::Close, ConnectionFault::Swap];
    let proxy = proxy(&peer, &FaultScript { seed: 3, faults, max_bytes: 4000 });
    let running = start_with(proxy.port(), &quick(), AT_ONCE, tags());
    proxy.wear_out(RECONNECTS, before);
    check_values(&running.recorder.recording());
    drop(running);
    drop(proxy);
    ResourceUsage::now().assert_within(before);
}
