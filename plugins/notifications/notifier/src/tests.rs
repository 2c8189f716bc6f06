//! The plugin against a real mail server (aiosmtpd) and a real web server (http.server), and
//! against servers that hang, greet with garbage or are gone.

use std::io::{Read, Write};
use std::net::TcpListener;
use std::path::Path;
use std::thread::sleep;
use std::time::{Duration, Instant};

use busbar_link::testing::CertificateAuthority;
use busbar_plugin_sdk::testing::{host, run_command};
use busbar_plugin_sdk::{
    AlarmChange, AlarmNotification, AlarmOrigin, AlarmState, LinkState, NotificationBatch,
    NotificationReport, Notify, Plugin, Priority,
};
use peer_process::{Peer, PeerScript};
use serde_json::{Value, json};

use crate::{Notifier, Settings};

const MAIL: PeerScript = PeerScript { file: "smtp_aiosmtpd.py", import: "import aiosmtpd" };
const WEB: PeerScript = PeerScript { file: "webhook_server.py", import: "import http.server" };
/// Longest wait for a message, on a loaded machine.
const MAX_WAIT: Duration = Duration::from_secs(60);
const PASSWORD: &str = "pa55word-of-the-test";
const TOKEN: &str = "t0ken-of-the-test";

fn notifier(settings: Value) -> Notifier {
    let settings: Settings = serde_json::from_value(settings).unwrap();
    Notifier::create(settings, host()).unwrap()
}

fn mail_settings(port: u16) -> Value {
    json!({
        "recipients": [{ "name": "duty", "mail": ["duty@test.example"] }],
        "mail": {
            "host": "127.0.0.1", "port": port, "security": "none",
            "from": "Busbar <busbar@test.example>",
        },
        "site": "Station 12",
        "timeout_seconds": 5,
    })
}

fn web_settings(url: &str) -> Value {
    json!({
        "recipients": [{ "name": "duty", "webhooks": ["pager"] }],
        "webhooks": { "pager": { "url": url } },
        "timeout_seconds": 5,
    })
}

fn raised(number: u64, id: &str) -> AlarmNotification {
    AlarmNotification {
        number,
        alarm: id.to_owned(),
        change: AlarmChange::Raised,
        state: AlarmState::Unacknowledged,
        priority: Priority::Critical,
        occurred: 1_700_000_000_000_000_000,
        time: 1_700_000_000_000_000_000,
        place: vec!["=S12".to_owned(), "=S12D1T1-TA1".to_owned()],
        group: None,
        message: "Öltemperatur zu hoch".to_owned(),
        consequence: "The transformer trips".to_owned(),
        response: "Start all fans".to_owned(),
        operator: None,
        value: Some("103.5 °C".to_owned()),
        origin: Vec::new(),
        is_certain: true,
        source: None,
    }
}

fn batch(changes: Vec<AlarmNotification>) -> NotificationBatch {
    let handed = changes.iter().map(|change| change.number).max().unwrap_or(0);
    NotificationBatch { run: 1, handed, changes, ..NotificationBatch::default() }
}

/// Calls as the host does, until the report satisfies a condition.
fn until(
    notifier: &mut Notifier,
    changes: &[AlarmNotification],
    holds: impl Fn(&NotificationReport) -> bool,
) -> NotificationReport {
    let start = Instant::now();
    loop {
        let report = notifier.notify(batch(changes.to_vec())).unwrap();
        assert!(!report.message.contains(PASSWORD) && !report.message.contains(TOKEN));
        if holds(&report) {
            return report;
        }
        assert!(start.elapsed() < MAX_WAIT, "{report:?}");
        sleep(Duration::from_millis(20));
    }
}

fn messages(peer: &mut Peer) -> Vec<Value> {
    serde_json::from_str(&peer.ask(&json!({ "messages": true }))).unwrap()
}

fn secret(folder: &Path, name: &str, text: &str) -> Value {
    use std::os::unix::fs::PermissionsExt;
    let path = folder.join(name);
    std::fs::write(&path, text).unwrap();
    std::fs::set_permissions(&path, std::fs::Permissions::from_mode(0o600)).unwrap();
    json!({ "file": path })
}

