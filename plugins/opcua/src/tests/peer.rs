//! An independent server, asyncua, in a process of its own.

use std::io::{BufRead, BufReader, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};

/// Path from this crate to the workspace's root.
const ROOT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../..");

pub(super) struct Peer {
    child: Child,
    stdin: ChildStdin,
    stdout: BufReader<ChildStdout>,
    pub(super) port: u16,
}

impl Peer {
    /// Starts a server; `None`, said aloud, where there is no asyncua. Where peers are
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
            .arg(script())
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
        peer.port = port.unwrap_or_else(|| panic!("asyncua did not start: '{line}'"));
        peer
    }

    /// Gives a command and waits until it is carried out.
    pub(super) fn command(&mut self, command: &serde_json::Value) {
        assert_eq!(self.ask(command), "OK", "{command}");
    }

    /// Gives a command; its answer.
    pub(super) fn ask(&mut self, command: &serde_json::Value) -> String {
        writeln!(self.stdin, "{command}").unwrap();
        self.line()
    }

    /// Stops it, as if its machine hung, or lets it go on.
    #[cfg(target_os = "linux")]
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

/// Makes certificates with keys, `NAME.der` and `NAME.pem`, each for an application URI.
pub(super) fn make_certificates(folder: &Path, pairs: &[(&str, &str)]) {
    let mut command = Command::new(python().expect("a peer was there before"));
    command.arg(script()).arg("--make").arg(folder);
    for (name, uri) in pairs {
        command.args([name, uri]);
    }
    assert!(command.status().unwrap().success());
}

fn script() -> PathBuf {
    Path::new(ROOT).join("tests/peers/opcua_asyncua.py")
}

fn python() -> Option<PathBuf> {
    let path = std::env::var_os("BUSBAR_PYTHON")
        .map_or_else(|| Path::new(ROOT).join("target/venv/bin/python"), PathBuf::from);
    let works = Command::new(&path)
        .args(["-c", "import asyncua"])
        .stderr(Stdio::null())
        .status()
        .is_ok_and(|status| status.success());
    if works {
        return Some(path);
    }
    let remedy = format!(
        "{} has no asyncua: install tests/peers/requirements.txt and set BUSBAR_PYTHON",
        path.display()
    );
    let required = |name| std::env::var_os(name).is_some();
    assert!(!required("CI") && !required("BUSBAR_REQUIRE_PEERS"), "{remedy}");
    eprintln!("SKIPPED: {remedy}");
    None
}
