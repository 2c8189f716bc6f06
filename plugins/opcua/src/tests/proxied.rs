//! Over connections that break in every way: no wrong value, nothing left behind.

use std::time::Instant;

use fault_proxy::{Fault, FaultProxy, Script, Usage};

use super::peer::Peer;
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
const NODES: [&str; 3] = ["A", "B", "C"];
/// Connections of a test of all faults.
const CONNECTIONS: u64 = 60;
/// Those of a test of leaks.
const RECONNECTS: u64 = 150;
/// Descriptors and threads that a plugin, a proxy and their connections may hold at
/// once, beside those that were there before.
const MAX_DESCRIPTORS: usize = 24;
const MAX_THREADS: usize = 8;
/// Longest time of a test.
const MAX_TEST: Duration = Duration::from_secs(120);

/// A server whose values say which node they are of, and when they were made.
fn server() -> Option<Peer> {
    let nodes = NODES.map(|name| node(name, "Int64", &json!(0)));
    let mut peer = Peer::start(&json!({"nodes": nodes}))?;
    let ids = NODES.map(|name| format!("ns=2;s={name}"));
    peer.command(&json!({"count": ids, "seconds": 0.02}));
    Some(peer)
}

fn tags() -> Vec<TagSpec> {
    (0..).zip(NODES).map(|(index, name)| tag(index, ValueKind::I64, name)).collect()
}

fn quick() -> Json {
    json!({"connect_timeout_millis": 500, "silence_millis": 500})
}

fn proxy(peer: &Peer, script: &Script) -> FaultProxy {
    FaultProxy::start(([127, 0, 0, 1], peer.port).into(), script.clone()).unwrap()
}

/// Checks that every value is of its tag, and none older than one before; how many
/// there were of each.
#[track_caller]
fn check_values(recording: &Recording) -> [usize; NODES.len()] {
    [0, 1, 2].map(|tag: u32| {
        let of_tag = recording.samples.iter().filter(|sample| sample.tag == tag);
        let (mut newest, mut count) = (0, 0);
        for value in of_tag.filter_map(|sample| sample.value) {
            let Value::I64(value) = value else { panic!("{value:?}") };
            if value == 0 {
                continue;
            }
            let (node, number) = (value >> 24, value & 0xFF_FFFF);
            assert_eq!(node, i64::from(tag) + 1, "a value of another tag");
            assert!(number >= newest, "tag {tag}: {number} after {newest}");
            newest = number;
            count += 1;
        }
        count
    })
}

#[test]
fn no_value_is_wrong_whatever_happens_to_connections() {
    let Some(peer) = server() else { return };
    let script = Script { seed: 4, faults: FAULTS.to_vec(), max_bytes: 4000 };
    let proxy = proxy(&peer, &script);
    let running = start_with(proxy.port(), &quick(), AT_ONCE, tags());
    let deadline = Instant::now() + MAX_TEST;
    while proxy.connections() < CONNECTIONS {
        assert!(Instant::now() < deadline, "{} connections", proxy.connections());
        std::thread::sleep(Duration::from_millis(300));
        // Some connections have no fault that ends them.
        let last = proxy.connections().saturating_sub(1);
        if matches!(script.plan(last).fault, Fault::None | Fault::Split | Fault::Delay) {
            proxy.hang_up();
        }
    }
    let counts = check_values(&running.recorder.recording());
    assert!(counts.iter().all(|count| *count >= 10), "{counts:?}");
    assert!(proxy.strikes() >= CONNECTIONS / 4, "{}", proxy.strikes());
}

#[test]
fn hundreds_of_reconnects_leave_nothing_behind() {
    let Some(peer) = server() else { return };
    let before = Usage::now();
    let faults = vec![Fault::Reset, Fault::Close, Fault::Swap];
    let proxy = proxy(&peer, &Script { seed: 3, faults, max_bytes: 4000 });
    let running = start_with(proxy.port(), &quick(), AT_ONCE, tags());
    let deadline = Instant::now() + MAX_TEST;
    let mut most = before;
    while proxy.connections() < RECONNECTS {
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
