//! Over connections that break in every way: no wrong value, nothing left behind.

use fault_proxy::{
    ALL_FAULTS, ConnectionFault, ENDLESS_FAULTS, FaultProxy, FaultScript, ResourceUsage,
    check_stamps,
};

use super::*;

/// Delays that make reconnects quick.
const AT_ONCE: ReconnectBounds =
    ReconnectBounds { min: Duration::from_millis(1), max: Duration::from_millis(4) };
/// Integers whose values have their number in bits 24 to 30, and count up.
const TAGS: [u32; 3] = [1, 2, 3];
/// Connections of a test of all faults, and of one that leaves nothing behind.
const CONNECTIONS: u64 = 40;
const RECONNECTS: u64 = 300;

fn server() -> Option<Peer> {
    peer::start(&json!({"stamp_seconds": 0.005}))
}

fn tags() -> Vec<TagSpec> {
    TAGS.map(|number| tag(number, ValueKind::I64, &format!("GGIO1.IntIn{number}"), "ST")).into()
}

fn quick() -> serde_json::Value {
    json!({"connect_seconds": 1, "timeout_seconds": 0.3, "test_seconds": 0.2})
}

fn proxy(peer: &Peer, script: &FaultScript) -> FaultProxy {
    FaultProxy::start(([127, 0, 0, 1], peer.port).into(), script.clone()).unwrap()
}

/// Counts the values of each tag; none may be wrong.
#[track_caller]
fn check_values(recording: &Recording) -> [usize; TAGS.len()] {
    let mut values = recording.integers();
    // Before the server began to count.
    values.retain(|(_, value)| *value != 0);
    check_stamps(&values, TAGS)
}

#[test]
fn no_value_is_wrong_whatever_happens_to_connections() {
    let Some(peer) = server() else { return };
    let script = FaultScript { seed: 4, faults: ALL_FAULTS.to_vec(), max_bytes: 2000 };
    let proxy = proxy(&peer, &script);
    let running = start_with(proxy.port(), quick(), AT_ONCE, tags());
    proxy.break_all(&script, CONNECTIONS, Duration::from_millis(300), &ENDLESS_FAULTS);
    let counts = check_values(&running.recorder.recording());
    assert!(counts.iter().all(|count| *count >= 20), "{counts:?}");
}

#[test]
fn hundreds_of_reconnects_leave_nothing_behind() {
    let Some(peer) = server() else { return };
    // The first event loop of a process makes descriptors that stay.
    drop(start(peer.port, quick(), tags()));
    let before = ResourceUsage::now();
    let faults = vec![ConnectionFault::Reset, ConnectionFault::Close, ConnectionFault::Swap];
    let proxy = proxy(&peer, &FaultScript { seed: 3, faults, max_bytes: 400 });
    let running = start_with(proxy.port(), quick(), AT_ONCE, tags());
    proxy.wear_out(RECONNECTS, before);
    check_values(&running.recorder.recording());
    drop(running);
    drop(proxy);
    ResourceUsage::now().assert_within(before);
}
