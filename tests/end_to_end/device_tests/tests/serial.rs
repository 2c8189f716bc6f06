//! Serial line in a scene: the plugin's process may open it, and values that the line no longer
//! brings are bad.

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::Duration;

use e2e::peer::Peer;
use e2e::{Process, Scene, available, finish, wait_for};
use rustix::process::Signal;
use serde_json::{Value, json};

/// Longest time until socat has set up a line.
const MAX_START: Duration = Duration::from_secs(20);
/// Number of pieces of answers after which a value has come; each answer is two or three of them.
const ANSWERS: usize = 12;

/// Pair of pseudo-terminals that socat joins, in a folder.
struct Line {
    socat: Process,
    folder: tempfile::TempDir,
}

impl Line {
    fn lay() -> Option<Self> {
        let mut version = Command::new("socat");
        let has_socat = version.arg("-V").stdout(Stdio::null()).status().is_ok();
        if !available(has_socat, "no socat: run `cargo xtask test`") {
            return None;
        }
        let folder = tempfile::tempdir().expect("a temporary folder can be made");
        // What goes over the line is told on standard output.
        let mut socat = Command::new("sh");
        socat.args(["-c", "exec socat -x \"$@\" 2>&1", "socat"]);
        for end in ["ours", "theirs"] {
            let link = folder.path().join(end);
            socat.arg(format!("pty,raw,echo=0,link={}", link.display()));
        }
        let socat = Process::start(&mut socat);
        let line = Self { socat, folder };
        let has_ends = || line.end("ours").exists() && line.end("theirs").exists();
        wait_for("a serial line", MAX_START, || has_ends().then_some(()));
        Some(line)
    }

    /// Waits until the devices have sent `count` pieces.
    fn wait_for_answers(&self, mut count: usize) {
        self.socat.wait_for_line(|line| {
            count -= usize::from(line.starts_with("< "));
            (count == 0).then_some(())
        });
    }

    fn end(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }
}

fn scene(device: &Path) -> Scene {
    let mut scene = Scene::without_tags();
    scene.config["plugins"]["meters"] = json!({
        "plugin": "modbus_adapter",
        "settings": {"serial": {"device": device}, "poll_seconds": 0.1, "timeout_seconds": 0.3}
    });
    for unit in [1, 2] {
        scene.config["tags"][format!("Unit{unit}")] = json!({
            "type": "f64", "freshness_seconds": 60,
            "source": {"instance": "meters", "address": {
                "table": "holding", "register": 0, "type": "u16", "unit": unit
            }}
        });
    }
    scene
}

/// Returns the register table of unit 1 alone, which has this value.
fn unit_one(value: u16) -> Value {
    json!({"units": {"1": {"holding": {"0": value}}}})
}

#[test]
fn values_come_over_the_line_with_and_without_a_process() {
    let Some(line) = Line::lay() else { return };
    let Some(_peer) = Peer::start_serial(&line.end("theirs"), &unit_one(230)) else { return };
    for isolation in ["process", "none"] {
        let mut scene = scene(&line.end("ours"));
        scene.config["isolation"] = json!(isolation);
        finish(&mut scene.rendering(3.0)).expect_code(0);
        let (there, absent) = (scene.stats().tag("Unit1"), scene.stats().tag("Unit2"));
        assert_eq!((there.value, there.quality.as_str()), (json!(230.0), "good"), "{isolation}");
        let found = (absent.quality.as_str(), absent.reason.as_deref());
        assert_eq!(found, ("bad", Some("communication")), "{isolation}");
    }
}

#[test]
fn a_line_that_is_cut_leaves_nothing_good() {
    let Some(line) = Line::lay() else { return };
    let Some(_peer) = Peer::start_serial(&line.end("theirs"), &unit_one(230)) else { return };
    let scene = scene(&line.end("ours"));
    let running = Process::start(&mut scene.rendering(5.0));
    line.wait_for_answers(ANSWERS);
    line.socat.signal(Signal::KILL);
    running.finish().expect_code(0);
    for (id, tag) in scene.stats().tags() {
        let found = (tag.quality.as_str(), tag.reason.as_deref());
        assert_eq!(found, ("bad", Some("communication")), "{id}");
    }
    assert_eq!(scene.stats().tag("Unit1").value, json!(230.0), "the last value stays");
}