#[test]
fn a_mail_has_all_that_is_known_of_the_alarm() {
    let Some(mut server) = MAIL.start(0, &["{}"]) else { return };
    let mut notifier = notifier(mail_settings(server.port));
    let simulated = AlarmNotification { origin: vec![AlarmOrigin::Simulated], ..raised(1, "Oil") };
    let report = until(&mut notifier, &[simulated], |report| report.delivery == LinkState::Up);
    assert_eq!((report.taken, report.waiting, report.undelivered), (1, 0, 0));
    let mails = messages(&mut server);
    assert_eq!(mails.len(), 1, "{mails:?}");
    let mail = &mails[0];
    assert_eq!(mail["to"], json!(["duty@test.example"]));
    assert_eq!(mail["from"], "busbar@test.example");
    let subject = "[SIMULATED] Station 12: CRITICAL: Öltemperatur zu hoch, =S12D1T1-TA1";
    assert_eq!(mail["subject"], subject);
    assert_eq!((&mail["automatic"], &mail["kind"]), (&json!("auto-generated"), &json!("alarm")));
    let text = mail["text"].as_str().unwrap();
    for expected in [
        "NOT A LIVE VALUE: SIMULATED",
        "Equipment: =S12D1T1-TA1",
        "Area: =S12",
        "Came: 2023-11-14T22:13:20Z",
        "Value: 103.5 °C",
        "Consequence: The transformer trips",
        "Response: Start all fans",
    ] {
        assert!(text.contains(expected), "{expected}: {text}");
    }
}

#[test]
fn mail_is_encrypted_and_logged_in_as_the_settings_say() {
    let folder = tempfile::tempdir().unwrap();
    let authority = CertificateAuthority::new(folder.path(), "authority");
    let other = CertificateAuthority::new(folder.path(), "other");
    let (certificate, key) = authority.sign("server", "localhost");
    let password = secret(folder.path(), "password", PASSWORD);
    let username = secret(folder.path(), "user", "busbar");
    for security in ["tls", "starttls"] {
        let spec = json!({
            "security": security, "certificate": certificate, "key": key,
            "user": "busbar", "password": PASSWORD,
        });
        let Some(mut server) = MAIL.start(0, &[&spec.to_string()]) else { return };
        let mut settings = mail_settings(server.port);
        settings["mail"]["host"] = json!("localhost");
        settings["mail"]["security"] = json!(security);
        settings["mail"]["tls"] = json!({ "ca": authority.certificate() });
        settings["mail"]["login"] = json!({ "username": username, "password": password });
        let mut good = notifier(settings.clone());
        until(&mut good, &[raised(1, "Oil")], |report| report.delivery == LinkState::Up);
        let mails = messages(&mut server);
        assert_eq!(mails.len(), 1, "{security}: {mails:?}");
        assert_eq!((&mails[0]["encrypted"], &mails[0]["user"]), (&json!(true), &json!("busbar")));

        let mut wrong = settings.clone();
        wrong["mail"]["tls"] = json!({ "ca": other.certificate() });
        let mut distrustful = notifier(wrong);
        let down = |report: &NotificationReport| report.delivery == LinkState::Down;
        let report = until(&mut distrustful, &[raised(1, "Oil")], down);
        assert!(report.message.contains("mail.tls"), "{security}: {}", report.message);

        let mut wrong = settings;
        wrong["mail"]["login"]["password"] = secret(folder.path(), "wrong", "not it");
        let mut stranger = notifier(wrong);
        let report = until(&mut stranger, &[raised(1, "Oil")], down);
        assert!(report.message.contains("mail.login"), "{security}: {}", report.message);
        assert_eq!((report.waiting, report.undelivered), (1, 0), "it is tried again");
        assert_eq!(messages(&mut server).len(), 1);
    }
}

#[test]
fn one_refused_recipient_keeps_no_other_from_the_message_and_a_busy_server_gets_it_later() {
    let Some(mut server) = MAIL.start(0, &["{}"]) else { return };
    let mut settings = mail_settings(server.port);
    settings["recipients"][0]["mail"] = json!(["gone@test.example", "duty@test.example"]);
    server.command(&json!({ "refuse": ["gone@test.example"] }));
    let mut notifier = notifier(settings);
    let report = until(&mut notifier, &[raised(1, "Oil")], |report| {
        report.undelivered == 1 && report.waiting == 0
    });
    assert_eq!(report.delivery, LinkState::Down);
    assert!(report.message.contains("refuses the recipient gone@test.example"), "{report:?}");
    assert!(report.message.contains("there is no such user"), "{report:?}");
    assert_eq!(messages(&mut server).len(), 1);

    server.command(&json!({ "busy": true }));
    let second = raised(2, "Gas");
    let down = |report: &NotificationReport| report.message.contains("try again later");
    let report = until(&mut notifier, std::slice::from_ref(&second), down);
    assert_eq!(report.waiting, 2);
    server.command(&json!({ "busy": false }));
    until(&mut notifier, &[second], |report| report.waiting == 0);
    let subjects: Vec<_> = messages(&mut server).iter().map(|mail| mail["to"].clone()).collect();
    assert_eq!(subjects, vec![json!(["duty@test.example"]); 2]);
}

