//! Encrypted connections, names and passwords, to Mosquitto behind OpenSSL.

use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};

use busbar_link::testing::CertificateAuthority;

use super::*;

fn one_tag() -> Vec<TagSpec> {
    vec![tag(1, ValueKind::F64, json!({"topic": "a"}))]
}

#[test]
fn only_the_right_certificates_open_a_connection() {
    let folder = tempfile::tempdir().unwrap();
    let ours = CertificateAuthority::new(folder.path(), "ours");
    let theirs = CertificateAuthority::new(folder.path(), "theirs");
    let (server, server_key) = ours.sign("broker", "127.0.0.1");
    let lines = format!(
        "allow_anonymous true\nrequire_certificate true\ncafile {}\ncertfile {}\nkeyfile {}\n",
        ours.certificate().display(),
        server.display(),
        server_key.display()
    );
    let Some(broker) = Broker::start_with(&lines) else { return };
    let (good, bad) = (ours.sign("client", "viewer"), theirs.sign("client", "viewer"));
    let connect = |ca: &CertificateAuthority,
                   client: Option<&(PathBuf, PathBuf)>,
                   name: &str,
                   version: &str| {
        let mut tls = json!({"ca": ca.certificate(), "server_name": name});
        if let Some((certificate, key)) = client {
            tls["certificate"] = json!(certificate);
            tls["key"] = json!(key);
        }
        start_only(broker.port, &json!({"tls": tls, "version": version}), one_tag())
    };
    let spec = json!({"tls": {
        "ca": ours.certificate(), "certificate": good.0, "key": good.1
    }});
    let Some(mut peer) = Client::publisher(broker.port, &spec) else { return };
    for version in ["3.1.1", "5"] {
        let running = connect(&ours, Some(&good), "127.0.0.1", version);
        running.wait_for_link(LinkState::Up, "connected");
        peer.publish("a", "2.5");
        running.wait_for(1, Value::F64(2.5));
    }
    let refused = [
        (connect(&theirs, Some(&good), "127.0.0.1", "3.1.1"), "UnknownIssuer"),
        (connect(&ours, Some(&good), "another.example", "3.1.1"), "not valid for name"),
        (connect(&ours, None, "127.0.0.1", "3.1.1"), ""),
        (connect(&ours, Some(&bad), "127.0.0.1", "3.1.1"), ""),
    ];
    for (running, message) in &refused {
        running.wait_for_link(LinkState::Down, message);
        running.wait_for_bad(1, Reason::Communication);
        assert!(!running.has_good_samples());
    }
    let plain = start_only(broker.port, &json!({"timeout_seconds": 0.5}), one_tag());
    plain.wait_for_link(LinkState::Down, "");
    assert!(!plain.has_good_samples());
}

#[test]
fn a_wrong_password_is_told_and_never_shown() {
    let folder = tempfile::tempdir().unwrap();
    let passwords = folder.path().join("passwords");
    let made = std::process::Command::new("mosquitto_passwd")
        .args(["-b", "-c"])
        .arg(&passwords)
        .args(["viewer", "right-secret"])
        .status();
    let Ok(true) = made.map(|status| status.success()) else {
        assert!(std::env::var_os("BUSBAR_REQUIRE_PEERS").is_none(), "no mosquitto_passwd");
        return;
    };
    std::fs::set_permissions(&passwords, std::fs::Permissions::from_mode(0o644)).unwrap();
    let lines = format!("allow_anonymous false\npassword_file {}\n", passwords.display());
    let Some(broker) = Broker::start_with(&lines) else { return };
    let secret = |name: &str, text: &str| -> Json {
        let path: &Path = &folder.path().join(name);
        std::fs::write(path, format!("{text}\n")).unwrap();
        std::fs::set_permissions(path, std::fs::Permissions::from_mode(0o600)).unwrap();
        json!({ "file": path })
    };
    let name = secret("name", "viewer");
    let right = json!({"username": name, "password": secret("right", "right-secret")});
    let wrong = json!({"username": name, "password": secret("wrong", "wrong-secret")});
    for version in ["3.1.1", "5"] {
        let settings = json!({"login": right, "version": version});
        start(broker.port, &settings, one_tag());
        for settings in [json!({"login": wrong, "version": version}), json!({"version": version})] {
            let running = start_only(broker.port, &settings, one_tag());
            running.wait_for_link(LinkState::Down, "check login");
            let links = running.recorder.recording().links;
            assert!(links.iter().all(|(_, text)| !text.contains("secret")), "{links:?}");
        }
    }
    let missing = json!({"login": {"username": {"file": folder.path().join("missing")}}});
    let running = start_only(broker.port, &missing, one_tag());
    running.wait_for_link(LinkState::Down, "missing");
}
