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
/// Object addresses; values have them in their bits 24 to 30.
const TAGS: [u32; 3] = [1, 2, 3];
/// Connections of a test of all faults.
const CONNECTIONS: u64 = 40;

fn station() -> Option<Peer> {
    let point = |ioa: &u32| json!({"common_address": 1, "ioa": ioa, "type": "M_BO_NA_1", "value": ioa << 24});
    let points: Vec<_> = TAGS.iter().map(point).collect();
    peer::start(peer::HAT, &json!({"points": points, "stamp_seconds": 0.005}))
}

fn tags() -> Vec<TagSpec> {
    TAGS.map(|ioa| tag(ioa, ValueKind::I64)).into()
}

fn quick() -> serde_json::Value {
    json!({"t0_seconds": 1, "t1_seconds": 0.3, "t2_seconds": 0.2, "t3_seconds": 0.2})
}

fn proxy(peer: &Peer, script: &FaultScript) -> FaultProxy {
    FaultProxy::start(([127, 0, 0, 1], peer.port).into(), script.clone()).unwrap()
}

#[test]
fn no_value_is_wrong_whatever_happens_to_connections() {
    let Some(peer) = station() else { return };
    let script = FaultScript { seed: 4, faults: ALL_FAULTS.to_vec(), max_bytes: 600 };
    let proxy = proxy(&peer, &script);
    let running = start_with(proxy.port(), quick(), AT_ONCE, tags());
    proxy.break_all(&script, CONNECTIONS, Duration::from_millis(200), &ENDLESS_FAULTS);
    let counts = check_stamps(&running.recorder.recording().integers(), TAGS);
    assert!(counts.iter().all(|count| *count >= 20), "{counts:?}");
}

#[test]
fn a_thousand_reconnects_leave_nothing_behind() {
    let Some(peer) = station() else { return };
    let before = ResourceUsage::now();
    let faults = vec![ConnectionFault::Reset, ConnectionFault::Close, ConnectionFault::Swap];
    let proxy = proxy(&peer, &FaultScript { seed: 3, faults, max_bytes: 60 });
    let running = start_with(proxy.port(), quick(), AT_ONCE, tags());
    proxy.wear_out(1000, before);
    check_stamps(&running.recorder.recording().integers(), TAGS);
    drop(running);
    drop(proxy);
    ResourceUsage::now().assert_within(before);
}
