//! Over connections that break in every way: no wrong value, nothing left behind.

use std::time::Instant;

use fault_proxy::{Fault, FaultProxy, Script, Usage};

use super::peer::{Kind, Peer};
use super::*;

/// All that may happen to a connection.
const FAULTS: [Fault; 9] = [
    Fault::None,
    Fault::Split,
    Fault::Delay,
    Fault::Reset,
    Fault::Close,
    Fault::Vanish,
    Fault::Trickle,
    Fault::Garbage,
    Fault::Swap,
];
/// Delays that make reconnects quick.
const AT_ONCE: Reconnect =
    Reconnect { min: Duration::from_millis(1), max: Duration::from_millis(4) };
/// Object addresses; values have them in their bits 24 to 30.
const TAGS: [u32; 3] = [1, 2, 3];
/// Connections of a test of all faults.
const CONNECTIONS: u64 = 40;
/// Descriptors and threads that a plugin, a proxy and their connections may hold at
/// once, beside those that were there before.
const MAX_DESCRIPTORS: usize = 24;
const MAX_THREADS: usize = 8;
/// Longest time of a test.
const MAX_TEST: Duration = Duration::from_secs(120);

fn station() -> Option<Peer> {
    let point = |ioa: &u32| json!({"common_address": 1, "ioa": ioa, "type": "M_BO_NA_1", "value": ioa << 24});
    let points: Vec<_> = TAGS.iter().map(point).collect();
    Peer::start(Kind::Hat, &json!({"points": points, "stamp_seconds": 0.005}))
}

fn tags() -> Vec<TagSpec> {
    TAGS.map(|ioa| tag(ioa, ValueKind::I64)).into()
}

fn quick() -> serde_json::Value {
    json!({"t0_millis": 1000, "t1_millis": 300, "t2_millis": 200, "t3_millis": 200})
}

fn proxy(peer: &Peer, script: &Script) -> FaultProxy {
    FaultProxy::start(([127, 0, 0, 1], peer.port).into(), script.clone()).unwrap()
}

/// Checks that every value is of its tag, and none older than one before; how many
/// there were of each.
#[track_caller]
fn check_values(recording: &Recording) -> [usize; TAGS.len()] {
    assert!(recording.samples.len() < busbar_plugin_sdk::testing::MAX_RECORDED);
    TAGS.map(|tag| {
        let of_tag = recording.samples.iter().filter(|sample| sample.tag == tag);
        let (mut newest, mut count) = (0, 0);
        for value in of_tag.filter_map(|sample| sample.value) {
            let Value::I64(value) = value else { panic!("{value:?}") };
            let (ioa, number) = (value >> 24, value & 0xFF_FFFF);
            assert_eq!(ioa, i64::from(tag), "a value of another tag");
            assert!(number >= newest, "tag {tag}: {number} after {newest}");
            newest = number;
            count += 1;
        }
        count
    })
}

#[test]
fn no_value_is_wrong_whatever_happens_to_connections() {
    let Some(peer) = station() else { return };
    let script = Script { seed: 4, faults: FAULTS.to_vec(), max_bytes: 600 };
    let proxy = proxy(&peer, &script);
    let running = start_with(proxy.port(), quick(), AT_ONCE, tags());
    let deadline = Instant::now() + MAX_TEST;
    while proxy.connections() < CONNECTIONS {
        assert!(Instant::now() < deadline, "{} connections", proxy.connections());
        std::thread::sleep(Duration::from_millis(200));
        // Some connections have no fault that ends them.
        let last = proxy.connections().saturating_sub(1);
        if matches!(script.plan(last).fault, Fault::None | Fault::Split | Fault::Delay) {
            proxy.hang_up();
        }
    }
    let counts = check_values(&running.recorder.recording());
    assert!(counts.iter().all(|count| *count >= 20), "{counts:?}");
    assert!(proxy.strikes() >= CONNECTIONS / 4, "{}", proxy.strikes());
}

#[test]
fn a_thousand_reconnects_leave_nothing_behind() {
    let Some(peer) = station() else { return };
    let before = Usage::now();
    let faults = vec![Fault::Reset, Fault::Close, Fault::Swap];
    let proxy = proxy(&peer, &Script { seed: 3, faults, max_bytes: 60 });
    let running = start_with(proxy.port(), quick(), AT_ONCE, tags());
    let deadline = Instant::now() + MAX_TEST;
    let mut most = before;
    while proxy.connections() < 1000 {
        assert!(Instant::now() < deadline, "{} connections", proxy.connections());
        std::thread::sleep(Duration::from_millis(5));
        most = most.max(Usage::now());
    }
    check_values(&running.recorder.recording());
    assert!(most.descriptors <= before.descriptors + MAX_DESCRIPTORS, "{before:?}, {most:?}");
    assert!(most.threads <= before.threads + MAX_THREADS, "{before:?}, {most:?}");
    drop(running);
    drop(proxy);
    let after = Usage::now();
    assert!(after.is_within(before), "{before:?}, then {after:?}");
}
