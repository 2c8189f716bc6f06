//! Over connections that break in every way: no wrong value, nothing left behind.

use std::time::Instant;

use fault_proxy::{Fault, FaultProxy, Script, Usage};

use super::peer::{Libmodbus, Peer, Place, free_port};
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
/// Connections of a test of all faults.
const CONNECTIONS: u64 = 60;
/// Descriptors and threads that a plugin, a proxy and their connections may hold at
/// once, beside those that were there before.
const MAX_DESCRIPTORS: usize = 24;
const MAX_THREADS: usize = 8;
/// Longest time of a test.
const MAX_TEST: Duration = Duration::from_secs(120);

fn server_with_stamps() -> Option<Peer> {
    let mut peer = Libmodbus::compile()?.start(&Place::Tcp(free_port()));
    peer.command("stamp");
    Some(peer)
}

fn proxy(peer: &Peer, script: &Script) -> FaultProxy {
    FaultProxy::start(([127, 0, 0, 1], peer.port).into(), script.clone()).unwrap()
}

#[test]
fn no_value_is_wrong_whatever_happens_to_connections() {
    let Some(peer) = server_with_stamps() else { return };
    // Some 70 bytes a poll.
    let script = Script { seed: 20, faults: FAULTS.to_vec(), max_bytes: 400 };
    let proxy = proxy(&peer, &script);
    let settings = json!({"host": "127.0.0.1", "port": proxy.port(), "timeout_millis": 150});
    let running = start_with(settings, AT_ONCE, stamps::tags());
    let deadline = Instant::now() + MAX_TEST;
    while proxy.connections() < CONNECTIONS {
        assert!(Instant::now() < deadline, "{} connections", proxy.connections());
        std::thread::sleep(Duration::from_millis(150));
        // Some connections have no fault that ends them.
        let last = proxy.connections().saturating_sub(1);
        if matches!(script.plan(last).fault, Fault::None | Fault::Split | Fault::Delay) {
            proxy.hang_up();
        }
    }
    let counts = stamps::check(&running.recorder.recording());
    assert!(counts.iter().all(|count| *count >= 20), "{counts:?}");
    assert!(proxy.strikes() >= CONNECTIONS / 4, "{}", proxy.strikes());
}

#[test]
fn a_thousand_reconnects_leave_nothing_behind() {
    let Some(peer) = server_with_stamps() else { return };
    let before = Usage::now();
    let faults = vec![Fault::Reset, Fault::Close, Fault::Swap];
    let proxy = proxy(&peer, &Script { seed: 3, faults, max_bytes: 60 });
    let settings = json!({"host": "127.0.0.1", "port": proxy.port()});
    let running = start_with(settings, AT_ONCE, stamps::tags());
    let deadline = Instant::now() + MAX_TEST;
    let mut most = before;
    while proxy.connections() < 1000 {
        assert!(Instant::now() < deadline, "{} connections", proxy.connections());
        std::thread::sleep(Duration::from_millis(5));
        most = most.max(Usage::now());
    }
    stamps::check(&running.recorder.recording());
    assert!(most.descriptors <= before.descriptors + MAX_DESCRIPTORS, "{before:?}, {most:?}");
    assert!(most.threads <= before.threads + MAX_THREADS, "{before:?}, {most:?}");
    drop(running);
    drop(proxy);
    let after = Usage::now();
    assert!(after.is_within(before), "{before:?}, then {after:?}");
}

#[test]
fn a_device_is_tried_once_a_second_at_most() {
    // As the settings have it, and from a port where everybody is hung up on.
    let script = Script { seed: 1, faults: vec![Fault::Close], max_bytes: 0 };
    let Some(peer) = server_with_stamps() else { return };
    let proxy = proxy(&peer, &script);
    let settings = json!({"host": "127.0.0.1", "port": proxy.port()});
    let settings: Settings = serde_json::from_value(settings).unwrap();
    let mut adapter = ModbusAdapter::create(settings, host()).unwrap();
    let recorder = Recorder::new();
    let started = Instant::now();
    adapter.start(stamps::tags(), recorder.sink()).unwrap();
    while started.elapsed() < Duration::from_secs(5) || proxy.connections() < 3 {
        assert!(started.elapsed() < MAX_TEST, "{} connections", proxy.connections());
        // The first at once, and then one a second.
        let most = started.elapsed().as_secs() + 1;
        assert!(proxy.connections() <= most, "{} in {:?}", proxy.connections(), started.elapsed());
        std::thread::sleep(Duration::from_millis(10));
    }
    let delay = |text: &str| text.rsplit_once("next try in ")?.1.strip_suffix(" s")?.parse().ok();
    let links = recorder.recording().links;
    let delays: Vec<f64> = links.iter().filter_map(|(_, text)| delay(text)).collect();
    assert!(delays.iter().all(|delay| *delay >= 1.0), "{delays:?}");
}
