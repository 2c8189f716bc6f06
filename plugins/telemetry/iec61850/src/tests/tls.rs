//! Encrypted connections (IEC 62351-3), to libiec61850 behind its own TLS.

use std::path::PathBuf;

use busbar_link::testing::CertificateAuthority;

use super::*;

#[test]
fn only_the_right_certificates_open_a_connection() {
    let folder = tempfile::tempdir().unwrap();
    let ours = CertificateAuthority::new(folder.path(), "ours");
    let theirs = CertificateAuthority::new(folder.path(), "theirs");
    let (server, server_key) = ours.sign("server", "127.0.0.1");
    let spec = json!({
        "tls": {"ca": ours.certificate(), "certificate": server, "key": server_key}
    });
    let Some(mut peer) = peer::start(&spec) else { return };
    peer.command(&json!({"object": "LD0/MMXU1.TotW", "values": {"mag.f": 2.5}}));
    let tags = || vec![tag(1, ValueKind::F64, "MMXU1.TotW", "MX")];
    let connect =
        |ca: &CertificateAuthority, client: Option<&(PathBuf, PathBuf)>, server_name: &str| {
            let mut tls = json!({"ca": ca.certificate(), "server_name": server_name});
            if let Some((certificate, key)) = client {
                tls["certificate"] = json!(certificate);
                tls["key"] = json!(key);
            }
            start(peer.port, json!({ "tls": tls, "timeout_seconds": 1 }), tags())
        };
    let (good, bad) = (ours.sign("client", "viewer"), theirs.sign("client", "viewer"));
    let reported = connect(&ours, Some(&good), "127.0.0.1");
    reported.wait_for(1, Value::F64(2.5));
    drop(reported);
    let refused = [
        (
            connect(&theirs, Some(&good), "127.0.0.1"),
            "no secure connection: invalid peer certificate: UnknownIssuer",
        ),
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
    let plain = start(peer.port, json!({"timeout_seconds": 0.5}), tags());
    plain.wait_for_link(LinkState::Down, "");
    assert!(!plain.has_good_samples());
}

#[test]
fn files_that_cannot_be_used_are_named() {
    let folder = tempfile::tempdir().unwrap();
    let missing = folder.path().join("missing.pem");
    let settings = json!({"host": "127.0.0.1", "tls": {"ca": missing}});
    let settings: Settings = serde_json::from_value(settings).unwrap();
    let mut plugin = Iec61850::create(settings, host()).unwrap();
    let tags = vec![tag(1, ValueKind::F64, "MMXU1.TotW", "MX")];
    let error = plugin.start(tags, Recorder::new().sink()).unwrap_err();
    let expected = format!("tls: '{}': ", missing.display());
    assert!(error.message().starts_with(&expected), "{error}");
}
