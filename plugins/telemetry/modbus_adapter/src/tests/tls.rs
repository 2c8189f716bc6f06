//! Modbus/TCP Security, to pymodbus behind OpenSSL.

use std::path::PathBuf;

use busbar_link::testing::CertificateAuthority;

use super::peer::{Peer, Place};
use super::*;

/// Builds the settings of an encrypted connection (TLS).
fn settings(
    ca: &CertificateAuthority,
    own: Option<&(PathBuf, PathBuf)>,
    server_name: &str,
) -> serde_json::Value {
    let mut tls = json!({"ca": ca.certificate(), "server_name": server_name});
    if let Some((certificate, key)) = own {
        tls["certificate"] = json!(certificate);
        tls["key"] = json!(key);
    }
    tls
}

#[test]
fn only_the_right_certificates_open_a_connection() {
    let folder = tempfile::tempdir().unwrap();
    let ours = CertificateAuthority::new(folder.path(), "ours");
    let theirs = CertificateAuthority::new(folder.path(), "theirs");
    let (certificate, key) = ours.sign("device", "127.0.0.1");
    let files = json!({"ca": ours.certificate(), "certificate": certificate, "key": key});
    let Some(peer) = Peer::start_at(&Place::Tls(0, files), &types::values()) else { return };
    let (good, bad) = (ours.sign("client", "viewer"), theirs.sign("client", "viewer"));
    let right = settings(&ours, Some(&good), "127.0.0.1");
    types::check(json!({"host": "127.0.0.1", "port": peer.port, "tls": right}));

    let refused = [
        (settings(&theirs, Some(&good), "127.0.0.1"), "UnknownIssuer"),
        (settings(&ours, Some(&good), "another.example"), "not valid for name"),
        (settings(&ours, None, "127.0.0.1"), "does it trust our certificate?"),
        (settings(&ours, Some(&bad), "127.0.0.1"), "does it trust our certificate?"),
    ];
    for (tls, message) in refused {
        let running = start(peer.port, json!({ "tls": tls }), vec![holding(1, 60)]);
        running.wait_for_link(LinkState::Down, message);
        running.wait_for_bad(1, Reason::Communication);
        assert!(!running.has_good_samples());
    }
    // And without encryption there is no talking to it.
    let plain = start(peer.port, json!({"timeout_seconds": 0.5}), vec![holding(1, 60)]);
    plain.wait_for_link(LinkState::Down, "");
    assert!(!plain.has_good_samples());
}

#[test]
#[cfg(target_os = "linux")]
fn a_killed_or_frozen_device_makes_tags_bad_and_a_new_one_good() {
    let folder = tempfile::tempdir().unwrap();
    let ours = CertificateAuthority::new(folder.path(), "ours");
    let (certificate, key) = ours.sign("device", "127.0.0.1");
    let files = json!({"ca": ours.certificate(), "certificate": certificate, "key": key});
    let start_peer = |port: u16, value: u16| {
        let values = json!({"holding": {"0": value}});
        Peer::start_at(&Place::Tls(port, files.clone()), &values)
    };
    let Some(peer) = start_peer(0, 5) else { return };
    let port = peer.port;
    let tls = settings(&ours, Some(&ours.sign("client", "viewer")), "127.0.0.1");
    let running = start(port, json!({"timeout_seconds": 0.3, "tls": tls}), vec![holding(1, 0)]);
    running.wait_for(1, Value::F64(5.0));
    drop(peer);
    running.wait_for_bad(1, Reason::Communication);
    let peer = start_peer(port, 50).unwrap();
    running.wait_for(1, Value::F64(50.0));
    peer.signal("STOP");
    running.wait_for_bad(1, Reason::Communication);
    running.wait_for_link(LinkState::Down, "no answer within 300 ms");
    // The system still takes connections for it, but nobody shakes hands.
    running.wait_for_link(LinkState::Down, "no secure connection within 300 ms");
    peer.signal("CONT");
    running.wait_for(1, Value::F64(50.0));
}

#[test]
fn a_device_that_does_not_encrypt_is_named() {
    let Some(peer) = Peer::start(&types::values()) else { return };
    let folder = tempfile::tempdir().unwrap();
    let ours = CertificateAuthority::new(folder.path(), "ours");
    let tls = settings(&ours, None, "127.0.0.1");
    let running =
        start(peer.port, json!({"timeout_seconds": 0.3, "tls": tls}), vec![holding(1, 60)]);
    running.wait_for_link(LinkState::Down, "no secure connection");
    assert!(!running.has_good_samples());
}

#[test]
fn a_file_that_cannot_be_used_is_named() {
    let missing = tempfile::tempdir().unwrap().path().join("missing.pem");
    let settings = json!({"host": "a", "tls": {"ca": missing}});
    let settings: Settings = serde_json::from_value(settings).unwrap();
    let mut adapter = ModbusAdapter::create(settings, host()).unwrap();
    let error = adapter.start(vec![holding(1, 0)], Recorder::new().sink()).unwrap_err();
    assert!(error.message().contains(&format!("tls: '{}': ", missing.display())), "{error}");
}
