//! Encrypted connections, to c104 behind mbed TLS.

use std::path::PathBuf;

use busbar_link::testing::CertificateAuthority;

use super::peer;
use super::*;

#[test]
fn only_the_right_certificates_open_a_connection() {
    let folder = tempfile::tempdir().unwrap();
    let ours = CertificateAuthority::new(folder.path(), "ours");
    let theirs = CertificateAuthority::new(folder.path(), "theirs");
    let (server, server_key) = ours.sign("station", "127.0.0.1");
    let spec = json!({
        "points": [{"common_address": 1, "ioa": 1, "type": "M_ME_NC_1", "value": 2.5}],
        "tls": {"ca": ours.certificate(), "certificate": server, "key": server_key}
    });
    let Some(peer) = peer::start(peer::C104, &spec) else { return };
    let connect =
        |ca: &CertificateAuthority, client: Option<&(PathBuf, PathBuf)>, server_name: &str| {
            let mut tls = json!({"ca": ca.certificate(), "server_name": server_name});
            if let Some((certificate, key)) = client {
                tls["certificate"] = json!(certificate);
                tls["key"] = json!(key);
            }
            start(peer.port, json!({ "tls": tls }), vec![tag(1, ValueKind::F64)])
        };
    let (good, bad) = (ours.sign("client", "viewer"), theirs.sign("client", "viewer"));
    connect(&ours, Some(&good), "127.0.0.1").wait_for(1, Value::F64(2.5));

    let refused = [
        (connect(&theirs, Some(&good), "127.0.0.1"), "UnknownIssuer"),
        (connect(&ours, Some(&good), "another.example"), "not valid for name"),
        (connect(&ours, None, "127.0.0.1"), ""),
        (connect(&ours, Some(&bad), "127.0.0.1"), ""),
    ];
    for (running, message) in &refused {
        running.wait_for_link(LinkState::Down, message);
        running.wait_for_bad(1, Reason::Communication);
        assert!(!running.has_good_samples());
    }
    // And without encryption there is no talking to it.
    let plain = start(
        peer.port,
        json!({"t1_seconds": 0.5, "t2_seconds": 0.2}),
        vec![tag(1, ValueKind::F64)],
    );
    plain.wait_for_link(LinkState::Down, "");
    assert!(!plain.has_good_samples());
}

#[test]
fn files_that_cannot_be_used_are_named() {
    let folder = tempfile::tempdir().unwrap();
    let ours = CertificateAuthority::new(folder.path(), "ours");
    let (certificate, key) = ours.sign("client", "viewer");
    let garbage = folder.path().join("garbage.pem");
    std::fs::write(&garbage, "no certificate").unwrap();
    let missing = folder.path().join("missing.pem");
    let other_key = ours.sign("other", "viewer").1;
    let cases = [
        (&missing, &certificate, &key, &missing),
        (&garbage, &certificate, &key, &garbage),
        (&ours.certificate(), &garbage, &key, &garbage),
        (&ours.certificate(), &certificate, &missing, &missing),
        (&ours.certificate(), &certificate, &certificate, &certificate),
        (&ours.certificate(), &certificate, &other_key, &other_key),
    ];
    for (ca, certificate, key, at_fault) in cases {
        let settings: Settings = serde_json::from_value(json!({
            "host": "127.0.0.1", "tls": {"ca": ca, "certificate": certificate, "key": key}
        }))
        .unwrap();
        let mut plugin = Iec104::create(settings, host()).unwrap();
        let error = plugin.start(vec![tag(1, ValueKind::F64)], Recorder::new().sink()).unwrap_err();
        let path = at_fault.display().to_string();
        assert!(error.message().starts_with(&format!("tls: '{path}': ")), "{error}");
    }
}
