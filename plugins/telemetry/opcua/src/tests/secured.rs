//! With certificates and users, good and wrong ones.

use std::fs;
use std::path::{Path, PathBuf};

use tempfile::TempDir;

use busbar_plugin_sdk::abi;
use peer_process::Peer;

use super::peer::{self, make_certificates};
use super::*;
use crate::import::tests::{check_refused, list, points};

const SERVER: &str = "urn:busbar:test:server";
const CLIENT: &str = "urn:busbar:viewer";
const POLICIES: [&str; 6] = [
    "Basic256Sha256/Sign",
    "Basic256Sha256/SignAndEncrypt",
    "Aes128Sha256RsaOaep/Sign",
    "Aes128Sha256RsaOaep/SignAndEncrypt",
    "Aes256Sha256RsaPss/Sign",
    "Aes256Sha256RsaPss/SignAndEncrypt",
];

/// A folder with certificates, and a server that has one of them.
struct Setting {
    folder: TempDir,
    peer: Peer,
}

impl Setting {
    /// The server's certificate is by this name, and the server offers these policies.
    fn new(server: &str, policies: &[&str], more: &Json) -> Option<Self> {
        let probe = peer::start(&json!({}))?;
        drop(probe);
        let folder = tempfile::tempdir().unwrap();
        let pairs = [
            ("client", CLIENT),
            ("other", CLIENT),
            ("user", "urn:user"),
            ("stranger", "urn:stranger"),
            ("server", SERVER),
            ("expired_server", SERVER),
            ("expired_client", CLIENT),
            ("renamed_server", "urn:another"),
        ];
        make_certificates(folder.path(), &pairs);
        fs::create_dir(folder.path().join("trusted")).unwrap();
        fs::create_dir(folder.path().join("rejected")).unwrap();
        let path = |end| folder.path().join(format!("{server}.{end}"));
        let mut spec = json!({
            "nodes": [node("A", "Double", &json!(5.0))],
            "security": {"certificate": path("der"), "key": path("pem"), "policies": policies}
        });
        spec.as_object_mut().unwrap().extend(more.as_object().unwrap().clone());
        for name in spec.get_mut("certificates").and_then(Json::as_array_mut).into_iter().flatten()
        {
            *name = json!(folder.path().join(name.as_str().unwrap()));
        }
        let peer = peer::start(&spec)?;
        Some(Self { folder, peer })
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    fn trust(&self, name: &str) {
        let name = format!("{name}.der");
        fs::copy(self.path(&name), self.path("trusted").join(name)).unwrap();
    }

    /// The settings `security` with our certificate by this name.
    fn security(&self, client: &str, policy: &str, mode: &str) -> Json {
        json!({"security": {
            "policy": policy, "mode": mode,
            "certificate": self.path(&format!("{client}.der")),
            "key": self.path(&format!("{client}.pem")),
            "trusted": self.path("trusted"), "rejected": self.path("rejected"),
        }})
    }

    fn start(&self, settings: &Json) -> Running {
        start(self.peer.port, settings, vec![tag(1, ValueKind::F64, "A")])
    }

    /// Checks that nothing good comes, for this reason.
    #[track_caller]
    fn check_refused(&self, settings: &Json, message: &str) {
        let running = self.start(settings);
        running.wait_for_link(LinkState::Down, message);
        running.wait_for_bad(1, Reason::Communication);
        assert!(!running.has_good_samples());
    }
}

fn with(mut settings: Json, name: &str, value: Json) -> Json {
    settings[name] = value;
    settings
}

fn secret(folder: &Path, text: &str) -> PathBuf {
    use std::os::unix::fs::PermissionsExt;
    let path = folder.join(format!("{text}.secret"));
    fs::write(&path, text).unwrap();
    fs::set_permissions(&path, fs::Permissions::from_mode(0o600)).unwrap();
    path
}

#[test]
fn every_policy_and_mode_is_spoken() {
    let Some(setting) = Setting::new("server", &POLICIES, &json!({})) else { return };
    setting.trust("server");
    for policy in ["Basic256Sha256", "Aes128_Sha256_RsaOaep", "Aes256_Sha256_RsaPss"] {
        for mode in ["Sign", "SignAndEncrypt"] {
            let running = setting.start(&setting.security("client", policy, mode));
            running.wait_for(1, Value::F64(5.0));
        }
    }
}

#[test]
fn a_server_that_is_not_trusted_is_refused_until_somebody_trusts_it() {
    let Some(setting) = Setting::new("server", &POLICIES, &json!({})) else { return };
    setting.trust("other");
    let security = setting.security("client", "Basic256Sha256", "SignAndEncrypt");
    let running = setting.start(&security);
    running.wait_for_link(LinkState::Down, "security: the server's certificate (CN=server, SHA-1 ");
    running.wait_for_link(LinkState::Down, "is not trusted: check at the server");
    assert!(!running.has_good_samples());
    // It was kept, for somebody to check; moved to the trusted ones, it is.
    let kept = fs::read_dir(setting.path("rejected")).unwrap().next().unwrap().unwrap();
    assert_eq!(fs::read(kept.path()).unwrap(), fs::read(setting.path("server.der")).unwrap());
    fs::rename(kept.path(), setting.path("trusted/plc.der")).unwrap();
    running.wait_for(1, Value::F64(5.0));
}

#[test]
fn a_certificate_may_be_pinned_by_its_file() {
    let Some(setting) = Setting::new("server", &POLICIES, &json!({})) else { return };
    let mut settings = setting.security("client", "Basic256Sha256", "SignAndEncrypt");
    settings["security"]["trusted"] = json!(setting.path("server.der"));
    setting.start(&settings).wait_for(1, Value::F64(5.0));
    settings["security"]["trusted"] = json!(setting.path("other.der"));
    setting.check_refused(&settings, "is not trusted");
}

#[test]
fn expired_and_foreign_certificates_are_refused() {
    for (server, message) in [
        ("expired_server", "is not valid now: "),
        ("renamed_server", "is not that of the application 'urn:busbar:test:server'"),
    ] {
        let Some(setting) = Setting::new(server, &POLICIES, &json!({})) else { return };
        setting.trust(server);
        let security = setting.security("client", "Basic256Sha256", "Sign");
        setting.check_refused(&security, message);
    }
}

#[test]
fn what_is_wrong_with_our_own_certificate_is_told() {
    let Some(setting) = Setting::new("server", &POLICIES, &json!({})) else { return };
    setting.trust("server");
    let security = |name| setting.security(name, "Basic256Sha256", "Sign");
    setting.check_refused(&security("stranger"), "does not name 'urn:busbar:viewer'");
    setting.check_refused(&security("expired_client"), "our certificate is not valid now");
    setting.check_refused(&security("missing"), "missing.der': No such file");
    let mut crossed = security("client");
    crossed["security"]["key"] = json!(setting.path("other.pem"));
    setting.check_refused(&crossed, "other.pem' is not the key of '");
    crossed["security"]["key"] = json!(setting.path("other.der"));
    setting.check_refused(&crossed, "is no RSA key in PEM form");
}

#[test]
fn what_the_server_does_not_offer_is_told_with_what_it_does() {
    let Some(setting) = Setting::new("server", &POLICIES[1..2], &json!({})) else { return };
    setting.trust("server");
    setting.check_refused(
        &setting.security("client", "Aes256_Sha256_RsaPss", "Sign"),
        "offers no Aes256_Sha256_RsaPss with Sign; it offers Basic256Sha256 with SignAndEncrypt",
    );
    setting.check_refused(&json!({}), "offers no endpoint without security");
}

#[test]
fn users_have_names_and_passwords() {
    let more = json!({"users": {"viewer": "right"}});
    let policies = [&POLICIES[..], &["None"]].concat();
    let Some(setting) = Setting::new("server", &policies, &more) else { return };
    setting.trust("server");
    let user = |text: &str| json!({"name": "viewer", "password": {"file": secret(setting.folder.path(), text)}});
    for mode in ["Sign", "SignAndEncrypt"] {
        let security = setting.security("client", "Basic256Sha256", mode);
        let running = setting.start(&with(security.clone(), "user", user("right")));
        running.wait_for(1, Value::F64(5.0));
        let wrong = with(security.clone(), "user", user("wrong"));
        let running = setting.start(&wrong);
        running.wait_for_link(LinkState::Down, "user: Bad");
        let links = running.recorder.recording().links;
        assert!(links.iter().all(|(_, text)| !text.contains("wrong")), "{links:?}");
        setting.check_refused(&security, "user: Bad");
    }
    // The server's certificate encrypts it where the channel does not.
    setting.start(&json!({"user": user("right")})).wait_for(1, Value::F64(5.0));
}

#[test]
fn a_password_is_not_sent_where_everybody_can_read_it() {
    let spec = json!({"nodes": [node("A", "Double", &json!(5.0))], "users": {"viewer": "right"}});
    let Some(peer) = peer::start(&spec) else { return };
    let folder = tempfile::tempdir().unwrap();
    let mut settings = json!({
        "user": {"name": "viewer", "password": {"file": secret(folder.path(), "right")}}
    });
    let running = start(peer.port, &settings, vec![tag(1, ValueKind::F64, "A")]);
    running.wait_for_link(LinkState::Down, "the server would get the password unencrypted");
    settings["user"]["allow_plain_password"] = json!(true);
    let running = start(peer.port, &settings, vec![tag(1, ValueKind::F64, "A")]);
    running.wait_for(1, Value::F64(5.0));
}

#[test]
fn users_have_certificates() {
    let more = json!({"certificates": ["user.der"]});
    let Some(setting) = Setting::new("server", &POLICIES, &more) else { return };
    setting.trust("server");
    let user = |name: &str| {
        let path = |end| setting.path(&format!("{name}.{end}"));
        json!({"certificate": path("der"), "key": path("pem")})
    };
    for mode in ["Sign", "SignAndEncrypt"] {
        let security = setting.security("client", "Aes128_Sha256_RsaOaep", mode);
        setting.start(&with(security.clone(), "user", user("user"))).wait_for(1, Value::F64(5.0));
        setting.check_refused(&with(security, "user", user("stranger")), "user: Bad");
    }
}

#[test]
fn keys_are_renewed_before_they_are_too_old() {
    let Some(mut setting) = Setting::new("server", &POLICIES, &json!({})) else { return };
    setting.trust("server");
    let mut settings = setting.security("client", "Basic256Sha256", "SignAndEncrypt");
    settings["silence_seconds"] = json!(1.5);
    let tags = || vec![tag(1, ValueKind::F64, "A")];
    let mut running = start(setting.peer.port, &settings, Vec::new());
    running.plugin.config.channel_lifetime = Duration::from_secs(2);
    running.plugin.start(tags(), running.recorder.sink()).unwrap();
    running.wait_for(1, Value::F64(5.0));
    // Several lifetimes, in which nothing may be lost.
    for value in 6..14 {
        std::thread::sleep(Duration::from_secs(1));
        setting.peer.command(&json!({"set": node("A", "Double", &json!(f64::from(value)))}));
        running.wait_for(1, Value::F64(f64::from(value)));
    }
    let states: Vec<_> = running.recorder.recording().links.iter().map(|link| link.0).collect();
    assert_eq!(states, [LinkState::Connecting, LinkState::Up]);
}

#[test]
fn alarms_of_a_secured_server_are_current_only_once_it_is_trusted() {
    let hot = json!({
        "ActiveState/Id": true, "AckedState/Id": false, "Retain": true, "Severity": 500
    });
    let alarms = json!({"conditions": ["ns=2;s=Hot"], "alarms": {"ns=2;s=Hot": hot}});
    let policies = ["Basic256Sha256/SignAndEncrypt"];
    let Some(setting) = Setting::new("server", &policies, &alarms) else { return };
    let security = setting.security("client", "Basic256Sha256", "SignAndEncrypt");
    let settings = with(security, "alarms", json!(true));
    let mut running = setting.start(&settings);
    running.wait_for_link(LinkState::Down, "trusted");
    let report = running.plugin.alarms(0).unwrap();
    assert!(report.fault.unwrap().contains("trusted"), "it says which check failed");
    assert_eq!(report.alarms, None, "nothing is known");
    setting.trust("server");
    running.wait_for(1, Value::F64(5.0));
    let deadline = std::time::Instant::now() + PATIENCE;
    let report = loop {
        let report = running.plugin.alarms(0).unwrap();
        if report.fault.is_none() || std::time::Instant::now() > deadline {
            break report;
        }
        std::thread::sleep(Duration::from_millis(20));
    };
    assert_eq!(report.fault, None);
    assert!(report.alarms.unwrap()[0].is_active);
}

#[test]
fn an_instance_without_the_setting_says_that_it_mirrors_no_alarms() {
    let settings = json!({"url": "opc.tcp://127.0.0.1:1/test"});
    let settings: Settings = serde_json::from_value(settings).unwrap();
    let mut plugin = OpcUa::create(settings, host()).unwrap();
    let error = plugin.alarms(0).unwrap_err().to_string();
    assert!(error.contains("\"alarms\": true"), "{error}");
}

#[test]
fn points_are_listed_with_the_same_security_and_the_same_users() {
    let users = json!({"users": {"viewer": "right"}});
    let Some(setting) = Setting::new("server", &POLICIES, &users) else { return };
    setting.trust("server");
    let security = setting.security("client", "Basic256Sha256", "SignAndEncrypt");
    let user = |text: &str| json!({"name": "viewer", "password": {"file": secret(setting.folder.path(), text)}});
    let run = points(setting.peer.port, &with(security.clone(), "user", user("right")), &[]);
    assert_eq!(run.exit_code, Some(0), "{:?}", run.diagnostics);
    assert!(list(&run).contains("\nTest.A,,f64,,,,nsu=urn:busbar:test;s=A,,\n"), "{}", list(&run));
    let run = points(setting.peer.port, &with(security, "user", user("wrong")), &[]);
    check_refused(&run, abi::BUSBAR_EXIT_CODE_INPUT, "user: ");
    // A certificate that somebody else has, and one that is not trusted any more.
    let other = setting.security("expired_client", "Basic256Sha256", "SignAndEncrypt");
    check_refused(
        &points(setting.peer.port, &with(other, "user", user("right")), &[]),
        abi::BUSBAR_EXIT_CODE_INPUT,
        "security: ",
    );
    fs::remove_file(setting.path("trusted/server.der")).unwrap();
    setting.trust("other");
    let security = setting.security("client", "Basic256Sha256", "SignAndEncrypt");
    check_refused(
        &points(setting.peer.port, &with(security, "user", user("right")), &[]),
        abi::BUSBAR_EXIT_CODE_INPUT,
        "is not trusted: check at the server",
    );
}
