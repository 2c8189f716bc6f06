//! Chromium with one page, and a server for it: for tests of the web page.
#![allow(dead_code)]

pub(crate) mod delay_line;

use std::path::PathBuf;
use std::process::Command;
use std::time::{Duration, Instant};

/// Wall time as pages tell it.
pub(crate) use e2e::clock_reader::wall_millis;
use e2e::clock_reader::{CLOCK_PLACE, ClockLook};
use e2e::peer::python;
use e2e::{Process, Scene, busbar, wait_for, workspace_path};
use serde_json::{Value, json};

pub(crate) const PATIENCE: Duration = Duration::from_secs(60);
/// Time that a picture stays the same before it counts as at rest: what is sharpened later has come.
const CALM: Duration = Duration::from_millis(2500);
const CALM_POLL_MILLIS: u64 = 500;
/// Time in which a picture comes to rest, on a busy machine too.
const CALM_PATIENCE: Duration = Duration::from_secs(120);
pub(crate) const TOKEN: &str = "a_token_of_the_tests_0123456789";

/// Difference of two channels of a pixel that has colour, and the share of such pixels in a
/// picture that has: one in so many.
const MIN_COLOR: u8 = 12;
const MIN_COLORED: usize = 100;

/// Chromium with one page; none where it cannot be had.
pub(crate) struct Browser {
    process: Process,
    answers: usize,
}

impl Browser {
    pub(crate) fn start() -> Option<Self> {
        let mut command = Command::new(python("playwright")?);
        let process =
            Process::start(command.arg(workspace_path("tests/end_to_end/peers/web_browser.py")));
        process.wait_for_line(|line| (line == "READY").then_some(()));
        Some(Self { process, answers: 0 })
    }

    /// Has it do something; what it answers, or its fault.
    pub(crate) fn attempt(&mut self, what: &str, value: Value) -> Result<Value, String> {
        self.process.write_line(&json!({ what: value }).to_string());
        let mut left = self.answers;
        self.answers += 1;
        let answer = self.process.wait_for_line(|line| {
            let answer: Value = serde_json::from_str(line).ok().filter(Value::is_object)?;
            let is_next = left == 0;
            left = left.saturating_sub(1);
            is_next.then_some(answer)
        });
        match answer.get("fault") {
            Some(fault) => Err(fault.to_string()),
            None => Ok(answer["done"].clone()),
        }
    }

    #[track_caller]
    pub(crate) fn ask(&mut self, what: &str, value: Value) -> Value {
        self.attempt(what, value).unwrap_or_else(|fault| panic!("{what}: {fault}"))
    }

    /// Waits until the view's state is as wanted.
    #[track_caller]
    pub(crate) fn until(&mut self, what: &str, wanted: impl Fn(&Value) -> bool) -> Value {
        let start = Instant::now();
        loop {
            // While a page is loaded there is none.
            let state = self.attempt("state", Value::Null).unwrap_or_default();
            if wanted(&state) {
                return state;
            }
            assert!(start.elapsed() < PATIENCE, "it is never {what}: {state}");
        }
    }

    #[track_caller]
    pub(crate) fn until_live(&mut self) {
        let live = self.until("live", |state| state["dead"] == json!(false));
        assert_eq!((&live["filter"], &live["shown"]), (&json!("none"), &json!(false)));
    }

    #[track_caller]
    pub(crate) fn until_dead(&mut self, words: &str) -> Value {
        let dead = self.until(words, |state| {
            let says = |key: &str| state[key].as_str().is_some_and(|told| told.contains(words));
            state["dead"] == json!(true) && (says("what") || says("why"))
        });
        assert_eq!((&dead["shown"], &dead["stripes"]), (&json!(true), &json!(true)));
        assert_eq!(dead["filter"], json!("grayscale(1)"));
        assert!(dead["age"].as_str().is_some_and(|age| age.ends_with(" old")), "{dead}");
        dead
    }

    /// Waits until the picture has stayed the same for [`CALM`] and is live; returns it.
    #[track_caller]
    pub(crate) fn until_calm(&mut self) -> Value {
        let start = Instant::now();
        let (mut before, mut since) = (Value::Null, Instant::now());
        let (mut changes, mut dead) = (0, 0);
        loop {
            let picture = self.ask("picture", Value::Null);
            let state = self.ask("state", Value::Null);
            if picture != before {
                (before, since) = (picture, Instant::now());
                changes += 1;
            } else if since.elapsed() >= CALM && state["dead"] == json!(false) {
                return before;
            }
            dead += u32::from(state["dead"] != json!(false));
            assert!(
                start.elapsed() < CALM_PATIENCE,
                "it never rests: {changes} changes, {dead} times dead, at last {state}"
            );
            self.ask("wait", json!(CALM_POLL_MILLIS));
        }
    }

    /// Does something with the hands, and waits until it has changed the picture.
    #[track_caller]
    pub(crate) fn turn(&mut self, how: &str, value: Value) -> Value {
        let before = self.until_calm();
        self.ask(how, value.clone());
        wait_for("another picture", PATIENCE, || {
            (self.ask("picture", Value::Null)["sum"] != before["sum"]).then_some(())
        });
        self.until_calm()
    }

