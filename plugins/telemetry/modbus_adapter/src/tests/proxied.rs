//! Over connections that break in every way: no wrong value, nothing left behind.

use std::time::Instant;

use fault_proxy::{
    ALL_FAULTS, ConnectionFault, ENDLESS_FAULTS, FaultProxy, FaultScript, MAX_DRILL, ResourceUsage,
};

use super::peer::{Libmodbus, Peer, Place, free_port};
use super::*;

/// Delays that make reconnects quick.
const AT_ONCE: ReconnectBounds =
    ReconnectBounds { min: Duration::from_millis(1), max: Duration::from_millis(4) };
/// Connections of a test of all faults.
const CONNECTIONS: u64 = 60;

fn server_with_stamps() -> Option<Peer> {
    let mut peer = Libmodbus::compile()?.start(&Place::Tcp(free_port()));
    peer.command("stamp");
    Some(peer)
}

fn proxy(peer: &Peer, script: &FaultScript) -> FaultProxy {
    FaultProxy::start(([127, 0, 0, 1], peer.port).into(), script.clone()).unwrap()
}

#[test]
fn no_value_is_wrong_whatever_happens_to_connections() {
    let Some(peer) = server_with_stamps() else { return };
    // Some 70 bytes a poll.
    let script = FaultScript { seed: 20, faults: ALL_FAULTS.to_vec(), max_bytes: 400 };
    let proxy = proxy(&peer, &script);
    let settings = json!({"host": "127.0.0.1", "port": proxy.port(), "timeout_seconds": 0.15});
    let running = start_with(settings, AT_ONCE, stamps::tags());
    proxy.break_all(&script, CONNECTIONS, Duration::from_millis(150), &ENDLESS_FAULTS);
    let counts = stamps::check(&running.recorder.recording());
    assert!(counts.iter().all(|count| *count >= 20), "{counts:?}");
}

#[test]
fn a_thousand_reconnects_leave_nothing_behind() {
    let Some(peer) = server_with_stamps() else { return };
    let before = ResourceUsage::now();
    let faults = vec![ConnectionFault::Reset, ConnectionFault::Close, ConnectionFault::Swap];
    let proxy = proxy(&peer, &FaultScript { seed: 3, faults, max_bytes: 60 });
    let settings = json!({"host": "127.0.0.1", "port": proxy.port()});
    let running = start_with(settings, AT_ONCE, stamps::tags());
    proxy.wear_out(1000, before);
    stamps::check(&running.recorder.recording());
    drop(running);
    drop(proxy);
    ResourceUsage::now().assert_within(before);
}

#[test]
fn a_device_is_tried_once_a_second_at_most() {
    // As the settings have it, and from a port where everybody is hung up on.
    let script = FaultScript { seed: 1, faults: vec![ConnectionFault::Close], max_bytes: 0 };
    let Some(peer) = server_with_stamps() else { return };
    let proxy = proxy(&peer, &script);
    let settings = json!({"host": "127.0.0.1", "port": proxy.port()});
    let settings: Settings = serde_json::from_value(settings).unwrap();
    let mut adapter = ModbusAdapter::create(settings, host()).unwrap();
    let recorder = Recorder::new();
    let started = Instant::now();
    adapter.start(stamps::tags(), recorder.sink()).unwrap();
    while started.elapsed() < Duration::from_secs(5) || proxy.connections() < 3 {
        assert!(started.elapsed() < MAX_DRILL, "{} connections", proxy.connections());
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
