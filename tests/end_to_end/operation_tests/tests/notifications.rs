//! Notifications from an alarm of an independent device to a mail box of an independent server:
//! the way there, what is said of it, and nothing twice or lost where processes are killed.

use std::process::Command;
use std::time::{Duration, Instant};

use busbar_scene_loader::LoadedScene;
use busbar_viewer::reload::{ReloadOutcome, Reloader};
use busbar_viewer::{RendererOptions, Viewer};
use e2e::peer::{Peer, normal_values, python};
use e2e::{Process, Scene, busbar, finish, wait_for, workspace_path};
use egui::{Event, Key, Modifiers};
use rustix::process::{Pid, Signal, kill_process};
use serde_json::{Value, json};

const SIZE: [u32; 2] = [480, 270];
/// Longest wait for a message, on a loaded machine.
const MAX_WAIT: Duration = Duration::from_secs(90);
/// Time in which a message that comes twice would have come.
const QUIET: Duration = Duration::from_secs(6);
const RELAY: &str = "=S12D1T1-TA1/buchholz relay";
/// Address of the Buchholz relay among the discrete inputs.
const RELAY_INPUT: u16 = 4;

/// Independent mail server, aiosmtpd.
struct MailServer {
    process: Process,
    port: u16,
    /// Number of the last query: answers to earlier ones stay in the output.
    query: u64,
}

impl MailServer {
    fn start(port: u16) -> Option<Self> {
        let python = python("aiosmtpd")?;
        let mut command = Command::new(python);
        command.arg(workspace_path("tests/end_to_end/peers/smtp_aiosmtpd.py"));
        command.args(["--port", &port.to_string(), "{}"]);
        let process = Process::start(&mut command);
        let port = process.wait_for_line(|line| line.strip_prefix("READY ")?.parse().ok());
        Some(Self { process, port, query: 0 })
    }

    fn messages(&mut self) -> Vec<Value> {
        self.query += 1;
        self.process.write_line(&json!({ "messages": self.query }).to_string());
        self.process.wait_for_line(|line| {
            let mut answer: Value = serde_json::from_str(line).ok()?;
            let messages = answer.get_mut("messages")?.as_array_mut().map(std::mem::take);
            messages.filter(|_| answer["query"] == self.query)
        })
    }

    fn subjects(&mut self) -> Vec<String> {
        let subject = |mail: &Value| mail["subject"].as_str().unwrap_or_default().to_owned();
        self.messages().iter().map(subject).collect()
    }
}

/// Returns a free port that nobody listens at.
fn free_port() -> u16 {
    let listener = std::net::TcpListener::bind("127.0.0.1:0").expect("a port is free");
    listener.local_addr().expect("it is bound").port()
}

/// Returns the demo scene with one alarm, which is told by mail.
fn scene(device: u16, mail: u16) -> Scene {
    let mut scene = Scene::demo(device);
    scene.add_plugin("notifier");
    let config = &mut scene.config;
    config["alarms"] = json!({
        "Trip": {
            "tag": "T1.Buchholz", "condition": { "equals": true }, "priority": "critical",
            "message": "Buchholz trip", "response": "Inspect the relay", "equipment": RELAY
        },
    });
    config["alarm_handling"] = json!({ "log_directory": "log" });
    config["plugins"]["mail"] = json!({
        "plugin": "notifier",
        "settings": {
            "recipients": [{ "name": "duty", "mail": ["duty@test.example"], "areas": ["=S12*"] }],
            "mail": {
                "host": "127.0.0.1", "port": mail, "security": "none",
                "from": "busbar@test.example",
            },
            "state_file": "${folder}/notifier.json",
            "timeout_seconds": 5,
        },
    });
    config["notifications"] = json!([{ "instance": "mail" }]);
    config["graphics"] = json!({ "samples": 1, "quality": "low" });
    config["window"] = json!({ "size": SIZE });
    scene
}

struct View {
    viewer: Viewer,
    seconds: f64,
}