    /// Keeps a screenshot where `BUSBAR_PICTURES` says, if it does.
    pub(crate) fn shot(&mut self, name: &str) {
        let Some(folder) = std::env::var_os("BUSBAR_PICTURES") else { return };
        let path = PathBuf::from(folder).join(format!("{name}.png"));
        self.ask("shot", json!(path));
    }

    /// Asserts that the page reported no errors, such as a part blocked by a strict content
    /// security policy.
    #[track_caller]
    pub(crate) fn expect_no_errors(&mut self) {
        assert_eq!(self.ask("errors", Value::Null), json!([]));
    }

    /// Has the page keep a record of when it counts as live.
    pub(crate) fn watch(&mut self) {
        self.ask("watch", Value::Null);
    }

    /// Spans of wall time in which the page counted as live since [`Browser::watch`],
    /// milliseconds; one that goes on ends now.
    pub(crate) fn live_spans(&mut self) -> Vec<[u64; 2]> {
        let log = self.ask("watched", Value::Null);
        let number = |value: &Value| value.as_u64().expect("milliseconds");
        let log: Vec<(u64, bool)> = log
            .as_array()
            .expect("a list")
            .iter()
            .map(|entry| (number(&entry[0]), entry[1] == json!(true)))
            .collect();
        let mut spans: Vec<[u64; 2]> = Vec::new();
        let mut since = None;
        for (at, is_live) in log {
            match (since, is_live) {
                (None, true) => since = Some(at),
                (Some(start), false) => {
                    spans.push([start, at]);
                    since = None;
                }
                _ => {}
            }
        }
        spans.extend(since.map(|start| [start, wall_millis()]));
        spans
    }

    /// Looks at the clock over some time: at each change, with the look before it repeated just
    /// then, and at the end. The record goes through a file.
    pub(crate) fn clock_looks(&mut self, file: &std::path::Path, millis: u64) -> Vec<ClockLook> {
        self.ask("watch_clock", json!(CLOCK_PLACE));
        let until = wall_millis() + millis;
        while wall_millis() < until {
            self.ask("wait", json!(CALM_POLL_MILLIS));
        }
        self.ask("clock_looks", json!(file));
        let text = std::fs::read_to_string(file).expect("it was written");
        let answer: Value = serde_json::from_str(&text).expect("JSON");
        let number = |value: &Value| value.as_u64().expect("a number");
        let log = answer[1].as_array().expect("a list");
        let ends = log.iter().skip(1).map(|next| &next[0]).chain([&answer[0]]).map(number);
        let looks = log.iter().zip(ends).flat_map(|(record, end)| {
            let pixels = record[2].as_array().expect("a list").iter();
            let pixels: Vec<u8> = pixels.map(|value| number(value) as u8).collect();
            let is_live = record[1] == json!(true);
            [number(&record[0]), end].map(|at| ClockLook { at, is_live, pixels: pixels.clone() })
        });
        looks.collect()
    }

    /// Waits until a screenshot passes for live; on a busy machine a page that became live may be
    /// marked again before it is taken.
    #[track_caller]
    pub(crate) fn until_looks_live(&mut self, path: &std::path::Path) {
        wait_for("a live picture", PATIENCE, || self.looks_live(path).then_some(()));
    }

    /// Reports whether a screenshot passes for live: it has colour.
    pub(crate) fn looks_live(&mut self, path: &std::path::Path) -> bool {
        self.ask("shot", json!(path));
        let picture = e2e::picture::load(path);
        let colored = picture.pixels().filter(|pixel| {
            let [least, most] = [pixel.0.iter().min(), pixel.0.iter().max()];
            most.zip(least).is_some_and(|(most, least)| most - least > MIN_COLOR)
        });
        colored.count() > picture.pixels().len() / MIN_COLORED
    }
}

pub(crate) fn scene() -> Scene {
    let mut scene = Scene::without_tags();
    scene.config["camera"]["transition_seconds"] = json!(0);
    scene
}

/// Serves a scene; the server, and the address that it printed.
pub(crate) fn serve(scene: &Scene, listen: &str, token: &str, more: &[&str]) -> (Process, String) {
    let mut command = busbar();
    command.arg("serve").arg(scene.write()).args(["--listen", listen]).args(more);
    let process = Process::start(command.env("BUSBAR_TOKEN", token));
    let address = process.wait_for_line(|line| line.starts_with("http").then(|| line.to_owned()));
    (process, address)
}

/// The viewer of a server.
pub(crate) fn viewer_of(server: &Process) -> u32 {
    let parent = server.id().to_string();
    let is_child = |stat: &str| {
        // After the name, which is in brackets: state, then the parent.
        stat.rsplit(')').next().and_then(|rest| rest.split_whitespace().nth(1)) == Some(&parent)
    };
    let processes = std::fs::read_dir("/proc").expect("it is there").flatten();
    let ids = processes.filter_map(|entry| entry.file_name().to_str()?.parse::<u32>().ok());
    let mut children = ids.filter(|id| {
        std::fs::read_to_string(format!("/proc/{id}/stat")).is_ok_and(|stat| is_child(&stat))
    });
    children.next().expect("a viewer runs")
}
