//! Independent servers in processes of their own.

use std::io::{BufRead, BufReader, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};

/// Path from this crate to the workspace's root.
const ROOT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../..");

/// Listening address of a server under test.
#[derive(Clone, Debug)]
pub(super) enum Place {
    /// TCP port; 0 stands for any free port.
    Tcp(u16),
    /// TCP port with TLS, and the files of its certificates.
    Tls(u16, serde_json::Value),
    /// Device file of a serial line.
    Serial(PathBuf),
}

/// A server, killed when dropped.
pub(super) struct Peer {
    child: Child,
    stdin: ChildStdin,
    stdout: BufReader<ChildStdout>,
    pub(super) port: u16,
}

impl Peer {
    /// Starts pymodbus with these values; `None`, said aloud, where there is
    /// none. Where peers are required that is a failure.
    pub(super) fn start(values: &serde_json::Value) -> Option<Self> {
        Self::start_at(&Place::Tcp(0), values)
    }

    pub(super) fn start_at(place: &Place, values: &serde_json::Value) -> Option<Self> {
        let mut command = Command::new(python()?);
        command.arg(Path::new(ROOT).join("tests/end_to_end/peers/pymodbus_server.py"));
        match place {
            Place::Tcp(port) => command.args(["--port", &port.to_string()]),
            Place::Tls(port, files) => {
                command.args(["--port", &port.to_string(), "--tls", &files.to_string()])
            }
            Place::Serial(device) => command.arg("--serial").arg(device),
        };
        Some(Self::run(command.arg(values.to_string())))
    }

    /// Starts a server anew on a port that another had.
    pub(super) fn restart(port: u16, values: &serde_json::Value) -> Self {
        Self::start_at(&Place::Tcp(port), values).expect("it was there before")
    }

    pub(super) fn run(command: &mut Command) -> Self {
        let mut child =
            command.stdin(Stdio::piped()).stdout(Stdio::piped()).spawn().expect("it starts");
        let stdin = child.stdin.take().unwrap();
        let stdout = BufReader::new(child.stdout.take().unwrap());
        let mut peer = Self { child, stdin, stdout, port: 0 };
        let line = peer.line();
        let port = line.strip_prefix("READY ").and_then(|p| p.parse().ok());
        peer.port = port.unwrap_or_else(|| panic!("{command:?} did not start: '{line}'"));
        peer
    }

    /// Gives a command and waits until it is carried out.
    pub(super) fn command(&mut self, command: &str) {
        writeln!(self.stdin, "{command}").unwrap();
        assert_eq!(self.line(), "OK", "{command}");
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

pub(super) fn python() -> Option<PathBuf> {
    let path = std::env::var_os("BUSBAR_PYTHON")
        .map_or_else(|| Path::new(ROOT).join("target/venv/bin/python"), PathBuf::from);
    let works = Command::new(&path)
        .args(["-c", "import pymodbus, serial"])
        .stderr(Stdio::null())
        .status()
        .is_ok_and(|status| status.success());
    let remedy = format!(
        "no pymodbus by {}: install tests/end_to_end/peers/requirements.txt and set BUSBAR_PYTHON",
        path.display()
    );
    available(works, &remedy).then_some(path)
}

/// libmodbus, compiled into a folder.
pub(super) struct Libmodbus {
    folder: tempfile::TempDir,
}

impl Libmodbus {
    /// Compiles the server; `None` as for pymodbus.
    pub(super) fn compile() -> Option<Self> {
        let folder = tempfile::tempdir().unwrap();
        let source = Path::new(ROOT).join("tests/end_to_end/peers/modbus_libmodbus.c");
        let mut gcc = Command::new("gcc");
        gcc.args(["-Wall", "-Werror", "-O1", "-o"]).arg(folder.path().join("server"));
        let status = gcc.arg(source).arg("-lmodbus").stderr(Stdio::null()).status();
        let works = status.is_ok_and(|status| status.success());
        available(works, "no server by libmodbus: install gcc and libmodbus-dev")
            .then_some(Self { folder })
    }

    /// Starts it on a port, or on a serial line as unit 1.
    pub(super) fn start(&self, place: &Place) -> Peer {
        let mut command = Command::new(self.folder.path().join("server"));
        match place {
            Place::Tcp(port) => command.args(["tcp", &port.to_string()]),
            Place::Serial(device) => command.arg("rtu").arg(device).arg("1"),
            Place::Tls(..) => panic!("libmodbus does not encrypt"),
        };
        Peer::run(&mut command)
    }
}

/// Returns a port that was free just now, for a server that cannot choose one.
pub(super) fn free_port() -> u16 {
    std::net::TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().port()
}

/// Reports whether a prerequisite of a test is present; panics where it is required and missing.
pub(super) fn available(present: bool, remedy: &str) -> bool {
    let required = |name| std::env::var_os(name).is_some();
    assert!(present || !required("CI") && !required("BUSBAR_REQUIRE_PEERS"), "{remedy}");
    if !present {
        eprintln!("SKIPPED: {remedy}");
    }
    present
}