impl View {
    /// Opens a scene, and switches its notifications on by an edit: a view that starts without a
    /// window tells nobody.
    fn open(scene: &mut Scene) -> Self {
        let notifications = std::mem::replace(&mut scene.config["notifications"], json!([]));
        let path = scene.write();
        let loaded = LoadedScene::load(&path, &|_, _, _| {}).expect("the scene loads");
        let options = RendererOptions { samples: 1, validation: true, ..Default::default() };
        let mut viewer = Viewer::new_headless(loaded, options, SIZE).expect("there is a device");
        viewer.set_operator("A. Operator");
        viewer.set_settles(false);
        let mut view = Self { viewer, seconds: 0.0 };
        let mut reloader = Reloader::start(&path, || {}).expect("a file can be watched");
        scene.config["notifications"] = notifications;
        scene.write();
        let outcome = wait_for("the edit", MAX_WAIT, || {
            view.frame(Vec::new());
            reloader.step(&mut view.viewer)
        });
        assert_eq!(outcome, ReloadOutcome::Shown);
        view
    }

    fn frame(&mut self, events: Vec<Event>) {
        self.seconds += 0.1;
        let mut input = self.viewer.headless_input(self.seconds);
        input.events = events;
        self.viewer.frame(input).expect("a frame is drawn");
    }

    fn key(&mut self, key: Key) {
        let modifiers = Modifiers::NONE;
        let event =
            |pressed| Event::Key { key, physical_key: None, pressed, repeat: false, modifiers };
        self.frame(vec![event(true)]);
        self.frame(vec![event(false)]);
    }

    /// Draws until something holds.
    fn until<T>(&mut self, what: &str, mut holds: impl FnMut(&Viewer) -> Option<T>) -> T {
        wait_for(what, MAX_WAIT, || {
            self.frame(Vec::new());
            holds(&self.viewer)
        })
    }

    /// Draws until a mail server has as many messages; returns their subjects.
    fn until_mails(&mut self, server: &mut MailServer, count: usize) -> Vec<String> {
        self.until("mail", |_| Some(server.subjects()).filter(|subjects| subjects.len() >= count))
    }

    /// Draws for a while.
    fn idle(&mut self) {
        let start = Instant::now();
        while start.elapsed() < QUIET {
            self.frame(Vec::new());
        }
    }

    /// Returns process and message of the plugin that tells.
    fn notifier(viewer: &Viewer) -> Option<(Pid, String)> {
        let stats = viewer.stats();
        let plugin = stats.plugins.iter().find(|plugin| plugin.name == "mail")?;
        let message = plugin.link.as_ref().map(|link| link.message.clone()).unwrap_or_default();
        Some((Pid::from_raw(plugin.pid? as i32)?, message))
    }
}

#[test]
fn an_alarm_and_its_acknowledgement_reach_the_mail_box() {
    let Some(mut device) = Peer::start(&normal_values()) else { return };
    for isolation in ["process", "none"] {
        let Some(mut server) = MailServer::start(0) else { return };
        device.set("discrete", RELAY_INPUT, &[0]);
        let mut scene = scene(device.port, server.port);
        scene.config["isolation"] = json!(isolation);
        let mut view = View::open(&mut scene);
        view.until("values", |viewer| (viewer.stats().quality.bad == 0).then_some(()));
        device.set("discrete", RELAY_INPUT, &[1]);
        let subjects = view.until_mails(&mut server, 1);
        assert_eq!(subjects, [format!("CRITICAL: Buchholz trip, {RELAY}")], "{isolation}");
        let mails = server.messages();
        let text = mails[0]["text"].as_str().expect("a text");
        assert!(text.contains("Response: Inspect the relay"), "{text}");
        assert!(text.contains("State: unacknowledged"), "{text}");
        assert!(!text.contains("NOT A LIVE VALUE"), "{text}");

        view.key(Key::F8);
        view.key(Key::F9);
        let subjects = view.until_mails(&mut server, 2);
        assert_eq!(subjects[1], format!("Acknowledged: Buchholz trip, {RELAY}"));
        let text = server.messages()[1]["text"].as_str().expect("a text").to_owned();
        assert!(text.contains("By: A. Operator"), "{text}");
    }
}