/// Starts a server that does as told with each connection.
fn peculiar(serve: impl Fn(std::net::TcpStream) + Send + Sync + Copy + 'static) -> u16 {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let port = listener.local_addr().unwrap().port();
    std::thread::spawn(move || {
        for stream in listener.incoming() {
            let Ok(stream) = stream else { return };
            std::thread::spawn(move || serve(stream));
        }
    });
    port
}

#[test]
fn servers_that_hang_greet_with_garbage_or_are_gone_are_told_with_a_remedy() {
    let hangs = peculiar(|mut stream| {
        let _ = stream.read(&mut [0; 1]);
        sleep(MAX_WAIT);
    });
    let garbage = peculiar(|mut stream| {
        let _ = stream.write_all(&[0xff, 0x00, 0x17, b'\n']);
        sleep(MAX_WAIT);
    });
    let endless = peculiar(|mut stream| while stream.write_all(&[b'2'; 4096]).is_ok() {});
    let gone = TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().port();
    let down = |report: &NotificationReport| report.delivery == LinkState::Down;
    for (port, expected) in [
        (hangs, "has not taken the message within 5 s"),
        (garbage, "does not greet as a mail server"),
        (endless, "does not greet as a mail server"),
        (gone, "connection refused; check \"mail.host\""),
    ] {
        let mut notifier = notifier(mail_settings(port));
        let report = until(&mut notifier, &[raised(1, "Oil")], down);
        assert!(report.message.contains(expected), "{expected}: {}", report.message);
        assert_eq!((report.waiting, report.undelivered), (1, 0));
        let dropped = Instant::now();
        drop(notifier);
        assert!(dropped.elapsed() < Duration::from_secs(2), "it ends at once");
    }
    for (port, expected) in [
        (hangs, "no answer within 5 s"),
        (garbage, "is it a web server"),
        (endless, "is it a web server"),
        (gone, "connection refused; check \"url\""),
    ] {
        let mut notifier = notifier(web_settings(&format!("http://127.0.0.1:{port}/a")));
        let report = until(&mut notifier, &[raised(1, "Oil")], down);
        assert!(report.message.contains(expected), "{expected}: {}", report.message);
    }
}

#[test]
fn a_webhook_gets_the_message_with_its_token_and_faults_are_told() {
    let folder = tempfile::tempdir().unwrap();
    let authority = CertificateAuthority::new(folder.path(), "authority");
    let (certificate, key) = authority.sign("server", "localhost");
    let spec = json!({ "certificate": certificate, "key": key }).to_string();
    let Some(mut server) = WEB.start(0, &[&spec]) else { return };
    let url = format!("https://localhost:{}/hooks/secret-part", server.port);
    let mut settings = web_settings("-");
    settings["webhooks"]["pager"] = json!({
        "secret_url": secret(folder.path(), "url", &url),
        "token": secret(folder.path(), "token", TOKEN),
        "tls": { "ca": authority.certificate() },
    });
    let mut notifier = notifier(settings);
    server.command(&json!({ "status": 503 }));
    let recorded = AlarmNotification { origin: vec![AlarmOrigin::Test], ..raised(1, "Oil") };
    let changes = [recorded];
    let report = until(&mut notifier, &changes, |report| report.delivery == LinkState::Down);
    assert!(report.message.contains("answers 503"), "{report:?}");
    assert!(!report.message.contains("secret-part"), "{report:?}");
    assert_eq!(report.waiting, 1);
    server.command(&json!({ "status": 204 }));
    until(&mut notifier, &changes, |report| report.delivery == LinkState::Up);
    let posted = messages(&mut server);
    assert_eq!(posted.len(), 1, "{posted:?}");
    let (body, key) = (&posted[0]["body"], &posted[0]["key"]);
    assert_eq!(posted[0]["path"], "/hooks/secret-part");
    assert_eq!(posted[0]["authorization"], format!("Bearer {TOKEN}"));
    assert_eq!((&body["id"], &body["kind"]), (key, &json!("alarm")));
    assert_eq!(body["not_live"], json!(["test"]));
    assert_eq!(body["alarms"][0]["alarm"], "Oil");

    server.command(&json!({ "status": 422 }));
    let report = until(&mut notifier, &[raised(2, "Gas")], |report| report.undelivered == 1);
    assert_eq!((report.waiting, report.delivery), (0, LinkState::Down));
    assert!(report.message.contains("422"), "{report:?}");
}

