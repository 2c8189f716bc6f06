//! An independent server in a process of its own.

use std::io::{BufRead, BufReader, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};

/// Path from this crate to the workspace's root.
const ROOT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../..");
const IMPORT: &str = "import pyiec61850.pyiec61850";

pub(super) struct Peer {
    child: Child,
    stdin: ChildStdin,
    stdout: BufReader<ChildStdout>,
    pub(super) port: u16,
}

impl Peer {
    /// Starts a server; `None`, said aloud, where there is no library. Where peers are
    /// required that is a failure.
    pub(super) fn start(spec: &serde_json::Value) -> Option<Self> {
        Some(Self::start_on(&python()?, 0, spec))
    }

    /// Ends it and starts another on its port.
    pub(super) fn restart(self, spec: &serde_json::Value) -> Self {
        let port = self.port;
        drop(self);
        Self::start_on(&python().expect("it was there before"), port, spec)
    }

    fn start_on(python: &Path, port: u16, spec: &serde_json::Value) -> Self {
        let mut child = Command::new(python)
            .arg(Path::new(ROOT).join("tests/peers/iec61850_server.py"))
            .args(["--port", &port.to_string(), &spec.to_string()])
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .unwrap();
        let stdin = child.stdin.take().unwrap();
        let stdout = BufReader::new(child.stdout.take().unwrap());
        let mut peer = Self { child, stdin, stdout, port };
        let line = peer.line();
        let port = line.strip_prefix("READY ").and_then(|p| p.parse().ok());
        peer.port = port.unwrap_or_else(|| panic!("it did not start: '{line}'"));
        peer
    }

    /// Gives a command and waits until it is carried out.
    #[track_caller]
    pub(super) fn command(&mut self, command: &serde_json::Value) {
        writeln!(self.stdin, "{command}").unwrap();
        assert_eq!(self.line(), "OK", "{command}");
    }

    /// Stops it, as if its machine hung, or lets it go on.
    pub(super) fn signal(&self, name: &str) {
        let id = self.child.id().to_string();
        assert!(Command::new("kill").args(["-s", name, &id]).status().unwrap().success());
    }

    fn line(&mut self) -> String {
        let mut line = String::new();
        self.stdout.read_line(&mut line).unwrap();
        line.trim().to_owned()
    }
}

impl Drop for Peer {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

fn python() -> Option<PathBuf> {
    let path = std::env::var_os("BUSBAR_PYTHON")
        .map_or_else(|| Path::new(ROOT).join("target/venv/bin/python"), PathBuf::from);
    let works = Command::new(&path)
        .args(["-c", IMPORT])
        .stderr(Stdio::null())
        .status()
        .is_ok_and(|status| status.success());
    if works {
        return Some(path);
    }
    let remedy = format!(
        "'{IMPORT}' fails by {}: install tests/peers/requirements.txt and set BUSBAR_PYTHON",
        path.display()
    );
    let required = |name| std::env::var_os(name).is_some();
    assert!(!required("CI") && !required("BUSBAR_REQUIRE_PEERS"), "{remedy}");
    eprintln!("SKIPPED: {remedy}");
    None
}