#[test]
fn a_simulated_alarm_says_so_in_the_mail() {
    let Some(mut device) = Peer::start(&normal_values()) else { return };
    let Some(mut server) = MailServer::start(0) else { return };
    let mut scene = scene(device.port, server.port);
    scene.config["plugins"]["bay"]["simulated"] = json!(true);
    let mut view = View::open(&mut scene);
    device.set("discrete", RELAY_INPUT, &[1]);
    let subjects = view.until_mails(&mut server, 1);
    assert_eq!(subjects, [format!("[SIMULATED] CRITICAL: Buchholz trip, {RELAY}")]);
    let text = server.messages()[0]["text"].as_str().expect("a text").to_owned();
    assert!(text.starts_with("NOT A LIVE VALUE: SIMULATED"), "{text}");
}

#[test]
fn a_message_that_waits_outlives_its_killed_process_and_comes_once() {
    let Some(mut device) = Peer::start(&normal_values()) else { return };
    let port = free_port();
    let mut scene = scene(device.port, port);
    let mut view = View::open(&mut scene);
    device.set("discrete", RELAY_INPUT, &[1]);
    let first = view.until("a message that waits", |viewer| {
        View::notifier(viewer).filter(|(_, message)| message.contains("1 messages wait"))
    });
    assert!(first.1.contains("connection refused; check \"mail.host\""), "{}", first.1);
    kill_process(first.0, Signal::KILL).expect("it runs");
    let Some(mut server) = MailServer::start(port) else { return };
    let subjects = view.until_mails(&mut server, 1);
    assert_eq!(subjects, [format!("CRITICAL: Buchholz trip, {RELAY}")]);

    // Killed once more, and the host too: the alarm is handed over again, and was told.
    // A message that is being handed over would come again: this one is told and noted.
    let second = view.until("the next process without messages", |viewer| {
        let is_done = |message: &str| !message.contains("wait");
        View::notifier(viewer).filter(|(pid, message)| *pid != first.0 && is_done(message))
    });
    kill_process(second.0, Signal::KILL).expect("it runs");
    view.until("a third process", |viewer| {
        View::notifier(viewer).filter(|(pid, _)| *pid != second.0)
    });
    view.idle();
    drop(view);
    let mut view = View::open(&mut scene);
    view.idle();
    assert_eq!(server.subjects().len(), 1, "{:?}", server.subjects());
    // The state is as before: the acknowledgement goes to who was told.
    view.key(Key::F8);
    view.key(Key::F9);
    let subjects = view.until_mails(&mut server, 2);
    assert_eq!(subjects[1], format!("Acknowledged: Buchholz trip, {RELAY}"));
}

#[test]
fn a_picture_tells_nobody() {
    let Some(mut device) = Peer::start(&normal_values()) else { return };
    let Some(mut server) = MailServer::start(0) else { return };
    device.set("discrete", RELAY_INPUT, &[1]);
    let scene = scene(device.port, server.port);
    let mut command = busbar();
    command.arg("render").arg(scene.write()).args(["--seconds", "3"]);
    finish(command.arg("--out").arg(scene.path("picture.png"))).expect_code(0);
    assert_eq!(server.subjects(), Vec::<String>::new());
}

#[test]
fn the_test_message_is_sent_by_a_command_and_faults_of_the_configuration_are_told() {
    let Some(mut server) = MailServer::start(0) else { return };
    let mut scene = scene(1, server.port);
    let run = |scene: &Scene, instance: &str, command: &str| {
        let mut program = busbar();
        program.args(["plugin", "run"]).arg(scene.write()).args([instance, command]);
        finish(&mut program)
    };
    let said = run(&scene, "mail", "test-message").expect_code(0);
    assert_eq!(said.stdout, "duty, mail to duty@test.example: delivered\n");
    assert_eq!(server.subjects(), ["[TEST] Test message"]);
    let said = run(&scene, "mail", "tell").expect_code(1);
    assert!(said.stderr.contains("name one of its commands: test-message"), "{}", said.stderr);
    let said = run(&scene, "male", "test-message").expect_code(1);
    assert!(said.stderr.contains("there is no plugin instance 'male'"), "{}", said.stderr);

    finish(busbar().arg("check").arg(scene.write())).expect_code(0);
    scene.config["notifications"] = json!([{ "instance": "optimizer" }]);
    let said = finish(busbar().arg("check").arg(scene.write())).expect_code(1);
    let said = said.stdout + &said.stderr;
    assert!(said.contains("busbar.notify/1-draft"), "{said}");
}