#[test]
fn a_server_that_hangs_keeps_no_other_from_its_messages() {
    let Some(mut server) = MAIL.start(0, &["{}"]) else { return };
    let hangs = peculiar(|_stream| sleep(MAX_WAIT));
    let mut settings = mail_settings(server.port);
    settings["recipients"][0]["webhooks"] = json!(["pager"]);
    settings["webhooks"] = json!({ "pager": { "url": format!("http://127.0.0.1:{hangs}/") } });
    settings["timeout_seconds"] = json!(60);
    let mut notifier = notifier(settings);
    let report = until(&mut notifier, &[raised(1, "Oil")], |report| report.waiting == 1);
    assert_eq!(report.delivery, LinkState::Up, "the other is still being tried: {report:?}");
    assert_eq!(messages(&mut server).len(), 1);
}

#[test]
fn what_waits_survives_a_restart_and_comes_once() {
    let folder = tempfile::tempdir().unwrap();
    let gone = TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().port();
    let mut settings = mail_settings(gone);
    settings["state_file"] = json!(folder.path().join("notifier.json"));
    let changes = [raised(1, "Oil"), raised(2, "Gas")];
    let mut first = notifier(settings.clone());
    let report = until(&mut first, &changes, |report| report.taken == 2 && report.waiting == 2);
    assert_eq!(report.undelivered, 0);
    // A second instance with the same file is refused, in words.
    let fault = notifier(settings.clone()).notify(batch(Vec::new())).unwrap_err();
    assert!(fault.message().contains("another instance"), "{fault}");
    drop(first);
    let Some(mut server) = MAIL.start(gone, &["{}"]) else { return };
    let mut second = notifier(settings.clone());
    // The host repeats what it does not know to be taken.
    until(&mut second, &changes, |report| report.waiting == 0 && report.delivery == LinkState::Up);
    drop(second);
    let mut third = notifier(settings);
    until(&mut third, &changes, |report| report.taken == 2);
    sleep(Duration::from_secs(1));
    let mut ids: Vec<_> = messages(&mut server).iter().map(|mail| mail["id"].to_string()).collect();
    assert_eq!(ids.len(), 2, "{ids:?}");
    ids.dedup();
    assert_eq!(ids.len(), 2, "each message has its own id");
}

#[test]
fn the_test_command_tells_what_came_of_each_message() {
    let Some(mut server) = MAIL.start(0, &["{}"]) else { return };
    let mut settings = mail_settings(server.port);
    settings["recipients"] = json!([
        { "name": "duty", "mail": ["duty@test.example"] },
        { "name": "boss", "mail": ["gone@test.example"] },
    ]);
    server.command(&json!({ "refuse": ["gone@test.example"] }));
    let notifier = notifier(settings);
    let run =
        |names: &[&str]| run_command(&notifier, "test-message", names, b"", (1, 100)).unwrap();
    let one = run(&["duty"]);
    assert_eq!(one.exit_code, Some(0));
    assert_eq!(one.output, b"duty, mail to duty@test.example: delivered\n");
    let mails = messages(&mut server);
    assert_eq!(mails[0]["subject"], "[TEST] Station 12: Test message");
    let all = run(&[]);
    assert_eq!(all.exit_code, Some(1));
    let text = String::from_utf8(all.output).unwrap();
    assert!(text.contains("refuses the recipient gone@test.example"), "{text}");
    let unknown = run(&["nobody"]);
    assert_eq!(unknown.exit_code, Some(2));
    assert!(unknown.diagnostics[0].1.contains("duty, boss"), "{:?}", unknown.diagnostics);
}

#[test]
fn faults_of_settings_name_their_place() {
    let mut settings = mail_settings(25);
    settings["mail"]["login"] = json!({ "username": { "env": "A" }, "password": { "env": "B" } });
    settings["mail"]["from"] = json!("nobody");
    settings["recipients"][0] = json!({
        "name": "duty", "mail": ["no address"], "webhooks": ["pager"], "delay_seconds": 100_000,
    });
    settings["state_file"] = json!("notifier.json");
    settings["webhooks"] = json!({ "other": { "url": "https://hooks.test/" } });
    let settings: Settings = serde_json::from_value(settings).unwrap();
    let fault = Notifier::create(settings, host()).err().unwrap();
    for expected in [
        "mail.login: it would be sent unencrypted",
        "mail.from: 'nobody' is no mail address",
        "recipients[0].mail: 'no address' is no mail address",
        "recipients[0].webhooks: there is no webhook 'pager'",
        "recipients[0].delay_seconds: 100000 is not within",
        "state_file: 'notifier.json' is no absolute path",
        "webhooks.other.tls: name the trusted authorities",
    ] {
        assert!(fault.message().contains(expected), "{expected}: {fault}");
    }
}
