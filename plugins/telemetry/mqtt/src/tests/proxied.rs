//! Over connections that break in every way: no wrong value, nothing left behind.

use busbar_link::testing::CertificateAuthority;
use fault_proxy::{ConnectionFault, FaultProxy, FaultScript, ResourceUsage, check_stamps};

use super::*;

/// All that may happen to a connection without encryption. `Garbage` and `Swap` are not among
/// them: bytes put into a stream make messages that nothing tells from the broker's; TLS does.
const FAULTS: [ConnectionFault; 7] = [
    ConnectionFault::None,
    ConnectionFault::Split,
    ConnectionFault::Delay,
    ConnectionFault::Reset,
    ConnectionFault::Close,
    ConnectionFault::Vanish,
    ConnectionFault::Trickle,
];
/// Faults among [`FAULTS`] that end no connection.
const ENDLESS: [ConnectionFault; 4] = [
    ConnectionFault::None,
    ConnectionFault::Split,
    ConnectionFault::Delay,
    ConnectionFault::Trickle,
];
const AT_ONCE: ReconnectBounds =
    ReconnectBounds { min: Duration::from_millis(1), max: Duration::from_millis(4) };
const TAGS: [u32; 3] = [1, 2, 3];
/// Connections of a test of all faults.
const CONNECTIONS: u64 = 30;
/// Connections after which nothing may be left.
const RECONNECTS: u64 = 300;

fn topic(tag: u32) -> String {
    format!("stamped/{tag}")
}

/// Starts a broker whose topics carry their index in bits 24 and up, and a count below.
fn stamped(lines: &str, publisher: &Json) -> Option<(Broker, Client)> {
    let broker = Broker::start_with(lines)?;
    let mut peer = Client::publisher(broker.port, publisher)?;
    let topics = TAGS.map(topic);
    peer.command(&json!({"stamp": {"qos": 1}, "topics": topics, "seconds": 0.005}));
    Some((broker, peer))
}

fn connect(proxy: &FaultProxy) -> Running {
    connect_with(proxy, &json!({}))
}

/// `settings` are added to quick ones.
fn connect_with(proxy: &FaultProxy, settings: &Json) -> Running {
    let tags = TAGS.map(|tag_id| tag(tag_id, ValueKind::I64, json!({"topic": topic(tag_id)})));
    let mut all = json!({
        "host": "127.0.0.1", "port": proxy.port(), "keep_alive_seconds": 2, "timeout_seconds": 0.5
    });
    all.as_object_mut().unwrap().extend(settings.as_object().unwrap().clone());
    let settings: Settings = serde_json::from_value(all).unwrap();
    let mut plugin = Mqtt::create(settings, host()).unwrap();
    plugin.config.reconnect = AT_ONCE;
    plugin.config.keep_alive = Duration::from_millis(800);
    RunningPlugin::start(plugin, tags.into(), PATIENCE)
}

fn proxy(broker: &Broker, script: &FaultScript) -> FaultProxy {
    FaultProxy::start(([127, 0, 0, 1], broker.port).into(), script.clone()).unwrap()
}

#[test]
fn no_value_is_wrong_whatever_happens_to_connections() {
    let Some((broker, _peer)) = stamped("allow_anonymous true\n", &json!({})) else { return };
    check_faults(&broker, &FAULTS, &json!({}));
}

#[test]
fn over_tls_no_value_is_wrong_even_if_bytes_are() {
    let folder = tempfile::tempdir().unwrap();
    let ours = CertificateAuthority::new(folder.path(), "ours");
    let (certificate, key) = ours.sign("broker", "127.0.0.1");
    let lines = format!(
        "allow_anonymous true\ncertfile {}\nkeyfile {}\n",
        certificate.display(),
        key.display()
    );
    let tls = json!({"tls": {"ca": ours.certificate()}});
    let Some((broker, _peer)) = stamped(&lines, &tls) else { return };
    let faults = [&FAULTS[..], &[ConnectionFault::Garbage, ConnectionFault::Swap]].concat();
    check_faults(&broker, &faults, &tls);
}

fn check_faults(broker: &Broker, faults: &[ConnectionFault], settings: &Json) {
    let script = FaultScript { seed: 4, faults: faults.to_vec(), max_bytes: 3000 };
    let proxy = proxy(broker, &script);
    let running = connect_with(&proxy, settings);
    proxy.break_all(&script, CONNECTIONS, Duration::from_millis(300), &ENDLESS);
    let counts = check_stamps(&running.recorder.recording().integers(), TAGS);
    assert!(counts.iter().all(|count| *count >= 20), "{counts:?}");
}

#[test]
fn reconnects_leave_nothing_behind() {
    let Some((broker, _peer)) = stamped("allow_anonymous true\n", &json!({})) else { return };
    // What the event loops of a process share stays with it.
    drop(busbar_link::IoLoop::new(1).unwrap());
    let before = ResourceUsage::now();
    let faults = vec![ConnectionFault::Reset, ConnectionFault::Close];
    let proxy = proxy(&broker, &FaultScript { seed: 3, faults, max_bytes: 60 });
    let running = connect(&proxy);
    proxy.wear_out(RECONNECTS, before);
    check_stamps(&running.recorder.recording().integers(), TAGS);
    drop(running);
    drop(proxy);
    ResourceUsage::now().assert_within(before);
}
