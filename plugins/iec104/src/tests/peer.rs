//! Independent stations in processes of their own.

use std::io::{BufRead, BufReader, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};

/// Path from this crate to the workspace's root.
const ROOT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../..");

/// Which implementation.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Kind {
    /// lib60870-C behind c104.
    C104,
    /// hat-drivers, in Python throughout.
    Hat,
}

impl Kind {
    fn script(self) -> &'static str {
        match self {
            Self::C104 => "iec104_c104.py",
            Self::Hat => "iec104_hat.py",
        }
    }

    fn import(self) -> &'static str {
        match self {
            Self::C104 => "import c104",
            Self::Hat => "from hat.drivers import iec104",
        }
    }
}

pub(super) struct Peer {
    child: Child,
    stdin: ChildStdin,
    stdout: BufReader<ChildStdout>,
    kind: Kind,
    pub(super) port: u16,
}

impl Peer {
    /// Starts a station; `None`, said aloud, where there is none of the kind.
    /// Where peers are required that is a failure.
    pub(super) fn start(kind: Kind, spec: &serde_json::Value) -> Option<Self> {
        Some(Self::start_on(&python(kind)?, kind, 0, spec))
    }

    /// Ends it and starts another on its port.
    pub(super) fn restart(self, spec: &serde_json::Value) -> Self {
        let (kind, port) = (self.kind, self.port);
        drop(self);
        Self::start_on(&python(kind).expect("it was there before"), kind, port, spec)
    }

    fn start_on(python: &Path, kind: Kind, port: u16, spec: &serde_json::Value) -> Self {
        let script = Path::new(ROOT).join("tests/peers").join(kind.script());
        let mut child = Command::new(python)
            .arg(script)
            .args(["--port", &port.to_string(), &spec.to_string()])
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .unwrap();
        let stdin = child.stdin.take().unwrap();
        let stdout = BufReader::new(child.stdout.take().unwrap());
        let mut peer = Self { child, stdin, stdout, kind, port };
        let line = peer.line();
        let port = line.strip_prefix("READY ").and_then(|p| p.parse().ok());
        peer.port = port.unwrap_or_else(|| panic!("{kind:?} did not start: '{line}'"));
        peer
    }

    /// Gives a command and waits until it is carried out.
    pub(super) fn command(&mut self, command: &serde_json::Value) {
        self.begin(command);
        self.finish();
    }

    /// Gives a command.
    pub(super) fn begin(&mut self, command: &serde_json::Value) {
        writeln!(self.stdin, "{command}").unwrap();
    }

    /// Waits until the command is carried out.
    pub(super) fn finish(&mut self) {
        assert_eq!(self.line(), "OK", "{:?}", self.kind);
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

pub(crate) fn python(kind: Kind) -> Option<PathBuf> {
    let path = std::env::var_os("BUSBAR_PYTHON")
        .map_or_else(|| Path::new(ROOT).join("target/venv/bin/python"), PathBuf::from);
    let works = Command::new(&path)
        .args(["-c", kind.import()])
        .stderr(Stdio::null())
        .status()
        .is_ok_and(|status| status.success());
    if works {
        return Some(path);
    }
    let remedy = format!(
        "'{}' fails by {}: install tests/peers/requirements.txt and set BUSBAR_PYTHON",
        kind.import(),
        path.display()
    );
    let required = |name| std::env::var_os(name).is_some();
    assert!(!required("CI") && !required("BUSBAR_REQUIRE_PEERS"), "{remedy}");
    eprintln!("SKIPPED: {remedy}");
    None
}
