//! Independent implementations that tests talk to: scripts of `tests/end_to_end/peers` in Python, each in
//! a process of its own, that say `READY`, and then `OK` or an answer to each command.
#![allow(clippy::print_stderr, reason = "a test that is skipped says so")]
#![allow(clippy::missing_panics_doc, reason = "a test ends where its peer fails a command")]

use std::io::{BufRead, BufReader, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};

use serde_json::Value;

/// Path from this crate to the workspace's root.
const ROOT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../..");
/// Environment variable with the interpreter that has the peers' packages.
const PYTHON_VARIABLE: &str = "BUSBAR_PYTHON";

/// Python script of `tests/end_to_end/peers`.
#[derive(Clone, Copy, Debug)]
pub struct PeerScript {
    /// File name of the script.
    pub file: &'static str,
    /// Import statement that fails where its package is missing.
    pub import: &'static str,
}

impl PeerScript {
    /// Starts it on a port, 0 for a free one, with arguments after that; `None`, said aloud,
    /// where its package is missing. Where peers are required that is a failure.
    #[track_caller]
    pub fn start(self, port: u16, arguments: &[&str]) -> Option<Peer> {
        let mut child = Command::new(self.python()?)
            .arg(self.path())
            .args(["--port", &port.to_string()])
            .args(arguments)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .expect("Python was just there");
        let stdin = child.stdin.take().expect("it is piped");
        let stdout = BufReader::new(child.stdout.take().expect("it is piped"));
        let mut peer = Peer { child, stdin, stdout, script: self, port };
        let line = peer.line();
        let Some(chosen) = line.strip_prefix("READY") else {
            panic!("{} did not start: '{line}'", self.file)
        };
        if let Ok(chosen) = chosen.trim().parse() {
            peer.port = chosen;
        }
        Some(peer)
    }

    /// Returns the path of the script.
    pub fn path(self) -> PathBuf {
        Path::new(ROOT).join("tests/end_to_end/peers").join(self.file)
    }

    /// Returns the interpreter, if it has the package.
    #[track_caller]
    pub fn python(self) -> Option<PathBuf> {
        let path = std::env::var_os(PYTHON_VARIABLE)
            .map_or_else(|| Path::new(ROOT).join("target/venv/bin/python"), PathBuf::from);
        let tried = Command::new(&path).args(["-c", self.import]).stderr(Stdio::null()).status();
        if tried.is_ok_and(|status| status.success()) {
            return Some(path);
        }
        skip(&format!(
            "'{}' fails by {}: install tests/end_to_end/peers/requirements.txt and set {PYTHON_VARIABLE}",
            self.import,
            path.display()
        ));
        None
    }
}

/// Announces that a test has no peer; where peers are required that is a failure.
#[track_caller]
pub fn skip(remedy: &str) {
    let required = |name| std::env::var_os(name).is_some();
    assert!(!required("CI") && !required("BUSBAR_REQUIRE_PEERS"), "{remedy}");
    eprintln!("SKIPPED: {remedy}");
}

/// Running script that ends when dropped.
pub struct Peer {
    child: Child,
    stdin: ChildStdin,
    stdout: BufReader<ChildStdout>,
    script: PeerScript,
    /// Port that the peer listens at, or connects to.
    pub port: u16,
}

impl Peer {
    /// Ends the script and starts another on its port with `spec`.
    #[track_caller]
    pub fn restart(self, spec: &Value) -> Self {
        let (script, port) = (self.script, self.port);
        drop(self);
        script.start(port, &[&spec.to_string()]).expect("it was there before")
    }

    /// Sends a command and waits until it is carried out.
    #[track_caller]
    pub fn command(&mut self, command: &Value) {
        assert_eq!(self.ask(command), "OK", "{command}");
    }

    /// Sends a command; returns its answer.
    #[track_caller]
    pub fn ask(&mut self, command: &Value) -> String {
        self.begin(command);
        self.line()
    }

    /// Sends a command without waiting for its answer.
    #[track_caller]
    pub fn begin(&mut self, command: &Value) {
        writeln!(self.stdin, "{command}").expect("it reads");
    }

    /// Waits until the command is carried out.
    #[track_caller]
    pub fn finish(&mut self) {
        assert_eq!(self.line(), "OK", "{}", self.script.file);
    }

    /// Stops the process (`STOP`), as if its machine hung, or continues it (`CONT`).
    #[track_caller]
    pub fn signal(&self, name: &str) {
        let id = self.child.id().to_string();
        let sent = Command::new("kill").args(["-s", name, &id]).status();
        assert!(sent.expect("there is kill").success());
    }

    fn line(&mut self) -> String {
        let mut line = String::new();
        self.stdout.read_line(&mut line).expect("it speaks UTF-8");
        line.trim().to_owned()
    }
}

impl Drop for Peer {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}
