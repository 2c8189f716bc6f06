//! Over connections that break in every way: no wrong value, nothing left behind.

use std::time::Instant;

use busbar_link::testing::Authority;
use fault_proxy::{Fault, FaultProxy, Script, Usage};

use super::*;

/// All that may happen to a connection without encryption. `Garbage` and `Swap` are not among
/// them: bytes put into a stream make messages that nothing tells from the broker's; TLS does.
const FAULTS: [Fault; 7] = [
    Fault::None,
    Fault::Split,
    Fault::Delay,
    Fault::Reset,
    Fault::Close,
    Fault::Vanish,
    Fault::Trickle,
];
const AT_ONCE: Reconnect =
    Reconnect { min: Duration::from_millis(1), max: Duration::from_millis(4) };
const TAGS: [u32; 3] = [1, 2, 3];
/// Connections of a test of all faults.
const CONNECTIONS: u64 = 30;
/// Connections after which nothing may be left.
const RECONNECTS: u64 = 300;
/// Descriptors and threads that a plugin, a proxy and their connections may hold at
/// once, beside those that were there before.
const MAX_DESCRIPTORS: usize = 24;
const MAX_THREADS: usize = 8;
const MAX_TEST: Duration = Duration::from_secs(120);

fn topic(tag: u32) -> String {
    format!("stamped/{tag}")
}

/// A broker whose topics get their index in bits 24 and up, and a number that counts up.
fn stamped(lines: &str, publisher: &Json) -> Option<(Broker, Peer)> {
    let broker = Broker::start_with(lines)?;
    let mut peer = Peer::publisher(broker.port, publisher)?;
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
        "host": "127.0.0.1", "port": proxy.port(), "keep_alive_seconds": 2, "timeout_millis": 500
    });
    all.as_object_mut().unwrap().extend(settings.as_object().unwrap().clone());
    let settings: Settings = serde_json::from_value(all).unwrap();
    let mut plugin = Mqtt::create(settings, host()).unwrap();
    plugin.config.reconnect = AT_ONCE;
    plugin.config.keep_alive = Duration::from_millis(800);
    let recorder = Recorder::new();
    plugin.start(tags.into(), recorder.sink()).unwrap();
    Running { plugin, recorder }
}

fn proxy(broker: &Broker, script: &Script) -> FaultProxy {
    FaultProxy::start(([127, 0, 0, 1], broker.port).into(), script.clone()).unwrap()
}

/// Checks that every value is of its tag, and none older than one before; how many there
/// were of each.
#[track_caller]
fn check_values(recording: &Recording) -> [usize; TAGS.len()] {
    assert!(recording.samples.len() < busbar_plugin_sdk::testing::MAX_RECORDED);
    TAGS.map(|tag| {
        let of_tag = recording.samples.iter().filter(|sample| sample.tag == tag);
        let (mut newest, mut count) = (0, 0);
        for value in of_tag.filter_map(|sample| sample.value) {
            let Value::I64(value) = value else { panic!("{value:?}") };
            assert_eq!(value >> 24, i64::from(tag), "a value of another tag");
            let number = value & 0xFF_FFFF;
            assert!(number >= newest, "tag {tag}: {number} after {newest}");
            newest = number;
            count += 1;
        }
        count
    })
}

#[test]
fn no_value_is_wrong_whatever_happens_to_connections() {
    let Some((broker, _peer)) = stamped("allow_anonymous true\n", &json!({})) else { return };
    check_faults(&broker, &FAULTS, &json!({}));
}

#[test]
fn over_tls_no_value_is_wrong_even_if_bytes_are() {
    let folder = tempfile::tempdir().unwrap();
    let ours = Authority::new(folder.path(), "ours");
    let (certificate, key) = ours.sign("broker", "127.0.0.1");
    let lines = format!(
        "allow_anonymous true\ncertfile {}\nkeyfile {}\n",
        certificate.display(),
        key.display()
    );
    let tls = json!({"tls": {"ca": ours.certificate()}});
    let Some((broker, _peer)) = stamped(&lines, &tls) else { return };
    let faults = [&FAULTS[..], &[Fault::Garbage, Fault::Swap]].concat();
    check_faults(&broker, &faults, &tls);
}

fn check_faults(broker: &Broker, faults: &[Fault], settings: &Json) {
    let script = Script { seed: 4, faults: faults.to_vec(), max_bytes: 3000 };
    let proxy = proxy(broker, &script);
    let running = connect_with(&proxy, settings);
    let deadline = Instant::now() + MAX_TEST;
    while proxy.connections() < CONNECTIONS {
        let links = || running.recorder.recording().links;
        assert!(Instant::now() < deadline, "{} connections, {:?}", proxy.connections(), links());
        std::thread::sleep(Duration::from_millis(300));
        // Some connections have no fault that ends them.
        let last = proxy.connections().saturating_sub(1);
        let fault = script.plan(last).fault;
        if matches!(fault, Fault::None | Fault::Split | Fault::Delay | Fault::Trickle) {
            proxy.hang_up();
        }
    }
    let counts = check_values(&running.recorder.recording());
    assert!(counts.iter().all(|count| *count >= 20), "{counts:?}");
    assert!(proxy.strikes() >= CONNECTIONS / 4, "{}", proxy.strikes());
}

#[test]
fn reconnects_leave_nothing_behind() {
    let Some((broker, _peer)) = stamped("allow_anonymous true\n", &json!({})) else { return };
    // What the event loops of a process share stays with it.
    drop(busbar_link::IoLoop::new(1).unwrap());
    let before = Usage::now();
    let faults = vec![Fault::Reset, Fault::Close];
    let proxy = proxy(&broker, &Script { seed: 3, faults, max_bytes: 60 });
    let running = connect(&proxy);
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
